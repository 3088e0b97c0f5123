"""Tables in which nobody meets anybody: whoever would takes another way, sooner or later than planned.

Rows cannot follow a plan closely, so a few pairs that keep apart on paper would meet. One after the other, the pair
that has been in the way least: of all ways of either (`ways`), the first that meets nobody is taken; else a way of
each that meet neither each other nor anybody else; else the way that meets least, which passes the trouble on, and
each pair that still meets weighs more (the breakout of Morris 1993, The breakout method for escaping from local
minima, AAAI). Those that end late are offered other ways, too. What is left is for the proof to say.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.hardware.desi.encode import Table
from fiberplan.hardware.desi.meetings import SHIFTS, Meetings, Pair, Path
from fiberplan.hardware.desi.moves import creeping_moves, planned_moves
from fiberplan.hardware.desi.rows import Row, rows_of
from fiberplan.hardware.desi.ways import Way, seconds, ways
from fiberplan.plan import Plan

SPARE = 0.25  #: tables may take so much longer than the plan and their tails before other ways are looked for [s]
TAIL = 2.25  #: what two creeping turns of 3 deg take [s]
_AT_ONCE = 6  # ways of one positioner that are judged at once
_JOINTLY, _MOST_JOINTLY = 200, 6_000  # ways of two that are tried with each other at once, and in all
_LATE = 0.3  # what a second late weighs beside a pair that meets
_MORE = 1.0  # what a pair that meets weighs more each time
_TRIES = 2  # times that one pair is parted
_MOST = 200  # changes in all
_HALVINGS = 6  # of a wait of somebody late, to find how long it has to be


class _Taken(NamedTuple):
    """A way, its rows, and the path that they are."""

    way: Way
    rows: list[Row]
    path: Path


def scheduled(plan: Plan, made: list[Table], tail: bool, margin: float) -> list[Table]:
    """The tables with other rows for those that would meet.

    Args:
        plan: that they were made of.
        made: the tables.
        tail: as of `rows_of`.
        margin: clearance to keep [mm].
    """
    return _Schedule(plan, made, tail, margin).settled()


class _Schedule:
    def __init__(self, plan: Plan, made: list[Table], tail: bool, margin: float):
        self._plan, self._plane, self._tail = plan, plan.problem.plane, tail
        self._tables = {self._plane.names[table.posid]: table for table in made}
        self._meetings = Meetings(plan, self._tables, tail, margin)
        self._start, self._end = (np.degrees(angles) for angles in (plan.trajectory.start, plan.trajectory.end))
        self._until = plan.makespan + SPARE + (TAIL if tail else 0.0)
        self._ways: dict[int, list[Way]] = {}
        self._weight: dict[Pair, float] = {}

    def settled(self) -> list[Table]:
        """The tables, after so many changes."""
        meeting, tries, changes = self._meetings.all(), dict[Pair, int](), 0
        for i, table in self._tables.items():
            if seconds(table.rows) > self._until and not any(i in pair for pair in meeting):
                self._hurry(i)
        while changes < _MOST:
            able = [pair for pair in meeting if tries.get(pair, 0) < _TRIES]
            if not able:
                break
            pair = min(able, key=lambda pair: (self._weight.get(pair, 1.0), pair))
            tries[pair], changes = tries.get(pair, 0) + 1, changes + 1
            changed = self._parted(pair)
            meeting = {other for other in meeting if not set(other) & changed}
            meeting |= {pair for i in changed for pair in self._meetings.of(i)}
            for other in meeting:
                self._weight[other] = self._weight.get(other, 1.0) + _MORE
        for i in sorted(self._tables, key=lambda i: -seconds(self._tables[i].rows)):
            self._wait_no_longer(i)
        return [self._tables[i] for i in self._tables]

    def _hurry(self, i: int) -> None:
        """Take a way that is in time and meets nobody, if there is one."""
        for way in self._offered(i):
            if way.late:
                return
            taken = self._taken(i, way)
            if not self._meetings.judged(i, [taken.path]).any():
                self._take(i, taken)
                return

    def _wait_no_longer(self, i: int) -> None:
        """Cut the longest wait of somebody late as short as nobody is met."""
        rows = self._tables[i].rows
        late = round(1000 * (seconds(rows) - self._until))
        if late <= 0:
            return
        k = max(range(len(rows)), key=lambda k: rows[k].pause)
        low, high = max(0, rows[k].pause - late), rows[k].pause
        if low == high or self._meetings.of(i):
            return
        for _ in range(_HALVINGS):
            pause = (low + high) // 2
            shorter = (*rows[:k], rows[k]._replace(pause=pause), *rows[k + 1 :])
            path = self._meetings.path(i, shorter)
            if self._meetings.judged(i, [path]).any():
                low = pause
            else:
                high = pause
                self._tables[i] = self._tables[i]._replace(rows=shorter)
                self._meetings.take(i, path)

    def _parted(self, pair: Pair) -> set[int]:
        """Other ways for one of a pair, or both; who has one."""
        able = [i for i in pair if i in self._tables]
        free: dict[int, list[_Taken]] = {i: [] for i in able}
        best: tuple[float, int, _Taken] | None = None
        for in_time in (True, False):
            offered = {i: [way for way in self._offered(i) if (way.late == 0.0) == in_time] for i in able}
            for k in range(0, max(map(len, offered.values()), default=0), _AT_ONCE):
                for i in able:
                    if k < len(offered[i]):
                        cost, taken = self._least(i, offered[i][k : k + _AT_ONCE], pair, free[i])
                        if best is None or cost < best[0]:
                            best = cost, i, taken
                if best is not None and best[0] < 1.0:
                    self._take(*best[1:])
                    return {best[1]}
            if len(able) == 2 and self._jointly(able[0], able[1], free[able[0]], free[able[1]], in_time):
                return set(able)
        if best is None:
            return set()
        self._take(*best[1:])
        return {best[1]}

    def _least(self, i: int, offered: list[Way], pair: Pair, free: list[_Taken]) -> tuple[float, _Taken]:
        """The way that costs least, and what; those that meet nobody but the pair are added to `free`."""
        beside = self._meetings.beside[i]
        weight = np.array([self._weight.get((min(i, j), max(i, j)), 1.0) for j in beside])
        others = np.array([j not in pair for j in beside], bool)
        some = [self._taken(i, way) for way in offered]
        met = self._meetings.judged(i, [each.path for each in some])
        free += [each for each, meets in zip(some, met, strict=True) if not meets[others].any()]
        cost = met @ weight + _LATE * np.array([way.late for way in offered])
        return float(cost.min()), some[int(np.argmin(cost))]

    def _jointly(self, i: int, j: int, first: list[_Taken], second: list[_Taken], in_time: bool) -> bool:
        """Take the soonest two ways, of those that meet nobody else, that do not meet each other; if there are such."""
        ends = [np.array([seconds(each.rows) for each in some]) for some in (first, second)]
        shifts = np.clip((ends[1] - ends[0][:, None]) / TAIL, -1.0, 1.0)
        able = self._meetings.tails_clear(i, j)[np.rint((shifts + 1.0) * SHIFTS).astype(int)]
        both = [
            (max(a.way.late, b.way.late), k + m, k, m)
            for k, a in enumerate(first)
            for m, b in enumerate(second)
            if able[k, m] and (max(a.way.late, b.way.late) == 0.0) == in_time
        ]
        both = sorted(both)[:_MOST_JOINTLY]
        paths = [each.path for each in first], [each.path for each in second]
        for k in range(0, len(both), _JOINTLY):
            some = [(a, b) for *_, a, b in both[k : k + _JOINTLY]]
            clear = self._meetings.apart(i, paths[0], j, paths[1], some)
            if clear.any():
                a, b = some[int(np.argmax(clear))]
                self._take(i, first[a])
                self._take(j, second[b])
                return True
        return False

    def _take(self, i: int, taken: _Taken) -> None:
        self._tables[i] = self._tables[i]._replace(rows=tuple(taken.rows))
        self._meetings.take(i, taken.path)

    def _taken(self, i: int, way: Way) -> _Taken:
        rows = rows_of(way.moves, self._tables[i].linear, self._tail, way.rest)
        return _Taken(way, rows, self._meetings.path(i, rows))

    def _offered(self, i: int) -> list[Way]:
        if i not in self._ways:
            linear = self._tables[i].linear
            planned = planned_moves(self._plan, i, linear)
            creeping = [] if linear else creeping_moves(self._plan, i)
            ends = self._start[i], self._end[i]
            ranges = np.degrees(self._plane.lower[i]), np.degrees(self._plane.upper[i])
            self._ways[i] = ways(planned, creeping, ends, ranges, linear, self._tail, self._until)
        return self._ways[i]
