"""How planners are set for the table where their own defaults are for something else, and who gets no large scenes."""

from collections.abc import Callable
from typing import Any

import numpy as np

import fiberplan as fp


def _roadmap(plane: fp.FocalPlane) -> dict[str, Any]:
    """Its defaults are for the probe arms of its paper, which turn by 1.8 deg/s: faster arms need shorter steps."""
    slow = plane.max_speed.min() < np.radians(5.0)
    return {} if slow else {"dt": 0.5, "max_time": 60.0, "continuous": True}


SETTINGS: dict[str, Callable[[fp.FocalPlane], dict[str, Any]]] = {
    "greedy-fold": lambda plane: {"step": np.radians(1.0)},  # its own is 0.1 deg, which takes longer
    "prioritized-roadmap": _roadmap,
}

LARGEST: dict[str, int] = {
    "prioritized-roadmap": 40,  # positioners: made for 12 arms, and minutes of CPU for 61
}


def settings(name: str, plane: fp.FocalPlane) -> dict[str, Any]:
    """The settings of a planner for an array; its defaults unless something else is said above."""
    return SETTINGS[name](plane) if name in SETTINGS else {}
