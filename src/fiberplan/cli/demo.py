"""``fiberplan demo``: a first plan, without any file of one's own."""

import math
from pathlib import Path
from typing import Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import JsonOption, SeedOption
from fiberplan.cli.output import made_folder, page_output, plan_output, refuse_unwritable, say, working
from fiberplan.cli.report import say_plan
from fiberplan.cli.report_facts import plan_facts

MARGIN = 0.8  # [mm] with arms of radius 1.5 mm the same as the papers' buffer of 1.9 mm


def demo(
    folder: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Write plan.fits and plan.html here.")
    ] = Path(),
    seed: SeedOption = 0,
    json: JsonOption = False,
) -> None:
    """Plan, prove and show a move between two made-up fields: the SDSS-V array, targets clustered as galaxies are."""
    output, page = folder / "plan.fits", folder / "plan.html"
    made_folder(folder)
    refuse_unwritable(plan_output(output), page_output(page))
    with working("planning from field to field of the sdss array"):
        from fiberplan.focal_plane import FocalPlane
        from fiberplan.planners import Direct, GreedyFold
        from fiberplan.problem import Problem
        from fiberplan.scenes.clustered import clustered_targets
        from fiberplan.visuals import show
        from fiberplan.visuals.origin import Origin

        plane = FocalPlane.load("sdss")
        fields = [clustered_targets(plane, 2 * seed + k, MARGIN) for k in (0, 1)]
        to_first = Problem.from_targets(plane, fields[0], margin=MARGIN, conflicts="drop")
        here = GreedyFold(step=math.radians(1.0), seed=seed).plan(to_first).trajectory.end
        problem = Problem.from_targets(plane, fields[1], start=here, margin=MARGIN, conflicts="drop")
        plan = Direct(seed=seed).plan(problem)
        hub = GreedyFold(step=math.radians(1.0), seed=seed).plan(problem)
        faults = plan.faults()
        plan.write(output)
        show(plan, page, Origin.now(output))

    if json:
        say_json(plan_facts(plan, faults) | {"folded": str(hub), "written": [output, page]})
        raise typer.Exit(1 if faults else 0)
    say_plan(plan, [f"straight: {plan}", f"by way of folded: {hub}"], faults, (), [output, page])
    say(f"open {page} in a browser to see it move")
    raise typer.Exit(1 if faults else 0)
