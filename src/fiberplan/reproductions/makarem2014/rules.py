"""The three rules under which each experiment is run.

*literal* is the printed field with the sign of its repulsion mended, on joints that turn on and on, as the paper has
them. *literal, limited* is the same within the instrument's joint ranges. *repaired* keeps these ranges and changes
the field (see `fiberplan.planners.navigation`).
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.plan import Plan
from fiberplan.planners.navigation_function import NavigationFunction
from fiberplan.problem import Problem

TURNS = 4.0  #: an unlimited joint has so many turns each way


@dataclass(frozen=True)
class Rule:
    """A mode, and whether joint ranges bind."""

    name: str
    planner: NavigationFunction
    limited: bool

    def plane(self, plane: FocalPlane) -> FocalPlane:
        """The array with the joint ranges of this rule."""
        if self.limited:
            return plane
        far = np.full((plane.n, 2), 2 * np.pi * TURNS)
        return plane.replace(lower=-far, upper=far)

    def plan(self, problem: Problem) -> Plan:
        """Plan the same problem under this rule."""
        if not self.limited:
            problem = Problem(self.plane(problem.plane), problem.start, problem.goal, alternatives=problem.alternatives)
        return self.planner.plan(problem)


LITERAL = Rule("literal", NavigationFunction(mode="literal"), limited=False)
LIMITED = Rule("literal, limited", NavigationFunction(mode="literal"), limited=True)
REPAIRED = Rule("repaired", NavigationFunction(), limited=True)
RULES = (LITERAL, LIMITED, REPAIRED)
