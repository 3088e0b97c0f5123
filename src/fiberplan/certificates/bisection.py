"""Lower bounds of a pair's clearance over time, and the bisection that makes them sharp.

Two bounds, both over a whole interval from one look in it. First order, across any knots: clearance changes by no more
than the arms move. Second order, between knots, where joint speeds are constant: `fiberplan.kernels.even_motion`.
"""

import numpy as np

from fiberplan.certificates.path import knot_near_middle, state, top_speed
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import inlined, kernel, leaf
from fiberplan.kernels.even_motion import constant_speed_bound
from fiberplan.tolerances import ROUNDING

_RESOLVED = 2.5 * ROUNDING  # [mm] a bound this close to what was seen gets no better: the interval is not split
_JUMP = 1e-6  # of the jitter [s]: nor are intervals so short, in which speeds within the jitter may jump
_ULP = 2.0**-52  # relative spacing of floating-point numbers
_DEPTH = 256  # of the stack of intervals still to look at
_MOST_LOOKS = 50_000, 100  # per pair, and per knot of it; a pair that needs more is undecided


@leaf
def interval_bound(arms, path, i, j, t0, t1, jitter, error):
    """Look at a pair once in [t0, t1].

    Returns:
        (the time looked at, effective clearance then, its lower bound over all of [t0, t1]) [s, mm, mm]. Effective
        clearance is the clearance less what clock jitter [s] and the two position errors (their sum `error` [mm]) can
        take away: both speeds, the largest within the jitter of the moment, times the jitter.
    """
    t = 0.5 * (t0 + t1)
    if t >= t1:  # rounded up: what holds from there on says nothing of before
        t = t0
    knot_i, knot_j = knot_near_middle(path, i, t0, t1, t), knot_near_middle(path, j, t0, t1, t)
    smooth = np.isnan(knot_i) and np.isnan(knot_j)
    if not smooth:
        t = knot_i if not (abs(knot_j - t) <= abs(knot_i - t)) and not np.isnan(knot_i) else knot_j
    a_i, b_i, va_i, vb_i, far_i = state(path, i, t)
    a_j, b_j, va_j, vb_j, far_j = state(path, j, t)
    frame_i, frame_j = frame(arms, i, a_i, b_i), frame(arms, j, a_j, b_j)
    if smooth:
        h = max(t - t0, t1 - t)  # the middle is rounded, by much where times are large
        now, bound = constant_speed_bound(arms, i, frame_i, va_i, vb_i, j, frame_j, va_j, vb_j, h)
    else:
        now, bound = frames_clearance(arms, i, frame_i, j, frame_j), -np.inf
    _, _, _, _, begin_i = state(path, i, t0)
    _, _, _, _, begin_j = state(path, j, t0)
    _, _, _, _, end_i = state(path, i, t1)
    _, _, _, _, end_j = state(path, j, t1)
    moved = max(far_i - begin_i + far_j - begin_j, end_i - far_i + end_j - far_j)
    if moved < np.inf:  # past a zone of avoidance it is infinite, or no number
        bound = max(bound, now - moved - ROUNDING)
    pad_now = pad = error
    if jitter > 0.0:
        pad_now += jitter * (top_speed(path, i, t - jitter, t + jitter) + top_speed(path, j, t - jitter, t + jitter))
        if not (pad_now < np.inf):
            pad_now = error  # of an arm in its zone of avoidance nothing is known: neither safe nor in contact
        early, late = t0 - jitter - _ULP * t1, t1 + jitter + _ULP * t1
        pad += jitter * (top_speed(path, i, early, late) + top_speed(path, j, early, late))
    return t, now - pad_now, bound - pad


@inlined
def too_short(t0, t, t1, jitter):
    """Whether [t0, t1] is too short to be split at t."""
    return t1 - t0 <= _JUMP * jitter or not (t0 < t < t1)


@leaf
def more_looks(path, i, j):
    """How often a pair may be looked at: in proportion to its knots, so that a jittery motion is not refused."""
    knots = 0
    for k in (i, j):
        if k < len(path.offsets) - 1:
            knots += path.offsets[k + 1] - path.offsets[k]
    return _MOST_LOOKS[0] + _MOST_LOOKS[1] * knots


@leaf
def closest(arms, path, i, j, margin, jitter, error, tolerance, cap, starts, ends):
    """Bounds of the smallest effective clearance of a pair over the whole motion.

    Returns:
        (lower, upper, time of upper). Lower is proven, upper was seen. They differ by at most `tolerance` [mm], unless
        both exceed `cap` [mm], where no more is asked; near the margin they are pushed apart from it as far as
        rounding lets them. Lower is -inf if that took too long.
    """
    starts[0], ends[0], depth = 0.0, path.duration, 1
    lower, upper, when = np.inf, np.inf, 0.0
    for _ in range(more_looks(path, i, j)):
        if depth == 0:
            return lower, upper, when
        depth -= 1
        t0, t1 = starts[depth], ends[depth]
        t, now, bound = interval_bound(arms, path, i, j, t0, t1, jitter, error)
        if np.isnan(now):
            return -np.inf, now, t
        if now < upper:
            upper, when = now, t
        wanted = min(cap, upper - tolerance)
        if upper > margin:
            wanted = max(wanted, min(margin, upper))
        if bound >= wanted or now - bound <= _RESOLVED or too_short(t0, t, t1, jitter):
            lower = min(lower, bound)
            continue
        if depth + 2 > len(starts):
            return -np.inf, upper, when
        starts[depth], ends[depth] = t, t1
        starts[depth + 1], ends[depth + 1] = t0, t
        depth += 2
    return -np.inf, upper, when


@leaf
def first_crossing(arms, path, i, j, margin, jitter, error, known, starts, ends):
    """Earliest time [s] from which the margin could not be shown to hold, given a time at which it does not."""
    starts[0], ends[0], depth = 0.0, known, 1
    for _ in range(more_looks(path, i, j)):
        if depth == 0:
            return known
        depth -= 1
        t0, t1 = starts[depth], ends[depth]
        t, now, bound = interval_bound(arms, path, i, j, t0, t1, jitter, error)
        if bound >= margin:
            continue
        if not (now >= margin):
            depth, known = 0, t  # nothing later matters
        if too_short(t0, t, t1, jitter) or depth + 2 > len(starts):
            return t0
        if now >= margin:
            starts[depth], ends[depth] = t, t1
            depth += 1
        starts[depth], ends[depth] = t0, t
        depth += 1
    return known


@kernel
def judge(arms, path, pairs, errors, margin, jitter, tolerance, cap):
    """Per pair of arms: proven lower bound of its effective clearance, smallest seen, time of first crossing.

    The time is NaN where the margin is shown to hold.

    Returns:
        (m, 3) [mm, mm, s].
    """
    out = np.empty((len(pairs), 3))
    starts, ends = np.empty(_DEPTH), np.empty(_DEPTH)
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        error = errors[i] + errors[j]
        low, high, when = closest(arms, path, i, j, margin, jitter, error, tolerance, cap, starts, ends)
        out[k, 0], out[k, 1], out[k, 2] = low, high, np.nan
        if not (low >= margin):
            out[k, 2] = first_crossing(arms, path, i, j, margin, jitter, error, when, starts, ends)
    return out
