"""``fiberplan export``: a plan's motion for other programs, and for controllers."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.completion import formats
from fiberplan.cli.options import JsonOption, PlanArgument
from fiberplan.cli.output import Output, refuse_unwritable, say, working

if TYPE_CHECKING:
    from collections.abc import Callable

    from fiberplan.plan import Plan

_TABLES = ("ecsv", "motions")


def export(
    plan: PlanArgument,
    to: Annotated[
        str,
        typer.Option(
            "--to",
            metavar="FORMAT",
            help="ecsv: a row a knot; motions: a row a move; or a controller.",
            autocompletion=formats,
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Write it here.")],
    json: JsonOption = False,
) -> None:
    """Write a plan's motion in another format, times in s and angles in degrees."""
    refuse_unwritable(_output(to, output), inputs=(plan,))
    with working("exporting"):
        from fiberplan.plan import Plan

        _writer(to)(Plan.read(plan), output)
    if json:
        say_json({"format": to, "written": [output]})
    else:
        say(f"wrote {output}")


def _output(name: str, path: Path) -> Output:
    """What is written: our tables are ECSV, and what a controller takes is the controller's."""
    return Output(path, (".ecsv",), "an ECSV table") if name in _TABLES else Output(path, (path.suffix,), f"for {name}")


def _writer(name: str) -> "Callable[[Plan, Path], None]":
    """What writes the format, or for the controller, of this name."""
    from fiberplan.hardware import CONTROLLERS
    from fiberplan.io.exports import EXPORTS

    return CONTROLLERS[name].write if name in CONTROLLERS else EXPORTS.find(name)
