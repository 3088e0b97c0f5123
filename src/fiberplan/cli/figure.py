"""``fiberplan figure``: one figure of a plan, for a paper or a report."""

import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.completion import figure_kinds
from fiberplan.cli.options import JsonOption, PlanArgument
from fiberplan.cli.output import Output, refuse_unwritable, say, working
from fiberplan.errors import FiberplanError

if TYPE_CHECKING:
    from fiberplan.visuals.figures.registry import Drawing


def figure(
    plan: PlanArgument,
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="focal-plane, snapshots, joints, speeds, clearance, histogram, makespan, coverage, multiplicity or "
            "joint-space.",
            autocompletion=figure_kinds,
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="The figure, which ends in .svg, .pdf or .png.")
    ],
    times: Annotated[
        list[float] | None,
        typer.Option("--time", metavar="S", help="The moment (s). Repeatable for snapshots.", min=0.0),
    ] = None,
    positioners: Annotated[
        list[str] | None,
        typer.Option(
            "--positioner",
            metavar="ID",
            help="Whose joints, clearance or joint space; or around whom a focal plane is drawn. Repeatable where "
            "several can be.",
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Draw a figure of a plan, in vectors unless it is a PNG."""
    refuse_unwritable(Output(output, (".svg", ".pdf", ".png"), "a figure"), inputs=(plan,))
    with working("drawing"):
        from fiberplan.plan import Plan
        from fiberplan.visuals.canvas import figure_format
        from fiberplan.visuals.figures import draw
        from fiberplan.visuals.figures import kind as drawing_of

        figure_format(output)
        drawing = drawing_of(kind)
        read = Plan.read(plan)
        names = [read.problem.plane.index_of(name) for name in positioners or ()]
        options = _option(kind, drawing, "time", times or ()) | _option(kind, drawing, "positioner", names)
        draw(read, kind, output, **options)
    if json:
        say_json({"kind": kind, "written": [output]})
    else:
        say(f"wrote {output}")


def _option(kind: str, drawing: "Drawing", name: str, values: Any) -> dict[str, Any]:
    """The values of an option as the figure takes them: one, or several.

    Raises:
        FiberplanError: it takes none, or only one.
    """
    if not len(values):
        return {}
    known = inspect.signature(drawing).parameters
    if f"{name}s" in known:
        return {f"{name}s": list(values)}
    if name not in known:
        raise FiberplanError(f"--{name}: a figure of the kind '{kind}' has no such option")
    if len(values) > 1:
        raise FiberplanError(f"--{name}: a figure of the kind '{kind}' takes one, got {len(values)}")
    return {name: values[0]}
