"""Which obstacles a positioner could touch."""

from collections.abc import Sequence

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.kernels.neighbours import box_pairs

_BESIDE = 0.1  # obstacles this much farther off are neighbours too: a proof tells their clearance [mm]


def obstacles_within(base: np.ndarray, reach: np.ndarray, obstacles: Sequence[Obstacle], gap: float) -> np.ndarray:
    """(m, 2) positioner and obstacle number that could come within `gap` [mm].

    Args:
        base: (n, 2) of positioners [mm].
        reach: (n,) of their bodies [mm].
        obstacles: all of them.
        gap: to keep [mm].
    """
    boxes = [[*(o.points.min(axis=0) - o.radius), *(o.points.max(axis=0) + o.radius)] for o in obstacles]
    near = box_pairs(base, reach, read_only(np.array(boxes, float).reshape(-1, 4)), gap)
    first = np.searchsorted(near[:, 1], np.arange(len(obstacles) + 1))
    kept = np.ones(len(near), bool)  # a long edge that runs askew has a box that is far larger than itself
    for k, obstacle in enumerate(obstacles):
        i = near[first[k] : first[k + 1], 0]
        kept[first[k] : first[k + 1]] = obstacle.distance(base[i]) <= reach[i] + gap + _BESIDE
    return near[kept]
