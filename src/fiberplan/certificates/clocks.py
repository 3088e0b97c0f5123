"""Pairs whose clocks may be off: their clearance at all pairs of moments that are near enough to each other.

If each clock is off by up to tau, arm i may be where it should be at c + d while arm j is where it should be at c - d,
for any moment c and any |d| <= tau. Boxes of (c, d) are bisected: within one, each arm goes no farther than its motion
bound says. The bound of `bisection`, speeds times tau, counts every speed as one towards each other; so what it cannot
show is looked into here, where it does not matter how fast two come apart, or how fast they go side by side.
"""

import numpy as np

from fiberplan.certificates.bisection import more_looks
from fiberplan.certificates.path import state
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.tolerances import ROUNDING

_DEPTH = 256  # of the stack of boxes still to look at
_RESOLVED = 2.5 * ROUNDING  # [mm] a bound this close to what was seen gets no better: the box is not split
_ULP = 2.0**-50  # relative rounding of a moment, generously


@leaf
def travel(path, i, low, middle, high):
    """No farther than this arm i gets from where it is in the middle of a stretch of its motion [mm]."""
    pad = _ULP * (abs(low) + abs(high))
    _, _, _, _, begin = state(path, i, low - pad)
    _, _, _, _, here = state(path, i, middle)
    _, _, _, _, end = state(path, i, high + pad)
    return max(here - begin, end - here)


@leaf
def box_bound(arms, path, i, j, c0, c1, d0, d1, error):
    """Look at a pair once, in the middle of a box of (c, d).

    Returns:
        (clearance there, its lower bound over all of the box) [mm], both less `error`.
    """
    c, d = 0.5 * (c0 + c1), 0.5 * (d0 + d1)
    a_i, b_i, _, _, _ = state(path, i, c + d)
    a_j, b_j, _, _, _ = state(path, j, c - d)
    now = frames_clearance(arms, i, frame(arms, i, a_i, b_i), j, frame(arms, j, a_j, b_j)) - error
    used = travel(path, i, c0 + d0, c + d, c1 + d1) + travel(path, j, c0 - d1, c - d, c1 - d0)
    return now, (now - used - ROUNDING if used < np.inf else -np.inf)


@leaf
def _closest(arms, path, i, j, margin, jitter, error, tolerance, cap, looks, boxes):
    """(lower, upper): bounds of the smallest clearance of a pair after so many looks, as `bisection.closest`."""
    boxes[0, 0], boxes[0, 1], boxes[0, 2], boxes[0, 3] = -jitter, path.duration + jitter, -jitter, jitter
    lower, upper, depth = np.inf, np.inf, 1
    for _ in range(looks):
        if depth == 0:
            return lower, upper
        depth -= 1
        c0, c1, d0, d1 = boxes[depth, 0], boxes[depth, 1], boxes[depth, 2], boxes[depth, 3]
        now, bound = box_bound(arms, path, i, j, c0, c1, d0, d1, error)
        if np.isnan(now):
            return -np.inf, now
        upper = min(upper, now)
        wanted = min(cap, upper - tolerance)
        if upper > margin:
            wanted = max(wanted, min(margin, upper))
        if bound >= wanted or now - bound <= _RESOLVED:
            lower = min(lower, bound)
            continue
        c, d = 0.5 * (c0 + c1), 0.5 * (d0 + d1)
        late = c1 - c0 > d1 - d0  # split the longer side
        if depth + 2 > len(boxes) or not ((late and c0 < c < c1) or (not late and d0 < d < d1)):
            return -np.inf, upper
        boxes[depth, 0], boxes[depth, 1] = (c if late else c0), c1
        boxes[depth, 2], boxes[depth, 3] = (d0 if late else d), d1
        boxes[depth + 1, 0], boxes[depth + 1, 1] = c0, (c if late else c1)
        boxes[depth + 1, 2], boxes[depth + 1, 3] = d0, (d1 if late else d)
        depth += 2
    return -np.inf, upper


@kernel
def judge_clocks(arms, path, pairs, errors, margin, jitter, tolerance, cap):
    """Per pair of arms whose clocks are off by up to `jitter` [s]: proven lower bound of its clearance, smallest seen.

    Both are less the two position errors; the bound is -inf where that took too long, or past a zone of avoidance.

    Returns:
        (m, 2) [mm].
    """
    out = np.empty((len(pairs), 2))
    boxes = np.empty((_DEPTH, 4))
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        error = errors[i] + errors[j]
        looks = more_looks(path, i, j)
        out[k, 0], out[k, 1] = _closest(arms, path, i, j, margin, jitter, error, tolerance, cap, looks, boxes)
    return out


@kernel
def at_any_moments(arms, path, pairs, errors, margin, looks):
    """(m,) whether each pair is shown to keep a margin [mm] with each of the two at any moment of its motion.

    As `keeping.keeps`, with clocks that are off by all the time there is; what takes more than so many `looks` at boxes
    of moments counts as not shown.
    """
    out = np.empty(len(pairs), np.bool_)
    boxes = np.empty((_DEPTH, 4))
    half = 0.5 * path.duration
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        error = errors[i] + errors[j]
        low, _ = _closest(arms, path, i, j, margin, half, error, np.inf, margin, looks, boxes)
        out[k] = low >= margin
    return out
