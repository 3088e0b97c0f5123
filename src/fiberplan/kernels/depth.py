"""Clearance with a sign that means something where arms overlap: how far they would have to be moved apart.

`fiberplan.kernels.clearance` saturates on overlap, which is enough to see a contact. Here two overlapping convex pieces
have minus their depth: the least motion along any direction that parts them. For convex shapes that is the largest
separation along the normals of their edges (separating axis theorem), less than zero while they overlap.
"""

import numpy as np

from fiberplan.kernels.arms import frame, vertex
from fiberplan.kernels.clearance import far_apart, meet, piece_to_piece
from fiberplan.kernels.compile import kernel, leaf


@leaf
def separation(arms, frame_i, p, frame_j, q, nx, ny):
    """How far piece q lies beyond piece p along the unit vector n [mm]; negative if they overlap along it."""
    far, near = -np.inf, np.inf
    for k in range(arms.piece[p].first, arms.piece[p].last):
        x, y = vertex(arms, frame_i, arms.piece[p].link, k)
        far = max(far, x * nx + y * ny)
    for k in range(arms.piece[q].first, arms.piece[q].last):
        x, y = vertex(arms, frame_j, arms.piece[q].link, k)
        near = min(near, x * nx + y * ny)
    return near - far


@leaf
def _best_normal(arms, frame_i, p, frame_j, q, of_second, best, bx, by):
    """The largest separation along the normals of one piece's edges, and that normal; or what was known before."""
    frame_, r = (frame_j, q) if of_second else (frame_i, p)
    piece = arms.piece[r]
    ax, ay = vertex(arms, frame_, piece.link, piece.last - 1)
    for k in range(piece.first, piece.last):
        cx, cy = vertex(arms, frame_, piece.link, k)
        ex, ey = cx - ax, cy - ay
        length = np.sqrt(ex * ex + ey * ey)
        if length > 0.0:
            nx, ny = ey / length, -ex / length
            for _ in range(2):
                gap = separation(arms, frame_i, p, frame_j, q, nx, ny)
                if gap > best:
                    best, bx, by = gap, nx, ny
                nx, ny = -nx, -ny
        ax, ay = cx, cy
    return best, bx, by


@leaf
def signed_gap(arms, frame_i, p, frame_j, q):
    """Signed distance of two pieces' skeletons [mm], and the unit vector along which it is measured, from p to q.

    Not a number if an angle is not.
    """
    d2, wx, wy = piece_to_piece(arms, frame_i, p, frame_j, q)
    if not (d2 <= 0.0):
        distance = np.sqrt(d2)
        return distance, wx / distance, wy / distance
    best, nx, ny = _best_normal(arms, frame_i, p, frame_j, q, False, -np.inf, 1.0, 0.0)
    best, nx, ny = _best_normal(arms, frame_i, p, frame_j, q, True, best, nx, ny)
    return (best, nx, ny) if best > -np.inf else (0.0, 1.0, 0.0)  # two points that are one


@leaf
def signed_clearance(arms, i, alpha_i, beta_i, j, alpha_j, beta_j):
    """Gap between the bodies of two arms [mm]; where they overlap, minus the depth; inf if none can meet."""
    frame_i, frame_j = frame(arms, i, alpha_i, beta_i), frame(arms, j, alpha_j, beta_j)
    smallest = np.inf
    for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
        for q in range(arms.arm[j].first_piece, arms.arm[j].last_piece):
            if meet(arms, p, q) and not far_apart(arms, frame_i, p, frame_j, q, smallest):
                gap, _, _ = signed_gap(arms, frame_i, p, frame_j, q)
                gap -= arms.piece[p].radius + arms.piece[q].radius
                if np.isnan(gap):
                    return gap
                smallest = min(smallest, gap)
    return smallest


@kernel
def signed_clearances(arms, angles, pairs):
    """Signed clearance of each pair of arms [mm] at one configuration; `angles` (n, 2) covers obstacles too."""
    out = np.empty(len(pairs))
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        out[k] = signed_clearance(arms, i, angles[i, 0], angles[i, 1], j, angles[j, 0], angles[j, 1])
    return out
