"""Tables in which nobody meets anybody: whoever would takes another way, sooner or later than planned.

Rows cannot follow a plan closely, so a few pairs that keep apart on paper would meet. One after the other, the pair
that has been in the way least: of all ways of either (`ways`), the first that meets nobody is taken; else a way of
each that meet neither each other nor anybody else; else the way that meets least, which passes the trouble on, and
each pair that still meets weighs more (the breakout of Morris 1993, The breakout method for escaping from local
minima, AAAI). Those that end late are offered other ways, too. What is left is for the proof to say.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.certificates.keeping import keeps
from fiberplan.certificates.path import as_motion
from fiberplan.focal_plane.drift import motion_bounds
from fiberplan.hardware.desi.decode import Tables, turned
from fiberplan.hardware.desi.encode import Row, Table, planned_moves, rows_of
from fiberplan.hardware.desi.turns import largest_errors
from fiberplan.hardware.desi.ways import Way, seconds, ways
from fiberplan.kernels.arms import ARM, Arms
from fiberplan.kernels.clearance import clearances
from fiberplan.motion import Trajectory
from fiberplan.plan import Plan
from fiberplan.tolerances import SLACK

SPARE = 0.25  #: tables may take so much longer than the plan and their tails before other ways are looked for [s]
TAIL = 2.25  #: what two creeping turns of 3 deg take [s]
_AT_ONCE = 6  # ways of one positioner that are judged at once
_JOINTLY, _MOST_JOINTLY = 200, 6_000  # ways of two that are tried with each other at once, and in all
_LATE = 0.3  # what a second late weighs beside a pair that meets
_MORE = 1.0  # what a pair that meets weighs more each time
_TRIES = 2  # times that one pair is parted
_MOST = 200  # changes in all


class _Path(NamedTuple):
    """What the motors of one positioner make of its rows."""

    times: np.ndarray  #: (k,) [s]
    angles: np.ndarray  #: (k, 2) [rad]


class _Taken(NamedTuple):
    """A way, its rows, and the path that they are."""

    way: Way
    rows: list[Row]
    path: _Path


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
        plane, self._margin = self._plane, margin + SLACK
        self._tables = {plane.names[table.posid]: table for table in made}
        self._start, self._end = (np.degrees(angles) for angles in (plan.trajectory.start, plan.trajectory.end))
        still = np.zeros(1)
        self._paths = [_Path(still, np.radians(self._start[i : i + 1])) for i in range(plane.n)]
        linear = np.zeros(plane.n, bool)
        for i, table in self._tables.items():
            self._paths[i], linear[i] = self._path(i, table.rows), table.linear
        assert plan.problem.position_error is not None  # set on construction
        error = plan.problem.position_error + motion_bounds(plane, largest_errors(linear))
        self._errors = np.concatenate([error, np.zeros(len(plane.obstacles))])
        self._pairs = self._that_can_part()
        self._beside: list[list[int]] = [[] for _ in range(plane.n)]
        for i, j in self._pairs.tolist():
            self._beside[i].append(j)
            if j < plane.n:
                self._beside[j].append(i)
        self._until = plan.makespan + SPARE + (TAIL if tail else 0.0)
        self._ways: dict[int, list[Way]] = {}
        self._weight: dict[tuple[int, int], float] = {}

    def _that_can_part(self) -> np.ndarray:
        """Pairs of which one turns and that keep the margin at the start; others only come apart, or never meet."""
        plane = self._plane
        pairs = plane.arm_pairs_within(self._margin + 2.0 * float(self._errors.max()))
        turns = np.zeros(len(self._errors), bool)
        turns[list(self._tables)] = True
        pairs = read_only(pairs[turns[pairs].any(axis=1)], np.int64)
        gaps = clearances(plane.arms, plane.with_obstacles(self._plan.trajectory.start), pairs)
        return read_only(pairs[gaps - self._errors[pairs].sum(axis=1) >= self._margin], np.int64)

    def settled(self) -> list[Table]:
        """The tables, after so many changes."""
        meeting, tries, changes = self._meeting(), dict[tuple[int, int], int](), 0
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
            meeting |= {pair for i in changed for pair in self._met_by(i)}
            for other in meeting:
                self._weight[other] = self._weight.get(other, 1.0) + _MORE
        return [self._tables[i] for i in self._tables]

    def _meeting(self) -> set[tuple[int, int]]:
        """All pairs that are not shown to keep the margin."""
        kept = self._kept(self._plane.arms, self._paths, self._pairs, self._errors)
        return {(i, j) for i, j in self._pairs[~kept].tolist()}

    def _met_by(self, i: int) -> set[tuple[int, int]]:
        """The pairs of one positioner that meet."""
        met = self._judged(i, [self._paths[i]])[0]
        return {(min(i, j), max(i, j)) for j, meets in zip(self._beside[i], met, strict=True) if meets}

    def _hurry(self, i: int) -> None:
        """Take a way that is in time and meets nobody, if there is one."""
        for way in self._offered(i):
            if way.late:
                return
            taken = self._taken(i, way)
            if not self._judged(i, [taken.path]).any():
                self._take(i, taken)
                return

    def _parted(self, pair: tuple[int, int]) -> set[int]:
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

    def _least(self, i: int, offered: list[Way], pair: tuple[int, int], free: list[_Taken]) -> tuple[float, _Taken]:
        """The way that costs least, and what; those that meet nobody but the pair are added to `free`."""
        beside = self._beside[i]
        weight = np.array([self._weight.get((min(i, j), max(i, j)), 1.0) for j in beside])
        others = np.array([j not in pair for j in beside], bool)
        some = [self._taken(i, way) for way in offered]
        met = self._judged(i, [each.path for each in some])
        free += [each for each, meets in zip(some, met, strict=True) if not meets[others].any()]
        cost = met @ weight + _LATE * np.array([way.late for way in offered])
        return float(cost.min()), some[int(np.argmin(cost))]

    def _jointly(self, i: int, j: int, first: list[_Taken], second: list[_Taken], in_time: bool) -> bool:
        """Take the soonest two ways, of those that meet nobody else, that do not meet each other; if there are such."""
        who, paths = [i] * len(first) + [j] * len(second), [each.path for each in (*first, *second)]
        both = [(max(a.way.late, b.way.late), k + m, k, m) for k, a in enumerate(first) for m, b in enumerate(second)]
        both = sorted(each for each in both if (each[0] == 0.0) == in_time)[:_MOST_JOINTLY]
        for k in range(0, len(both), _JOINTLY):
            some = np.array([(a, len(first) + b) for *_, a, b in both[k : k + _JOINTLY]])
            clear = self._kept(self._some(who), paths, some, self._errors[who])
            if clear.any():
                a, b = both[k + int(np.argmax(clear))][2:]
                self._take(i, first[a])
                self._take(j, second[b])
                return True
        return False

    def _take(self, i: int, taken: _Taken) -> None:
        self._tables[i], self._paths[i] = self._tables[i]._replace(rows=tuple(taken.rows)), taken.path

    def _taken(self, i: int, way: Way) -> _Taken:
        rows = rows_of(way.moves, self._tables[i].linear, self._tail, way.rest)
        return _Taken(way, rows, self._path(i, rows))

    def _offered(self, i: int) -> list[Way]:
        if i not in self._ways:
            linear = self._tables[i].linear
            planned = planned_moves(self._plan, i, linear)
            lower, upper = np.degrees(self._plane.lower[i]), np.degrees(self._plane.upper[i])
            self._ways[i] = ways(planned, self._start[i], self._end[i], lower, upper, linear, self._tail, self._until)
        return self._ways[i]

    def _path(self, i: int, rows: Sequence[Row]) -> _Path:
        """What the motors make of rows."""
        table = self._tables[i]
        cruise = np.array([[mode == "cruise" for mode in row.mode] for row in rows])
        steps, times = np.array([row.steps for row in rows]), np.array([row.time for row in rows])
        pauses = np.array([row.pause for row in rows]) / 1000
        moments, angles, _ = turned(Tables(table.posid, "", table.linear, steps, cruise, times, pauses))
        return _Path(moments, np.radians(self._start[i] + angles))

    def _judged(self, i: int, paths: list[_Path]) -> np.ndarray:
        """(paths, beside) whether each of some paths of a positioner meets each of those beside it."""
        n, beside = self._plane.n, self._beside[i]
        others, fixed = [j for j in beside if j < n], [j for j in beside if j >= n]
        who = [*others, *[i] * len(paths), *fixed]
        at = {j: k for k, j in enumerate(who) if j != i}
        pairs = [(len(others) + k, at[j]) for k in range(len(paths)) for j in beside]
        kept = self._kept(self._some(who), [*(self._paths[j] for j in others), *paths], pairs, self._errors[who])
        return ~kept.reshape(len(paths), len(beside))

    def _some(self, who: list[int]) -> Arms:
        """Arms as often as they are named."""
        arms = self._plane.arms
        return arms._replace(arm=read_only(arms.arm[who], ARM))

    def _kept(self, arms: Arms, paths: Sequence[_Path], pairs: object, errors: np.ndarray) -> np.ndarray:
        offsets = np.cumsum([0, *(len(path.times) for path in paths)])
        times, angles = (np.concatenate([path[k] for path in paths]) for k in (0, 1))
        motion = as_motion(arms, Trajectory(offsets, times, angles))
        return keeps(arms, motion, read_only(np.array(pairs), np.int64), read_only(errors), self._margin)
