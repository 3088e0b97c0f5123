"""What can be drawn of a plan, by the name that ``fiberplan figure`` knows.

A figure is a function of a plan and options that returns the axes it drew on; it registers itself where it is defined.
Another package adds a kind by an entry point of the group ``fiberplan.figures``.
"""

from collections.abc import Callable
from typing import Any

from fiberplan.registry import Registry

Drawing = Callable[..., Any]  #: of a plan and options; it returns axes, or a list of them
_ORDER = (
    "focal-plane",
    "snapshots",
    "joints",
    "speeds",
    "clearance",
    "histogram",
    "makespan",
    "coverage",
    "multiplicity",
    "joint-space",
)
FIGURES: Registry[Drawing] = Registry("figure", "fiberplan.figures", _ORDER)  #: all kinds by name
