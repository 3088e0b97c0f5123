"""``fiberplan replay``: does every claim in a plan file hold, by a checker that shares nothing with the planner?"""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import JsonOption, PlanArgument
from fiberplan.cli.output import say, working
from fiberplan.errors import FiberplanError, PlanError

if TYPE_CHECKING:
    from fiberplan.certificates.replay import Claims

LISTED = 20  # faults that have a line of their own


def replay(
    plan: PlanArgument,
    since: Annotated[
        Path | None,
        typer.Option(metavar="OLD", help="A plan that has been replayed, and held: only what differs from it is."),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(metavar="N", help="Processes; one for each core unless given.", min=1)
    ] = None,
    json: JsonOption = False,
) -> None:
    """Replay a plan's certificate in interval arithmetic; exit 0 if every claim in the file holds, 1 if not.

    Decided are, from positioners, motion and certificate alone: that pairs keep the margin, that pairs without a
    certificate cannot meet, ranges, speeds, start, goals and outcomes.
    """
    with working("replaying") as report:
        try:
            from fiberplan.certificates.whole_replay import replay as replay_all
        except ModuleNotFoundError as missing:
            raise FiberplanError(f"replay needs {missing.name}: pip install 'fiberplan[proof]'") from None

        content = _read(plan)
        claims, before = _claims(content, plan), None if since is None else _claims(_read(since), since)
        made = "CERTIFICATE_AXES" not in claims.tables
        if made:
            claims.rows = _made(content, plan)
        found = replay_all(claims, before, jobs, report)
    faults = found.faults
    notes = [*(["the file holds no axes: they were made first, and then replayed"] if made else []), *found.notes]
    if since is not None:
        notes.append(f"{found.taken} pairs are as in {since}, which must have been replayed itself")
    about = f"about {found.about}"
    if json:
        facts = {"ok": not faults, "faults": faults, "notes": notes, "about": about}
        say_json(facts | {"judged": found.judged, "taken": found.taken})
        raise typer.Exit(1 if faults else 0)
    for line in faults[:LISTED]:
        say(line, style="yellow")
    if len(faults) > LISTED:
        say(f"and {len(faults) - LISTED} more: --json lists them all", style="yellow")
    for note in notes:
        say(f"note: {note}")
    verdict = f"{len(faults)} claims are not shown to hold" if faults else "every claim holds"
    say(f"{verdict}: {found.judged} pairs judged; {about}", style="red" if faults else "green")
    raise typer.Exit(1 if faults else 0)


def _read(path: Path) -> bytes:
    from fiberplan.tables.contents import read_whole

    return read_whole(path, PlanError)


def _claims(content: bytes, path: Path) -> "Claims":
    from fiberplan.certificates.replay import BadFileError, Claims

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of astropy, about files that are refused in a line of ours
            return Claims(content)
    except BadFileError as error:
        raise PlanError(f"{path}: {error}") from None


def _made(content: bytes, path: Path) -> dict:
    """Axes of a plan whose file has none."""
    from fiberplan.certificates.replay import Claims
    from fiberplan.io.plan_file import plan_bytes, plan_from_bytes

    return Claims(plan_bytes(plan_from_bytes(content, path))).rows
