"""Controllers: what writes a plan for the motors of an instrument, and reads back the motion that its files cause.

A controller registers in `CONTROLLERS`; another package names its own in the entry points of the group
``fiberplan.controllers``. ``fiberplan export --to NAME`` offers them beside the formats of `fiberplan.io.exports`.

- `simulated`: what robots make of a motion when clocks, motors and the line to them are not perfect
"""

import os
from typing import Protocol

from fiberplan.plan import Plan
from fiberplan.registry import Registry


class Controller(Protocol):
    """One controller."""

    def write(self, plan: Plan, path: str | os.PathLike) -> None:
        """Write the plan's motion as the controller takes it.

        Raises:
            FiberplanError: what the controller cannot do, or a file that cannot be written.
        """
        ...


CONTROLLERS: Registry[Controller] = Registry("controller", "fiberplan.controllers")
