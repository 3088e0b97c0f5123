"""``fiberplan animate``: a plan as a film."""

from pathlib import Path
from typing import Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import JsonOption, PlanArgument
from fiberplan.cli.output import Output, refuse_unwritable, say, working


def animate(
    plan: PlanArgument,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="FILE", help="The film: .mp4 (extra `movie`), or .gif."),
    ],
    speed: Annotated[
        float | None,
        typer.Option(
            metavar="X", help="Times faster than real; such that the film lasts 10 s if not given.", min=0.001
        ),
    ] = None,
    fps: Annotated[float, typer.Option(metavar="N", help="Frames per second; at most 50 of a GIF.", min=1.0)] = 30.0,
    size: Annotated[int, typer.Option(metavar="PIXELS", help="Height and width.", min=200)] = 1000,
    json: JsonOption = False,
) -> None:
    """Write a plan as a film, its time and how much faster than real it is shown in every picture."""
    refuse_unwritable(Output(output, (".mp4", ".gif"), "a film"), inputs=(plan,))
    with working("drawing") as tell:
        from fiberplan.plan import Plan
        from fiberplan.visuals.film import animate as film
        from fiberplan.visuals.film import speed_for

        read = Plan.read(plan)
        chosen = speed_for(read.makespan) if speed is None else speed
        film(read, output, fps, chosen, size, lambda done, count: tell(f"frame {done} of {count}"))
    if json:
        say_json({"speed": chosen, "written": [output]})
    else:
        say(f"wrote {output}: {chosen:g} x real speed")
