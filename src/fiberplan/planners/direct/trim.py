"""From paths on a lattice to knots: one wherever a joint changes its speed, none after the last move."""

import numpy as np

from fiberplan.kernels.compile import kernel
from fiberplan.motion import Trajectory

_EVEN = 1e-9  # of a step: speeds this alike are the same


@kernel
def _turning_points(path, steps, keep):
    """Mark the steps of each path (n, steps + 1, 2) that need a knot; returns how many there are."""
    count = 0
    for i in range(len(path)):
        end = steps
        while end > 0 and path[i, end - 1, 0] == path[i, end, 0] and path[i, end - 1, 1] == path[i, end, 1]:
            end -= 1
        for k in range(end + 1):
            turns = k == 0 or k == end
            for d in range(2):
                if not turns:
                    before, after = path[i, k, d] - path[i, k - 1, d], path[i, k + 1, d] - path[i, k, d]
                    turns = abs(after - before) > _EVEN * max(abs(before), abs(after))
            keep[i, k] = turns
            count += turns
    return count


def in_parts(knots: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Even moves between `knots` (m, ...) cut into `counts` (m - 1,) equal parts each (1 + sum of counts, ...)."""
    at = np.concatenate([[0], np.cumsum(counts)])
    columns = [np.interp(np.arange(at[-1] + 1), at, column) for column in knots.reshape(len(knots), -1).T]
    return np.stack(columns, axis=1).reshape(-1, *knots.shape[1:])


def as_trajectory(path: np.ndarray, duration: float) -> Trajectory:
    """Paths (n, steps + 1, 2) [rad] with steps of `duration` [s] as a trajectory."""
    n, steps = len(path), path.shape[1] - 1
    keep = np.zeros((n, steps + 1), np.bool_)
    _turning_points(path, steps, keep)
    offsets = np.concatenate([[0], np.cumsum(keep.sum(axis=1))])
    times = np.broadcast_to(duration * np.arange(steps + 1), (n, steps + 1))
    return Trajectory(offsets, times[keep], path[keep])
