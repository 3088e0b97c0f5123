"""GreedyFold."""

from fiberplan.planners.greedy_fold.planner import GreedyFold

__all__ = ["GreedyFold"]
