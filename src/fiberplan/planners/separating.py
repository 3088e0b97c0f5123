"""Parting positioners that touch, or stand nearer than the margin, with proof that none comes nearer meanwhile."""

from collections.abc import Callable
from time import process_time

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.plan import Outcome, Plan
from fiberplan.planners.shared.opening import opened
from fiberplan.problem import Problem, State


def separate(
    plane: FocalPlane,
    state: State | np.ndarray,
    margin: float | None = None,
    report: Callable[[str], None] | None = None,
) -> Plan:
    """A plan that parts those who are nearer than the margin, and moves nobody else than has to make room.

    Who cannot be brought to the margin is `DEADLOCKED`, with those in its way as blockers.

    Args:
        plane: the array.
        state: where everyone stands, or (n, 2) commanded angles [rad].
        margin: clearance to reach [mm]; what the focal plane recommends unless given, or 0.
        report: told about progress, in words.

    Raises:
        ProblemError: a state that does not fit, or a joint far out of its range.
    """
    begun = process_time()
    margin = (plane.recommended_margin or 0.0) if margin is None else margin
    nowhere = np.full((plane.n, 2), np.nan)
    problem = Problem(plane, state, nowhere, margin, near_start="open")  # type: ignore[arg-type]
    done = opened(problem.roomy, problem.start, problem.margin, report)

    def outcome(i: int) -> Outcome:
        if not problem.plane.online[i]:
            return Outcome.OFFLINE
        return Outcome.DEADLOCKED if i in done.wedged else Outcome.NO_TARGET

    return Plan(
        problem=problem,
        trajectory=done.motion,
        outcomes=tuple(outcome(i) for i in range(plane.n)),
        planner="separate",
        blockers={i: tuple(map(plane.public, others)) for i, others in done.wedged.items()},
        timings={"search": process_time() - begun},
        notes=problem.notes,
    )
