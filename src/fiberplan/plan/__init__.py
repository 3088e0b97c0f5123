"""What a planner returns: a motion with an outcome for every positioner, and why it is as it is."""

from fiberplan.plan.diagnosis import diagnose
from fiberplan.plan.outcomes import Outcome
from fiberplan.plan.plan import Plan

__all__ = ["Outcome", "Plan", "diagnose"]
