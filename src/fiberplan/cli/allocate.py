"""``fiberplan allocate``: from a catalogue to targets that positioners can take together, all of which are reached."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.numbered import numbers_of
from fiberplan.cli.options import InstrumentArgument, JsonOption, PriorityOrder, RegionsOption, SeedOption, SolverOption
from fiberplan.cli.output import Output, plan_output, refuse_unwritable, say, working
from fiberplan.cli.report import assumptions, cautions
from fiberplan.cli.start import Jitter, Margin, Offline, PositionError, StartTime, begun, room, switched_off
from fiberplan.errors import FiberplanError

if TYPE_CHECKING:
    from fiberplan.survey import Allocation

_TABLES = (".ecsv", ".csv", ".fits", ".txt", ".dat")


def allocate(
    instrument: InstrumentArgument,
    catalogue: Annotated[
        Path, typer.Argument(metavar="CATALOGUE", help="A table: x, y (mm unless it says), priority, tier, ...")
    ],
    start: Annotated[Path | None, typer.Option(metavar="FILE", help="A plan's end, a motion, table or record.")] = None,
    start_time: StartTime = None,
    offline: Offline = None,
    stay: Annotated[
        list[str] | None, typer.Option(metavar="ID,ID", help="Robots that keep their place. Repeatable.")
    ] = None,
    margin: Margin = None,
    jitter: Jitter = 0.0,
    position_error: PositionError = 0.0,
    require: Annotated[
        list[str] | None,
        typer.Option(metavar="CATEGORY=N", help="Positions of a category that are needed, such as sky=80. Repeatable."),
    ] = None,
    regions: RegionsOption = 1,
    priority_order: PriorityOrder = "larger",
    motion: Annotated[
        bool, typer.Option("--motion/--no-motion", help="Choose again around whoever does not arrive.")
    ] = True,
    solver: SolverOption = "milp",
    deadline: Annotated[
        float | None,
        typer.Option(metavar="S", help="Seconds for each integer program; then the best so far.", min=0.0),
    ] = None,
    seed: SeedOption = 0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write the targets here.")
    ] = None,
    plan: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the plan that reaches them.")] = None,
    json: JsonOption = False,
) -> None:
    """Say which positioner takes which target; exit 1 if nothing is, or less than is required."""
    refuse_unwritable(
        Output(output, _TABLES, "a table"), plan_output(plan), inputs=(Path(instrument), catalogue, start)
    )
    if plan is not None and not motion:
        raise FiberplanError("allocate: --plan asks for a motion that --no-motion leaves out")
    with working("allocating"):
        from fiberplan.focal_plane import FocalPlane
        from fiberplan.survey import Catalogue
        from fiberplan.survey import allocate as allocated

        plane, off = switched_off(FocalPlane.load(instrument), offline or ())
        leave = room(plane, margin, jitter, position_error)
        found = allocated(
            plane,
            Catalogue.read(catalogue, priority_order),
            leave.margin,
            start=begun(plane, start, start_time),
            motion=motion,
            required=numbers_of(require or (), "--require"),
            regions=regions,
            position_error=leave.error,
            stay=[name for text in stay or () for name in text.split(",") if name],
            solver=solver,
            seed=seed,
            deadline=deadline,
        )
        faults = [] if found.plan is None else found.plan.faults()
        if output is not None and found.targets is not None:
            found.write(output)
        if plan is not None and found.plan is not None:
            found.plan.write(plan)
    written = [path for path in (output, plan) if path is not None and found.targets is not None]
    short = [quota for quota in found.quotas if quota.allocated < quota.required]
    failed = bool(short or faults or found.targets is None)
    if json:
        say_json(_facts(found, faults) | {"written": written})
        raise typer.Exit(1 if failed else 0)
    say(str(found), style="bold")
    for tier in found.tiers if len(found.tiers) > 1 else ():
        say(f"tier {tier.tier}: {tier.targets} targets, value {tier.value:g} of at most {tier.bound:g}")
    for quota in short:
        what = f"{quota.allocated} of {quota.required} required positions of category {quota.category}"
        say(f"{what} in region {quota.region}", style="yellow")
    for why, count in found.counts().items():
        say(f"not allocated: {count}: {why.value}")
    for note in (*off, *leave.notes, *cautions(plane, leave.margin), *found.problem.notes):
        say(f"note: {note}")
    if found.plan is not None:
        again = f"; planned {found.rounds} times, which cost priority {found.price:g}" if found.rounds > 1 else ""
        say(f"{found.plan}{again}")
        for fault in faults:
            say(fault, style="yellow")
        for line in assumptions(found.plan, found.plan.certificate):
            say(line)
        if not faults:
            say(str(found.plan.certificate), style="green")
    say(f"wrote {' and '.join(map(str, written))}" if written else "nothing written: -o FILE keeps the targets")
    raise typer.Exit(1 if failed else 0)


def _facts(found: "Allocation", faults: list[str]) -> dict[str, Any]:
    """The allocation for programs."""
    listed, ids = found.catalogue, found.problem.plane.ids
    pairs = zip(found.positioners.tolist(), found.rows.tolist(), strict=True)
    return {
        "value": found.value,
        "bound": found.bound,
        "tiers": [tier._asdict() for tier in found.tiers],
        "required": [quota._asdict() for quota in found.quotas],
        "allocated": {ids[i]: listed.ids[row] for i, row in pairs},
        "not_allocated": {
            listed.ids[row]: {"why": reason.why, "text": reason.text} for row, reason in found.reasons.items()
        },
        "rounds": found.rounds,
        "price": found.price,
        "makespan": None if found.plan is None else found.plan.makespan,
        "interrupted": found.interrupted,
        "faults": faults,
        "assumptions": [] if found.plan is None else found.plan.certificate.assumptions,
    }
