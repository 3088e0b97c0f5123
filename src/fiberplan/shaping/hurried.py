"""The same paths at the speeds that joints have, without rests: what a robot needs that waits for nobody."""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory

_PART = 1.0 - 1e-6  # of a joint's speed: rounding of times makes even short pieces no faster


def hurried(trajectory: Trajectory, plane: FocalPlane) -> Trajectory:
    """The motion in which each piece of a path takes the least time that it can; none takes longer than it did."""
    turns, times = np.abs(np.diff(trajectory.angles, axis=0)), np.zeros(len(trajectory.times))
    needed = (turns / (plane.max_speed[trajectory.owner[1:]] * _PART)).max(axis=1)
    needed = np.where(turns.any(axis=1), np.minimum(needed, np.diff(trajectory.times)), 0.0)
    for a, b in zip(trajectory.offsets[:-1].tolist(), trajectory.offsets[1:].tolist(), strict=True):
        times[a + 1 : b] = np.cumsum(needed[a : b - 1])  # each by itself: sums of all would lose digits
    return Trajectory.from_knots(trajectory.owner, times, trajectory.angles, trajectory.n)
