"""The repulsive term of Makarem2014 (Eq. 2) with its sign mended, and the bound of its Theorem 1.

Printed, the term is min(0, (x^2 - D^2) / (x^2 - d^2)), which falls to minus infinity as the distance x falls to d, so
that its descent attracts. Negated it is max(0, (D^2 - x^2) / (x^2 - d^2)), and with s = q_i - q_j its gradient with
respect to q_i is -2 (D^2 - d^2) s / (x^2 - d^2)^2 inside D. Below d that term has no force but its gradient formula
still repels, so the gradient is what is used.
"""

from fiberplan.kernels.compile import inlined

_NEAREST = 1e-6  # [mm^2] x^2 - d^2 is taken as no smaller than this, so that the force stays finite


@inlined
def push(sx, sy, D, d):
    """Minus the gradient of the repulsive term at a separation (sx, sy) from the neighbour [1/mm]; 0 from D on."""
    x2 = sx * sx + sy * sy
    if not (x2 < D * D):
        return 0.0, 0.0
    gap = max(abs(x2 - d * d), _NEAREST)
    strength = 2.0 * (D * D - d * d) / (gap * gap)
    return strength * sx, strength * sy


def theorem1_bound(D: float, d: float, R: float = 7.0) -> float:
    """Makarem2014, Theorem 1 (Eq. 9): lambda1 / lambda2 below this leaves one neighbour no spurious minimum [1/mm^2].

    The paper's own figures in mm give 0.048, and its simulations use a ratio of 20. The theorem is about one neighbour:
    the pushes of several can cancel.

    Args:
        D: distance at which repulsion begins [mm].
        d: safety distance [mm].
        R: farthest a fiber can be from its goal [mm]; the paper's Table 3 has 7, which we read as reach plus ferrule.
    """
    return D / (D * D - d * d) / R
