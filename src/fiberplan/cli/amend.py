"""``fiberplan amend``: other goals for a few positioners of a plan that exists."""

import math
from pathlib import Path
from typing import Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import JsonOption, PlanArgument, VerboseOption, no_option, number_or_option
from fiberplan.cli.output import plan_output, refuse_unwritable, working
from fiberplan.cli.report import say_plan
from fiberplan.cli.report_facts import plan_facts
from fiberplan.errors import FiberplanError


def amend(
    plan: PlanArgument,
    positioner: Annotated[
        str | None, typer.Argument(metavar="[ID]", help="Whose goal is changed.", parser=no_option)
    ] = None,
    x: Annotated[
        float | None, typer.Argument(metavar="[X]", help="Where its fiber is to be (mm).", parser=number_or_option)
    ] = None,
    y: Annotated[
        float | None, typer.Argument(metavar="[Y]", help="The same along y (mm).", parser=number_or_option)
    ] = None,
    angles: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="A B", help="Instead of X Y: commanded alpha and beta (deg)."),
    ] = None,
    goals: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Instead of ID X Y: a table of targets, one after the other.")
    ] = None,
    longer: Annotated[
        float, typer.Option(metavar="PART", help="Part of the makespan that may be added where it must.", min=0.0)
    ] = 0.05,
    output: Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write the plan here.")] = None,
    verbose: VerboseOption = False,
    json: JsonOption = False,
) -> None:
    """Change goals of a plan and as little else as possible, and prove all of it anew.

    Exit 0 if the new goals are reached, 1 if one is not: that positioner then moves as before.
    """
    _refuse_two_ways(positioner, (x, y), angles, goals)
    refuse_unwritable(plan_output(output), inputs=(plan, goals))
    with working("amending"):
        import numpy as np

        from fiberplan.plan import Outcome, Plan
        from fiberplan.planners.amending.targets import amend_to
        from fiberplan.problem import Targets

        read = Plan.read(plan)
        plane = read.problem.plane
        if goals is not None:
            targets = Targets.read(goals)
        elif angles is not None:
            nowhere, given = np.array([math.nan]), np.radians([angles])
            targets = Targets(nowhere, nowhere, (str(positioner),), angles=given, source="amend", rows=("the goal",))
        else:
            targets = Targets(np.array([x]), np.array([y]), (str(positioner),), source="amend", rows=("the goal",))
        new = amend_to(read, targets, longer)
        faults = new.faults()
        if output is not None:
            new.write(output)
    missed = [i for i in targets.indices(plane) if new.outcomes[i] is not Outcome.ARRIVED]
    if json:
        say_json(plan_facts(new, faults) | {"written": [output] if output else []})
        raise typer.Exit(1 if faults or missed else 0)
    say_plan(new, [str(new)], faults, new.notes[len(read.notes) :], [output] if output else [], verbose)
    raise typer.Exit(1 if faults or missed else 0)


def _refuse_two_ways(
    positioner: str | None,
    place: tuple[float | None, float | None],
    angles: tuple[float, float] | None,
    goals: Path | None,
) -> None:
    """Refuse goals given in no way, or in two."""
    placed = any(value is not None for value in place)
    if goals is not None:
        if positioner is not None or placed or angles is not None:
            raise FiberplanError("amend: goals come from --goals, or from ID with X Y or --angles, not from both")
    elif positioner is None:
        raise FiberplanError("amend: whose goal? Give ID X Y, ID --angles A B, or --goals FILE")
    elif angles is not None and placed:
        raise FiberplanError(f"amend: the goal of {positioner} is given by X Y or by --angles, not by both")
    elif angles is None and None in place:
        raise FiberplanError(f"amend: the goal of {positioner} needs X and Y, or --angles A B")
