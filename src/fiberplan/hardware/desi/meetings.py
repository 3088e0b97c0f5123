"""Who meets whom, of the paths that motors make of rows: yes or no, for `scheduling`, which asks it of many ways."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.certificates.keeping import keeps
from fiberplan.certificates.path import as_motion
from fiberplan.focal_plane.drift import motion_bounds
from fiberplan.hardware.desi.decode import Tables, turned
from fiberplan.hardware.desi.encode import Table
from fiberplan.hardware.desi.endings import tails_clear
from fiberplan.hardware.desi.rows import Row
from fiberplan.hardware.desi.turns import largest_errors
from fiberplan.kernels.arms import ARM, Arms
from fiberplan.kernels.clearance import clearances
from fiberplan.motion import Trajectory
from fiberplan.plan import Plan
from fiberplan.tolerances import SLACK

SHIFTS = 20  #: of a tail, by which two may end one after the other, that are looked at

Pair = tuple[int, int]


class Path(NamedTuple):
    """What the motors of one positioner make of its rows."""

    times: np.ndarray  #: (k,) [s]
    angles: np.ndarray  #: (k, 2) [rad]


class Meetings:
    """The paths of everybody, and who meets whom on them."""

    beside: list[list[int]]  #: of each positioner, the arms that it could meet

    def __init__(self, plan: Plan, tables: dict[int, Table], tail: bool, margin: float):
        """Of tables of a plan, with tails or without, at a margin [mm]."""
        self._plane, self._tables, self._margin = plan.problem.plane, dict(tables), margin + SLACK
        plane = self._plane
        self._start, self._end = plan.trajectory.start, plan.trajectory.end
        linear, self._tailed = np.zeros(plane.n, bool), np.zeros(plane.n + len(plane.obstacles), bool)
        for i, table in tables.items():
            linear[i], self._tailed[i] = table.linear, tail and not table.linear
        assert plan.problem.position_error is not None  # set on construction
        error = plan.problem.position_error + motion_bounds(plane, largest_errors(linear))
        self._errors = np.concatenate([error, np.zeros(len(plane.obstacles))])
        still = np.zeros(1)
        self._paths = [Path(still, self._start[i : i + 1]) for i in range(plane.n)]
        for i, table in tables.items():
            self._paths[i] = self.path(i, table.rows)
        self._pairs = self._that_can_part()
        self.beside = [[] for _ in range(plane.n)]
        for i, j in self._pairs.tolist():
            self.beside[i].append(j)
            if j < plane.n:
                self.beside[j].append(i)

    def _that_can_part(self) -> np.ndarray:
        """Pairs of which one turns and that keep the margin at the start; others only come apart, or never meet."""
        plane = self._plane
        pairs = plane.arm_pairs_within(self._margin + 2.0 * float(self._errors.max()))
        turns = np.zeros(len(self._errors), bool)
        turns[list(self._tables)] = True
        pairs = read_only(pairs[turns[pairs].any(axis=1)], np.int64)
        gaps = clearances(plane.arms, plane.with_obstacles(self._start), pairs)
        return read_only(pairs[gaps - self._errors[pairs].sum(axis=1) >= self._margin], np.int64)

    def path(self, i: int, rows: Sequence[Row]) -> Path:
        """What the motors of a positioner make of rows."""
        table = self._tables[i]
        cruise = np.array([[mode == "cruise" for mode in row.mode] for row in rows])
        steps, times = np.array([row.steps for row in rows]), np.array([row.time for row in rows])
        pauses = np.array([row.pause for row in rows]) / 1000
        moments, angles, _ = turned(Tables(table.posid, "", table.linear, steps, cruise, times, pauses))
        return Path(moments, self._start[i] + np.radians(angles))

    def take(self, i: int, path: Path) -> None:
        """From now on a positioner has this path."""
        self._paths[i] = path

    def all(self) -> set[Pair]:
        """All pairs that are not shown to keep the margin."""
        kept = self._kept(self._plane.arms, self._paths, self._pairs, self._errors)
        return {(i, j) for i, j in self._pairs[~kept].tolist()}

    def of(self, i: int) -> set[Pair]:
        """The pairs of one positioner that meet."""
        met = self.judged(i, [self._paths[i]])[0]
        return {(min(i, j), max(i, j)) for j, meets in zip(self.beside[i], met, strict=True) if meets}

    def judged(self, i: int, paths: list[Path]) -> np.ndarray:
        """(paths, beside) whether each of some paths of a positioner meets each of those beside it."""
        n, beside = self._plane.n, self.beside[i]
        others, fixed = [j for j in beside if j < n], [j for j in beside if j >= n]
        who = [*others, *[i] * len(paths), *fixed]
        at = {j: k for k, j in enumerate(who) if j != i}
        pairs = [(len(others) + k, at[j]) for k in range(len(paths)) for j in beside]
        kept = self._kept(self._some(who), [*(self._paths[j] for j in others), *paths], pairs, self._errors[who])
        return ~kept.reshape(len(paths), len(beside))

    def apart(self, i: int, first: list[Path], j: int, second: list[Path], pairs: list[Pair]) -> np.ndarray:
        """(pairs,) whether a path of one positioner and one of another, by their numbers, do not meet."""
        who = [i] * len(first) + [j] * len(second)
        each = [(k, len(first) + m) for k, m in pairs]
        return self._kept(self._some(who), [*first, *second], each, self._errors[who])

    def tails_clear(self, i: int, j: int) -> np.ndarray:
        """(2 `SHIFTS` + 1,) whether two can end so far one after the other, from j a tail sooner to i a tail sooner."""
        shifts = np.linspace(-1.0, 1.0, 2 * SHIFTS + 1)
        pairs = np.tile([i, j], (len(shifts), 1))
        needed, ends = self._margin + self._errors[pairs].sum(axis=1), self._plane.with_obstacles(self._end)
        return tails_clear(self._plane.arms, ends, self._tailed, pairs, shifts, needed)

    def _some(self, who: list[int]) -> Arms:
        """Arms as often as they are named."""
        arms = self._plane.arms
        return arms._replace(arm=read_only(arms.arm[who], ARM))

    def _kept(self, arms: Arms, paths: Sequence[Path], pairs: object, errors: np.ndarray) -> np.ndarray:
        offsets = np.cumsum([0, *(len(path.times) for path in paths)])
        times, angles = (np.concatenate([path[k] for path in paths]) for k in (0, 1))
        motion = as_motion(arms, Trajectory(offsets, times, angles))
        each = read_only(np.array(pairs, np.int64).reshape(-1, 2), np.int64)  # of none, too
        return keeps(arms, motion, each, read_only(errors), self._margin)
