"""Joint angles that bring a fiber to a point: every solution, as often as the joint ranges hold it."""

import numpy as np

from fiberplan.focal_plane.focal_plane import FocalPlane
from fiberplan.tolerances import RANGE

TURN = 2 * np.pi


def solutions(
    plane: FocalPlane, who: np.ndarray, points: np.ndarray, offset: np.ndarray, parity: np.ndarray
) -> np.ndarray:
    """All commanded angles (m, k, 2) [rad] that bring fibers to `points`, quickest from folded first, NaN-padded.

    The time is that of the slower joint; equal times (to a nanosecond) go to the right elbow, then to smaller angles.

    Args:
        plane: whose lengths, zeros and ranges to use.
        who: (m,) positioners.
        points: (m, 2) in the focal plane [mm].
        offset: (m, 2) of the fiber in the beta link's frame [mm].
        parity: (m,) +1 right elbow only, -1 left only, 0 either; four-bar arms have none.
    """
    found, slack = plane.kinematics.inverse(plane, who, points, offset, parity)  # (m, c, 2)
    alphas = _turns(found[..., 0], plane.lower[who, 0], plane.upper[who, 0], slack)  # (m, c, a)
    betas = _turns(found[..., 1], plane.lower[who, 1], plane.upper[who, 1], slack)  # (m, c, b)
    shape = (*found.shape[:2], alphas.shape[2], betas.shape[2])
    angles = np.stack(
        [np.broadcast_to(alphas[:, :, :, None], shape), np.broadcast_to(betas[:, :, None, :], shape)], axis=-1
    )
    angles = np.where(np.isfinite(angles).all(axis=-1, keepdims=True), angles, np.nan)
    solution = np.broadcast_to(np.arange(shape[1])[None, :, None, None], shape)
    flat = (len(who), int(np.prod(shape[1:])))
    return _quickest_first(plane, who, angles.reshape(*flat, 2), solution.reshape(flat))


def reaches(plane: FocalPlane, who: np.ndarray, points: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """(m,) whether any angles in range bring fibers to `points` by either elbow; arguments as of `solutions`."""
    found, slack = plane.kinematics.inverse(plane, who, points, offset, np.zeros(len(who)))
    held = np.ones(found.shape[:2], bool)
    for joint in (0, 1):
        held &= np.isfinite(_turns(found[..., joint], plane.lower[who, joint], plane.upper[who, joint], slack)).any(-1)
    return np.asarray(held.any(axis=1))


def _turns(angle: np.ndarray, lower: np.ndarray, upper: np.ndarray, slack: np.ndarray) -> np.ndarray:
    """`angle` (m, 2) plus every number of turns that lands in its range: (m, 2, k), NaN-padded.

    Where none does, those that are out of it by `slack` (m,) at most are taken to its end.
    """
    lower, upper, slack = lower[:, None], upper[:, None], slack[:, None]
    start = lower - slack
    lowest = start + np.mod(angle - start, TURN)
    most = int(np.max((upper - lower + 2 * slack) // TURN, initial=0.0))
    found = lowest[:, :, None] + TURN * np.arange(most + 1)
    inside = found <= (upper + slack)[:, :, None]
    truly = inside & (found >= (lower - RANGE)[:, :, None]) & (found <= (upper + RANGE)[:, :, None])
    inside &= truly | ~truly.any(axis=2, keepdims=True)
    return np.where(inside, np.clip(found, lower[:, :, None], upper[:, :, None]), np.nan)


def _quickest_first(plane: FocalPlane, who: np.ndarray, angles: np.ndarray, solution: np.ndarray) -> np.ndarray:
    """Sort each row's solutions (m, k, 2) and leave out columns that no row needs."""
    travel = plane.least_time(angles - plane.folded[who, None], who)
    time = np.round(travel.max(axis=2, initial=0.0), 9)
    keys = (angles[:, :, 1], angles[:, :, 0], solution, np.where(np.isnan(time), np.inf, time))
    rows = np.repeat(np.arange(len(who)), solution.shape[1])
    order = np.lexsort([*(key.ravel() for key in keys), rows]).reshape(solution.shape)  # row by row, in one go
    order -= np.arange(len(who))[:, None] * solution.shape[1]
    ordered = np.take_along_axis(angles, order[:, :, None], axis=1)
    needed = int(np.isfinite(ordered[:, :, 0]).sum(axis=1).max(initial=0))
    return ordered[:, : max(needed, 1)]
