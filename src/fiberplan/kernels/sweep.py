"""Is a pair clear over a whole step, not just at its ends?

First order: while the arms move by m, their clearance changes by at most m. A sample therefore vouches for its
surroundings, and what it does not reach is split. Planners use this; `fiberplan.certificates` has its own, sharper test.
"""

import numpy as np

from fiberplan.kernels.arms import frame, motion
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import kernel

SLACK = 5e-4  # [mm] planners keep this more than the margin, so that the proof has room; a start has twice that
_TOUCH = 1e-5  # [mm] a sample closer than this to the limit counts as contact
_MOST_SAMPLES = 200  # a step that needs more counts as contact


@kernel
def swept_clear(arms, i, a0, b0, da, db, j, c0, d0, dc, dd, limit):
    """Whether arms i and j keep `limit` [mm] while i turns from (a0, b0) by (da, db) and j from (c0, d0) by (dc, dd).

    Both move evenly over the same time. False where it could not be shown: never a wrong True.
    """
    moved = motion(arms, i, da, db) + motion(arms, j, dc, dd)
    lo = np.empty(64)
    hi = np.empty(64)
    lo[0], hi[0], depth = 0.0, 1.0, 1
    for _ in range(_MOST_SAMPLES):
        depth -= 1
        left, right = lo[depth], hi[depth]
        s = 0.5 * (left + right)
        gap = frames_clearance(
            arms, i, frame(arms, i, a0 + s * da, b0 + s * db), j, frame(arms, j, c0 + s * dc, d0 + s * dd)
        )
        slack = gap - limit
        if not (slack >= _TOUCH):
            return False
        covered = slack / moved if moved > 0.0 else 1.0
        if s + covered < right:
            if depth + 2 > len(lo):
                return False
            lo[depth], hi[depth] = s + covered, right
            depth += 1
        if s - covered > left:
            lo[depth], hi[depth] = left, s - covered
            depth += 1
        if depth == 0:
            return True
    return False
