"""A trajectory as the proof's kernels take it: knots with the motion bound up to each and the speed after it."""

from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.kernels.arms import Arms, motion
from fiberplan.kernels.compile import kernel, leaf, record
from fiberplan.kernels.four_bar import leaves_range
from fiberplan.motion import Trajectory
from fiberplan.tolerances import ROUNDING

KNOT = record(
    [
        ("time", "f8"),  # [s]
        ("alpha", "f8"),  # [rad]
        ("beta", "f8"),
        ("travelled", "f8"),  # motion bound since the first knot [mm]; inf past a zone of avoidance
        ("speed", "f8"),  # largest speed of any body point until the next knot [mm/s]
    ]
)


_UP = 1.0 + 2.0**-51  # rounds a sum of two numbers up: what is added up then never falls short
_TURN = 2.0**-49  # of all angles that are added up: rounding of the angle of a link, generously
_LENGTH = 2.0**-50  # of a coordinate or length: rounding, likewise


class Motion(NamedTuple):
    """A trajectory as the kernels take it."""

    offsets: np.ndarray  # (n + 1,)
    knots: np.ndarray  # (k,) KNOT
    duration: float  # [s]


@leaf
def measure(arms, offsets, knots):
    """Fill in how far each positioner has travelled at each knot, and its speed until the next.

    Both are infinite from where a four-bar arm enters its zone of avoidance, since no bound is known there. One that
    stands in it does not move.
    """
    for i in range(len(offsets) - 1):
        for k in range(offsets[i], offsets[i + 1] - 1):
            here, after = knots[k], knots[k + 1]
            da, db = after.alpha - here.alpha, after.beta - here.beta
            step = motion(arms, i, da, db)
            bent = arms.arm[i].bar >= 0 and (da != 0.0 or db != 0.0)
            if bent and not np.isnan(leaves_range(arms, i, here.alpha, here.beta, da, db)[0]):
                step = np.inf
            after.travelled = (here.travelled + step) * _UP
            here.speed = step / (after.time - here.time)


@kernel
def rounding(arms, offsets, knots):
    """How far off each arm's bodies and motion bounds may be computed, beyond what `ROUNDING` has room for [mm].

    It is zero in any instrument; after a million turns, or thousands of kilometres from the origin, it is not.

    Returns:
        (arms,), obstacles included.
    """
    out = np.zeros(len(arms.arm))
    for i in range(len(out)):
        arm = arms.arm[i]
        alpha = beta = far = size = 0.0
        if i < len(offsets) - 1:
            for k in range(offsets[i], offsets[i + 1]):
                alpha, beta = max(alpha, abs(knots[k].alpha)), max(beta, abs(knots[k].beta))
                if knots[k].travelled < np.inf:
                    far = max(far, knots[k].travelled)
        for p in range(arm.first_piece, arm.last_piece):
            for k in range(arms.piece[p].first, arms.piece[p].last):
                size = max(size, abs(arms.vertices[k, 0]) + abs(arms.vertices[k, 1]))
        turned = _TURN * (alpha + beta + abs(arm.alpha_zero) + abs(arm.beta_zero))
        size += abs(arm.x) + abs(arm.y) + far
        lost = motion(arms, i, turned, turned) + _LENGTH * size
        out[i] = max(0.0, lost - 0.1 * ROUNDING) if lost < np.inf else np.inf
    return out


@kernel
def zone_entries(arms, offsets, knots):
    """When each positioner is first not shown to be outside its zone of avoidance (NaN: never), and its slider then.

    Returns:
        (n, 2) [s, mm].
    """
    n = len(offsets) - 1
    out = np.full((n, 2), np.nan)
    for i in range(n):
        for k in range(offsets[i], offsets[i + 1]):
            here, after = knots[k], knots[min(k + 1, offsets[i + 1] - 1)]
            da, db = after.alpha - here.alpha, after.beta - here.beta
            part, length = leaves_range(arms, i, here.alpha, here.beta, da, db)
            if not np.isnan(part):
                out[i, 0], out[i, 1] = here.time + part * (after.time - here.time), length
                break
    return out


def as_motion(arms: Arms, trajectory: Trajectory) -> Motion:
    """A trajectory of these arms as the kernels take it."""
    knots = np.zeros(len(trajectory.times), KNOT)
    knots["time"], knots["alpha"], knots["beta"] = trajectory.times, *trajectory.angles.T
    measure(arms, trajectory.offsets, knots)
    return Motion(trajectory.offsets, read_only(knots, KNOT), trajectory.duration)


@leaf
def last_knot(path, i, t):
    """Index of the last knot of positioner i at or before t, or its first knot."""
    lo, hi = path.offsets[i], path.offsets[i + 1]
    while hi - lo > 1:
        mid = (lo + hi) // 2
        if path.knots[mid].time <= t:
            lo = mid
        else:
            hi = mid
    return lo


@leaf
def next_knot(path, i, t):
    """Time of the first knot of arm i after t [s]; inf if there is none."""
    if i >= len(path.offsets) - 1:
        return np.inf
    k = last_knot(path, i, t)
    if path.knots[k].time > t:
        return path.knots[k].time
    return path.knots[k + 1].time if k + 1 < path.offsets[i + 1] else np.inf


@leaf
def state(path, i, t):
    """(alpha, beta, their speeds, motion bound so far) of arm i at time t; an obstacle rests at zero."""
    if i >= len(path.offsets) - 1:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    k = last_knot(path, i, t)
    here = path.knots[k]
    if k + 1 == path.offsets[i + 1] or t < here.time:
        return here.alpha, here.beta, 0.0, 0.0, here.travelled
    after = path.knots[k + 1]
    span, dt = after.time - here.time, t - here.time
    va, vb = (after.alpha - here.alpha) / span, (after.beta - here.beta) / span
    far = here.travelled
    if dt > 0.0:  # what follows may be infinite
        far += (after.travelled - far) * (dt / span)
    return here.alpha + va * dt, here.beta + vb * dt, va, vb, far


@leaf
def knot_near_middle(path, i, t0, t1, middle):
    """Knot time of arm i strictly within (t0, t1) that is nearest to the middle, or NaN."""
    if i >= len(path.offsets) - 1:
        return np.nan
    k = last_knot(path, i, middle)
    best = np.nan
    for m in range(k, min(k + 2, path.offsets[i + 1])):
        t = path.knots[m].time
        if t0 < t < t1 and not (abs(t - middle) >= abs(best - middle)):
            best = t
    return best


@leaf
def top_speed(path, i, t0, t1):
    """Largest speed of any body point of arm i between t0 and t1 [mm/s]."""
    if i >= len(path.offsets) - 1:
        return 0.0
    top = 0.0
    for k in range(last_knot(path, i, t0), path.offsets[i + 1]):
        if path.knots[k].time > t1:
            break
        top = max(top, path.knots[k].speed)
    return top
