"""Bounds of the clearance of two arms, each joint of which may be anywhere within its half-width of where it is.

A body point x of a link that alpha and beta turn is x(m) + x' d + e for joints that are off by d, and e is no longer
than `(l d_alpha^2 + r (d_alpha + d_beta)^2) / 2`: l from base to elbow, r from elbow to x (Taylor's theorem). It is no
farther from x(m) than the arcs are long either, about the elbow and then about the base. From below, the gap along the
connection of the closest points is taken of every pair of vertices. From above, one point of each arm is enough: those
that are closest, or cross, in the middle; and arms that overlap there by their depth come apart by no more than their
vertices move.
"""

import numpy as np

from fiberplan.kernels.arms import motion, point, vertex
from fiberplan.kernels.clearance import meet
from fiberplan.kernels.compile import inlined, leaf
from fiberplan.kernels.depth import signed_gap
from fiberplan.kernels.segments import point_to_segment
from fiberplan.tolerances import ROUNDING


@inlined
def _spread(frame_, link, x, y, ha, hb, nx, ny):
    """How far a point may come along n, across it, off these by curvature, and in all; beta's part of the last [mm]."""
    bx, by, ex, ey = frame_[0], frame_[1], frame_[2], frame_[3]
    if link == 0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    ux, uy = x - bx, y - by
    along, across = abs(ux * ny - uy * nx) * ha, abs(ux * nx + uy * ny) * ha
    if link == 1:
        far = np.sqrt(ux * ux + uy * uy)
        return along, across, 0.5 * far * ha * ha, far * ha, 0.0
    vx, vy = x - ex, y - ey
    along += abs(vx * ny - vy * nx) * hb
    across += abs(vx * nx + vy * ny) * hb
    near, length = np.sqrt(vx * vx + vy * vy), np.sqrt((ex - bx) ** 2 + (ey - by) ** 2)
    bent = 0.5 * (length * ha * ha + near * (ha + hb) ** 2)
    return along, across, bent, near * hb + (np.sqrt(ux * ux + uy * uy) + near * hb) * ha, near * hb


@inlined
def _reached(arms, frame_, p, ha, hb, nx, ny):
    """How far any point of piece p may come along n, the longest way of any, that of the first, beta's part [mm]."""
    piece = arms.piece[p]
    far, most, way, turned = -np.inf, 0.0, 0.0, 0.0
    for k in range(piece.first, piece.last):
        x, y = vertex(arms, frame_, piece.link, k)
        along, _, bent, whole, beta = _spread(frame_, piece.link, x, y, ha, hb, nx, ny)
        most = max(most, whole)
        if x * nx + y * ny + min(along + bent, whole) > far:
            far, way, turned = x * nx + y * ny + min(along + bent, whole), whole, beta
    return far, most, way, turned


@inlined
def _crossing(ax, ay, bx, by, cx, cy, dx, dy):
    """Where on ab, as a part of it, segments ab and cd cross; NaN if they do not."""
    turn = (bx - ax) * (dy - cy) - (by - ay) * (dx - cx)
    s = ((cx - ax) * (dy - cy) - (cy - ay) * (dx - cx)) / turn
    t = ((cx - ax) * (by - ay) - (cy - ay) * (bx - ax)) / turn
    return s if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0 else np.nan


@leaf
def nearest_points(arms, frame_i, p, frame_j, q):
    """A point of each of two pieces: where their outlines cross, else those of the outlines that are closest."""
    piece_p, piece_q = arms.piece[p], arms.piece[q]
    best, px, py, qx, qy = np.inf, np.nan, np.nan, np.nan, np.nan
    ax, ay = vertex(arms, frame_i, piece_p.link, piece_p.last - 1)
    for k in range(piece_p.first, piece_p.last):
        bx, by = vertex(arms, frame_i, piece_p.link, k)
        cx, cy = vertex(arms, frame_j, piece_q.link, piece_q.last - 1)
        for m in range(piece_q.first, piece_q.last):
            dx, dy = vertex(arms, frame_j, piece_q.link, m)
            s = _crossing(ax, ay, bx, by, cx, cy, dx, dy)
            if s == s:
                x, y = ax + s * (bx - ax), ay + s * (by - ay)
                return x, y, x, y
            d2, wx, wy = point_to_segment(bx, by, cx, cy, dx, dy)
            if d2 < best:
                best, px, py, qx, qy = d2, bx, by, bx + wx, by + wy
            d2, wx, wy = point_to_segment(dx, dy, ax, ay, bx, by)
            if d2 < best:
                best, px, py, qx, qy = d2, dx + wx, dy + wy, dx, dy
            cx, cy = dx, dy
        ax, ay = bx, by
    return px, py, qx, qy


@leaf
def _of_pieces(arms, frame_i, p, hai, hbi, frame_j, q, haj, hbj, room):
    """Signed distance of two pieces' skeletons, bounds of it, and what each joint moves what comes nearest [mm]."""
    gap, nx, ny = signed_gap(arms, frame_i, p, frame_j, q)
    far, most_i, way_i, beta_i = _reached(arms, frame_i, p, hai, hbi, nx, ny)
    near, most_j, way_j, beta_j = _reached(arms, frame_j, q, haj, hbj, -nx, -ny)
    low = -near - far if gap > 0.0 else -np.inf
    high = gap + most_i + most_j
    if gap >= room:
        return gap, low, high, way_i - beta_i, beta_i, way_j - beta_j, beta_j
    px, py, qx, qy = nearest_points(arms, frame_i, p, frame_j, q)
    dx, dy = qx - px, qy - py
    apart = np.sqrt(dx * dx + dy * dy)
    if apart > 0.0:
        nx, ny = dx / apart, dy / apart
    link_p, link_q = arms.piece[p].link, arms.piece[q].link
    along_i, across_i, bent_i, whole_i, turned_i = _spread(frame_i, link_p, px, py, hai, hbi, nx, ny)
    along_j, across_j, bent_j, whole_j, turned_j = _spread(frame_j, link_q, qx, qy, haj, hbj, nx, ny)
    along, across = apart + along_i + along_j, across_i + across_j
    of_points = min(np.sqrt(along * along + across * across) + bent_i + bent_j, apart + whole_i + whole_j)
    return gap, low, min(high, of_points), whole_i - turned_i, turned_i, whole_j - turned_j, turned_j


@leaf
def box_bounds(arms, i, frame_i, hai, hbi, j, frame_j, haj, hbj, margin, shut):
    """Clearance of two arms of two links in the middle of boxes of their joints, and all over them [mm].

    Arms i and j have `frame_i` and `frame_j` in the middle, their joints the half-widths hai, hbi, haj and hbj [rad].
    Of clearances above `margin` no bound is wanted, and an upper bound below `shut` ends the search [mm].

    Returns:
        clearance in the middle, lower bound, upper bound, and the ways that alpha and beta of both move the bodies
        that are closest there, of those that may come nearer than the margin.
    """
    now, low, high, nearest = np.inf, np.inf, np.inf, np.inf
    w0 = w1 = w2 = w3 = 0.0
    moved = motion(arms, i, hai, hbi) + motion(arms, j, haj, hbj) + margin
    for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
        a = arms.piece[p]
        ax, ay = point(frame_i, a.link, a.u, a.v)
        for q in range(arms.arm[j].first_piece, arms.arm[j].last_piece):
            if not meet(arms, p, q):
                continue
            b = arms.piece[q]
            bx, by = point(frame_j, b.link, b.u, b.v)
            far = moved + a.extent + b.extent + a.radius + b.radius
            if (ax - bx) * (ax - bx) + (ay - by) * (ay - by) > far * far:
                continue
            radii = a.radius + b.radius
            gap, below, above, u0, u1, u2, u3 = _of_pieces(
                arms, frame_i, p, hai, hbi, frame_j, q, haj, hbj, margin + radii
            )
            low = min(low, below - radii - ROUNDING) if below == below else -np.inf
            high = min(high, above - radii + ROUNDING)
            now = min(now, gap - radii)
            if not (below - radii - ROUNDING >= margin) and not (gap - radii >= nearest):
                nearest, w0, w1, w2, w3 = gap - radii, u0, u1, u2, u3
            if high < shut:
                return now, low, high, w0, w1, w2, w3
    return now, low, high, w0, w1, w2, w3
