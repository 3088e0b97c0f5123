"""What every planner is: its published parameters, and one method."""

from collections.abc import Callable
from typing import Protocol

from fiberplan.plan import Plan
from fiberplan.problem import Problem
from fiberplan.registry import Registry


class Planner(Protocol):
    """A frozen dataclass whose fields are the paper's parameters."""

    @property
    def name(self) -> str:
        """Its key in `PLANNERS`."""
        ...

    @property
    def reference(self) -> str:
        """The published source."""
        ...

    def plan(self, problem: Problem) -> Plan:
        """A motion that is safe as it stands and begins at the start, with an outcome for every positioner."""
        ...


PLANNERS: Registry[Callable[..., Planner]] = Registry(
    "planner",
    "fiberplan.planners",
    ("direct", "greedy-fold", "navigation-function", "elliptic-navigation-function", "prioritized-roadmap"),
)
"""Planners by name: dataclasses that make a planner of their settings, ours in a fixed order, then others' by name."""
