"""Readers of states, and their writer: where everyone stands and who can move, from whatever says it.

A plan, or its file; a table with a row for each positioner, or with a row for each knot of a motion, as ours are
exported; a SDSS ``confSummary``; a DESI focal-plane file; a field of targets as instruments have them, whose robots
have arrived; a controller's file of a motion. Whoever is not in it, or has no angles in it, is unknown: offline, and
taken as folded. Angles are commanded ones.
"""

import io
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fiberplan.arrays.door import number
from fiberplan.errors import InstrumentError, ProblemError, TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.instruments.desi import angles_of, focal_plane_file
from fiberplan.instruments.formats import TARGET_FILES
from fiberplan.instruments.sdss_states import standing as record_of
from fiberplan.io.motion_states import Standing, standing_after, standing_in_file
from fiberplan.io.plan_file import is_plan, plan_from_bytes
from fiberplan.motion import Executed, Trajectory
from fiberplan.plan import Plan
from fiberplan.problem import State, Targets
from fiberplan.problem.agreement import Agreement, second_names_agree, state_agrees
from fiberplan.tables.atomic import write_whole
from fiberplan.tables.contents import plain_name, read_whole
from fiberplan.tables.formats import content_format
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_table
from fiberplan.tables.wording import nearest

_SHOWN = 12  # how many positioners a note lists


class _Rows(NamedTuple):
    """What a source says, a row a positioner."""

    ids: Sequence[str]
    where: Sequence[str]  #: "line 7", for messages
    angles: np.ndarray  #: (k, 2) [rad]; NaN: not said
    online: np.ndarray | None = None  #: (k,)
    position_error: np.ndarray | None = None  #: (k,) [mm]
    guessed: np.ndarray | None = None  #: (k,) whose angles are a guess
    why: str = "offline"  #: what they are who cannot move
    numbers: Sequence[str] | None = None  #: (k,) what else the source calls them
    points: np.ndarray | None = None  #: (k, 2) where the source puts their fibers [mm]; NaN: not said
    fibers: Sequence[str] | None = None  #: (k,) which fibers; "": the default one


def read_state(source: object, plane: FocalPlane, at: float | None = None) -> State:
    """Where everyone on `plane` stands.

    Args:
        source: a `State`, a `Plan`, a motion (`Executed` or `Trajectory`), or the path of a file.
        plane: whose positioners they are; its robots are named by ids or second names.
        at: moment of a motion [s]; its end unless given.

    Raises:
        ProblemError: a file, column, unit or value that cannot be used, a positioner that `plane` does not have, one
            given twice, or a moment of what is no motion; one line that names it.
        PlanError: a plan file that is damaged or of a newer format.
    """
    if at is not None:
        at = number(at, "s", "the moment of a state", ProblemError)
        if not (np.isfinite(at) and at >= 0):
            raise ProblemError(f"a state is read at a moment of 0 s or more, got {at:g} s")
    if isinstance(source, State):
        return source
    if isinstance(source, Plan):
        return _arranged(plane, "plan", _of_plan(source, at))
    if isinstance(source, Executed | Trajectory):
        executed = source if isinstance(source, Executed) else Executed.exactly(source)
        return _arranged(plane, "motion", _of_standing(plane, standing_after(executed, plane, at)))
    if not isinstance(source, str | os.PathLike):
        raise ProblemError(f"a state is read from a plan, a motion or a file, got {type(source).__name__}")
    path = Path(source)
    return _arranged(plane, str(path), _of_file(path, plane, at))


def write_state(state: State, path: str | os.PathLike, plane: FocalPlane) -> None:
    """Write where everyone stands as an ECSV table that `read_state` reads; who is unknown has no angles.

    Raises:
        ProblemError: another number of positioners than the focal plane has, or a file that cannot be written.
    """
    from astropy import units
    from astropy.table import QTable

    if len(state.angles) != plane.n:
        raise ProblemError(f"the state has {len(state.angles)} positioners, the focal plane {plane.n}")
    alpha, beta = np.where(state.unknown[:, None], np.nan, np.degrees(state.angles)).T
    columns = {"positioner": np.array(plane.ids, str), "alpha": alpha * units.deg, "beta": beta * units.deg}
    columns |= {"online": state.online, "position_error": state.position_error * units.mm}
    text = io.StringIO()
    meta = {"instrument": plane.name, "source": state.source, "notes": list(state.notes)}
    QTable(columns, meta=meta).write(text, format="ascii.ecsv")
    write_whole(path, text.getvalue().encode(), ProblemError)


def _of_file(path: Path, plane: FocalPlane, at: float | None) -> _Rows:
    if _is_desi(path):
        _refuse_moment(path, at, "a focal-plane file")
        try:
            found = angles_of(path)
        except InstrumentError as error:
            raise ProblemError(str(error)) from None
        here = [k for k, id_ in enumerate(found.ids) if id_ in plane.names] or list(range(len(found.ids)))
        ids = [found.ids[k] for k in here]  # of one petal, or of all
        return _Rows(ids, [f"LOCATION {id_}" for id_ in ids], found.angles[here])
    content = read_whole(path, ProblemError)
    if is_plan(content):
        return _of_plan(plan_from_bytes(content, path), at)
    if plain_name(path).suffix.lower() == ".par":
        _refuse_moment(path, at, "a record")
        record = record_of(path, content)
        why = "disabled, so offline,"
        return _Rows(
            record.ids,
            record.rows,
            record.angles,
            ~record.disabled,
            why=why,
            numbers=record.numbers,
            points=record.points,
            fibers=record.fibers,
        )
    known = content_format(TARGET_FILES, path, content)
    if known is not None:
        _refuse_moment(path, at, "a field")
        try:
            return _of_field(Targets(**known.read(path, content)), plane)
        except TargetError as error:
            raise ProblemError(str(error)) from None
    standing = standing_in_file(path, content, plane, at)
    if standing is not None:
        return _of_standing(plane, standing)
    return _of_table(read_table(path, ProblemError, content), at)


def _is_desi(path: Path) -> bool:
    try:
        return focal_plane_file(path) is not None
    except OSError:
        return False


def _refuse_moment(source: object, at: float | None, what: str) -> None:
    if at is not None:
        raise ProblemError(f"{source}: {what} is no motion: nothing is known of {at:g} s")


def _of_plan(plan: Plan, at: float | None) -> _Rows:
    state, ids = plan.end if at is None else plan.state_at(at), plan.problem.plane.ids
    where = [f"row {k + 1}" for k in range(len(ids))]
    return _Rows(ids, where, state.angles, state.online, state.position_error, state.unknown)


def _of_standing(plane: FocalPlane, found: Standing) -> _Rows:
    angles = np.where(found.guessed[:, None], np.nan, found.angles)
    where = [f"row {k + 1}" for k in range(plane.n)]
    return _Rows(plane.ids, where, angles, found.online, found.position_error, why="not moved, or cannot move,")


def _of_field(targets: Targets, plane: FocalPlane) -> _Rows:
    """Whoever has a target stands at it."""
    who, solution = targets.indices(plane), targets.solve(plane)
    return _Rows([plane.ids[i] for i in who], targets.rows, solution.goal[who])


def _of_table(table: InputTable, at: float | None) -> _Rows:
    table.require("positioner", "alpha", "beta")
    ids = table.names("positioner")
    angles = np.stack([table.numbers(name, "rad", "deg", blank=np.nan) for name in ("alpha", "beta")], axis=1)
    if "time" in table:
        return _of_motion(table, ids, angles, at)
    _refuse_moment(table.source, at, "a table without a column 'time'")
    online = table.flags("online", blank=True) if "online" in table else None
    error = None
    if "position_error" in table:
        error = table.numbers("position_error", "mm", blank=0.0)
        for row in np.flatnonzero(error < 0):
            raise table.fail(int(row), f"position_error is {error[row]:g}, expected 0 mm or more")
    points = None
    if "x" in table and "y" in table:
        points = np.stack([table.numbers(name, "mm", blank=np.nan) for name in ("x", "y")], axis=1)
    fibers = table.texts("fiber", blank="") if "fiber" in table else None
    return _Rows(ids, table.rows, angles, online, error, points=points, fibers=fibers)


def _of_motion(table: InputTable, ids: Sequence[str], angles: np.ndarray, at: float | None) -> _Rows:
    """Each positioner at its last knot, or where it is at a moment; it rests before its first knot and after its last.

    In the meta data of our own exports there is who was offline, and whose place was a guess.
    """
    times = table.numbers("time", "s")
    rows: dict[str, list[int]] = {}
    for row, id_ in enumerate(ids):
        own = rows.setdefault(id_, [])
        if own and not times[row] > times[own[-1]]:
            before = f"{times[own[-1]]:g} s in {table.rows[own[-1]]}"
            raise table.fail(row, f"time of positioner '{id_}' is {times[row]:g} s, not after the {before}")
        if np.isnan(angles[row]).any():
            raise table.fail(row, f"{'alpha' if np.isnan(angles[row, 0]) else 'beta'} of a motion is empty")
        own.append(row)

    def place(own: list[int]) -> np.ndarray:
        if at is None:
            return angles[own[-1]]
        return np.array([np.interp(at, times[own], angles[own, joint]) for joint in (0, 1)])

    said = {name: {str(id_) for id_ in table.meta.get(name) or ()} for name in ("offline", "unknown")}
    return _Rows(
        list(rows),
        [table.rows[own[-1]] for own in rows.values()],
        np.array([place(own) for own in rows.values()]),
        online=np.array([id_ not in said["offline"] for id_ in rows]),
        guessed=np.array([id_ in said["unknown"] for id_ in rows]),
    )


def _arranged(plane: FocalPlane, source: str, said: _Rows) -> State:
    """Rows in the focal plane's order; whoever has no angles is unknown, offline and taken as folded."""
    angles, online = np.full((plane.n, 2), np.nan), np.array(plane.online)
    error, unknown = np.zeros(plane.n), np.zeros(plane.n, bool)
    rows: dict[int, str] = {}
    stopped = []
    for k, (id_, row) in enumerate(zip(said.ids, said.where, strict=True)):
        if id_ not in plane.names:
            raise ProblemError(f"{source}: {row}: {plane.name} has no positioner '{id_}'{nearest(id_, plane.names)}")
        i = plane.names[id_]
        if (first := rows.setdefault(i, row)) != row:
            raise ProblemError(f"{source}: {row}: positioner '{id_}' was already given in {first}")
        angles[i] = said.angles[k]
        error[i] = 0.0 if said.position_error is None else said.position_error[k]
        unknown[i] = said.guessed is not None and bool(said.guessed[k])
        if said.online is not None and not said.online[k]:
            stopped += [i] if plane.online[i] else []
            online[i] = False
    who = np.array(list(rows), np.int64)
    try:
        notes = list(second_names_agree(plane, who, said.numbers, source))
        agreed = Agreement()
        if said.points is not None:
            stated = (said.angles, said.points, said.fibers, said.online)
            agreed = state_agrees(plane, who, said.where, *stated, source)
    except TargetError as refusal:
        raise ProblemError(str(refusal).partition(" --prefer")[0]) from None
    unsaid = np.isnan(angles).any(axis=1)
    if unsaid.any():
        absent = _listed(plane, np.flatnonzero(unsaid).tolist())
        notes.append(f"no angles in {source} for {absent}: taken as offline and folded")
    notes += [*agreed.notes, *(f"{why}: taken as offline and folded" for why in agreed.apart.values())]
    lacking = unsaid.copy()
    lacking[who[list(agreed.apart)]] = True
    angles[lacking] = plane.folded[lacking]
    online &= ~lacking
    if others := [i for i in stopped if not lacking[i]]:
        notes.append(f"{said.why} in {source}: {_listed(plane, others)}")
    return State(angles, online, error, unknown | lacking, source, tuple(notes), agreed.named)


def _listed(plane: FocalPlane, who: Sequence[int]) -> str:
    names = ", ".join(plane.ids[i] for i in who[:_SHOWN])
    return names + (f" and {len(who) - _SHOWN} more" if len(who) > _SHOWN else "")
