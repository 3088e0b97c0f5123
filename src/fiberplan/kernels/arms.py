"""What the kernels know of a focal plane: arms, their frames and the convex pieces that ride on them.

An arm is a base, a first link turned by alpha and a second link turned by alpha + beta, so that beta = pi is folded
back. Obstacles are arms too: their pieces ride on link 0, which never moves, and their index follows those of the
positioners. Every clearance, bound and proof is therefore written once, for a pair of arms.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.compile import inlined

# Records, not one array a field: a kernel call counts references to every array it is handed.
ARM = np.dtype(
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
    ],
    align=True,
)
PIECE = np.dtype(
    [
        ("link", "i8"),  # 0 fixed, 1 alpha, 2 beta
        ("radius", "f8"),  # rounding [mm]
        ("category", "i8"),  # one bit
        ("meets", "i8"),  # bits of the categories it can touch
        ("first", "i8"),  # vertices
        ("last", "i8"),  # one past
    ],
    align=True,
)


class Arms(NamedTuple):
    """Positioners, then obstacles; all read-only and C-ordered, so that each kernel compiles once."""

    arm: np.ndarray  # (n,) ARM
    piece: np.ndarray  # (p,) PIECE
    vertices: np.ndarray  # (v, 2) in the frame of the piece's link [mm]


@inlined
def frame(arms, i, alpha, beta):
    """Link frames of arm i: (base x, y, elbow x, y, cos and sin of link 1, cos and sin of link 2)."""
    arm = arms.arm[i]
    first = alpha + arm.alpha_zero
    second = first + beta + arm.beta_zero
    c1, s1 = np.cos(first), np.sin(first)
    c2, s2 = np.cos(second), np.sin(second)
    return arm.x, arm.y, arm.x + arm.length * c1, arm.y + arm.length * s1, c1, s1, c2, s2


@inlined
def vertex(arms, frame_, link, k):
    """Vertex k of a piece on `link`, in focal-plane coordinates [mm]."""
    bx, by, ex, ey, c1, s1, c2, s2 = frame_
    u, v = arms.vertices[k, 0], arms.vertices[k, 1]
    if link == 2:
        return ex + c2 * u - s2 * v, ey + s2 * u + c2 * v
    if link == 1:
        return bx + c1 * u - s1 * v, by + s1 * u + c1 * v
    return bx + u, by + v


@inlined
def motion(arms, i, d_alpha, d_beta):
    """Bound on how far any body point of arm i moves while its joints turn by so much, evenly [mm]."""
    turn = abs(d_alpha)
    arm = arms.arm[i]
    return max(arm.length * turn + arm.reach_beta * abs(d_alpha + d_beta), arm.reach_alpha * turn)


@inlined
def acceleration(arms, i, alpha_speed, beta_speed):
    """Bound on the acceleration of any body point of arm i at constant joint speeds [mm/s^2]."""
    turn = alpha_speed * alpha_speed
    both = alpha_speed + beta_speed
    arm = arms.arm[i]
    return max(arm.length * turn + arm.reach_beta * both * both, arm.reach_alpha * turn)
