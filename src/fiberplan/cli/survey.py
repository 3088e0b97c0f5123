"""``fiberplan survey``: many fields in order, each allocated, planned and proven; go on where a run was ended."""

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.numbered import numbers_of
from fiberplan.cli.options import InstrumentArgument, JsonOption, PriorityOrder, RegionsOption, SeedOption, SolverOption
from fiberplan.cli.output import made_folder, say, working
from fiberplan.cli.start import Margin, Offline, begun, room, switched_off
from fiberplan.errors import FiberplanError

if TYPE_CHECKING:
    from fiberplan.focal_plane import FocalPlane
    from fiberplan.survey import Survey, Telescope

_MOST_FAILED = 5  # fields that failed, by name


def survey(
    instrument: InstrumentArgument,
    catalogue: Annotated[
        Path | None,
        typer.Argument(metavar="CATALOGUE", help="A table: ra, dec (deg), or field, x, y (mm); id, priority, ..."),
    ] = None,
    fields: Annotated[
        Path | None, typer.Argument(metavar="FIELDS", help="A table: id; ra, dec (deg); chain, year, ...")
    ] = None,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Plans, allocations, tables and report.")
    ] = Path("survey"),
    demo: Annotated[
        int | None, typer.Option(metavar="N", help="N fields of a made-up sky, without any file.", min=1)
    ] = None,
    telescope: Annotated[
        str | None, typer.Option(metavar="NAME|FILE", help="Of ra and dec; that of INSTRUMENT if not given.")
    ] = None,
    start: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Where everyone stands before each chain; folded if not given.")
    ] = None,
    offline: Offline = None,
    margin: Margin = None,
    require: Annotated[
        list[str] | None,
        typer.Option(metavar="CATEGORY=N", help="Positions that each field needs, such as sky=80. Repeatable."),
    ] = None,
    regions: RegionsOption = 1,
    priority_order: PriorityOrder = "larger",
    solver: SolverOption = "milp",
    executor: Annotated[Literal["processes", "dask"], typer.Option(help="Who does the fields.")] = "processes",
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Of Dask; a cluster of this machine if not given.")
    ] = None,
    at_once: Annotated[
        int | None, typer.Option(metavar="N", help="Fields at a time; as many as there are cores if not given.", min=1)
    ] = None,
    seed: SeedOption = 0,
    json: JsonOption = False,
) -> None:
    """Allocate, plan and prove field after field; exit 0 if every field is, 1 if not.

    Ended at any moment and started again, it goes on where it was.
    """
    if scheduler is not None and executor != "dask":
        raise FiberplanError(f"--scheduler {scheduler}: needs --executor dask")
    if demo is None and (catalogue is None or fields is None):
        raise FiberplanError("survey: name CATALOGUE and FIELDS, or --demo N for a made-up sky")
    if demo is not None and catalogue is not None:
        raise FiberplanError(f"survey: --demo {demo} makes its sky up, and {catalogue} is a file")
    with working("surveying") as tell:
        from fiberplan.focal_plane import FocalPlane
        from fiberplan.survey import Fields, SurveyTargets, run
        from fiberplan.survey.batch.workers import dask_executor

        plane, off = switched_off(FocalPlane.load(instrument), offline or ())
        leave = room(plane, margin, 0.0, 0.0)
        optics = _optics(plane, telescope)
        sky = _made_up(plane, optics, demo, seed) if demo is not None else (catalogue, fields)
        targets, listed = SurveyTargets.of(sky[0]), Fields.of(sky[1])
        if priority_order == "smaller":
            targets = targets.turned()
        state = begun(plane, start, None)
        required = numbers_of(require or (), "--require")
        made_folder(output)
        with dask_executor(scheduler) if executor == "dask" else nullcontext((None, None)) as (who, cores):
            done = run(
                plane,
                targets,
                listed,
                output,
                who,
                margin=leave.margin,
                telescope=optics,
                start=state,
                required=required,
                regions=regions,
                solver=solver,
                seed=seed,
                at_once=at_once or cores,
                report=tell,
            )
    page = output / "report.html"
    if json:
        say_json(_facts(done) | {"notes": [*off, *leave.notes, *done.assumptions], "written": [output]})
        raise typer.Exit(1 if done.failed else 0)
    say(str(done), style="bold")
    for row in done.tables()["completeness"]:
        share = f"{row['complete']} of {row['in_fields']} in fields complete, {row['observed']} observed"
        say(f"{row['class']}, tier {row['tier']}: {share}")
    for record in done.failed[:_MOST_FAILED]:
        say(f"field {record.id} failed: {record.why}", style="yellow")
    if len(done.failed) > _MOST_FAILED:
        say(f"and {len(done.failed) - _MOST_FAILED} more fields failed (--json)", style="yellow")
    for note in (*off, *leave.notes, *done.assumptions):
        say(f"note: {note}")
    if done.longest == len(done.records) > 1 and at_once != 1:
        say("note: each field waits for the one before, by its chain or by targets in both: one worker does it all")
    say(f"wrote {output}; open {page} in a browser")
    raise typer.Exit(1 if done.failed else 0)


def _optics(plane: "FocalPlane", named: str | None) -> "Telescope | None":
    """The telescope that is named, or that feeds this focal plane; None if neither."""
    from fiberplan.errors import InstrumentError
    from fiberplan.survey import Telescope

    if named is not None:
        return Telescope.load(named)
    try:
        return Telescope.load(plane.name)
    except InstrumentError:
        return None  # targets may have x and y


def _made_up(plane: "FocalPlane", optics: "Telescope | None", count: int, seed: int) -> tuple[Any, Any]:
    """A catalogue and fields, with twice as many targets in a field as positioners; nights in up to four regions."""
    from fiberplan.scenes import clustered_sky

    if optics is None:
        raise FiberplanError(f"survey: --demo needs a telescope for {plane.name}: --telescope NAME|FILE")
    return clustered_sky(count, optics.radius, 2.0 * plane.n, seed, regions=min(4, -(-count // 10)))


def _facts(done: "Survey") -> dict[str, Any]:
    """The survey for programs."""
    completeness = done.tables()["completeness"]
    return {
        "fields": len(done.records),
        "failed": {record.id: record.why for record in done.failed},
        "observations": sum(len(record.taken) for record in done.records),
        "moving": done.moving,
        "completeness": [dict(zip(completeness.colnames, row.as_void().tolist(), strict=True)) for row in completeness],
    }
