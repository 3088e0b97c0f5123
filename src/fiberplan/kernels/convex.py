"""How far two convex pieces are apart, and along which axis.

The distance of two convex shapes is the most that any axis has between them. Which axis that is, the differences of
their points say (Gilbert1988): the point nearest to the origin, of the corners of the difference
that are known, is the axis along which the next corner is looked for. What is returned was measured along an axis, so
it is never more than the distance, wherever the search ends.
"""

import numpy as np

from fiberplan.kernels.arms import point, vertex
from fiberplan.kernels.compile import inlined, leaf

_MORE = 8  # corners of the difference that are looked for, more than the pieces have: two or three are, mostly
_SAME = 2.0**-50  # of lengths: rounding


@inlined
def _in_frame(frame_, link, nx, ny):
    """A direction in the frame of `link`."""
    c, s = 1.0, 0.0
    if link == 2:
        c, s = frame_[6], frame_[7]
    elif link == 1:
        c, s = frame_[4], frame_[5]
    elif link == 3:
        c, s = frame_[10], frame_[11]
    return c * nx + s * ny, c * ny - s * nx


@inlined
def _corner(arms, frame_, p, nx, ny):
    """The vertex of piece p that lies farthest along n."""
    piece = arms.piece[p]
    u, v = _in_frame(frame_, piece.link, nx, ny)
    most, corner = -np.inf, piece.first
    for k in range(piece.first, piece.last):
        along = arms.vertices[k, 0] * u + arms.vertices[k, 1] * v
        if along > most:
            most, corner = along, k
    return vertex(arms, frame_, piece.link, corner)


@inlined
def _nearest_to_origin(ax, ay, bx, by):
    """The point of segment ab nearest to the origin, and whether that is b."""
    ux, uy = bx - ax, by - ay
    length2, t = ux * ux + uy * uy, -(ax * ux + ay * uy)
    if not (t > 0.0):
        return ax, ay, False
    if t >= length2:
        return bx, by, True
    off = (ax * uy - ay * ux) / length2  # across the segment: its direction is exact however near the origin is
    return off * uy, -off * ux, False


@leaf
def convex_distance(arms, frame_i, p, frame_j, q):
    """Squared distance of two pieces of any number of vertices, and the vector from the first to the second.

    Zeros where they overlap. Frames have to be numbers.
    """
    piece_p, piece_q = arms.piece[p], arms.piece[q]
    ax, ay = point(frame_i, piece_p.link, piece_p.u, piece_p.v)
    bx, by = point(frame_j, piece_q.link, piece_q.u, piece_q.v)
    wx, wy = bx - ax, by - ay  # any axis will do to begin with
    if wx == 0.0 and wy == 0.0:
        wx = 1.0
    best, nx, ny = 0.0, 0.0, 0.0
    corners = 0  # known ones: a and b
    for _ in range(piece_p.last - piece_p.first + piece_q.last - piece_q.first + _MORE):
        px, py = _corner(arms, frame_i, p, wx, wy)
        qx, qy = _corner(arms, frame_j, q, -wx, -wy)
        x, y = qx - px, qy - py
        along, length2 = x * wx + y * wy, wx * wx + wy * wy
        if along > 0.0 and along * along > best * length2:
            nx, ny = wx * along / length2, wy * along / length2
            best = nx * nx + ny * ny
        if corners == 0:
            ax, ay, corners = x, y, 1
            wx, wy = x, y
        elif (x == ax and y == ay) or (corners == 2 and x == bx and y == by):
            return best, nx, ny
        elif length2 - along <= _SAME * (abs(x) + abs(y)) * (abs(wx) + abs(wy)):
            return best, nx, ny  # all that is left is rounding
        else:
            if corners == 2:
                side, first, second = ax * by - ay * bx, bx * y - by * x, x * ay - y * ax
                if side * first >= 0.0 and side * second >= 0.0:
                    return 0.0, 0.0, 0.0  # the origin is one of the differences
            wx, wy, at_corner = _nearest_to_origin(ax, ay, x, y)
            if corners == 2:
                vx, vy, at_other = _nearest_to_origin(bx, by, x, y)
                if vx * vx + vy * vy < wx * wx + wy * wy:
                    ax, ay, wx, wy, at_corner = bx, by, vx, vy, at_other
            if at_corner:
                ax, ay, corners = x, y, 1
            else:
                bx, by, corners = x, y, 2
        if not (wx * wx + wy * wy > 0.0):
            return best, nx, ny  # they touch
    return best, nx, ny
