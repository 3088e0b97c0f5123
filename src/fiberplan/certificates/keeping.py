"""Which pairs keep a margin, yes or no: for searches that ask it of many paths, and of each of them only that."""

import numpy as np

from fiberplan.certificates.bisection import _DEPTH, closest
from fiberplan.kernels.compile import kernel


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
        low, _, _ = closest(arms, path, i, j, margin, 0.0, errors[i] + errors[j], np.inf, margin, starts, ends)
        out[k] = low >= margin
    return out
