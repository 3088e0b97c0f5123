"""What the kernels know of a focal plane: arms, their frames and the convex pieces that ride on them.

An arm of two links is a base, a first link turned by alpha and a second link turned by alpha + beta, so that beta = pi
is folded back. A four-bar arm has a third link (see `fiberplan.kernels.four_bar`). Obstacles are arms too: their
pieces ride on link 0, which never moves, and their index follows those of the positioners. Every clearance, bound and
proof is therefore written once, for a pair of arms.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.compile import inlined, leaf, record
from fiberplan.tolerances import ZONE

ARM = record(
    [
        ("x", "f8"),  # base: the alpha axis [mm]
        ("y", "f8"),
        ("length", "f8"),  # base to elbow [mm]
        ("alpha_zero", "f8"),  # added to commanded angles [rad]
        ("beta_zero", "f8"),
        ("reach_alpha", "f8"),  # farthest body point of the alpha link from the base [mm], less radii
        ("reach_beta", "f8"),  # farthest body point of the beta link from the elbow [mm], less radii
        ("first_piece", "i8"),
        ("last_piece", "i8"),  # one past
        ("bar", "i8"),  # row of its four-bar constants; -1: two links
    ]
)
BAR = record(
    [
        ("x", "f8"),  # J2: the second fixed pivot [mm]
        ("y", "f8"),
        ("spacing", "f8"),  # J1 to J2 [mm]
        ("length", "f8"),  # J2 to J4 [mm]
        ("turn", "f8"),  # direction of the rocker at beta = 0 [rad]; it turns by -beta
        ("shortest", "f8"),  # slider, J3 to J4 [mm]
        ("longest", "f8"),
        ("reach", "f8"),  # farthest body point of the rocker from J2 [mm], less radii
    ]
)
PIECE = record(
    [
        ("link", "i8"),  # 0 fixed, 1 alpha, 2 beta, 3 rocker
        ("radius", "f8"),  # rounding [mm]
        ("category", "i8"),  # one bit
        ("meets", "i8"),  # bits of the categories it can touch
        ("first", "i8"),  # vertices
        ("last", "i8"),  # one past
        ("u", "f8"),  # center of a circle about the vertices, in the link's frame [mm]
        ("v", "f8"),
        ("extent", "f8"),  # its radius [mm]
    ]
)


class Arms(NamedTuple):
    """Positioners, then obstacles; all read-only and C-ordered, so that each kernel compiles once."""

    arm: np.ndarray  # (n,) ARM
    piece: np.ndarray  # (p,) PIECE
    vertices: np.ndarray  # (v, 2) in the frame of the piece's link [mm]
    bar: np.ndarray  # (b,) BAR


@leaf
def _linkage(arms, k, beta, ex, ey):
    """Direction of the probe of four-bar arm k, whose J3 is at (ex, ey), then J2 and the direction of the rocker."""
    bar = arms.bar[k]
    third = bar.turn - beta
    c3, s3 = np.cos(third), np.sin(third)
    rx, ry = bar.x + bar.length * c3 - ex, bar.y + bar.length * s3 - ey
    slider = np.sqrt(rx * rx + ry * ry)
    return rx / slider, ry / slider, bar.x, bar.y, c3, s3


@inlined
def frame(arms, i, alpha, beta):
    """Link frames of arm i: (base x, y, elbow x, y, cos and sin of links 1 and 2, rocker x, y, its cos and sin).

    The rocker's are zeros for an arm of two links. The elbow of a four-bar arm is J3, its second link the probe, from
    J3 through J4; where these coincide its direction is not a number.
    """
    arm = arms.arm[i]
    first = alpha + arm.alpha_zero
    c1, s1 = np.cos(first), np.sin(first)
    ex, ey = arm.x + arm.length * c1, arm.y + arm.length * s1
    if arm.bar >= 0:
        c2, s2, jx, jy, c3, s3 = _linkage(arms, arm.bar, beta, ex, ey)
        return arm.x, arm.y, ex, ey, c1, s1, c2, s2, jx, jy, c3, s3
    second = first + beta + arm.beta_zero
    c2, s2 = np.cos(second), np.sin(second)
    return arm.x, arm.y, ex, ey, c1, s1, c2, s2, 0.0, 0.0, 0.0, 0.0


@inlined
def point(frame_, link, u, v):
    """A point of `link`, given in its frame, in focal-plane coordinates [mm]."""
    bx, by, ex, ey, c1, s1, c2, s2, jx, jy, c3, s3 = frame_
    if link == 2:
        return ex + c2 * u - s2 * v, ey + s2 * u + c2 * v
    if link == 1:
        return bx + c1 * u - s1 * v, by + s1 * u + c1 * v
    if link == 3:
        return jx + c3 * u - s3 * v, jy + s3 * u + c3 * v
    return bx + u, by + v


@inlined
def vertex(arms, frame_, link, k):
    """Vertex k of a piece on `link`, in focal-plane coordinates [mm]."""
    return point(frame_, link, arms.vertices[k, 0], arms.vertices[k, 1])


@inlined
def motion(arms, i, d_alpha, d_beta):
    """Bound on how far any body point of arm i moves while its joints turn by so much, evenly [mm].

    For a four-bar arm it holds while the slider stays in its range, that is, outside the zone of avoidance.
    """
    turn = abs(d_alpha)
    arm = arms.arm[i]
    if arm.bar >= 0:
        bar = arms.bar[arm.bar]
        lean = (arm.length * turn + bar.length * abs(d_beta)) / (bar.shortest - ZONE)
        rigid = max(arm.reach_alpha * turn, bar.reach * abs(d_beta))
        return max(arm.length * turn + arm.reach_beta * lean, rigid)
    return max(arm.length * turn + arm.reach_beta * abs(d_alpha + d_beta), arm.reach_alpha * turn)


@inlined
def acceleration(arms, i, alpha_speed, beta_speed):
    """Bound on the acceleration of any body point of a two-link arm at constant joint speeds [mm/s^2]."""
    turn = alpha_speed * alpha_speed
    both = alpha_speed + beta_speed
    arm = arms.arm[i]
    return max(arm.length * turn + arm.reach_beta * both * both, arm.reach_alpha * turn)
