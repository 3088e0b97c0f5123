"""Planners: one published algorithm a module, each a frozen dataclass of its parameters with one method, `plan`."""

from collections.abc import Callable

from fiberplan.planners.greedy_fold import GreedyFold
from fiberplan.planners.protocol import Planner

PLANNERS: dict[str, Callable[..., Planner]] = {"greedy-fold": GreedyFold}

__all__ = ["PLANNERS", "GreedyFold", "Planner"]
