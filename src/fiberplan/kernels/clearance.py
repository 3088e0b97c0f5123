"""Clearance of two arms: the smallest gap between bodies that meet, less their radii.

Pieces are convex: one vertex is a disc, two a capsule, three or more a filled outline, all rounded by a radius.
Overlapping pieces give the saturated value, minus the radii.
"""

import numpy as np

from fiberplan.kernels.arms import frame, vertex
from fiberplan.kernels.compile import kernel
from fiberplan.kernels.segments import segment_to_segment


@kernel
def _edges(count):
    """How many edges a piece of `count` vertices has; a point is one edge of no length."""
    return count if count > 2 else 1


@kernel
def _contains(arms, frame_, link, first, count, px, py):
    """Whether a convex outline contains a point: the point lies on one side of every edge."""
    left = right = False
    ax, ay = vertex(arms, frame_, link, first + count - 1)
    for k in range(count):
        bx, by = vertex(arms, frame_, link, first + k)
        side = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
        left = left or side > 0.0
        right = right or side < 0.0
        ax, ay = bx, by
    return not (left and right)


@kernel
def piece_to_piece(arms, frame_i, p, frame_j, q):
    """Squared distance of two pieces' skeletons and the vector from the first to the second, zero on overlap."""
    p0, q0 = arms.piece[p].first, arms.piece[q].first
    np_, nq = arms.piece[p].last - p0, arms.piece[q].last - q0
    link_p, link_q = arms.piece[p].link, arms.piece[q].link
    best, wx, wy = np.inf, 0.0, 0.0
    for a in range(_edges(np_)):
        ax, ay = vertex(arms, frame_i, link_p, p0 + a)
        bx, by = vertex(arms, frame_i, link_p, p0 + (a + 1) % np_)
        for c in range(_edges(nq)):
            cx, cy = vertex(arms, frame_j, link_q, q0 + c)
            dx, dy = vertex(arms, frame_j, link_q, q0 + (c + 1) % nq)
            d2, vx, vy = segment_to_segment(ax, ay, bx, by, cx, cy, dx, dy)
            if not (d2 >= best):
                best, wx, wy = d2, vx, vy
                if not (d2 > 0.0):
                    return best, wx, wy
    if np_ > 2:
        cx, cy = vertex(arms, frame_j, link_q, q0)
        if _contains(arms, frame_i, link_p, p0, np_, cx, cy):
            return 0.0, 0.0, 0.0
    if nq > 2:
        ax, ay = vertex(arms, frame_i, link_p, p0)
        if _contains(arms, frame_j, link_q, q0, nq, ax, ay):
            return 0.0, 0.0, 0.0
    return best, wx, wy


@kernel
def meet(arms, p, q):
    """Whether two pieces are of categories that can touch."""
    a, b = arms.piece[p], arms.piece[q]
    return (a.category & b.meets) != 0 or (b.category & a.meets) != 0


@kernel
def frames_clearance(arms, i, frame_i, j, frame_j):
    """Gap between the bodies of two arms whose frames are known [mm]; NaN if either is not a number."""
    smallest = np.inf
    for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
        for q in range(arms.arm[j].first_piece, arms.arm[j].last_piece):
            if meet(arms, p, q):
                d2, _, _ = piece_to_piece(arms, frame_i, p, frame_j, q)
                gap = np.sqrt(d2) - arms.piece[p].radius - arms.piece[q].radius
                if np.isnan(gap):
                    return gap
                smallest = min(smallest, gap)
    return smallest


@kernel
def clearance(arms, i, alpha_i, beta_i, j, alpha_j, beta_j):
    """Gap between the bodies of two arms [mm]; negative if they overlap, NaN if an angle is, inf if none can meet."""
    return frames_clearance(arms, i, frame(arms, i, alpha_i, beta_i), j, frame(arms, j, alpha_j, beta_j))


@kernel
def clearances(arms, angles, pairs):
    """Clearance of each pair of arms [mm] at one configuration; `angles` (n, 2) covers obstacles too."""
    out = np.empty(len(pairs))
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        out[k] = clearance(arms, i, angles[i, 0], angles[i, 1], j, angles[j, 0], angles[j, 1])
    return out
