"""From DESI's move tables to the motion they cause.

A row turns both axes from the same moment (`turns`); the next begins when the row's time and pause are over. Rows count
steps from wherever the axis is, so angles are only known from the state before.
"""

import ast
import csv
import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.hardware.desi.turns import Turn, axis_turn
from fiberplan.motion import Executed, Trajectory
from fiberplan.problem import State
from fiberplan.tables.wording import nearest

COLUMNS = ("posid", "motor_steps_T", "motor_steps_P", "speed_mode_T", "speed_mode_P", "move_time", "postpause")
_SAME = 1e-9  # [s] moments that differ by rounding alone
_FROM_REST = ("rows begin when the times of the rows before them, as the table states them, are over",)
_SHOWN = 12


class Tables(NamedTuple):
    """The move table of one positioner."""

    posid: str
    line: str
    linear: bool  #: phi has a linear motor
    steps: np.ndarray  #: (rows, 2) theta, phi; of the motors
    cruise: np.ndarray  #: (rows, 2)
    time: np.ndarray  #: (rows,) [s]
    pause: np.ndarray  #: (rows,) [s]

    @property
    def begins(self) -> np.ndarray:
        """(rows + 1,) when each row begins, and when all is over [s]."""
        return np.concatenate([[0.0], np.cumsum(self.time + self.pause)])

    def turns(self, row: int) -> tuple[Turn, Turn]:
        """What theta and phi do in a row."""
        theta, phi = (
            axis_turn(int(self.steps[row, k]), bool(self.cruise[row, k]), bool(k) and self.linear) for k in (0, 1)
        )
        return theta, phi

    @property
    def net(self) -> np.ndarray:
        """(rows, 2) what the shafts have turned at the end of each row [deg]."""
        return np.cumsum([[turn.angles[-1] for turn in self.turns(row)] for row in range(len(self.time))], axis=0)


def read_tables(path: Path, content: bytes) -> list[Tables]:
    """All tables of a file.

    Raises:
        TrajectoryError: a column that lacks, or a cell that cannot be used; line, column and value are named.
    """
    try:
        lines = list(csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline="")))
    except (UnicodeDecodeError, csv.Error):
        raise TrajectoryError(f"{path}: is no table of moves") from None
    for name in COLUMNS:
        if not lines or name not in lines[0]:
            raise TrajectoryError(f"{path}: no column '{name}', which tables of moves have")
    found: dict[str, Tables] = {}
    for number, cells in enumerate(lines, 2):
        table = _table(path, f"line {number}", cells)
        if table.posid in found:
            raise TrajectoryError(
                f"{path}: line {number}: {table.posid} was already given in {found[table.posid].line}"
            )
        found[table.posid] = table
    return list(found.values())


def _table(path: Path, line: str, cells: Mapping[str, str]) -> Tables:
    lists = {name: _list(path, line, name, cells[name]) for name in COLUMNS[1:]}
    counts = {len(values) for values in lists.values()}
    if len(counts) != 1:
        said = ", ".join(f"{len(values)} of {name}" for name, values in lists.items())
        raise TrajectoryError(f"{path}: {line}: rows differ in number: {said}")
    steps, times = ("motor_steps_T", "motor_steps_P"), ("move_time", "postpause")
    for name in (*steps, *times):
        for value in lists[name]:
            whole = isinstance(value, int) or (isinstance(value, float) and np.isfinite(value) and name in times)
            if isinstance(value, bool) or not whole or (name in times and value < 0):
                raise TrajectoryError(f"{path}: {line}: {name} has {value!r}")
    for name in ("speed_mode_T", "speed_mode_P"):
        for value in lists[name]:
            if value not in ("cruise", "creep"):
                raise TrajectoryError(f"{path}: {line}: {name} has {value!r}, neither cruise nor creep")
    (count,) = counts
    return Tables(
        posid=cells["posid"].strip(),
        line=line,
        linear="P" in (cells.get("zeno") or ""),
        steps=np.array([lists[name] for name in steps], np.int64).reshape(2, count).T,
        cruise=np.array([[mode == "cruise" for mode in lists[f"speed_mode_{axis}"]] for axis in "TP"], bool).T,
        time=np.array(lists["move_time"], float),
        pause=np.array(lists["postpause"], float) / 1000,
    )


def _list(path: Path, line: str, name: str, cell: str | None) -> list[Any]:
    try:
        value = ast.literal_eval(cell or "")
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        value = None
    if not isinstance(value, list):
        raise TrajectoryError(f"{path}: {line}: {name} is '{(cell or '')[:40]}', expected a list")
    return value


def decode(path: Path, content: bytes, plane: FocalPlane, state: State, linear: frozenset[str]) -> Executed:
    """The motion that a file causes, from the state before.

    Args:
        path: of the file.
        content: of the file.
        plane: whose positioners it moves.
        state: where they stand before.
        linear: device ids of those whose phi has a linear motor, besides those that the file names.

    Raises:
        TrajectoryError: no table of moves, or a positioner that `plane` does not have.
    """
    rest, error, moved = np.degrees(state.angles), np.zeros((plane.n, 2)), np.zeros(plane.n, bool)
    knots = {i: (np.zeros(1), rest[i : i + 1]) for i in range(plane.n)}
    for table in read_tables(path, content):
        if table.posid not in plane.names:
            known = nearest(table.posid, plane.names)
            raise TrajectoryError(f"{path}: {table.line}: {plane.name} has no positioner '{table.posid}'{known}")
        i, table = plane.names[table.posid], table._replace(linear=table.linear or table.posid in linear)
        moved[i] = True
        times, angles, error[i] = turned(table)
        knots[i] = times, rest[i] + angles
    offsets = np.cumsum([0, *(len(knots[i][0]) for i in range(plane.n))])
    all_times, angles = (np.concatenate([knots[i][k] for i in range(plane.n)]) for k in (0, 1))
    return Executed(
        Trajectory(offsets, all_times, np.radians(angles)),
        joint_error=np.radians(error),
        clock_error=0.0,
        assumptions=(*_FROM_REST, *_assumed(plane, state, moved)),
        online=moved & plane.online & state.online,
    )


def turned(table: Tables) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Moments (k,) [s], what both shafts have turned then (k, 2), and how far off they may be between (2,) [deg]."""
    axes = [_axis(table, k) for k in (0, 1)]
    times = _either(axes[0].times, axes[1].times)
    angles = np.stack([np.interp(times, axis.times, axis.angles) for axis in axes], axis=1)
    return times, angles, [axis.error for axis in axes]


def _assumed(plane: FocalPlane, state: State, moved: np.ndarray) -> Iterator[str]:
    for which, what in (
        (moved, "move from where they are taken to stand"),
        (~moved, "have no table: taken as resting"),
    ):
        who = [plane.ids[i] for i in np.flatnonzero(which & state.unknown)]
        if who:
            more = f" and {len(who) - _SHOWN} more" if len(who) > _SHOWN else ""
            yield f"{', '.join(who[:_SHOWN])}{more} {what}, folded"


def _either(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Moments of either axis; of two that differ by rounding alone, that of the first."""
    after = np.minimum(np.searchsorted(first, second), len(first) - 1)
    near = np.minimum(np.abs(first[after] - second), np.abs(first[np.maximum(after - 1, 0)] - second))
    return np.sort(np.concatenate([first, second[near > _SAME]]))


def _axis(table: Tables, axis: int) -> Turn:
    """All turns of one axis, one after the other [s, deg]."""
    begins = table.begins
    rows = [row for row in range(len(table.time)) if table.steps[row, axis]]
    turns = [
        axis_turn(int(table.steps[row, axis]), bool(table.cruise[row, axis]), bool(axis) and table.linear)
        for row in rows
    ]
    if not turns:
        return Turn(np.zeros(1), np.zeros(1), 0.0)
    before = np.concatenate([[0.0], np.cumsum([turn.angles[-1] for turn in turns])])
    times = np.concatenate([begins[row] + turn.times for row, turn in zip(rows, turns, strict=True)])
    angles = np.concatenate([at + turn.angles for at, turn in zip(before, turns, strict=False)])
    new = np.concatenate([[True], np.diff(times) > _SAME])
    return Turn(times[new], angles[new], max(turn.error for turn in turns))
