"""Whether two arms stay clear of each other wherever in their boxes of joint space they are."""

import numpy as np

from fiberplan.kernels.arms import motion
from fiberplan.kernels.clearance import clearance
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.tolerances import ROUNDING

_DEPTH = 128  # of the stack of boxes still to look at
_MOST = 20_000  # boxes looked at per pair; a pair that needs more is not shown to be clear


@leaf
def _clear(arms, i, j, margin, stack):
    """Whether arms i and j, in `stack[0]` (2, 2, 2) (arm, joint, low and high), are shown to keep the margin."""
    depth = 1
    for _ in range(_MOST):
        if depth == 0:
            return True
        depth -= 1
        box = stack[depth]
        ai, bi = 0.5 * (box[0, 0, 0] + box[0, 0, 1]), 0.5 * (box[0, 1, 0] + box[0, 1, 1])
        aj, bj = 0.5 * (box[1, 0, 0] + box[1, 0, 1]), 0.5 * (box[1, 1, 0] + box[1, 1, 1])
        now = clearance(arms, i, ai, bi, j, aj, bj)
        if not (now >= margin):
            return False
        widest, most, within = 0, 0.0, 0.0
        for arm in range(2):
            for joint in range(2):
                half = 0.5 * (box[arm, joint, 1] - box[arm, joint, 0])
                moved = motion(arms, i if arm == 0 else j, half if joint == 0 else 0.0, half if joint == 1 else 0.0)
                within += moved
                if moved > most:
                    widest, most = 2 * arm + joint, moved
        if now - within - ROUNDING >= margin:
            continue
        if depth + 2 > len(stack):
            return False
        arm, joint = widest // 2, widest % 2
        middle = 0.5 * (box[arm, joint, 0] + box[arm, joint, 1])
        if not (box[arm, joint, 0] < middle < box[arm, joint, 1]):
            return False
        for a in range(2):
            for b in range(2):
                stack[depth + 1, a, b, 0], stack[depth + 1, a, b, 1] = box[a, b, 0], box[a, b, 1]
        stack[depth, arm, joint, 0] = middle
        stack[depth + 1, arm, joint, 1] = middle
        depth += 2
    return False


@kernel
def clear_boxes(arms, pairs, boxes, second, margin):
    """Which pairs of two-link arms are shown to keep the margin wherever in their boxes they are.

    Args:
        arms: the array, obstacles included.
        pairs: (m, 2) arms.
        boxes: (2 arms, 2, 2) of each arm as first of a pair, per joint from and to [rad], then of each as second.
        second: row of the first of the latter.
        margin: [mm].

    Returns:
        (m,)
    """
    out = np.empty(len(pairs), np.bool_)
    stack = np.empty((_DEPTH, 2, 2, 2))
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        for joint in range(2):
            for end in range(2):
                stack[0, 0, joint, end] = boxes[i, joint, end]
                stack[0, 1, joint, end] = boxes[second + j, joint, end]
        out[k] = _clear(arms, i, j, margin, stack)
    return out
