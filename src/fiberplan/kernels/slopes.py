"""How signed clearances change as joints turn: by central differences, for steps small against the arms."""

import numpy as np

from fiberplan.kernels.compile import kernel
from fiberplan.kernels.depth import signed_clearance

_STEP = 1e-5  # [rad]


@kernel
def clearance_slopes(arms, angles, pairs):
    """Signed clearance of pairs of arms, and its slopes in their four joints.

    Args:
        arms: the array.
        angles: (arms, 2) where everyone is [rad].
        pairs: (m, 2) arms.

    Returns:
        (m, 5): clearance [mm], then its slope in alpha and beta of the first and of the second arm [mm/rad].
    """
    out = np.zeros((len(pairs), 5))
    q = np.empty(4)
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        q[0], q[1], q[2], q[3] = angles[i, 0], angles[i, 1], angles[j, 0], angles[j, 1]
        out[k, 0] = signed_clearance(arms, i, q[0], q[1], j, q[2], q[3])
        for d in range(4):
            at = q[d]
            q[d] = at + _STEP
            more = signed_clearance(arms, i, q[0], q[1], j, q[2], q[3])
            q[d] = at - _STEP
            less = signed_clearance(arms, i, q[0], q[1], j, q[2], q[3])
            q[d] = at
            out[k, 1 + d] = (more - less) / (2.0 * _STEP)
    return out
