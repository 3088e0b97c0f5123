"""What every planner is: its published parameters, and one method."""

from typing import Protocol

from fiberplan.plan import Plan
from fiberplan.problem import Problem


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
