"""Is a pair clear over a whole step, not just at its ends?

First order: while the arms move by m, their clearance changes by at most m. A sample therefore vouches for its
surroundings, and what it does not reach is looked at again. Planners use this; the proof has its own, sharper test.
"""

from fiberplan.kernels.arms import frame, motion
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import leaf

SLACK = 5e-4  # [mm] planners keep this more than the margin, so that the proof has room; a start has twice that
_TOUCH = 1e-5  # [mm] a sample closer than this to the limit counts as contact
_MOST_SAMPLES = 200  # a step that needs more counts as contact


@leaf
def swept_clear(arms, i, a0, b0, da, db, j, c0, d0, dc, dd, limit):
    """Whether arms i and j keep `limit` [mm] while i turns from (a0, b0) by (da, db) and j from (c0, d0) by (dc, dd).

    Both move evenly over the same time. False where it could not be shown: never a wrong True.
    """
    moved = motion(arms, i, da, db) + motion(arms, j, dc, dd)
    shown, ahead = 0.0, 0.5  # shown clear up to here; how far ahead to look next
    for _ in range(_MOST_SAMPLES):
        s = min(1.0, shown + ahead)
        gap = frames_clearance(
            arms, i, frame(arms, i, a0 + s * da, b0 + s * db), j, frame(arms, j, c0 + s * dc, d0 + s * dd)
        )
        slack = gap - limit
        if not (slack >= _TOUCH):
            return False
        vouched = slack / moved if moved > 0.0 else 1.0
        if s - vouched > shown:
            ahead = 0.5 * (s - vouched - shown)
            continue
        shown, ahead = s + vouched, vouched
        if shown >= 1.0:
            return True
    return False
