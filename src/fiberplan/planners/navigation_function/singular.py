"""Singular poses: with the second arm fully stretched or bent back, the fiber can't move along the arm.

Descent through the transposed Jacobian then stands still although the fiber is away from its target, and close by it
crawls. A nudge of the second joint leaves such a pose; its side is drawn once per positioner, from the planner's seed.
"""

import numpy as np

from fiberplan.kernels.compile import inlined


def nudge_sides(n: int, seed: int) -> np.ndarray:
    """(n,) which way each positioner leaves a singular pose: +1 or -1."""
    return np.where(np.random.default_rng([seed, 0x5109]).random(n) < 0.5, -1.0, 1.0)


@inlined
def nudged(d_alpha, d_beta, beta, lower, upper, side, most, least):
    """The step, with the second joint turned by `most` where it would turn both joints by less than `least` [rad].

    Call it only for a fiber that is away from its target with nothing that repels it. The nudge goes to `side` unless
    the joint's range ends there.
    """
    if abs(d_alpha) >= least or abs(d_beta) >= least:
        return d_alpha, d_beta
    way = side * most
    if not (lower <= beta + way <= upper):
        way = -way
    return d_alpha, min(max(beta + way, lower), upper) - beta
