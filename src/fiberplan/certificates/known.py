"""What the proof of one motion says of another: pairs whose arms move alike in both need not be looked at again.

A motion that is made anew with a few paths changed is mostly the one that was proven before.
"""

from typing import TYPE_CHECKING

import numpy as np

from fiberplan.certificates.tolerated import Subject
from fiberplan.kernels.arms import Arms
from fiberplan.motion import Trajectory

if TYPE_CHECKING:
    from fiberplan.certificates.safety import Certificate


def taken_over(known: "Certificate", subject: Subject, pairs: np.ndarray, margin: float, jitter: float) -> np.ndarray:
    """Bounds of clearance that a proof of another motion has proven for this one, too.

    Args:
        known: the other proof; of no use if its margin, its jitter or an arm of its array is another.
        subject: the motion, and of which array.
        pairs: (m, 2) arms as the kernels count them.
        margin: that is asked for [mm].
        jitter: clock error allowed for [s].

    Returns:
        (m,) [mm]; NaN where it was not proven to keep the margin, and where an arm moves otherwise or may be off by
        more or less.
    """
    out, before, plane = np.full(len(pairs), np.nan), known.subject, subject.plane
    if before is None or (known.margin, known.jitter) != (margin, jitter):
        return out
    if not _same_arms(before.plane.arms, plane.arms):
        return out
    alike = np.ones(len(plane.arms.arm), bool)
    alike[: plane.n] = _alike(before.trajectory, subject.trajectory) & (before.errors == subject.errors)
    low = np.concatenate([known.clearance, known.obstacle_clearance])
    looked_at = np.concatenate([known.pairs, known.obstacle_pairs + np.array([0, plane.n])])
    keys, wanted = (each @ [len(alike), 1] for each in (looked_at, pairs))
    _, mine, theirs = np.intersect1d(wanted, keys, assume_unique=True, return_indices=True)
    proven = (low[theirs] >= margin) & alike[pairs[mine]].all(axis=1)
    out[mine[proven]] = low[theirs[proven]]
    return out


def _same_arms(one: Arms, other: Arms) -> bool:
    """Whether two arrays are made of the same arms and obstacles."""
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def _alike(one: Trajectory, other: Trajectory) -> np.ndarray:
    """(n,) whose knots are the same in two motions."""
    counts = np.diff(other.offsets)
    alike = np.diff(one.offsets) == counts
    who = np.repeat(np.arange(other.n), counts)
    mine = np.flatnonzero(alike[who])  # knots
    theirs = mine - (other.offsets[:-1] - one.offsets[:-1])[who[mine]]
    same = (other.times[mine] == one.times[theirs]) & (other.angles[mine] == one.angles[theirs]).all(axis=1)
    alike[who[mine[~same]]] = False
    return alike
