"""Which pairs of robots keep their distance if one of them begins later than the other, or hurries, on the same paths.

Pairs of which one rests are left out, and those that are clear of each other at any two moments of their motions, as
most are. Nothing changes for a pair of which both begin later alike. All else is shown for that delay, once, as the
proof will do it.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.certificates.clocks import at_any_moments
from fiberplan.certificates.keeping import keeps
from fiberplan.certificates.path import KNOT, Motion, as_motion
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import ARM
from fiberplan.motion import Trajectory
from fiberplan.shaping.supply_load import stretches_of
from fiberplan.tolerances import SLACK

_LOOKS = 400  # at a pair, to show that it never meets: about as long as asking for some delays


class Begin(NamedTuple):
    """How a robot moves along its path."""

    path: int  #: which motion: 0: that which was given; 1: the other, if there is one
    later: int  #: [ms]


class DelayedPairs:
    """The pairs of one motion.

    Args:
        plane: whose robots move.
        motions: of all robots: that which was given, and another on the same paths, if robots may change to it.
        moving: (n,) which robots move at all.
        margin: clearance to keep [mm].
        error: (n,) each arm may be off by this [mm].
    """

    def __init__(
        self, plane: FocalPlane, motions: Sequence[Trajectory], moving: np.ndarray, margin: float, error: np.ndarray
    ):
        self.paths = len(motions)  #: that robots have
        self._arms, self._margin, self._error = plane.arms, margin + SLACK, read_only(error)
        every = side_by_side(motions)
        twice = plane.arms._replace(arm=read_only(np.tile(plane.arms.arm[: plane.n], self.paths), ARM))
        self._knots, self._offsets = as_motion(twice, every).knots, every.offsets
        pairs = plane.pairs_within(self._margin + 2.0 * float(error.max(initial=0.0)))
        self._pairs = self._that_meet(motions[-1], pairs[moving[pairs].all(axis=1)])
        self._beside: list[list[tuple[int, int]]] = [[] for _ in range(plane.n)]  # the pair, and the other
        for k, (i, j) in enumerate(self._pairs.tolist()):
            self._beside[i].append((k, j))
            self._beside[j].append((k, i))
        self._kept: dict[tuple[int, ...], bool] = {}

    def too_near(self, changed: Mapping[int, Begin], begins: Sequence[Begin]) -> set[int]:
        """Robots that would not be proven to keep their distance from one of some that begin otherwise.

        Args:
            changed: robots that begin otherwise, and how; also these may be too near to each other.
            begins: how all begin now, so that all keep their distance.
        """
        asked, others = [], []
        for i in changed:
            for k, j in self._beside[i]:
                first, second = (i, j) if self._pairs[k, 0] == i else (j, i)
                key = _key(k, changed.get(first, begins[first]), changed.get(second, begins[second]))
                if key != _key(k, begins[first], begins[second]):
                    asked.append(key)
                    others.append(j)
        if new := list(dict.fromkeys(key for key in asked if key not in self._kept)):
            self._kept |= dict(zip(new, self._shown(*np.array(new).T).tolist(), strict=True))
        return {j for key, j in zip(asked, others, strict=True) if not self._kept[key]}

    def _that_meet(self, motion: Trajectory, pairs: np.ndarray) -> np.ndarray:
        """The pairs that are not shown to be clear of each other at any two moments."""
        pairs = read_only(pairs, np.int64)
        path = as_motion(self._arms, motion)
        return pairs[~at_any_moments(self._arms, path, pairs, self._error, self._margin, _LOOKS)]

    def _shown(self, rows: np.ndarray, path: np.ndarray, other: np.ndarray, after: np.ndarray) -> np.ndarray:
        """(m,) whether pairs keep the margin, by row, paths of the two, and how much later the second begins [ms]."""
        robots = self._pairs[rows].ravel()
        moved = robots + len(self._error) * np.stack([path, other], axis=1).ravel()
        counts = self._offsets[moved + 1] - self._offsets[moved]
        offsets = np.concatenate([[0], np.cumsum(counts)])
        knots = self._knots[np.arange(offsets[-1]) + np.repeat(self._offsets[moved] - offsets[:-1], counts)]
        knots["time"] += np.repeat(
            np.stack([np.maximum(-after, 0), np.maximum(after, 0)], axis=1).ravel() / 1000, counts
        )
        motion = Motion(read_only(offsets, np.int64), read_only(knots, KNOT), float(knots["time"].max()))
        arms = self._arms._replace(arm=read_only(self._arms.arm[robots], ARM))
        each = read_only(np.arange(len(robots)).reshape(-1, 2), np.int64)
        return keeps(arms, motion, each, read_only(self._error[robots]), self._margin)


def side_by_side(motions: Sequence[Trajectory]) -> Trajectory:
    """Motions as one, of all robots of the first, then all of the second."""
    offsets = np.cumsum([0, *np.concatenate([np.diff(motion.offsets) for motion in motions])])
    times, angles = (np.concatenate([getattr(motion, name) for motion in motions]) for name in ("times", "angles"))
    return Trajectory(offsets, times, angles)


def begun_later(motion: Trajectory, later: np.ndarray) -> Trajectory:
    """The motion in which each robot begins `later` (n,) [s]; who does has no rest after its last turn."""
    moves, stops, owner = stretches_of(motion), np.full(motion.n, np.inf), motion.owner
    late = later[moves.owner] > 0
    stops[moves.owner[late]] = moves.end[late]  # the last one written is the latest
    kept = motion.times <= stops[owner]
    offsets = np.concatenate([[0], np.cumsum(np.bincount(owner[kept], minlength=motion.n))])
    return Trajectory(offsets, (motion.times + later[owner])[kept], motion.angles[kept])


def _key(row: int, first: Begin, second: Begin) -> tuple[int, int, int, int]:
    return row, first.path, second.path, second.later - first.later
