"""The potential of Makarem2016 as turns of both joints: a pull to the goal and a push per pair of zones that meet.

The pull is that of a distance, not of its square, so its strength is constant: it turns the joints straight towards
their goal at full speed. (The printed pull is on the fiber, which cannot tell the two elbow solutions apart, and
chatters at the goal under Euler steps; ours does neither, since a step never passes the goal.) The push is the
repulsive term of `fiberplan.planners.shared.repulsion` on the weighted distance of two zones' centres, Eq. 7 with
its signs mended: its gradient reaches the joints through the Jacobian of the zone's own centre, and through the
weights, which turn with the arm.
"""

from typing import NamedTuple

from fiberplan.kernels.compile import inlined, leaf
from fiberplan.planners.shared.repulsion import push


class Field(NamedTuple):
    """Weights of the potential."""

    lambda1: float  # of the pull: this part of the full speed
    lambda2: float  # of pushes on zones in the outer half of an arm [rad/s mm^2]
    lambda3: float  # and on all others
    D: float  # weighted distance below which zones push [mm]
    d: float  # and at which they touch [mm]
    near: float  # two positioners both this near to their goals do not push each other fully [s]
    stall_time: float  # a positioner that has come no nearer for this long does not push [s]
    dt: float  # [s]


@inlined
def centre(frame_, link, u, v):
    """A zone's centre in the focal plane [mm], and the cosine and sine of its link."""
    bx, by, ex, ey, c1, s1, c2, s2 = frame_
    if link == 2:
        return ex + c2 * u - s2 * v, ey + s2 * u + c2 * v, c2, s2
    if link == 1:
        return bx + c1 * u - s1 * v, by + s1 * u + c1 * v, c1, s1
    return bx + u, by + v, 1.0, 0.0


@leaf
def zone_push(frame_i, zone, frame_j, other, size, D, d):
    """Minus the gradient of the repulsive term of two zones with respect to the angles of both links of the first.

    Args:
        frame_i: of the positioner that is pushed.
        zone: its ZONE.
        frame_j: of its neighbour.
        other: the neighbour's ZONE.
        size: how much larger than they are the pushed one takes both zones for.
        D: weighted distance at which the push begins [mm].
        d: and at which it is infinite [mm].
    """
    xi, yi, ci, si = centre(frame_i, zone.link, zone.u, zone.v)
    xj, yj, cj, sj = centre(frame_j, other.link, other.u, other.v)
    sx, sy = xi - xj, yi - yj
    axx = zone.along * ci * ci + zone.across * si * si  # the ellipse as a matrix: A
    axy = (zone.along - zone.across) * ci * si
    ayy = zone.along * si * si + zone.across * ci * ci
    grown = 2.0 * size * size / (d * d)  # M = grown (A + B); the weighted distance squared is s' M^-1 s
    mxx = grown * (axx + other.along * cj * cj + other.across * sj * sj)
    mxy = grown * (axy + (other.along - other.across) * cj * sj)
    myy = grown * (ayy + other.along * sj * sj + other.across * cj * cj)
    det = mxx * myy - mxy * mxy
    gx, gy = (myy * sx - mxy * sy) / det, (mxx * sy - mxy * sx) / det  # M^-1 s, half the gradient of that
    x2 = sx * gx + sy * gy
    if not (x2 < D * D):
        return 0.0, 0.0
    x = max(x2, 1e-12) ** 0.5
    strength = push(max(x, d * 1.05), 0.0, D, d)[0] / x  # bounded: safety does not hang on it
    fx, fy = strength * gx, strength * gy
    ax, ay = axx * gx + axy * gy, axy * gx + ayy * gy
    turning = strength * grown * (gx * ay - gy * ax)  # dM = grown (E A - A E) dtheta, E a quarter turn
    bx, by, ex, ey = frame_i[0], frame_i[1], frame_i[2], frame_i[3]
    if zone.link == 2:
        return (ex - bx) * fy - (ey - by) * fx, (xi - ex) * fy - (yi - ey) * fx + turning
    if zone.link == 1:
        return (xi - bx) * fy - (yi - by) * fx + turning, 0.0
    return 0.0, 0.0
