"""A lower bound of clearance over an interval in which joint speeds are constant, from one look in its middle.

Along a fixed axis, the gap between two body points is g + g' t up to A t^2 / 2, A bounding their relative acceleration.
The minimum is taken over *every* pair of vertices of two convex pieces: the closest pair alone would be unsound, since
another may close faster. The axis only decides how sharp the bound is, never whether it holds.
"""

import numpy as np

from fiberplan.kernels.arms import motion, vertex
from fiberplan.kernels.clearance import far_apart, meet, piece_to_piece
from fiberplan.kernels.compile import inlined
from fiberplan.kernels.four_bar import largest_acceleration, rates
from fiberplan.tolerances import ROUNDING


@inlined
def vertex_speed_along(frame_, rates_, link, x, y, nx, ny):
    """Speed along the axis n of a body point at (x, y) on `link`, whose links turn at `rates_` [mm/s]."""
    bx, by, ex, ey = frame_[0], frame_[1], frame_[2], frame_[3]
    if link == 2:
        elbow = rates_[0] * ((ex - bx) * ny - (ey - by) * nx)
        return elbow + rates_[1] * ((x - ex) * ny - (y - ey) * nx)
    if link == 1:
        return rates_[0] * ((x - bx) * ny - (y - by) * nx)
    if link == 3:
        return rates_[2] * ((x - frame_[8]) * ny - (y - frame_[9]) * nx)
    return 0.0


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


@inlined  # as a call of its own it costs a quarter more: the compiler then inlines less within it
def constant_speed_bound(arms, i, frame_i, va_i, vb_i, j, frame_j, va_j, vb_j, h):
    """Clearance now, and a lower bound of it within +-h [s] of now at constant joint speeds [mm]."""
    bent_i = largest_acceleration(arms, i, frame_i, va_i, vb_i, h)
    bend = 0.5 * h * h * (bent_i + largest_acceleration(arms, j, frame_j, va_j, vb_j, h))
    rates_i, rates_j = rates(arms, i, frame_i, va_i, vb_i), rates(arms, j, frame_j, va_j, vb_j)
    two_links = arms.arm[i].bar < 0 and arms.arm[j].bar < 0  # others' motion has no bound in their zone of avoidance
    now, bound = np.inf, np.inf
    for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
        for q in range(arms.arm[j].first_piece, arms.arm[j].last_piece):
            if not meet(arms, p, q):
                continue
            if two_links and now < np.inf:  # two farther apart than that add nothing to the look, nor to the bound
                travel = motion(arms, i, va_i * h, vb_i * h) + motion(arms, j, va_j * h, vb_j * h)
                if far_apart(arms, frame_i, p, frame_j, q, max(now, bound + travel)):
                    continue
            d2, wx, wy = piece_to_piece(arms, frame_i, p, frame_j, q)
            radii = arms.piece[p].radius + arms.piece[q].radius
            distance = np.sqrt(d2)
            now = min(now, distance - radii) if not np.isnan(distance) else distance
            if not (distance > 0.0 and bend < np.inf):
                bound = min(bound, -radii)  # saturated: nothing is less
                continue
            nx, ny = wx / distance, wy / distance
            gap = least_gap_along(arms, frame_i, rates_i, p, frame_j, rates_j, q, nx, ny, h)
            bound = min(bound, max(-radii, gap - bend - radii))
    return now, bound - ROUNDING
