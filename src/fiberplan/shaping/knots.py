"""Knots of motions of which each joint is shaped by itself."""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.tolerances import SPEED

APART = 1e-7  #: knots nearer than this are one [s]


def first_of_each(owner: np.ndarray, times: np.ndarray) -> np.ndarray:
    """(k,) whether a knot, of those sorted by owner and time, is no nearer than `APART` to the one before it."""
    return np.append(True, (np.diff(times) > APART) | (owner[1:] != owner[:-1]))[: len(times)]


def merged(alpha: Trajectory, beta: Trajectory, plane: FocalPlane) -> Trajectory:
    """One motion of two: the alphas of the first and the betas of the second, with no more knots than it takes."""
    owner, times = np.concatenate([alpha.owner, beta.owner]), np.concatenate([alpha.times, beta.times])
    order = np.lexsort((times, owner))
    owner, times = owner[order], times[order]
    kept = first_of_each(owner, times)
    owner, times = owner[kept], times[kept]
    angles = np.stack([angles_at(alpha, owner, times)[:, 0], angles_at(beta, owner, times)[:, 1]], axis=1)
    return with_bends(owner, times, angles, plane)


def with_bends(owner: np.ndarray, times: np.ndarray, angles: np.ndarray, plane: FocalPlane) -> Trajectory:
    """A motion of those of the knots (k,), sorted by owner and time, at which a joint changes its speed."""
    kept = _bends(owner, times, angles, SPEED * plane.max_speed[owner])
    return Trajectory.from_knots(owner[kept], times[kept], angles[kept], plane.n)


def _bends(owner: np.ndarray, times: np.ndarray, angles: np.ndarray, least: np.ndarray) -> np.ndarray:
    """(k,) knots at which a joint changes its speed by more than `least` (k, 2), and first and last ones."""
    same = owner[1:] == owner[:-1]
    speed = np.diff(angles, axis=0) / np.where(same, np.diff(times), 1.0)[:, None]
    kept = np.ones(len(owner), bool)
    kept[1:-1] = ~(same[1:] & same[:-1]) | (np.abs(np.diff(speed, axis=0)) > least[1:-1]).any(axis=1)
    return kept


def angles_at(trajectory: Trajectory, owner: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Angles (m, 2) of each `owner` at its time in a motion."""
    offsets, knots = trajectory.offsets, trajectory.times
    span = trajectory.duration + 1.0
    held = np.clip(times, knots[offsets[owner]], knots[offsets[owner + 1] - 1])
    left = np.searchsorted(trajectory.owner * span + knots, owner * span + held, side="right") - 1
    left = np.clip(left, offsets[owner], np.maximum(offsets[owner + 1] - 2, offsets[owner]))
    right = np.minimum(left + 1, offsets[owner + 1] - 1)
    gap = knots[right] - knots[left]
    part = np.divide(held - knots[left], gap, out=np.zeros(len(gap)), where=gap > 0)[:, None]
    return (1.0 - part) * trajectory.angles[left] + part * trajectory.angles[right]
