"""Sabater2018: prioritized planning over roadmaps in joint space, and what the paper leaves for later, as options.

The planner asks an arm two questions: is a configuration in its zone of avoidance, and is it in contact with those
already planned at a given time? So it serves any kind of arm.
"""

from fiberplan.planners.prioritized_roadmap.planner import PrioritizedRoadmap

__all__ = ["PrioritizedRoadmap"]
