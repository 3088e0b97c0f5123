"""``fiberplan export``: a plan's motion for other programs, and for controllers."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fiberplan.cli.options import PlanArgument
from fiberplan.cli.output import Output, refuse_unwritable, say, working

if TYPE_CHECKING:
    from collections.abc import Callable

    from fiberplan.plan import Plan


def export(
    plan: PlanArgument,
    to: Annotated[
        str,
        typer.Option("--to", metavar="FORMAT", help="ecsv: a row a knot; motions: a row a move; or a controller."),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Write it here.")],
) -> None:
    """Write a plan's motion in another format, times in s and angles in degrees."""
    refuse_unwritable(Output(output, (".ecsv",), "an ECSV table"), inputs=(plan,))
    with working("exporting"):
        from fiberplan.plan import Plan

        _writer(to)(Plan.read(plan), output)
    say(f"wrote {output}")


def _writer(name: str) -> "Callable[[Plan, Path], None]":
    """What writes the format, or for the controller, of this name."""
    from fiberplan.hardware import CONTROLLERS
    from fiberplan.io.exports import EXPORTS

    return CONTROLLERS[name].write if name in CONTROLLERS else EXPORTS.find(name)
