"""How near two convex pieces come along a fixed axis, over an interval in which joint speeds are constant."""

import numpy as np

from fiberplan.kernels.arms import vertex
from fiberplan.kernels.compile import inlined
from fiberplan.kernels.even_motion import vertex_speed_along


@inlined
def least_gap_along(arms, frame_i, rates_i, p, frame_j, rates_j, q, nx, ny, h):
    """Least gap of pieces p and q along the unit vector n within +-h [s], but for what the motions bend [mm].

    Over linear motions the least gap is at an end of the interval, and there it is the least of one piece's points less
    the greatest of the other's: the minimum over every pair of vertices.
    """
    late_p, early_p, late_q, early_q = -np.inf, -np.inf, np.inf, np.inf
    for k in range(arms.piece[p].first, arms.piece[p].last):
        x, y = vertex(arms, frame_i, arms.piece[p].link, k)
        along = x * nx + y * ny
        drift = h * vertex_speed_along(frame_i, rates_i, arms.piece[p].link, x, y, nx, ny)
        late_p, early_p = max(late_p, along + drift), max(early_p, along - drift)
    for k in range(arms.piece[q].first, arms.piece[q].last):
        x, y = vertex(arms, frame_j, arms.piece[q].link, k)
        along = x * nx + y * ny
        drift = h * vertex_speed_along(frame_j, rates_j, arms.piece[q].link, x, y, nx, ny)
        late_q, early_q = min(late_q, along + drift), min(early_q, along - drift)
    return min(late_q - late_p, early_q - early_p)
