"""Collision-free, proven motion for fiber positioners and probe arms.

The names below are imported when first used, so that ``fiberplan --help`` need not wait for the compiler.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fiberplan import planners, shaping
    from fiberplan.certificates import Certificate, Contact, verify
    from fiberplan.errors import FiberplanError
    from fiberplan.focal_plane import Body, FocalPlane, Obstacle
    from fiberplan.motion import Trajectory
    from fiberplan.plan import Outcome, Plan, diagnose
    from fiberplan.problem import Dropped, Problem, Targets
    from fiberplan.visuals import show

__version__ = "0.1.0"

_HOME = {
    "Body": "focal_plane",
    "Certificate": "certificates",
    "Contact": "certificates",
    "Dropped": "problem",
    "FiberplanError": "errors",
    "FocalPlane": "focal_plane",
    "Obstacle": "focal_plane",
    "Outcome": "plan",
    "Plan": "plan",
    "Problem": "problem",
    "Targets": "problem",
    "Trajectory": "motion",
    "diagnose": "plan",
    "show": "visuals",
    "verify": "certificates",
}

__all__ = [
    "Body",
    "Certificate",
    "Contact",
    "Dropped",
    "FiberplanError",
    "FocalPlane",
    "Obstacle",
    "Outcome",
    "Plan",
    "Problem",
    "Targets",
    "Trajectory",
    "diagnose",
    "planners",
    "shaping",
    "show",
    "verify",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its module the first time it is asked for."""
    if name in ("planners", "shaping"):
        return importlib.import_module(f"fiberplan.{name}")
    if name in _HOME:
        value = getattr(importlib.import_module(f"fiberplan.{_HOME[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'fiberplan' has no attribute '{name}'")


def __dir__() -> list[str]:
    """Public names, imported or not."""
    return sorted({*globals(), *__all__})
