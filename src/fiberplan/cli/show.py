"""``fiberplan show``: a plan as an HTML page."""

from pathlib import Path
from typing import Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import JsonOption, PlanArgument
from fiberplan.cli.output import page_output, refuse_unwritable, say, working


def show(
    plan: PlanArgument,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="The page; beside the plan, ending .html, if not given."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Write one self-contained HTML page that plays the plan, for any browser, without a network."""
    page = plan.with_suffix(".html") if output is None else output
    refuse_unwritable(page_output(page), inputs=(plan,))
    with working("drawing"):
        from fiberplan.plan import Plan
        from fiberplan.visuals import show as draw

        draw(Plan.read(plan), page)
    if json:
        say_json({"written": [page]})
    else:
        say(f"wrote {page}")
