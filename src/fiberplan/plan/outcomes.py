"""What can become of a positioner, and what of it the problem settles before planning; who was in the way."""

from collections.abc import Iterator, Mapping, Sequence
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


def contradictions(problem: Problem, outcomes: Sequence[Outcome]) -> Iterator[tuple[int, str]]:
    """Positioner and what is wrong, for outcomes that the problem rules out.

    What `settled_outcome` says is so, and only that is: nobody else is offline or without a target. (A planner may drop
    more goals than the problem did.)
    """
    settled = np.full(problem.n, None, object)
    settled[np.isnan(problem.requested[:, 0])] = Outcome.NO_TARGET
    settled[list(problem.dropped)] = Outcome.DROPPED
    settled[~problem.plane.online] = Outcome.OFFLINE
    reasons = {
        Outcome.OFFLINE: "it is not online",
        Outcome.DROPPED: "its goal was dropped",
        Outcome.NO_TARGET: "no goal is requested of it",
        None: "it is online and has a goal",
    }
    near = {i for a, b, _ in problem.opening for i in (a, b)} if Outcome.DEADLOCKED in outcomes else set()
    for i, (must, given) in enumerate(zip(settled.tolist(), outcomes, strict=True)):
        open_ = must is None and given not in (Outcome.OFFLINE, Outcome.NO_TARGET) and isinstance(given, Outcome)
        open_ |= must is Outcome.NO_TARGET and given is Outcome.DEADLOCKED and i in near  # wedged where it stands
        if given is not must and not open_:
            yield i, f"its outcome is {getattr(given, 'name', given)}, but {reasons[must]}"
