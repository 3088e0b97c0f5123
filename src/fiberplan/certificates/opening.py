"""A pair that begins nearer than the margin may only come apart.

It keeps the clearance that it begins with until it has the margin, and from then on the margin holds.

Clearance is signed here (`fiberplan.kernels.depth`), so that arms which overlap can be shown to come apart. The
intervals of a motion are taken in the order of time. One is accepted if the margin holds in it, or, before that has
happened for the first time, if the clearance of the beginning does and the pair is shown to stay below the margin (by
`OPENING`, which rounding takes, it may exceed it): else it could have the margin for a moment within the interval and
lose it again.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.certificates.bisection import more_looks, too_short
from fiberplan.certificates.path import knot_near_middle, state, top_speed
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import meet
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.kernels.depth import signed_clearance, signed_gap
from fiberplan.kernels.even_motion import least_gap_along
from fiberplan.kernels.four_bar import largest_acceleration, rates
from fiberplan.tolerances import OPENING, ROUNDING

_DEPTH = 256  # of the stack of intervals still to evaluate


class Opening(NamedTuple):
    """Two that begin nearer than the margin and only come apart."""

    pair: tuple[int, int]  #: positioners; -1 - k is obstacle k
    clearance: float  #: at the start [mm]; negative: overlap
    time: float  #: from which the margin holds [s]; inf: never, and then they never come nearer


@leaf
def _signed_bound(arms, i, frame_i, va_i, vb_i, j, frame_j, va_j, vb_j, h):
    """Signed clearance now, and a lower bound of it within +-h [s] of now at constant joint speeds [mm]."""
    bend = largest_acceleration(arms, i, frame_i, va_i, vb_i, h) + largest_acceleration(arms, j, frame_j, va_j, vb_j, h)
    bend *= 0.5 * h * h
    rates_i, rates_j = rates(arms, i, frame_i, va_i, vb_i), rates(arms, j, frame_j, va_j, vb_j)
    now, bound = np.inf, np.inf
    for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
        for q in range(arms.arm[j].first_piece, arms.arm[j].last_piece):
            if not meet(arms, p, q):
                continue
            gap, nx, ny = signed_gap(arms, frame_i, p, frame_j, q)
            radii = arms.piece[p].radius + arms.piece[q].radius
            if np.isnan(gap):
                return gap, -np.inf
            now = min(now, gap - radii)
            gap = least_gap_along(arms, frame_i, rates_i, p, frame_j, rates_j, q, nx, ny, h)
            bound = min(bound, gap - bend - radii)
    return now, bound - ROUNDING


@leaf
def _pad(path, i, j, t0, t1, jitter, error):
    """What position errors and clock jitter can take from a pair's clearance in [t0, t1] [mm]."""
    if jitter > 0.0:
        error += jitter * (top_speed(path, i, t0 - jitter, t1 + jitter) + top_speed(path, j, t0 - jitter, t1 + jitter))
    return error


@leaf
def _signed_interval(arms, path, i, j, t0, t1, jitter, error):
    """As `bisection.interval_bound`, of the signed clearance; last an upper bound of it over all of [t0, t1] [mm]."""
    t = 0.5 * (t0 + t1)
    if t >= t1:
        t = t0
    knot_i, knot_j = knot_near_middle(path, i, t0, t1, t), knot_near_middle(path, j, t0, t1, t)
    smooth = np.isnan(knot_i) and np.isnan(knot_j)
    if not smooth:
        t = knot_i if not (abs(knot_j - t) <= abs(knot_i - t)) and not np.isnan(knot_i) else knot_j
    a_i, b_i, va_i, vb_i, far_i = state(path, i, t)
    a_j, b_j, va_j, vb_j, far_j = state(path, j, t)
    if smooth:
        frame_i, frame_j = frame(arms, i, a_i, b_i), frame(arms, j, a_j, b_j)
        now, bound = _signed_bound(arms, i, frame_i, va_i, vb_i, j, frame_j, va_j, vb_j, max(t - t0, t1 - t))
    else:
        now, bound = signed_clearance(arms, i, a_i, b_i, j, a_j, b_j), -np.inf
    _, _, _, _, begin_i = state(path, i, t0)
    _, _, _, _, begin_j = state(path, j, t0)
    _, _, _, _, end_i = state(path, i, t1)
    _, _, _, _, end_j = state(path, j, t1)
    moved = max(far_i - begin_i + far_j - begin_j, end_i - far_i + end_j - far_j)
    most = np.inf
    if moved < np.inf:
        bound = max(bound, now - moved - ROUNDING)  # a depth, too, changes no faster than the arms move
        most = now + moved + ROUNDING - _pad(path, i, j, t1, t0, jitter, error)  # what all moments have
    return t, now - _pad(path, i, j, t, t, jitter, error), bound - _pad(path, i, j, t0, t1, jitter, error), most


@leaf
def _opens(arms, path, i, j, margin, jitter, error, starts, ends):
    """Clearance at the start [mm], when the margin is reached [s], and when the rule could not be shown to hold [s]."""
    a_i, b_i, _, _, _ = state(path, i, 0.0)
    a_j, b_j, _, _, _ = state(path, j, 0.0)
    first = signed_clearance(arms, i, a_i, b_i, j, a_j, b_j) - _pad(path, i, j, 0.0, 0.0, jitter, error)
    floor, reached = first - OPENING, np.inf
    if not (first < margin):
        return first, 0.0, 0.0  # nothing to open, or no number
    starts[0], ends[0], depth = 0.0, path.duration, 1
    for _ in range(more_looks(path, i, j)):
        if depth == 0:
            return first, reached, np.nan
        depth -= 1
        t0, t1 = starts[depth], ends[depth]
        t, now, bound, most = _signed_interval(arms, path, i, j, t0, t1, jitter, error)
        if bound >= margin:
            reached = min(reached, t0)
            continue
        before = reached == np.inf
        if not (now >= floor) or (not before and not (now >= margin)):
            return first, reached, t
        holds, short = before and bound >= floor, too_short(t0, t, t1, jitter)
        if holds and (short or most < margin + OPENING):
            continue
        if short or (not holds and now - bound <= 3.0 * ROUNDING):
            return first, reached, t
        if depth + 2 > len(starts):
            return first, reached, t
        starts[depth], ends[depth] = t, t1
        starts[depth + 1], ends[depth + 1] = t0, t
        depth += 2
    return first, reached, path.duration


@kernel
def judge_opening(arms, path, pairs, errors, margin, jitter):
    """For each pair: signed clearance at the start, when it has the margin, when the rule fails (NaN: it holds).

    Returns:
        (m, 3) [mm, s, s].
    """
    out = np.empty((len(pairs), 3))
    starts, ends = np.empty(_DEPTH), np.empty(_DEPTH)
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        error = errors[i] + errors[j]
        out[k, 0], out[k, 1], out[k, 2] = _opens(arms, path, i, j, margin, jitter, error, starts, ends)
    return out
