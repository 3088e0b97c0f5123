"""Twelve probe arms about one field, as in the experiment of Sabater2018."""

from functools import cache
from pathlib import Path

import fiberplan as fp
from fiberplan.scenes.assigned import assignment_plan
from scenes.scene import Scene


@cache
def array() -> fp.FocalPlane:
    return fp.FocalPlane.load("miradas")


def assignment(seed: int, data: Path) -> fp.Problem:
    """Twelve probe arms from park to an assignment plan of twelve targets."""
    return fp.Problem.from_targets(array(), assignment_plan(array(), seed))


SCENES = (Scene("miradas", assignment, quick=True),)
