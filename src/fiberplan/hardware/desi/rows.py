"""Rows of DESI's move tables: what each axis turns, in whole steps of its motor, and how long that takes.

A row turns both axes from the same moment, each at the one speed that its motor has: cruise, or creep for turns of up
to `CREEPS`, which take 66 times as long.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

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
