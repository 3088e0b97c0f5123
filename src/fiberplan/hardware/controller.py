"""What a controller is to us: something that writes a plan for motors, and reads back the motion that a file causes."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from fiberplan.arrays import FrozenDict
from fiberplan.certificates import Certificate
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Executed
from fiberplan.plan import Plan
from fiberplan.problem import State
from fiberplan.registry import Registry


@dataclass(frozen=True)
class HandedOver:
    """What was written for a controller, and the proof of what it makes the motors do."""

    executed: Executed  #: as read back from the written bytes
    certificate: Certificate  #: of the executed motion
    facts: Mapping[str, Any] = field(default_factory=dict)  #: how large the file is by the controller's own count

    def __post_init__(self) -> None:
        object.__setattr__(self, "facts", FrozenDict(self.facts))


class Controller(Protocol):
    """One controller; each of ours is a package whose `encode` and `decode` share no code.

    It may have more, which `fiberplan.hardware.planned` uses to plan for it: ``with_limits(plane)``, the focal plane
    with the ranges and speeds that it takes; ``with_goals(problem, **options)``, the problem with goals at which it can
    end, given the options of ``write``; ``fit(plan)``, the plan in the shape that it executes; ``SEGMENT``, the seconds
    by whose multiples a motion can begin later and still be in that shape. And ``prove``, called as `verify`, where
    that does not fit what it does.
    """

    def write(self, plan: Plan, path: str | os.PathLike) -> HandedOver | None:
        """Write the plan's motion as the controller takes it.

        Raises:
            PlanError: what the controller cannot do, by robot and moment; a motion that is not proven once it is read
                back; or a file that cannot be written. There is no new file then.
        """
        ...

    def read(self, path: str | os.PathLike, plane: FocalPlane, state: State | None = None) -> Executed:
        """The motion that a file causes; it is neither refused nor changed, whatever it does.

        Args:
            path: of the file.
            plane: whose robots it moves.
            state: where they stand before; folded unless given.

        Raises:
            TrajectoryError: a file that cannot be read as the controller's; one line that says where.
        """
        ...

    def accepts(self, path: Path, content: bytes) -> bool:
        """Whether a file of this name and content is one of the controller's; it never raises."""
        ...


def known_to(plane: FocalPlane, state: State | None) -> State:
    """The state before a file is executed; folded, which nobody is known to be, unless it is given."""
    if state is not None:
        return state
    return State(plane.folded, plane.online, unknown=np.ones(plane.n, bool), source="folded")


CONTROLLERS: Registry[Controller] = Registry("controller", "fiberplan.controllers", ("sdss", "desi", "moons", "pfs"))
