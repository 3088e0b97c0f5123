"""Distances between points and segments in the plane.

All return the squared distance and the vector from the closest point of the first shape to the closest point of the
second (zero where they touch or cross). Zero-length segments are points; nothing here divides by zero.
"""

from fiberplan.kernels.compile import inlined, leaf

_CROSSING = 1e-18  # a crossing point is on both segments up to rounding: squared, relative to their size


@inlined
def point_to_segment(px, py, ax, ay, bx, by):
    """Squared distance [mm^2] from point p to segment ab, and the vector from p to its closest point [mm]."""
    ux, uy = bx - ax, by - ay
    length2 = ux * ux + uy * uy
    t = 0.0
    if length2 > 0.0:
        t = ((px - ax) * ux + (py - ay) * uy) / length2
        t = min(1.0, max(0.0, t))
    wx, wy = ax + t * ux - px, ay + t * uy - py
    return wx * wx + wy * wy, wx, wy


@inlined
def segments_cross(ax, ay, bx, by, cx, cy, dx, dy):
    """Whether segments ab and cd cross in one interior point of each (touching ends are not a crossing)."""
    abx, aby = bx - ax, by - ay
    cdx, cdy = dx - cx, dy - cy
    side_c = abx * (cy - ay) - aby * (cx - ax)
    side_d = abx * (dy - ay) - aby * (dx - ax)
    side_a = cdx * (ay - cy) - cdy * (ax - cx)
    side_b = cdx * (by - cy) - cdy * (bx - cx)
    return (
        ((side_c > 0.0) != (side_d > 0.0))
        and ((side_a > 0.0) != (side_b > 0.0))
        and (side_c != 0.0 and side_d != 0.0 and side_a != 0.0 and side_b != 0.0)
    )


@leaf
def _meet(ax, ay, bx, by, cx, cy, dx, dy):
    """Whether segments said to cross do: of two on one line, far apart, rounding alone can put ends on both sides."""
    side_c = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    side_d = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    t = side_c / (side_c - side_d)
    d2, _, _ = point_to_segment(cx + t * (dx - cx), cy + t * (dy - cy), ax, ay, bx, by)
    size = (bx - ax) ** 2 + (by - ay) ** 2 + (dx - cx) ** 2 + (dy - cy) ** 2 + (cx - ax) ** 2 + (cy - ay) ** 2
    return not (d2 > _CROSSING * size)


@inlined
def segment_to_segment(ax, ay, bx, by, cx, cy, dx, dy):
    """Squared distance [mm^2] between segments ab and cd, and the vector from ab to cd [mm].

    In the plane, two segments that do not cross are closest at an end of one of them, so four point distances and the
    crossing test are the whole answer: parallel, collinear, touching and zero-length segments need no case of their
    own.
    """
    best, wx, wy = point_to_segment(ax, ay, cx, cy, dx, dy)
    d2, vx, vy = point_to_segment(bx, by, cx, cy, dx, dy)
    if d2 < best:
        best, wx, wy = d2, vx, vy
    d2, vx, vy = point_to_segment(cx, cy, ax, ay, bx, by)
    if d2 < best:
        best, wx, wy = d2, -vx, -vy
    d2, vx, vy = point_to_segment(dx, dy, ax, ay, bx, by)
    if d2 < best:
        best, wx, wy = d2, -vx, -vy
    if best > 0.0 and segments_cross(ax, ay, bx, by, cx, cy, dx, dy) and _meet(ax, ay, bx, by, cx, cy, dx, dy):
        return 0.0, 0.0, 0.0
    return best, wx, wy
