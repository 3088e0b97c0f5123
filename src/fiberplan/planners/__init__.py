"""Planners: one published algorithm a module, each a frozen dataclass of its parameters with one method, `plan`."""

from fiberplan.planners.amending.one_goal import amend
from fiberplan.planners.direct import Direct
from fiberplan.planners.elliptic_navigation import EllipticNavigationFunction
from fiberplan.planners.greedy_fold import GreedyFold
from fiberplan.planners.navigation_function import NavigationFunction
from fiberplan.planners.prioritized_roadmap import PrioritizedRoadmap
from fiberplan.planners.protocol import PLANNERS, Planner

__all__ = [
    "PLANNERS",
    "Direct",
    "EllipticNavigationFunction",
    "GreedyFold",
    "NavigationFunction",
    "Planner",
    "PrioritizedRoadmap",
    "amend",
]
