"""A plan with another goal for one positioner, and as little else changed as possible."""

from fiberplan.planners.amending.one_goal import amend

__all__ = ["amend"]
