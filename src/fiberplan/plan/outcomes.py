"""What can become of a positioner, and what of it the problem settles before planning; who was in the way."""

from collections.abc import Mapping
from enum import Enum

import numpy as np

from fiberplan.problem import Problem


class Outcome(Enum):
    """What became of a positioner; of several that fit, the first."""

    OFFLINE = "cannot move"
    NO_TARGET = "has no target"
    DROPPED = "its goal touched something at rest or was out of reach"
    ARRIVED = "arrived at its goal"
    INFEASIBLE = "proven unable to reach its goal"
    DEADLOCKED = "stuck or given up, without proof that it had to be"


def settled_outcome(problem: Problem, i: int) -> Outcome | None:
    """The outcome of positioner `i` if the problem alone decides it; None if the plan does."""
    if not problem.plane.online[i]:
        return Outcome.OFFLINE
    if i in problem.dropped:
        return Outcome.DROPPED
    return Outcome.NO_TARGET if np.isnan(problem.requested[i, 0]) else None


def all_blockers(problem: Problem, found: Mapping[int, tuple[int, ...]]) -> dict[int, tuple[int, ...]]:
    """Positioner that does not arrive -> who was in its way: what planning `found`, and of goals dropped before it."""
    early = {i: dropped.blockers for i, dropped in problem.dropped.items() if dropped.blockers}
    return dict(sorted((early | dict(found)).items()))
