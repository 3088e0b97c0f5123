"""Who could touch whom at a given margin, as neighbour lists over all arms, obstacles included."""

from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane.focal_plane import FocalPlane
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.kernels.neighbours import NEAR, neighbour_lists
from fiberplan.tolerances import NEAR as NEAR_MARGIN


class Neighbourhood(NamedTuple):
    """Pairs of arms that could touch at a margin, as lists; worth making once per focal plane and margin."""

    pairs: np.ndarray  #: (pairs, 2) arms, sorted; obstacle k is arm n + k
    offsets: np.ndarray  #: (arms + 1,) neighbours of arm i are near[offsets[i]:offsets[i + 1]]
    near: np.ndarray  #: (2 pairs,) NEAR

    @classmethod
    def of(cls, plane: FocalPlane, margin: float) -> "Neighbourhood":
        """Neighbour lists of all arms that could come within `margin` [mm] plus a little."""
        return cls.from_pairs(len(plane.arms.arm), plane.arm_pairs_within(margin + NEAR_MARGIN))

    @classmethod
    def from_pairs(cls, arms: int, pairs: np.ndarray) -> "Neighbourhood":
        """The lists that `pairs` (m, 2) make of so many arms."""
        pairs = read_only(pairs, np.int64)
        offsets, near = neighbour_lists(arms, pairs)
        return cls(pairs, read_only(offsets, np.int64), read_only(near, NEAR))

    def around(self, i: int) -> np.ndarray:
        """(m,) arms that arm `i` could touch, in pair order."""
        return self.near["arm"][self.offsets[i] : self.offsets[i + 1]]


@leaf
def clearance_around(arms, near, angles, i, alpha, beta):
    """Clearance of arm i at (alpha, beta) from its nearest neighbour at `angles` [mm]; NaN rows are nowhere."""
    frame_i = frame(arms, i, alpha, beta)
    smallest = np.inf
    for k in range(near.offsets[i], near.offsets[i + 1]):
        j = near.near[k].arm
        if not np.isnan(angles[j, 0]):
            gap = frames_clearance(arms, i, frame_i, j, frame(arms, j, angles[j, 0], angles[j, 1]))
            if np.isnan(gap):
                return gap
            smallest = min(smallest, gap)
    return smallest


@leaf
def touched(arms, near, angles, i, limit):
    """First neighbour that arm i does not clear by `limit` [mm] at `angles`, or -1; NaN rows are nowhere."""
    frame_i = frame(arms, i, angles[i, 0], angles[i, 1])
    for k in range(near.offsets[i], near.offsets[i + 1]):
        j = near.near[k].arm
        if not np.isnan(angles[j, 0]):
            gap = frames_clearance(arms, i, frame_i, j, frame(arms, j, angles[j, 0], angles[j, 1]))
            if not (gap >= limit):
                return j
    return -1


@kernel
def touching(arms, near, angles, who, limit):
    """For each arm of `who`, the first neighbour it does not clear by `limit` [mm] at `angles`, or -1."""
    out = np.empty(len(who), np.int64)
    for k in range(len(who)):
        out[k] = touched(arms, near, angles, who[k], limit)
    return out


@kernel
def clearances_around(arms, near, angles, i, candidates):
    """Clearance of arm i from its nearest neighbour at each of `candidates` (c, 2) [mm]."""
    out = np.empty(len(candidates))
    for k in range(len(candidates)):
        out[k] = clearance_around(arms, near, angles, i, candidates[k, 0], candidates[k, 1])
    return out
