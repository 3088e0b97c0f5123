"""From a plan's path to what is wanted of rows, one after the other.

A short turn would creep, so it waits until its axis has more to do, or for the tail. A piece of the plan in which an
axis is slower than cruise becomes several rows, as many as the time has room for.
"""

import numpy as np

from fiberplan.hardware.desi.rows import CRUISE_STEP, GEAR, RAMP_TURN, TICK, Move, Pair, rows_of
from fiberplan.plan import Plan

SLICE = 4.6  #: least turn of an axis in a row, so that it cruises [deg]
EDGE = 0.05  #: rows that turn within a plan keep this far from the ends of ranges, for they are whole steps [deg]
PIECE = 30.0  #: turn of a row that follows a path closely, about [deg]
MOST_SLICES = 4  #: rows that a piece of the plan becomes, at most
ROW = 2 * RAMP_TURN / (CRUISE_STEP / TICK)  #: what a row takes longer than its turn at cruise speed [s]


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
