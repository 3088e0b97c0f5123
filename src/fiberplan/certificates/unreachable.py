"""Proof that a positioner cannot get from start to goal past what never moves, whatever all others do.

The joint ranges are tiled with boxes. A box is blocked if at its middle the arm is closer to something fixed than the
margin by more than any body point can move within the box: then it is in contact everywhere in the box. Where it
overlaps something its depth counts, so that also outlines without a radius are in contact, at any margin. A motion that
stays clear passes only through boxes that are not blocked, each next to the one before; where those that can be come to
from the start do not include the goal's, there is no such motion. Leaving everyone else out only makes room, so the
proof stands for the whole field. That a proof is not found says nothing.
"""

import numpy as np
from scipy.ndimage import label

from fiberplan.arrays import number, read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import motion
from fiberplan.kernels.compile import kernel
from fiberplan.kernels.depth import signed_clearance
from fiberplan.tolerances import ROUNDING

_BOXES = np.radians([2.0, 0.5])  # widths that are tried in turn ...
_MOST = 2_000_000  # ... while there are no more boxes than this


@kernel
def _blocked(arms, i, fixed, pose, low, width, count, margin):
    """(count[0], count[1]) boxes of the joint ranges in which arm i touches one of `fixed` everywhere."""
    out = np.zeros((count[0], count[1]), np.bool_)
    within = motion(arms, i, 0.5 * width[0], 0.5 * width[1]) + ROUNDING
    for a in range(count[0]):
        for b in range(count[1]):
            alpha, beta = low[0] + (a + 0.5) * width[0], low[1] + (b + 0.5) * width[1]
            for k in range(len(fixed)):
                if signed_clearance(arms, i, alpha, beta, fixed[k], pose[k, 0], pose[k, 1]) + within < margin:
                    out[a, b] = True
                    break
    return out


def proven_unreachable(plane: FocalPlane, i: int, start: np.ndarray, goal: np.ndarray, margin: float) -> bool:
    """Whether positioner `i` is proven unable to reach its goal past obstacles and offline positioners.

    Args:
        plane: the array, of arms of two links.
        i: the positioner.
        start: (n, 2) where everyone stands [rad]; offline positioners stay there.
        goal: (2,) where `i` should go [rad].
        margin: clearance to keep [mm].

    Returns:
        True only with proof; False if there is a way or if nothing was proven, as for joint ranges of many turns.
    """
    margin = number(margin, "mm", "margin", ProblemError)
    start = read_only(start, unit="rad", name="start", error=ProblemError)
    goal = read_only(goal, unit="rad", name="goal", error=ProblemError)
    low, high = plane.lower[i], plane.upper[i]
    if plane.kinematics.has_avoidance or not np.all(np.isfinite([low, high])):
        return False
    pairs = plane.arm_pairs_within(margin)
    beside = np.concatenate([pairs[pairs[:, 0] == i, 1], pairs[pairs[:, 1] == i, 0]])
    never_moves = np.concatenate([~plane.online, np.ones(len(plane.obstacles), bool)])
    fixed = read_only(np.sort(beside[never_moves[beside]]), np.int64)
    pose = read_only(plane.with_obstacles(start)[fixed])
    for size in _BOXES:
        wanted = np.maximum(1.0, np.ceil((high - low) / size))
        if wanted.prod() > _MOST:
            return False
        count = wanted.astype(np.int64)
        width = (high - low) / count
        blocked = _blocked(plane.arms, i, fixed, pose, low, width, count, margin)
        connected, _ = label(~blocked, structure=np.ones((3, 3)))
        ends = [connected[_boxes_at(q, low, width, count)] for q in (start[i], goal)]
        if not np.intersect1d(ends[0][ends[0] > 0], ends[1][ends[1] > 0]).size:
            return True
    return False


def _boxes_at(q: np.ndarray, low: np.ndarray, width: np.ndarray, count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of the boxes that hold `q`, with their neighbours where it lies within rounding of an edge."""
    near = []
    for d in (0, 1):
        at = (q[d] - low[d]) / width[d] if width[d] > 0 else 0.0
        near.append(np.unique(np.clip([int(np.floor(at - 1e-9)), int(np.floor(at + 1e-9))], 0, count[d] - 1)))
    a, b = np.meshgrid(*near, indexing="ij")
    return a.ravel(), b.ravel()
