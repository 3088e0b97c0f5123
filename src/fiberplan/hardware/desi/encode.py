"""From a plan to the rows of DESI's move tables: what each axis turns, row by row, in whole steps of its motor.

A row turns both axes from the same moment, each at the one speed that its motor has: cruise, or creep for turns of up
to `CREEPS`, which take 66 times as long. So a short turn waits until its axis has more to do, or for the tail. A piece
of the plan in which an axis is slower than cruise becomes several rows, as many as the time has room for.
"""

import csv
import io
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from fiberplan.errors import PlanError
from fiberplan.plan import Plan

GEAR = (46 / 14 + 1) ** 4  #: turns of the motor a turn of the shaft
TICK = 1 / 18000  #: [s]
CRUISE_STEP, CREEP_STEP = 3.3, 0.1  #: [deg of the motor]
RAMP_TURN = 673.2  #: that an axis turns while it comes to cruise, or to rest [deg of the motor]
CREEPS = 1526.4  #: turns up to this creep [deg of the motor]
LINEAR_STEP, LINEAR_RAMP_TURN, LINEAR_SPEED = (
    10.0,
    505.0,
    180_000.0,
)  #: of linear phi motors [deg of the motor, and a second]
JOG = 5.0  #: by which a linear phi motor goes too low, so that it ends upwards [deg]
BACKLASH = 3.0  #: by which the tail goes back, and forth in creep [deg]
FORTH = (-1.0, 1.0)  #: direction of the last turn of theta and phi
SLICE = 4.6  #: least turn of an axis in a row, so that it cruises [deg]
EDGE = 0.05  #: rows that turn within a plan keep this far from the ends of ranges, for they are whole steps [deg]
PIECE = 30.0  #: turn of a row that follows a path closely, about [deg]
MOST_SLICES = 4  #: rows that a piece of the plan becomes, at most
ROW = 2 * RAMP_TURN / (CRUISE_STEP / TICK)  #: what a row takes longer than its turn at cruise speed [s]

Pair = tuple[float, float]


class Move(NamedTuple):
    """What is wanted of one row."""

    turn: Pair  #: of theta and phi [deg]
    pause: int = 0  #: after it [ms]


class Row(NamedTuple):
    """A row of a move table."""

    steps: tuple[int, int]  #: of the motors of theta and phi; theirs turn the other way than the shafts
    mode: tuple[str, str]  #: "cruise" or "creep"
    time: float  #: of the longer axis [s]
    pause: int  #: after it [ms]


class Table(NamedTuple):
    """The move table of one positioner."""

    posid: str
    canid: int
    busid: str
    linear: bool  #: whether phi has a linear motor
    rows: tuple[Row, ...]


class _Turn(NamedTuple):
    """A turn of one axis in whole steps."""

    steps: int
    mode: str
    time: float  # [s]
    done: float  # what the shaft turns [deg]


def turned(degrees: float, creeping: bool | None = None) -> _Turn:
    """A turn of a rotary axis; by its size in creep or at cruise, unless it is said."""
    size, sign = abs(degrees) * GEAR, -1 if degrees > 0 else 1
    if size <= CREEPS if creeping is None else creeping:
        steps = round(size / CREEP_STEP)
        return _Turn(sign * steps, "creep", 2 * steps * TICK, -sign * steps * CREEP_STEP / GEAR)
    steps = round((size - 2 * RAMP_TURN) / CRUISE_STEP)
    time = (steps * CRUISE_STEP + 4 * RAMP_TURN) / (CRUISE_STEP / TICK)
    return _Turn(sign * steps, "cruise", time, -sign * (steps * CRUISE_STEP + 2 * RAMP_TURN) / GEAR)


def turned_linear(degrees: float) -> _Turn:
    """A turn of a linear phi motor, of 3 deg at least; it has no creep."""
    size, sign = abs(degrees) * GEAR, -1 if degrees > 0 else 1
    steps = max(0, round((size - 2 * LINEAR_RAMP_TURN) / LINEAR_STEP))
    time = (steps * LINEAR_STEP + 4 * LINEAR_RAMP_TURN) / LINEAR_SPEED
    return _Turn(sign * steps, "cruise", time, -sign * (steps * LINEAR_STEP + 2 * LINEAR_RAMP_TURN) / GEAR)


def rows_of(moves: Iterable[Move], linear: bool = False, tail: bool = True, rest: Pair = (0.0, 0.0)) -> list[Row]:
    """The rows of a table.

    Args:
        moves: in order.
        linear: whether phi has a linear motor: it jogs, and the table has no tail but what theta lacks.
        tail: back and forth in creep at the end, for each axis that turns.
        rest: what is left to the tail [deg].
    """
    rows: list[Row] = []
    lacks, used = [0.0, 0.0], [abs(turn) > 0 for turn in rest]

    def add(turns: Sequence[_Turn | None], pause: int) -> None:
        modes = tuple("creep" if turn is None else turn.mode for turn in turns)
        if linear and (turns[1] is not None or (turns[0] is not None and turns[0].mode == "cruise")):
            modes = modes[0], "cruise"
        steps = tuple(0 if turn is None else turn.steps for turn in turns)
        time = max(0.0 if turn is None else turn.time for turn in turns)
        rows.append(Row(steps, modes, time, pause))  # type: ignore[arg-type]

    for (theta, phi), pause in moves:
        first = turned(theta) if theta else None
        if first is not None:
            lacks[0] += theta - first.done
        if linear and phi:
            add([None, turned_linear(-JOG if phi > 0 else phi - JOG)], 0)
            second: _Turn | None = turned_linear(phi + JOG if phi > 0 else JOG)
        else:
            second = turned(phi) if phi else None
            lacks[1] += 0.0 if second is None else phi - second.done
        used = [used[0] or bool(theta), used[1] or bool(phi)]
        add([first, second], pause)
    if linear:
        left = turned(lacks[0] + rest[0], creeping=True)
        if left.steps:
            rows.append(Row((left.steps, 0), ("creep", "cruise"), left.time, 0))
    elif tail and any(used):
        back = [turned(rest[k] - FORTH[k] * BACKLASH) if used[k] else None for k in (0, 1)]
        lacks = [
            lacks[k] + rest[k] - FORTH[k] * BACKLASH - turn.done if (turn := back[k]) is not None else 0.0
            for k in (0, 1)
        ]
        add(back, 0)
        add([turned(FORTH[k] * BACKLASH + lacks[k], creeping=True) if used[k] else None for k in (0, 1)], 0)
    return rows


def moves_of(times: np.ndarray, angles: np.ndarray, linear: bool) -> tuple[list[Move], Pair]:
    """What a positioner is to do, row by row, and what is left to the tail [deg].

    Args:
        times: (k,) of its knots [s].
        angles: (k, 2) theta and phi [deg].
        linear: whether phi has a linear motor.
    """
    moves: list[Move] = []
    now, owed = 0.0, np.zeros(2)
    for k in range(len(times) - 1):
        turn = angles[k + 1] - angles[k]
        begin, end = float(times[k]), float(times[k + 1])
        owed = owed + turn
        going = np.where(np.abs(owed) >= SLICE, owed, 0.0)
        if not going.any() or not turn.any():
            continue
        moves, now = _waited(moves, now, begin)
        parts = [going] if linear else _slices(going, end - max(now, begin))
        for k, part in enumerate(parts):
            moves, now = _waited(moves, now, begin + (end - begin) * k / len(parts))
            moves.append(Move((float(part[0]), float(part[1]))))
            now += sum(row.time for row in rows_of(moves[-1:], linear, tail=False)[: 2 if linear and part[1] else 1])
        owed = owed - going
    if linear and owed[1]:
        moves.append(Move((0.0, float(owed[1]))))
        owed[1] = 0.0
    return moves, (float(owed[0]), float(owed[1]))


def _waited(moves: list[Move], now: float, until: float) -> tuple[list[Move], float]:
    """The same with a pause until a moment, and the moment reached; a table that begins with one has a row for it."""
    pause = round(1000 * (until - now))
    if pause <= 0:
        return moves, now
    before = moves or [Move((0.0, 0.0))]
    return [*before[:-1], before[-1]._replace(pause=before[-1].pause + pause)], now + pause / 1000


def _slices(going: np.ndarray, time: float) -> list[np.ndarray]:
    """Turns of both axes [deg] cut into rows for which there is time [s], so that each axis cruises where it turns.

    The axis that turns less turns in some of the rows only, spread evenly.
    """
    size = np.abs(going)
    long, short = (0, 1) if size[0] >= size[1] else (1, 0)
    few = int(size[short] / SLICE)
    least = size[short] / few if few else SLICE  # a row lasts as long as its longer turn
    room = (time - size[long] * GEAR * TICK / CRUISE_STEP) / ROW
    count = max(1, min(int(room), int(size[long] / least), MOST_SLICES))
    few = min(few, count)
    parts = np.zeros((count, 2))
    parts[:, long] = going[long] / count
    if few:
        parts[((np.arange(few) + 0.5) * count / few).astype(int), short] = going[short] / few
    return list(parts)


def tables(plan: Plan, linear: dict[str, bool], buses: dict[str, tuple[int, str]], tail: bool) -> list[Table]:
    """The move tables of all positioners that turn.

    Raises:
        PlanError: a positioner without a device id, or one that turns nearer to a hard stop than its range by the tail.
    """
    plane, made = plan.problem.plane, []
    for i in np.flatnonzero(plane.online).tolist():
        if not np.ptp(plan.trajectory.knots(i)[1], axis=0).any():
            continue
        posid = plane.aliases[i] if plane.aliases else ""
        if not posid:
            raise PlanError(f"positioner '{plane.ids[i]}' has no device id (M01234), by which controllers know it")
        is_linear = linear.get(posid, False)
        moves, rest = planned_moves(plan, i, is_linear)
        digits = "".join(letter for letter in posid if letter.isdigit())
        canid, busid = buses.get(posid, (int(digits or 0), ""))
        made.append(Table(posid, canid, busid, is_linear, tuple(rows_of(moves, is_linear, tail, rest))))
    return made


def planned_moves(plan: Plan, i: int, linear: bool) -> tuple[list[Move], Pair]:
    """`moves_of` a positioner of a plan, of which whole steps lead no farther than its ranges."""
    return moves_of(plan.trajectory.knots(i)[0], _within_ranges(plan, i), linear)


def creeping_moves(plan: Plan, i: int) -> list[Move]:
    """A positioner's path piece by piece at once, in creep where an axis turns little: near it, and slow."""
    moves = []
    for turn in np.diff(_within_ranges(plan, i), axis=0):
        parts = max(1, int(np.abs(turn).max() / PIECE))
        moves += [Move((float(turn[0] / parts), float(turn[1] / parts)))] * (parts if turn.any() else 0)
    return moves


def _within_ranges(plan: Plan, i: int) -> np.ndarray:
    """(k, 2) knots of a positioner's path [deg], between the first and the last a little away from its ranges' ends."""
    angles = np.degrees(plan.trajectory.knots(i)[1])
    lower, upper = (np.degrees(edge[i]) for edge in (plan.problem.plane.lower, plan.problem.plane.upper))
    angles[1:-1] = np.clip(angles[1:-1], lower + EDGE, np.maximum(upper - EDGE, lower + EDGE))
    return angles


def as_csv(made: list[Table]) -> bytes:
    """The tables as the instrument's archive keeps them: a line a positioner, a list in each cell of its rows."""
    text = io.StringIO()
    zeno = any(table.linear for table in made)
    names = ["busid", "canid", "motor_steps_P", "motor_steps_T", "move_time", "nrows", "posid", "postpause", "required"]
    names += ["speed_mode_P", "speed_mode_T", "total_time", "failed_to_send", *(["zeno"] if zeno else [])]
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(names)
    for table in made:
        rows = table.rows
        times, pauses = [row.time for row in rows], [row.pause for row in rows]
        total = sum(times) + sum(pauses) / 1000
        steps, modes = ([[getattr(row, name)[axis] for row in rows] for axis in (1, 0)] for name in ("steps", "mode"))
        cells = [table.busid, table.canid, *steps, times, len(rows), table.posid, pauses, True, *modes, total, False]
        lines.writerow([*cells, *(["P" if table.linear else ""] if zeno else [])])
    return text.getvalue().encode()
