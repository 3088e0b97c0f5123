"""``fiberplan plan``: from a focal plane and a table of targets to a proven plan."""

import dataclasses
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.completion import controller_names, planner_names, setting_keys
from fiberplan.cli.options import InstrumentArgument, JsonOption, SeedOption, VerboseOption
from fiberplan.cli.output import page_output, plan_output, refuse_unwritable, say, working
from fiberplan.cli.report import cautions, incomplete, say_plan
from fiberplan.cli.report_facts import plan_facts
from fiberplan.cli.start import (
    Jitter,
    Margin,
    Offline,
    PositionError,
    StartTime,
    begun,
    refuse_overlaps,
    room,
    switched_off,
)

if TYPE_CHECKING:
    from fiberplan.certificates import Certificate

Conflicts = Literal["raise", "drop"]
Order = Literal["larger", "smaller"]
Prefer = Literal["angles", "xy"]


def plan(
    instrument: InstrumentArgument,
    targets: Annotated[Path, typer.Argument(metavar="TARGETS", help="A table: positioner, x, y (mm unless it says).")],
    start: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A plan's end, motion, table or record.",
        ),
    ] = None,
    start_time: StartTime = None,
    offline: Offline = None,
    planner: Annotated[
        str,
        typer.Option(metavar="NAME", help="See `fiberplan planners`.", autocompletion=planner_names),
    ] = "direct",
    assignments: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="A setting: `fiberplan planners NAME`. Repeatable.",
            autocompletion=setting_keys,
        ),
    ] = None,
    settings: Annotated[Path | None, typer.Option(metavar="FILE", help="Settings, as a TOML file.")] = None,
    controller: Annotated[
        str | None,
        typer.Option("--for", metavar="CONTROLLER", help="So that its motors can.", autocompletion=controller_names),
    ] = None,
    exported: Annotated[
        list[str] | None,
        typer.Option("--export", metavar="KEY=VALUE", help="Export option: power=0.5."),
    ] = None,
    margin: Margin = None,
    jitter: Jitter = 0.0,
    position_error: PositionError = 0.0,
    conflicts: Annotated[Conflicts, typer.Option(help="Bad goals: refuse or drop?")] = ("raise"),
    priority_order: Annotated[Order, typer.Option(help="Which priority goes first.")] = "larger",
    park_idle: Annotated[bool, typer.Option("--park-idle", help="Fold who has no target.")] = False,
    park_at: Annotated[tuple[float, float] | None, typer.Option(metavar="A B", help="Park idle there (deg).")] = None,
    prefer: Annotated[
        Prefer | None,
        typer.Option(help="Which counts where angles and x, y disagree."),
    ] = None,
    seed: SeedOption = 0,
    deadline: Annotated[
        float | None,
        typer.Option(metavar="S", help="Best plan after so many seconds (direct).", min=0.0),
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write the plan here.")] = None,
    page: Annotated[Path | None, typer.Option(metavar="FILE", help="Write an HTML page that shows it.")] = None,
    verbose: VerboseOption = False,
    json: JsonOption = False,
) -> None:
    """Plan the motion from START to TARGETS and prove it safe; exit 0 if every target is reached, 1 if not.

    Without -o and --page nothing is written.
    """
    refuse_unwritable(plan_output(output), page_output(page), inputs=(Path(instrument), targets, start, settings))
    with working("planning") as tell:
        import numpy as np

        from fiberplan.cli.export_options import export_options
        from fiberplan.cli.planner import chosen_planner, planned_by, settings_facts
        from fiberplan.focal_plane import FocalPlane
        from fiberplan.hardware.certified import said
        from fiberplan.hardware.planned import executed, fitted
        from fiberplan.plan.diagnosis import displaced
        from fiberplan.planners.parking import plan_with_parking
        from fiberplan.problem import Problem, Targets

        options = export_options(controller, exported or ())
        chosen = chosen_planner(planner, seed, assignments or (), settings)
        plane, off = switched_off(FocalPlane.load(instrument, conflicts), offline or ())
        plane = plane if controller is None else fitted(plane, controller)
        leave = room(plane, margin, jitter, position_error)
        field = Targets.read(targets, priority_order, prefer, conflicts)
        problem = Problem.from_targets(
            plane,
            dataclasses.replace(field, notes=(*off, *leave.notes, *field.notes)),
            start=begun(plane, start, start_time),
            margin=leave.margin,
            conflicts=conflicts,
            position_error=leave.error,
        )
        refuse_overlaps(problem)

        planning = partial(planned_by, chosen, deadline=deadline, tell=tell, controller=controller, options=options)
        at = None if park_at is None else np.radians(park_at)
        parks = park_idle or park_at is not None
        planned = plan_with_parking(planning, problem, at) if parks else planning(problem)
        faults = planned.faults()
        proof = None if controller is None else executed(controller, planned, **options)
        if proof is not None and not proof.ok:
            faults.append(f"executed by {controller}: {said(planned, proof)}")
    with working("writing"):
        if output is not None:
            planned.write(output)
        if page is not None:
            from fiberplan.visuals import show
            from fiberplan.visuals.origin import Origin

            show(planned, page, Origin.now(output))
    written = [path for path in (output, page) if path is not None]

    if json:
        say_json(
            plan_facts(planned, faults) | _executed(proof) | {"settings": settings_facts(chosen), "written": written}
        )
        raise typer.Exit(1 if faults or incomplete(planned) else 0)
    notes = (*cautions(plane, leave.margin), *displaced(planned), *problem.notes, *planned.notes)
    say_plan(planned, [str(planned)], faults, notes, written, verbose)
    if proof is not None and proof.ok:
        say(f"executed by {controller}: {proof}", style="green")
    raise typer.Exit(1 if faults or incomplete(planned) else 0)


def _executed(proof: "Certificate | None") -> dict[str, Any]:
    """What is proven of the motion that a controller makes the motors do."""
    if proof is None:
        return {}
    return {"executed": {"ok": proof.ok, "summary": str(proof), "margin": proof.margin}}
