"""``fiberplan show``: a plan, or two side by side, as an HTML page."""

from pathlib import Path
from typing import Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import JsonOption, PlanArgument
from fiberplan.cli.output import page_output, refuse_unwritable, say, working


def show(
    plan: PlanArgument,
    other: Annotated[
        Path | None,
        typer.Argument(metavar="OTHER", help="Another plan, to see side by side.", show_default=False),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="The page; beside the plan, ending .html, if not given."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Write one self-contained HTML page that plays the plan, for any browser, without a network."""
    page = plan.with_suffix(".html") if output is None else output
    files = [plan] if other is None else [plan, other]
    refuse_unwritable(page_output(page), inputs=tuple(files))
    with working("drawing"):
        from fiberplan.plan import Plan
        from fiberplan.visuals import show as draw
        from fiberplan.visuals.origin import Origin

        plans = [Plan.read(file) for file in files]
        draw(plans, page, [Origin.of_file(file) for file in files])
    if json:
        say_json({"written": [page]})
    else:
        say(f"wrote {page}")
