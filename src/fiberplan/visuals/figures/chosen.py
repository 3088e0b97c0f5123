"""Who is worth a look where nobody is named: those who were lost, who come closest, who stop last."""

from collections.abc import Sequence

from fiberplan.plan import Plan, diagnose
from fiberplan.plan.closest import closest_pairs


def chosen(plan: Plan, positioners: Sequence[str | int] | None, count: int) -> list[int]:
    """Indices of the positioners that are named; of `count` that are worth a look if None are.

    Raises:
        PlanError: one that there is not.
    """
    if positioners is not None:
        return [plan[key].index for key in positioners]
    pairs = [close.pair for close in closest_pairs(plan, count)]
    last = [slow.positioner for slow in diagnose(plan).slowest]
    blocked = [int(i) for i in plan.lost if plan.blockers.get(int(i))]
    worth = [*blocked[:1], *(i for pair in pairs[:1] for i in pair if i >= 0), *last]
    worth += [i for pair in pairs for i in pair if i >= 0] + list(range(plan.problem.n))
    return list(dict.fromkeys(worth))[:count]
