"""Four-bar arms: how their third link makes the second turn, and how close they are to where it cannot.

J1 is the base, J2 a second fixed pivot at distance `spacing`. The first link turns J3 about J1 by theta1 = alpha, the
rocker J4 about J2 by theta2 = beta, the other way round; the second link, the probe, begins at J3 and slides through
J4. At (pi, 0) both point away from the tip: parked. The slider is the length from J3 to J4; where it leaves its range
is the zone of avoidance. Source: Sabater2018, section 2 (the direction itself in place of the printed root).

What moves by how much needs the slider bounded away from zero over the whole motion; the derivation is in
``design/four-bar.md``. With r the vector from J3 to J4, s its length, V >= |r'| and A >= |r''| over the motion, the
probe turns by psi' = (r x r') / s^2, so that |psi'| <= V / s, and a point at p from J3 has

    |psi'' perp(p) - psi'^2 p| <= |p| (A / s + (2 / sqrt 3) V^2 / s^2),

the last term being the largest of b sqrt(4 a^2 + b^2) over a^2 + b^2 = V^2, where a = s' and b = s psi'.
"""

import numpy as np

from fiberplan.kernels.arms import acceleration, frame
from fiberplan.kernels.compile import inlined, leaf
from fiberplan.tolerances import ZONE

SINGULAR = 1.0  # [mm] of slider, below which the probe's direction is too ill-conditioned to bound anything
_BENT = 2.0 / np.sqrt(3.0)
_FINEST = 2.0**-40  # of a step: a slider not shown in range over so short a part of it counts as out of range


@inlined
def slide(arms, i, frame_, va, vb):
    """Vector r from J3 to J4 of a four-bar arm, r' and r'' at joint speeds va, vb: (rx, ry, ux, uy, ax, ay)."""
    bx, by, ex, ey, _, _, _, _, jx, jy, c3, s3 = frame_
    arm = arms.arm[i]
    length = arms.bar[arm.bar].length
    px, py = length * c3, length * s3  # J2 to J4, which turns by -vb
    qx, qy = ex - bx, ey - by  # J1 to J3, which turns by va
    rx, ry = jx + px - ex, jy + py - ey
    ux, uy = vb * py + va * qy, -vb * px - va * qx
    ax, ay = va * va * qx - vb * vb * px, va * va * qy - vb * vb * py
    return rx, ry, ux, uy, ax, ay


@leaf
def _lean(arms, i, frame_, va, vb):
    """How fast the probe of a four-bar arm turns [rad/s]."""
    rx, ry, ux, uy, _, _ = slide(arms, i, frame_, va, vb)
    return (rx * uy - ry * ux) / (rx * rx + ry * ry)


@inlined
def rates(arms, i, frame_, va, vb):
    """How fast the three links of arm i turn now, at joint speeds va, vb [rad/s]."""
    second = va + vb
    if arms.arm[i].bar >= 0:
        second = _lean(arms, i, frame_, va, vb)
    return va, second, -vb


@leaf
def _bar_acceleration(arms, i, frame_, va, vb, h):
    """`largest_acceleration` of a four-bar arm."""
    if va == 0.0 and vb == 0.0:
        return 0.0
    arm = arms.arm[i]
    bar = arms.bar[arm.bar]
    rx, ry, ux, uy, ax, ay = slide(arms, i, frame_, va, vb)
    wa, wb = abs(va), abs(vb)
    swing, rock = arm.length * wa * wa, bar.length * wb * wb
    bent = min(swing + rock, np.sqrt(ax * ax + ay * ay) + h * (swing * wa + rock * wb))
    speed = min(arm.length * wa + bar.length * wb, np.sqrt(ux * ux + uy * uy) + h * bent)
    shortest = np.sqrt(rx * rx + ry * ry) - h * speed
    if not (shortest >= SINGULAR):
        return np.inf
    lean = speed / shortest
    probe = swing + arm.reach_beta * (bent / shortest + _BENT * lean * lean)
    return max(probe, max(arm.reach_alpha * wa * wa, bar.reach * wb * wb))


@inlined
def largest_acceleration(arms, i, frame_, va, vb, h):
    """Bound on the acceleration of any body point of arm i within +-h [s] of now, at constant joint speeds [mm/s^2].

    Infinite where a four-bar arm may come within `SINGULAR` of its singular configuration.
    """
    if arms.arm[i].bar >= 0:
        return _bar_acceleration(arms, i, frame_, va, vb, h)
    return acceleration(arms, i, va, vb)


@leaf
def slider(arms, i, alpha, beta):
    """Length from J3 to J4 of arm i [mm]; inf for two links, NaN if an angle is."""
    if arms.arm[i].bar < 0:
        return np.inf
    rx, ry, _, _, _, _ = slide(arms, i, frame(arms, i, alpha, beta), 0.0, 0.0)
    return np.sqrt(rx * rx + ry * ry)


@leaf
def leaves_range(arms, i, alpha, beta, d_alpha, d_beta):
    """Whether arm i enters its zone of avoidance while its joints turn by so much, evenly.

    Returns:
        (part of the step, 0 to 1, from which the slider could not be shown to stay in range, its length there [mm]);
        the part is NaN where it stays, within `ZONE`. With C = d12^2 + d13^2 + d24^2 and t the joint angles,

            s^2 = C - 2 d12 d24 cos t2 - 2 d12 d13 cos t1 + 2 d13 d24 cos(t1 + t2),

        whose second derivative in the step is bounded whatever the angles, and nothing is divided by.
    """
    arm = arms.arm[i]
    if arm.bar < 0:
        return np.nan, np.inf
    bar = arms.bar[arm.bar]
    both = d_alpha + d_beta
    bend = bar.spacing * (bar.length * d_beta * d_beta + arm.length * d_alpha * d_alpha)
    bend = 2.0 * (bend + arm.length * bar.length * both * both)
    low, high = max(bar.shortest - ZONE, 0.0), bar.longest + ZONE
    low, high = low * low, high * high
    done, length = 0.0, 1.0
    while done < 1.0:
        until = min(done + length, 1.0)
        h = 0.5 * (until - done)
        at = done + h
        rx, ry, ux, uy, _, _ = slide(arms, i, frame(arms, i, alpha + at * d_alpha, beta + at * d_beta), d_alpha, d_beta)
        square = rx * rx + ry * ry
        change = 2.0 * abs(rx * ux + ry * uy) * h + 0.5 * bend * h * h
        if square - change >= low and square + change <= high:
            done = until
            length *= 2.0
        elif length < _FINEST:
            return at, np.sqrt(square)
        else:
            length *= 0.5
    return np.nan, np.inf
