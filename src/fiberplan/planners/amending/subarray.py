"""A few positioners and everyone whom they could touch, as a focal plane and a motion of their own.

What happens there is settled at a cost that does not grow with the array, by the same code that plans and proves all
of it.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory


class Patch(NamedTuple):
    """Part of a focal plane, and which part it is."""

    plane: FocalPlane
    who: np.ndarray  #: (k,) the positioners, as the whole counts them, increasing
    obstacles: np.ndarray  #: (m,) the same for the obstacles

    def whole(self, arm: int) -> int:
        """What the whole focal plane calls a positioner, or obstacle -1 - k, of this part."""
        return int(self.who[arm]) if arm >= 0 else -1 - int(self.obstacles[-1 - arm])


def patch_around(plane: FocalPlane, inner: np.ndarray, gap: float) -> Patch:
    """The positioners `inner` (m,), with all that could come within `gap` [mm] of them."""
    inside = np.zeros(plane.n, bool)
    inside[inner] = True
    for i in inner:
        away = np.hypot(*(plane.base - plane.base[i]).T)
        inside |= away < plane.reach + plane.reach[i] + gap
    beside = plane.obstacle_pairs_within(gap)
    obstacles = np.unique(beside[np.isin(beside[:, 0], inner), 1])
    who = np.flatnonzero(inside)
    return Patch(plane.subset(who, obstacles), who, obstacles)


def part_of_motion(motion: Trajectory, who: np.ndarray) -> Trajectory:
    """The motion of the positioners `who` (k,) alone."""
    counts = np.diff(motion.offsets)[who]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    rows = np.arange(offsets[-1]) + np.repeat(motion.offsets[who] - offsets[:-1], counts)
    return Trajectory(offsets, motion.times[rows], motion.angles[rows])


def with_part(motion: Trajectory, who: np.ndarray, part: Trajectory) -> Trajectory:
    """`motion` in which the positioners `who` (k,) move as in `part`; the knots of all others are as they were."""
    owner = np.repeat(np.arange(motion.n), np.diff(motion.offsets))
    kept = ~np.isin(owner, who)
    owner = np.concatenate([owner[kept], np.repeat(who, np.diff(part.offsets))])
    order = np.argsort(owner, kind="stable")
    times, angles = np.concatenate([motion.times[kept], part.times]), np.concatenate([motion.angles[kept], part.angles])
    offsets = np.searchsorted(owner[order], np.arange(motion.n + 1))
    return Trajectory(offsets, times[order], angles[order])


def sampled(motion: Trajectory, times: np.ndarray) -> np.ndarray:
    """Where everybody is (n, len(times), 2) [rad] at `times` [s]."""
    out = np.empty((motion.n, len(times), 2))
    for i in range(motion.n):
        own = slice(motion.offsets[i], motion.offsets[i + 1])
        for joint in (0, 1):
            out[i, :, joint] = np.interp(times, motion.times[own], motion.angles[own, joint])
    return out
