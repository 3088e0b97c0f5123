"""Parking whoever has no target, folded or elsewhere, as far as that is safe and costs no target."""

import dataclasses
from collections.abc import Callable

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.plan import Outcome, Plan
from fiberplan.problem import Problem
from fiberplan.problem.solution import within_range
from fiberplan.tolerances import ARRIVAL


def plan_with_parking(plan: Callable[[Problem], Plan], problem: Problem, at: np.ndarray | None = None) -> Plan:
    """The plan in which idle positioners go to folded as well; who could not be parked is named in a note.

    An idle positioner's outcome stays `NO_TARGET`. Where parking would cost a target, nobody is parked.

    Args:
        plan: of a planner.
        problem: idle are those that can move and of whom nothing is requested.
        at: (2,) commanded angles to park at [rad] instead of folded.

    Raises:
        ProblemError: `at` is not two finite angles.
    """
    place = problem.plane.folded if at is None else _place(problem.plane, at)
    idle = problem.plane.online & np.isnan(problem.requested[:, 0])
    idle[list(problem.dropped)] = False
    if not idle.any():
        return plan(problem)
    assert problem.priority is not None  # set on construction
    parking = dataclasses.replace(
        problem,
        goal=np.where(idle[:, None], place, problem.goal),
        priority=np.where(idle, 0.0, problem.priority),
        conflicts="drop",
    )
    parked = _of_targets(plan(parking), problem, idle, place)
    if len(parked.lost) > len(problem.dropped) and (without := plan(problem)).kept > parked.kept:
        return dataclasses.replace(without, notes=(*without.notes, "nobody is parked: that would cost a target"))
    return parked


def _place(plane: FocalPlane, at: np.ndarray) -> np.ndarray:
    """(n, 2) `at` for everyone; what is out of a range by rounding is at its end."""
    at = read_only(at, unit="rad", name="park at", error=ProblemError)
    if at.shape != (2,) or not np.isfinite(at).all():
        raise ProblemError(f"park at {np.degrees(at).tolist()} deg: two finite angles are wanted")
    return within_range(plane, np.arange(plane.n), np.tile(at, (plane.n, 1)), plane.fiber)


def _of_targets(plan: Plan, problem: Problem, idle: np.ndarray, place: np.ndarray) -> Plan:
    """The plan as one of the problem without parking, and a note of who is parked."""
    plane = problem.plane
    away = np.linalg.norm(plane.fibers(plan.trajectory.end) - plane.fibers(place), axis=1)
    left = np.flatnonzero(idle & ~(away <= ARRIVAL))
    where = "folded" if np.array_equal(place, plane.folded) else "where they were sent"
    notes = [f"parked: {int(idle.sum()) - len(left)} of {int(idle.sum())} without a target are {where}"]
    if len(left):
        notes.append("not parked: " + ", ".join(plane.ids[i] for i in left))
    found = {i: each for i, each in plan.problem.dropped.items() if not idle[i]}
    if found != problem.dropped:  # what planning found out
        problem = problem.giving_up(found)
    return dataclasses.replace(
        plan,
        problem=problem,
        outcomes=tuple(
            Outcome.NO_TARGET if waits else outcome for outcome, waits in zip(plan.outcomes, idle, strict=True)
        ),
        blockers={i: others for i, others in plan.blockers.items() if not idle[i]},
        notes=(*plan.notes, *notes),
    )
