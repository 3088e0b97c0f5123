"""Which pairs keep a margin, yes or no: for searches that ask it of many paths, and of each of them only that."""

import numpy as np

from fiberplan.certificates.bisection import _DEPTH, closest
from fiberplan.certificates.path import state
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import kernel, leaf

_LOOKS, _APART = 8, 3  # moments at which a pair is looked at first, each so many after the one before, in turn


@leaf
def _seen_nearer(arms, path, i, j, least):
    """Whether a pair is seen nearer than `least` [mm] at one of a few moments: most that meet do so for a while."""
    for k in range(_LOOKS):
        t = path.duration * (k * _APART % _LOOKS + 0.5) / _LOOKS
        a_i, b_i, _, _, _ = state(path, i, t)
        a_j, b_j, _, _, _ = state(path, j, t)
        if frames_clearance(arms, i, frame(arms, i, a_i, b_i), j, frame(arms, j, a_j, b_j)) < least:
            return True
    return False


@kernel
def keeps(arms, path, pairs, errors, margin):
    """(m,) whether each pair of arms is shown to keep a margin [mm] over the whole motion.

    Args:
        arms: positioners, then obstacles.
        path: a `Motion` of the positioners.
        pairs: (m, 2) of arms.
        errors: (arms,) that each may be off by [mm].
        margin: [mm].
    """
    out = np.empty(len(pairs), np.bool_)
    starts, ends = np.empty(_DEPTH), np.empty(_DEPTH)
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        error = errors[i] + errors[j]
        out[k] = False
        if not _seen_nearer(arms, path, i, j, margin + error):
            low, _, _ = closest(arms, path, i, j, margin, 0.0, error, np.inf, margin, starts, ends)
            out[k] = low >= margin
    return out
