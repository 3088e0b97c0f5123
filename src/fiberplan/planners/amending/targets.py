"""Several goals of a plan changed, each given as a target: of the configurations that reach it, one that works."""

import numpy as np

from fiberplan.errors import ProblemError, TargetError
from fiberplan.plan import Outcome, Plan
from fiberplan.planners.amending.one_goal import amend
from fiberplan.problem import Targets


def amend_to(plan: Plan, targets: Targets, longer: float = 0.05) -> Plan:
    """The plan with other targets for some positioners, one after the other in the order of `targets`.

    Args:
        plan: a safe one.
        targets: of the positioners whose goals are changed.
        longer: as in `amend`, for each of them.

    Raises:
        TargetError: a positioner that there is not, or a target out of reach.
        ProblemError: as `amend`, for a target none of whose configurations can be kept.
    """
    plane = plan.problem.plane
    who, solution = targets.indices(plane), targets.solve(plane)
    for why in (*solution.unreachable.values(), *solution.lacking.values()):
        raise TargetError(f"{targets.source}: {why}")
    for i in who.tolist():
        found = np.concatenate([solution.goal[i : i + 1], solution.alternatives[i]])
        plan = _first_that_works(plan, i, found[np.isfinite(found).all(axis=1)], longer)
    return plan


def _first_that_works(plan: Plan, i: int, goals: np.ndarray, longer: float) -> Plan:
    """Amended to the first of `goals` (k, 2) [rad] that is reached; else to the first that touches nothing."""
    found: Plan | None = None
    refused: ProblemError | None = None
    for goal in goals:
        try:
            amended = amend(plan, i, goal, longer)
        except ProblemError as error:
            refused = refused or error
            continue
        if amended.outcomes[i] is Outcome.ARRIVED:
            return amended
        found = found or amended
    if found is None:
        assert refused is not None  # there is at least one goal
        raise refused
    return found
