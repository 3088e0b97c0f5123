"""Is a pair clear over a whole step, not just at its ends?

The step is shown clear piece by piece, each from one look in its middle (`fiberplan.kernels.even_motion`); a piece that
is not shown is halved. Close to contact the second-order bound matters: greedy arms press against each other and slide.
"""

from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import leaf
from fiberplan.kernels.even_motion import constant_speed_bound

_SHORTEST = 1.0 / 128.0  # a piece of the step as short as this that is not shown clear counts as contact
_ULP = 2.0**-52  # more than the rounding of a part of the step


@leaf
def swept_clear(arms, i, a0, b0, da, db, j, c0, d0, dc, dd, limit, shown, landing):
    """Whether arms i and j keep `limit` [mm] while i turns from (a0, b0) by (da, db) and j from (c0, d0) by (dc, dd).

    Both move evenly over the same time, of which the part up to `shown` (0 to 1) is known to be clear. False where it
    could not be shown: never a wrong True. The end is looked at first, since a move that is refused mostly ends badly;
    it has to be clear by `landing` [mm] more, or at least as clear as the beginning.
    """
    end = frames_clearance(arms, i, frame(arms, i, a0 + da, b0 + db), j, frame(arms, j, c0 + dc, d0 + dd))
    if not (end >= limit):
        return False
    if end < limit + landing:
        begin = frames_clearance(arms, i, frame(arms, i, a0, b0), j, frame(arms, j, c0, d0))
        if end < begin:
            return False
    length = 1.0 - shown
    while shown < 1.0:
        until = min(shown + length, 1.0)
        h = 0.5 * (until - shown)
        s = shown + h
        frame_i = frame(arms, i, a0 + s * da, b0 + s * db)
        frame_j = frame(arms, j, c0 + s * dc, d0 + s * dd)
        now, bound = constant_speed_bound(arms, i, frame_i, da, db, j, frame_j, dc, dd, h + _ULP)
        if bound >= limit:
            shown = until
            length *= 2.0
        elif not (now >= limit) or length < _SHORTEST:
            return False
        else:
            length *= 0.5
    return True
