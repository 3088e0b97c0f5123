"""Clearance of two arms: the smallest gap between bodies that meet, less their radii.

Pieces are convex: one vertex is a disc, two a capsule, three or more a filled outline, all rounded by a radius.
Overlapping pieces give the saturated value, minus the radii.
"""

import numpy as np

from fiberplan.kernels.arms import frame, point, vertex
from fiberplan.kernels.compile import inlined, kernel, leaf
from fiberplan.kernels.convex import convex_distance
from fiberplan.kernels.segments import segment_to_segment


@inlined
def piece_to_piece(arms, frame_i, p, frame_j, q):
    """Squared distance of two pieces' skeletons and the vector from the first to the second, zero on overlap."""
    piece_p, piece_q = arms.piece[p], arms.piece[q]
    count_p, count_q = piece_p.last - piece_p.first, piece_q.last - piece_q.first
    if count_p <= 2 and count_q <= 2:
        ax, ay = vertex(arms, frame_i, piece_p.link, piece_p.first)
        bx, by = vertex(arms, frame_i, piece_p.link, piece_p.last - 1)
        cx, cy = vertex(arms, frame_j, piece_q.link, piece_q.first)
        dx, dy = vertex(arms, frame_j, piece_q.link, piece_q.last - 1)
        return segment_to_segment(ax, ay, bx, by, cx, cy, dx, dy)
    if np.isnan(frame_i[2] + frame_i[6] + frame_j[2] + frame_j[6]):
        return np.nan, 0.0, 0.0  # an angle is not a number
    return convex_distance(arms, frame_i, p, frame_j, q)


@inlined
def meet(arms, p, q):
    """Whether two pieces are of categories that can touch."""
    a, b = arms.piece[p], arms.piece[q]
    return (a.category & b.meets) != 0 or (b.category & a.meets) != 0


@inlined
def far_apart(arms, frame_i, p, frame_j, q, gap):
    """Whether circles about two pieces are at least `gap` [mm] apart; asked of outlines, whose distance costs more."""
    a, b = arms.piece[p], arms.piece[q]
    if a.last - a.first <= 2 and b.last - b.first <= 2:
        return False
    ax, ay = point(frame_i, a.link, a.u, a.v)
    bx, by = point(frame_j, b.link, b.u, b.v)
    far = gap + a.extent + b.extent + a.radius + b.radius
    return far < np.inf and (ax - bx) * (ax - bx) + (ay - by) * (ay - by) > far * far and far > 0.0


@inlined
def clearance_within(arms, i, frame_i, j, frame_j, floor, cap):
    """The gap between the bodies of two arms whose frames are known, between `floor` and `cap` [mm]; NaN as below.

    Above `cap` it is `cap`; below `floor`, something below it. Either saves work.
    """
    smallest = cap
    for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
        for q in range(arms.arm[j].first_piece, arms.arm[j].last_piece):
            if meet(arms, p, q) and not far_apart(arms, frame_i, p, frame_j, q, smallest):
                d2, _, _ = piece_to_piece(arms, frame_i, p, frame_j, q)
                gap = np.sqrt(d2) - arms.piece[p].radius - arms.piece[q].radius
                if np.isnan(gap):
                    return gap
                smallest = min(smallest, gap)
                if smallest < floor:
                    return smallest
    return smallest


@inlined
def frames_clearance(arms, i, frame_i, j, frame_j):
    """Gap between the bodies of two arms whose frames are known [mm]; NaN if either is not a number."""
    return clearance_within(arms, i, frame_i, j, frame_j, -np.inf, np.inf)


@leaf
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
