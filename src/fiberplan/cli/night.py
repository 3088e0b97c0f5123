"""``fiberplan separate``, ``fold`` and ``unwind``: out of a contact, and home, from wherever everyone stands."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import InstrumentArgument, JsonOption, SeedOption, VerboseOption
from fiberplan.cli.output import plan_output, refuse_unwritable, working
from fiberplan.cli.report import cautions, folded, say_plan
from fiberplan.cli.report_facts import plan_facts
from fiberplan.cli.start import Margin, Offline, StartTime, begun, room, switched_off

if TYPE_CHECKING:
    from fiberplan.focal_plane import FocalPlane
    from fiberplan.plan import Plan
    from fiberplan.problem import Problem, State

Start = Annotated[
    Path,
    typer.Option(metavar="FILE", help="Where everyone stands: a plan's end, a table, an exported motion, a record."),
]
_Tell = Callable[[str], None]
_Planned = Callable[["FocalPlane", "State", float, _Tell], "Plan"]
Written = Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write the plan here.")]


def separate(
    instrument: InstrumentArgument,
    start: Start,
    start_time: StartTime = None,
    offline: Offline = None,
    margin: Margin = None,
    output: Written = None,
    verbose: VerboseOption = False,
    json: JsonOption = False,
) -> None:
    """Part those who touch or are nearer than the margin, with proof that they only come apart.

    Nobody else moves than has to make room. Exit 0 if all have the margin in the end, 1 if some are wedged: those are
    named, with who is in their way.
    """

    def plan(plane: "FocalPlane", state: "State", margin: float, tell: _Tell) -> "Plan":
        from fiberplan.planners import separate as parted

        return parted(plane, state, margin, tell)

    _from_a_state(plan, "parting", (instrument, start, start_time, offline, margin, output, verbose, json))


def fold(
    instrument: InstrumentArgument,
    start: Start,
    start_time: StartTime = None,
    offline: Offline = None,
    margin: Margin = None,
    seed: SeedOption = 0,
    output: Written = None,
    verbose: VerboseOption = False,
    json: JsonOption = False,
) -> None:
    """Bring everyone to folded by the direct planner, around those who cannot move; exit 1 if not all get there."""
    _from_a_state(
        _homeward("direct", seed), "folding", (instrument, start, start_time, offline, margin, output, verbose, json)
    )


def unwind(
    instrument: InstrumentArgument,
    start: Start,
    start_time: StartTime = None,
    offline: Offline = None,
    margin: Margin = None,
    seed: SeedOption = 0,
    output: Written = None,
    verbose: VerboseOption = False,
    json: JsonOption = False,
) -> None:
    """Bring everyone to folded by the greedy fold, all alphas one way: where arms are entangled, slower and surer.

    Exit 1 if not all get there.
    """
    _from_a_state(
        _homeward("greedy-fold", seed),
        "unwinding",
        (instrument, start, start_time, offline, margin, output, verbose, json),
    )


def _homeward(planner: str, seed: int) -> _Planned:
    """What brings everyone to folded by the planner of this name."""

    def plan(plane: "FocalPlane", state: "State", margin: float, tell: _Tell) -> "Plan":
        from fiberplan.cli.planner import planned_by
        from fiberplan.planners import PLANNERS

        return planned_by(PLANNERS[planner](seed=seed), _to_folded(plane, state, margin), None, tell)

    return plan


def _to_folded(plane: "FocalPlane", state: "State", margin: float) -> "Problem":
    import numpy as np

    from fiberplan.problem import Problem

    able = (plane.online & state.online)[:, None]
    goal = np.where(able, plane.folded, np.nan)
    return Problem(plane, state, goal, margin, conflicts="drop", near_start="open")  # type: ignore[arg-type]


_Options = tuple[str, Path, float | None, list[str] | None, float | None, Path | None, bool, bool]


def _from_a_state(plan: _Planned, doing: str, options: _Options) -> None:
    """Read the state, plan, write and tell."""
    instrument, start, start_time, offline, margin, output, verbose, json = options
    refuse_unwritable(plan_output(output), inputs=(Path(instrument), start))
    with working(doing) as tell:
        from fiberplan.focal_plane import FocalPlane

        plane, off = switched_off(FocalPlane.load(instrument), offline or ())
        leave = room(plane, margin, 0.0, 0.0)
        state = begun(plane, start, start_time)
        assert state is not None  # there is a --start
        planned = plan(plane, state, leave.margin, tell)
        faults = planned.faults()
        if output is not None:
            planned.write(output)
    from fiberplan.plan import Outcome

    stuck = planned.having(Outcome.DEADLOCKED)
    failed = bool(faults or len(planned.lost) or len(stuck))
    if json:
        say_json(plan_facts(planned, faults) | {"written": [output] if output else []})
        raise typer.Exit(1 if failed else 0)
    wedged = [f"wedged {plane.ids[i]}: {_in_the_way(planned, int(i))}" for i in stuck if i not in planned.lost]
    notes = (*off, *leave.notes, *cautions(plane, leave.margin), *planned.notes)
    first = [f"{doing}: {planned.makespan:.1f} s", *folded(wedged, "wedged", verbose)]
    say_plan(planned, first, faults, notes, [output] if output else [], verbose)
    raise typer.Exit(1 if failed else 0)


def _in_the_way(plan: "Plan", i: int) -> str:
    plane = plan.problem.plane
    others = plan.blockers.get(i, ())
    offline = [plane.label(b) for b in others if b >= 0 and not plane.online[b]]
    named = f"in the way: {', '.join(map(plane.label, others))}" if others else "nobody else is in the way"
    return named + (f" (offline: {', '.join(offline)})" if offline else "")
