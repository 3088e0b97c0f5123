"""What is asked of a planner: targets, the configurations that reach them, and the problem as it is settled."""

from fiberplan.problem.problem import Dropped, Problem
from fiberplan.problem.targets import Targets

__all__ = ["Dropped", "Problem", "Targets"]
