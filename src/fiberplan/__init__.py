"""Collision-free, proven motion for fiber positioners and probe arms.

The names below are imported when first used, so that ``fiberplan --help`` need not wait for the compiler. What each of
them is for: ``docs/api.md``. Progress and warnings go to the logger named "fiberplan", which is quiet unless asked.
"""

import importlib
import logging
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fiberplan import hardware, instruments, io, planners, scenes, shaping, survey, visuals
    from fiberplan.certificates import Certificate, Contact, ZoneEntry, proven_unreachable, verify
    from fiberplan.errors import (
        FiberplanError,
        InstrumentError,
        PlanError,
        ProblemError,
        TargetError,
        TrajectoryError,
        UnprovenError,
    )
    from fiberplan.focal_plane import Body, FocalPlane, FourBar, Obstacle
    from fiberplan.motion import Trajectory
    from fiberplan.plan import Bound, Diagnosis, Outcome, Plan, PositionerPlan, diagnose
    from fiberplan.planners import amend, homing_groups, separate
    from fiberplan.problem import Dropped, Problem, State, Targets
    from fiberplan.visuals import show

__version__ = "0.1.0"

logging.getLogger("fiberplan").addHandler(logging.NullHandler())

_PACKAGES = ("hardware", "instruments", "io", "planners", "scenes", "shaping", "survey", "visuals")
_HOME = {
    "Body": "focal_plane",
    "Certificate": "certificates",
    "Contact": "certificates",
    "Bound": "plan",
    "Diagnosis": "plan",
    "Dropped": "problem",
    "FiberplanError": "errors",
    "FocalPlane": "focal_plane",
    "FourBar": "focal_plane",
    "InstrumentError": "errors",
    "Obstacle": "focal_plane",
    "Outcome": "plan",
    "Plan": "plan",
    "PlanError": "errors",
    "PositionerPlan": "plan",
    "Problem": "problem",
    "ProblemError": "errors",
    "State": "problem",
    "TargetError": "errors",
    "Targets": "problem",
    "Trajectory": "motion",
    "TrajectoryError": "errors",
    "UnprovenError": "errors",
    "ZoneEntry": "certificates",
    "amend": "planners",
    "diagnose": "plan",
    "homing_groups": "planners",
    "proven_unreachable": "certificates",
    "separate": "planners",
    "show": "visuals",
    "verify": "certificates",
}

__all__ = [
    "Body",
    "Bound",
    "Certificate",
    "Contact",
    "Diagnosis",
    "Dropped",
    "FiberplanError",
    "FocalPlane",
    "FourBar",
    "InstrumentError",
    "Obstacle",
    "Outcome",
    "Plan",
    "PlanError",
    "PositionerPlan",
    "Problem",
    "ProblemError",
    "State",
    "TargetError",
    "Targets",
    "Trajectory",
    "TrajectoryError",
    "UnprovenError",
    "ZoneEntry",
    "amend",
    "diagnose",
    "hardware",
    "homing_groups",
    "instruments",
    "io",
    "planners",
    "proven_unreachable",
    "scenes",
    "separate",
    "shaping",
    "show",
    "survey",
    "verify",
    "visuals",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its module the first time it is asked for."""
    if name in _PACKAGES:
        return importlib.import_module(f"fiberplan.{name}")
    if name in _HOME:
        value = getattr(importlib.import_module(f"fiberplan.{_HOME[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'fiberplan' has no attribute '{name}'")


def __dir__() -> list[str]:
    """Public names, imported or not; modules that were imported meanwhile are not among them."""
    return sorted([*__all__, "__version__"])
