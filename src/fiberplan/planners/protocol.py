"""What every planner is: its published parameters, and one method."""

import dataclasses
from collections.abc import Callable
from typing import Any, Protocol

from fiberplan.plan import Plan
from fiberplan.problem import Problem
from fiberplan.registry import Registry


def setting(default: Any, help: str, unit: str = "") -> Any:
    """A field of a planner's dataclass that says what it means.

    For instance ``step: float = setting(0.1, "turn of the fastest joint per loop", "rad")``. The command line lists
    help, unit and default (``fiberplan planners NAME``) and takes the value as ``--set step=5.7``, in degrees what is
    in rad or rad/s here. Choices are those of a `typing.Literal`.

    Args:
        default: of the field.
        help: what it means, in a few words.
        unit: of the field, as in the library: "rad", "s", "mm"; empty if it has none.
    """
    return dataclasses.field(default=default, metadata={"help": help, "unit": unit})


class Planner(Protocol):
    """A frozen dataclass whose fields are the paper's parameters.

    One that gets better with time may let its `plan` take ``deadline`` [s], after which it returns the best so far, and
    ``report``, which it tells in words how far it is; the command line hands them in.
    """

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
