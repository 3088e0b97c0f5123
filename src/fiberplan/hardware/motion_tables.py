"""Motion from any table of (positioner, time, alpha, beta), whoever made it; our own ECSV and plan files included.

A row is a knot; between knots joints turn evenly. Where alpha or beta is empty, the row says nothing of that joint, so
that each may have times of its own. Units are those of the columns, else s and deg.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Executed, Trajectory
from fiberplan.problem import State
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_table
from fiberplan.tables.wording import nearest

COLUMNS = ("positioner", "time", "alpha", "beta")
_SHOWN = 12


def read_motion_table(path: Path, content: bytes, plane: FocalPlane, state: State) -> Executed:
    """The motion that a table tells; positioners that it leaves out stay where the state has them.

    Raises:
        TrajectoryError: no such table, or a positioner, time or angle that cannot be used; row and value are named.
    """
    table = read_table(path, TrajectoryError, content, wanted=[COLUMNS])
    table.require(*COLUMNS)
    owner, times = _owners(table, plane), table.numbers("time", "s")
    angles = np.stack([table.numbers(name, "rad", "deg", blank=np.nan) for name in COLUMNS[2:]], axis=1)
    for row in np.flatnonzero(times < 0):
        raise table.fail(int(row), f"time is {times[row]:g} s, before 0 s")
    knots, moved, notes = {}, np.zeros(plane.n, bool), []
    rows = np.argsort(owner, kind="stable")
    for own in np.split(rows, np.flatnonzero(np.diff(owner[rows])) + 1):
        i = int(owner[own[0]])
        knots[i], moved[i] = _knots(table, own, times, angles), True
        away = float(np.degrees(np.abs(knots[i][1][0] - state.angles[i]).max()))
        if away > 1.0 and not state.unknown[i]:
            notes.append(f"{plane.ids[i]} begins {away:.3g} deg from where it stands")
    said = {name: {str(id_) for id_ in table.meta.get(name) or ()} for name in ("offline", "unknown")}
    for i in np.flatnonzero(~moved).tolist():
        knots[i] = np.zeros(1), state.angles[i : i + 1]
    offline = np.array([id_ in said["offline"] for id_ in plane.ids])
    offsets = np.cumsum([0, *(len(knots[i][0]) for i in range(plane.n))])
    all_times, all_angles = (np.concatenate([knots[i][k] for i in range(plane.n)]) for k in (0, 1))
    return Executed(
        Trajectory(offsets, all_times, all_angles),
        joint_error=np.zeros((plane.n, 2)),
        clock_error=0.0,
        notes=tuple(notes),
        assumptions=tuple(_assumed(path, plane, state, moved, said["unknown"])),
        online=moved & ~offline & plane.online & state.online,
        placed=moved & ~np.array([id_ in said["unknown"] for id_ in plane.ids]),
    )


def _owners(table: InputTable, plane: FocalPlane) -> np.ndarray:
    names = table.texts("positioner")
    for row, name in enumerate(names):
        if name not in plane.names:
            raise table.fail(row, f"{plane.name} has no positioner '{name}'{nearest(name, plane.names)}")
    return np.array([plane.names[name] for name in names], np.int64)


def _knots(table: InputTable, own: np.ndarray, times: np.ndarray, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and angles of one positioner, from its rows: both joints at the times of either."""
    steps = np.diff(times[own])
    if (steps < 0).any():
        k = int(np.argmax(steps < 0))
        raise table.fail(
            int(own[k + 1]), f"time is {times[own[k + 1]]:g} s, before the {times[own[k]]:g} s of the row above"
        )
    joints = []
    for joint, name in enumerate(COLUMNS[2:]):
        rows = own[np.isfinite(angles[own, joint])]
        if not len(rows):
            raise table.fail(int(own[0]), f"{name} of this positioner is nowhere given")
        same = np.flatnonzero(np.diff(times[rows]) == 0)
        for k in same[angles[rows[same], joint] != angles[rows[same + 1], joint]]:
            raise table.fail(int(rows[k + 1]), f"{name} is elsewhere at {times[rows[k]]:g} s than in the row above")
        rows = np.delete(rows, same + 1)
        joints.append((times[rows], angles[rows, joint]))
    both = np.unique(times[own])
    return both, np.stack([np.interp(both, *joint) for joint in joints], axis=1)


def _assumed(path: Path, plane: FocalPlane, state: State, moved: np.ndarray, unknown: set[str]) -> Sequence[str]:
    """What the file leaves to guesses."""
    said = []
    absent = [plane.ids[i] for i in np.flatnonzero(~moved & state.unknown)]
    guessed = [id_ for id_ in plane.ids if id_ in unknown]
    for who, what in (
        (absent, f"are not in {path.name}: taken as folded, and as never moving"),
        (guessed, f"stand where {path.name} only takes them to stand"),
    ):
        if who:
            more = f" and {len(who) - _SHOWN} more" if len(who) > _SHOWN else ""
            said.append(f"{', '.join(who[:_SHOWN])}{more} {what}")
    return said
