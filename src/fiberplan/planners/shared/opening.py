"""Motion from a start that is nearer than the margin, or a little out of range, to one that any planner can begin with.

Robots that are too near one another move apart in small joint steps, each the answer of a linear program: as much
clearance as possible for the pairs that have too little, none of the margin taken from any other pair, joints turning
back into their ranges. A group that gets stuck takes its neighbours in, who may make room. What gets stuck all the same
is wedged: it stays where it is.

A pair only has to keep the clearance that it began with until it has the margin, which then holds. Within a step, of
which the ends and the middle are looked at, it may do otherwise; so each group's motion is judged as the proof will
(`fiberplan.certificates.opening`), and sought again in finer steps where that does not hold.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fiberplan.arrays import read_only
from fiberplan.certificates.opening import judge_opening
from fiberplan.certificates.path import as_motion
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.kernels.slopes import clearance_slopes
from fiberplan.kernels.sweep import swept_clear
from fiberplan.motion import Trajectory
from fiberplan.tolerances import EQUALITY, RANGE, SLACK, UNDER_LIMIT

_TURN = 0.02  # [rad] of a joint in one step, at most
_GAIN = 0.2  # [mm] that a pair comes apart in one step, at most
_ENOUGH = 2e-3  # [mm] more than a planner can begin with: so far apart a pair is open
_STEPS = 600  # of one group
_HALVINGS = 8  # of a step that is refused
_FINER = (1.0, 4.0, 16.0)  # steps as above, and divided by so much
_KINKS = 6  # of the near pairs' clearance around one place
_WORTH = 1e-7  # [mm] a step that opens by less is none


@dataclass(frozen=True, eq=False)
class Opened:
    """Where everyone is once the near have come apart, and how they got there."""

    motion: Trajectory
    wedged: dict[int, tuple[int, ...]] = field(default_factory=dict)
    """Positioner that could not be brought to the margin or into its range -> arms in its way, as the kernels count."""


class _Group:
    """A few positioners that come apart together, all others standing."""

    def __init__(
        self,
        plane: FocalPlane,
        near: Neighbourhood,
        margin: float,
        angles: np.ndarray,
        members: list[int],
        finer: float = 1.0,
    ):
        self._plane, self._near, self._margin, self._finer = plane, near, margin, finer
        self._start = np.array(angles)
        self._angles = plane.with_obstacles(angles).copy()
        self.members = members
        self._place = {i: k for k, i in enumerate(members)}
        inside = np.zeros(len(plane.arms.arm), bool)
        inside[members] = True
        touched = inside[near.pairs].any(axis=1)
        self._pairs = read_only(near.pairs[touched], np.int64)
        self.times, self.path = [0.0], [self._angles[members].copy()]

    def run(self) -> bool:
        """Come apart; False if stuck before everyone has the margin and is in range."""
        for _ in range(int(_STEPS * self._finer)):
            slopes = clearance_slopes(self._plane.arms, read_only(self._angles), self._pairs)
            open_ = slopes[:, 0] < self._margin + EQUALITY + _ENOUGH
            if not open_.any() and not self._outside().any():
                return True
            if not self._come_apart(slopes, open_):
                return False
        return False

    def _come_apart(self, slopes: np.ndarray, open_: np.ndarray) -> bool:
        """Take a step that opens all near pairs; False if none is found.

        At a kink the slopes are those of one side; where a step is refused for that, those just beyond count, too.
        """
        beyond: list[tuple[np.ndarray, np.ndarray]] = []
        for _ in range(_KINKS):
            step = self._best_step(slopes, open_, beyond)
            if step is None:
                return False
            if self._take(step, slopes[:, 0], open_):
                return True
            step = step * 0.5 ** (_HALVINGS - 1)
            at = self._angles.copy()
            at[self.members] += step
            beyond.append((step, clearance_slopes(self._plane.arms, read_only(at), self._pairs)))
        return False

    def _outside(self) -> np.ndarray:
        """(k, 2) how far each joint is out of its range, towards it [rad]; 0 within."""
        now, low, high = self._angles[self.members], self._plane.lower[self.members], self._plane.upper[self.members]
        return np.where(now < low - RANGE, low - now, np.where(now > high + RANGE, high - now, 0.0))

    def _row(self, pair: tuple[int, int], values: np.ndarray, opens: bool) -> np.ndarray:
        """(2 k + 1,) of a linear program: what a pair loses by turns of each member, and what it gains if it opens."""
        row = np.zeros(2 * len(self.members) + 1)
        for side, arm in enumerate(pair):
            if arm in self._place:
                k = 2 * self._place[arm]
                row[k : k + 2] = -values[1 + 2 * side : 3 + 2 * side]
        row[-1] = opens  # the least that any near pair gains
        return row

    def _best_step(
        self, slopes: np.ndarray, open_: np.ndarray, beyond: list[tuple[np.ndarray, np.ndarray]]
    ) -> np.ndarray | None:
        """(k, 2) turns [rad] that open all near pairs as much as a linear program can; None if nothing helps.

        `beyond` are small turns (k, 2) and the slopes there, which the near pairs' clearance follows, too.
        """
        count = 2 * len(self.members)
        rows, room = [], []
        for pair, values, opens in zip(self._pairs.tolist(), slopes, open_, strict=True):
            rows.append(self._row(pair, values, opens))
            room.append(0.0 if opens else max(0.0, 0.5 * (values[0] - self._margin - EQUALITY)))
        for turns, there in beyond:
            for k in np.flatnonzero(open_):
                row = self._row(self._pairs[k].tolist(), there[k], True)
                rows.append(row)
                room.append(there[k, 0] - slopes[k, 0] + float(row[:-1] @ turns.ravel()))
        speed = self._plane.max_speed[self.members]
        most = (_TURN / self._finer * speed / speed.max()).ravel()
        now = self._angles[self.members]
        low = np.minimum(self._plane.lower[self.members] - now, 0.0).ravel()
        high = np.maximum(self._plane.upper[self.members] - now, 0.0).ravel()
        back = self._outside().ravel()
        low, high = np.where(back > 0, np.minimum(back, most), low), np.where(back < 0, np.maximum(back, -most), high)
        bounds = [(max(a, -m), min(b, m)) for a, b, m in zip(low, high, most, strict=True)]
        gain = np.zeros(count + 1)
        gain[-1] = -1.0
        bounds.append((0.0, _GAIN / self._finer))
        least = np.array(rows).reshape(-1, count + 1)  # of nobody near, too
        solved = linprog(gain, least, np.array(room), bounds=bounds, method="highs")
        if not solved.success or (open_.any() and -solved.fun < _WORTH):
            return None
        return np.asarray(solved.x[:-1].reshape(-1, 2))

    def _take(self, step: np.ndarray, before: np.ndarray, open_: np.ndarray) -> bool:
        """Take as much of a step as is good; False if nothing is."""
        arms = self._plane.arms
        for _ in range(_HALVINGS):
            after = self._angles.copy()
            after[self.members] += step
            turns = after - self._angles
            good = True
            for k, (i, j) in enumerate(self._pairs.tolist()):
                if not open_[k]:
                    good = good and bool(
                        swept_clear(
                            arms, i, *self._angles[i], *turns[i], j, *self._angles[j], *turns[j],
                            self._margin + SLACK, 0.0, 0.0,
                        )
                    )  # fmt: skip
            for part in (0.5, 1.0):
                at = read_only(self._angles + part * turns)
                good = good and bool(np.all(clearance_slopes(arms, at, self._pairs)[open_, 0] >= before[open_]))
            if good:
                seconds = float((np.abs(step) / self._plane.max_speed[self.members]).max()) / UNDER_LIMIT
                self._angles = after
                self.times.append(self.times[-1] + max(seconds, 1e-6))
                self.path.append(after[self.members].copy())
                return True
            step = 0.5 * step
        return False

    def keeps_the_rule(self) -> bool:
        """Whether every pair that began nearer than the margin is shown to keep what it had, and then the margin."""
        arms, first = self._plane.arms, self._plane.with_obstacles(self._start)
        near = clearance_slopes(arms, first, self._pairs)[:, 0] < self._margin
        motion = as_motion(arms, self.motion())
        pairs, exact = read_only(self._pairs[near], np.int64), np.zeros(len(arms.arm))
        return bool(np.isnan(judge_opening(arms, motion, pairs, exact, self._margin, 0.0)[:, 2]).all())

    def motion(self) -> Trajectory:
        """Of all positioners, the others standing."""
        n = self._plane.n
        owner, times = np.tile(self.members, len(self.times)), np.repeat(self.times, len(self.members))
        poses = np.concatenate([self._start, *self.path])
        return Trajectory.from_knots(
            np.concatenate([np.arange(n), owner]), np.concatenate([np.zeros(n), times]), poses, n
        )

    def in_the_way(self) -> dict[int, tuple[int, ...]]:
        """Members that are still too near to someone, or out of range, and to whom."""
        slopes = clearance_slopes(self._plane.arms, read_only(self._angles), self._pairs)
        found: dict[int, set[int]] = {
            i: set() for i, out in zip(self.members, self._outside(), strict=True) if out.any()
        }
        for (i, j), values in zip(self._pairs.tolist(), slopes, strict=True):
            if values[0] < self._margin + EQUALITY + _ENOUGH:
                for a, b in ((i, j), (j, i)):
                    if a in self._place:
                        found.setdefault(a, set()).add(b)
        return {i: tuple(sorted(others)) for i, others in found.items()}


def opened(plane: FocalPlane, start: np.ndarray, margin: float, report: Callable[[str], None] | None = None) -> Opened:
    """Bring everyone from `start` (n, 2) [rad] to the margin [mm] and into range, where that can be.

    Groups of those who are too near each other move at the same time, unless arms of two may meet: then one after the
    other, each from where the ones before it ended.

    Args:
        plane: the array, bodies as thick as position errors ask.
        start: where everyone stands.
        margin: clearance to reach.
        report: told about progress, in words.
    """
    near = Neighbourhood.of(plane, margin + EQUALITY + _ENOUGH)
    everyone = plane.with_obstacles(start)
    gaps = clearance_slopes(plane.arms, everyone, near.pairs)[:, 0]
    moves = np.concatenate([plane.online, np.zeros(len(plane.obstacles), bool)])
    outside = ((start < plane.lower - RANGE) | (start > plane.upper + RANGE)).any(axis=1)
    groups = _groups(near.pairs[gaps < margin + EQUALITY], np.flatnonzero(outside), moves)
    angles, owner, times, poses = np.array(start), [np.arange(plane.n)], [np.zeros(plane.n)], [np.array(start)]
    ready, wedged, stuck = np.zeros(len(moves)), {}, []  # ready [s]: from then on an arm stands where its group left it

    def record(group: _Group) -> None:
        begin = ready[[j for i in group.members for j in (i, *near.around(i))]].max()
        for k, i in enumerate(group.members):
            owner.append(np.full(len(group.times), i))
            times.append(begin + np.array(group.times))
            poses.append(np.array([pose[k] for pose in group.path]))
        angles[group.members] = group.path[-1]
        ready[group.members] = begin + group.times[-1]

    def tell(number: int, of: int, what: str) -> None:
        if report is not None:
            report(f"coming apart, {what} {number + 1} of {of}")

    def run(members: list[int]) -> tuple[_Group, bool]:
        for finer in _FINER:
            group = _Group(plane, near, margin, angles, members, finer)
            free = group.run()
            if group.keeps_the_rule():
                break
        return group, free

    for k, members in enumerate(groups):
        tell(k, len(groups), "group")
        group, free = run(members)
        if free:
            record(group)
        else:
            stuck.append(members)
    for k, members in enumerate(stuck):  # with their neighbours, who may make room
        tell(k, len(stuck), "group that was stuck,")
        around = {int(j) for i in members for j in near.around(i) if moves[j]}
        group, free = run(sorted({*members, *around}))
        if not free:
            wedged.update(group.in_the_way())
        record(group)
    motion = Trajectory.from_knots(np.concatenate(owner), np.concatenate(times), np.concatenate(poses), plane.n)
    return Opened(motion, wedged)


def _groups(too_near: np.ndarray, outside: np.ndarray, moves: np.ndarray) -> list[list[int]]:
    """Arms that can move (`moves`) and have to, in groups of those who are connected by pairs (m, 2) that both can.

    `outside` are out of range.
    """
    pairs = too_near[moves[too_near].all(axis=1)]
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(moves), len(moves)))
    label = connected_components(graph, directed=False)[1]
    concerned = np.unique([*too_near.ravel(), *outside]).astype(np.int64)
    found: dict[int, list[int]] = {}
    for i in concerned[moves[concerned]].tolist():
        found.setdefault(int(label[i]), []).append(i)
    return list(found.values())
