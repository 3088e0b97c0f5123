"""``fiberplan export``: a plan's motion for other programs."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from fiberplan.cli.options import PlanArgument
from fiberplan.cli.output import Output, refuse_unwritable, say, working

Format = Literal["ecsv", "motions"]


def export(
    plan: PlanArgument,
    to: Annotated[Format, typer.Option("--to", help="ecsv: a row a knot; motions: a row a move.")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Write it here.")],
) -> None:
    """Write a plan's motion in another format, times in s and angles in degrees."""
    refuse_unwritable(Output(output, (".ecsv",), "an ECSV table"), inputs=(plan,))
    with working("exporting"):
        from fiberplan.io.exports import FORMATS
        from fiberplan.plan import Plan

        FORMATS[to](Plan.read(plan), output)
    say(f"wrote {output}")
