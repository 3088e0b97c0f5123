"""EllipticNavigationFunction."""

from fiberplan.planners.elliptic_navigation.planner import EllipticNavigationFunction

__all__ = ["EllipticNavigationFunction"]
