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


def with_part(motion: Trajectory, who: np.ndarray, part: Trajectory) -> Trajectory:
    """`motion` in which the positioners `who` (k,) move as in `part`; the knots of all others are as they were."""
    kept = ~np.isin(motion.owner, who)
    owner = np.concatenate([motion.owner[kept], who[part.owner]])
    times, angles = np.concatenate([motion.times[kept], part.times]), np.concatenate([motion.angles[kept], part.angles])
    return Trajectory.from_knots(owner, times, angles, motion.n)
