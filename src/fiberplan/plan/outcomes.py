"""What every planner says alike of a problem: outcomes that are settled before planning, and who was in the way."""

from collections.abc import Mapping

import numpy as np

from fiberplan.plan.plan import Outcome
from fiberplan.problem import Problem


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
