"""One field planned by the field alone or with relief, and what came of it."""

from time import process_time
from typing import Literal, NamedTuple

from fiberplan.plan import Outcome, Plan
from fiberplan.planners import EllipticNavigationFunction
from fiberplan.problem import Problem

Relief = Literal["none", "layers"]
MODES: dict[str, Relief] = {"alone": "none", "relief": "layers"}


class Run(NamedTuple):
    """What one plan came to."""

    asked: int  #: positioners with a goal that can be kept
    arrived: int
    contacts: int  #: found by `verify`, what it cannot decide included
    cpu: float  #: of planning [s]
    motion: float  #: its duration [s]


def planned(problem: Problem, mode: str) -> tuple[Plan, Run]:
    """A plan, and what it came to."""
    begun = process_time()
    plan = EllipticNavigationFunction(relief=MODES[mode]).plan(problem)
    cpu = process_time() - begun
    unsafe = len(plan.certificate.contacts) + len(plan.certificate.undecided)
    arrived = len(plan.having(Outcome.ARRIVED))
    return plan, Run(int(problem.has_goal.sum()), arrived, unsafe, cpu, plan.makespan)
