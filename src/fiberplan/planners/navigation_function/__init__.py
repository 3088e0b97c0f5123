"""NavigationFunction."""

from fiberplan.planners.navigation_function.planner import NavigationFunction

__all__ = ["NavigationFunction"]
