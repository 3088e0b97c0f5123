"""Ways of one positioner to its goal, in rows: along its plan, at once, one axis after the other, folded in between.

The last is along its plan piece by piece, in creep where pieces are short. Each may begin later, or wait before its
last turn. Which of them is taken is for `scheduling` to say.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from fiberplan.hardware.desi.moves import EDGE, SLICE
from fiberplan.hardware.desi.rows import Move, Pair, Row, rows_of

_WAITS = (0.0, 0.5, 1.0)  # of the time that a way leaves until all should be done
_LATER = (1.5, 3.0)  # [s] beyond that
_FOLDED = ((1.0, 0.0), (0.5, 0.0), (0.0, 0.5))
"""How far phi folds on the way: so much of the range above both ends, less so much of what lies between them."""
_ASIDE = (-15.0, 15.0, -45.0, 45.0)  # [deg] that theta turns first, to make room, or too far, to come from there


class Way(NamedTuple):
    """What is wanted of the rows of a table."""

    moves: list[Move]
    rest: Pair  #: left to the tail [deg]
    late: float  #: [s] after all should be done


def ways(
    planned: tuple[list[Move], Pair],
    creeping: list[Move],
    ends: tuple[np.ndarray, np.ndarray],
    ranges: tuple[np.ndarray, np.ndarray],
    linear: bool,
    tail: bool,
    until: float,
) -> list[Way]:
    """Ways from start to goal, those that are in time first, the simplest first among these.

    Args:
        planned: what the plan has it do, and leaves to the tail.
        creeping: the same piece by piece; none where phi has no creep.
        ends: start (2,) and goal (2,), theta and phi [deg].
        ranges: lower (2,) and upper (2,) ends [deg]; the upper of phi is where the arm is folded.
        linear: as of `rows_of`.
        tail: as of `rows_of`.
        until: when all should be done [s].
    """
    found: list[Way] = []
    others = [*map(_moves, _turns(*ends, ranges[0], ranges[1] - EDGE)), (creeping, (0.0, 0.0))]
    for moves, rest in _each_once([planned, *others]):
        if not moves and not any(rest):
            continue
        now = seconds(rows_of(moves, linear, tail, rest))
        spare = max(0.0, until - now)
        for wait in sorted({*(spare * part for part in _WAITS), *(spare + more for more in _LATER)}):
            late, pause = max(0.0, now + wait - until), round(1000 * wait)
            found.append(Way([Move((0.0, 0.0), pause), *moves] if pause else moves, rest, late))
            if pause and len(moves) > 1:
                before = moves[-2]._replace(pause=moves[-2].pause + pause)
                found.append(Way([*moves[:-2], before, moves[-1]], rest, late))
    return sorted(found, key=lambda way: way.late)


def seconds(rows: Iterable[Row]) -> float:
    """How long rows take."""
    return sum(row.time + row.pause / 1000 for row in rows)


def _turns(start: np.ndarray, goal: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Iterator[list[Pair]]:
    """What theta and phi turn, one after the other."""
    theta, phi = (goal - start).tolist()
    yield [(theta, phi)]
    yield [(0.0, phi), (theta, 0.0)]
    yield [(theta, 0.0), (0.0, phi)]
    high, low = max(start[1], goal[1]), min(start[1], goal[1])
    for up, down in _FOLDED:
        at = high + up * max(0.0, upper[1] - high) - down * (high - low)
        fold, unfold = float(at - start[1]), float(goal[1] - at)
        yield [(0.0, fold), (theta, 0.0), (0.0, unfold)]
        first, last = (np.sign(theta) * min(abs(theta) / 2, abs(turn)) for turn in (fold, unfold))
        yield [(first, fold), (theta - first - last, 0.0), (last, unfold)]
        yield [(first, fold), (theta - first, unfold)]
        yield [(theta - last, fold), (last, unfold)]
    fold, unfold = float(upper[1] - start[1]), float(goal[1] - upper[1])
    for turn in _ASIDE:
        if lower[0] < start[0] + turn < upper[0]:
            yield [(turn, 0.0), (theta - turn, phi)]
            yield [(turn, 0.0), (0.0, fold), (theta - turn, 0.0), (0.0, unfold)]
        if lower[0] < goal[0] + turn < upper[0]:
            yield [(theta + turn, phi), (-turn, 0.0)]
            yield [(0.0, fold), (theta + turn, 0.0), (0.0, unfold), (-turn, 0.0)]


def _moves(turns: list[Pair]) -> tuple[list[Move], Pair]:
    """The turns as moves, and what is left to the tail: an axis that would creep turns with its next turn."""
    moves, owed = [], np.zeros(2)
    for turn in turns:
        owed += turn
        going = np.where(np.abs(owed) >= SLICE, owed, 0.0)
        if going.any():
            moves.append(Move((float(going[0]), float(going[1]))))
            owed -= going
    return moves, (float(owed[0]), float(owed[1]))


def _each_once(found: list[tuple[list[Move], Pair]]) -> list[tuple[list[Move], Pair]]:
    return list({(tuple(moves), rest): (moves, rest) for moves, rest in found}.values())
