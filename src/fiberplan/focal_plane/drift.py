"""How far arms get when their joints turn by a little: the room that clocks and joints which are off ask for."""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane.focal_plane import FocalPlane
from fiberplan.kernels.arms import motion
from fiberplan.kernels.compile import kernel


def drift(plane: FocalPlane, seconds: float) -> np.ndarray:
    """(n,) bound on how far any body point of each positioner moves in so many seconds [mm]."""
    return motion_bounds(plane, plane.max_speed * seconds)


def motion_bounds(plane: FocalPlane, turns: np.ndarray) -> np.ndarray:
    """(n,) bound on how far any body point of each positioner moves if its joints turn by `turns` (n, 2) [rad] [mm].

    It holds for turns of either sign: those of the same sign move it farthest.
    """
    return read_only(_motions(plane.arms, read_only(np.abs(turns))))


@kernel
def _motions(arms, turns):
    """Bounds (n,) on the motion of each arm that turns by `turns` (n, 2) [rad]."""
    out = np.empty(len(turns))
    for i in range(len(turns)):
        out[i] = motion(arms, i, turns[i, 0], turns[i, 1])
    return out
