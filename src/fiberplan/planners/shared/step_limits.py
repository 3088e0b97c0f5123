"""Speed and range limits of a step: both joints are scaled together, which keeps the direction of descent.

Makarem2014 tunes the weights instead; with its own weights in mm the field asks for some 70 rad/s of joints that make
3. Clipping each joint by itself would turn the descent.
"""

from fiberplan.kernels.compile import inlined


@inlined
def limited(d_alpha, d_beta, most_alpha, most_beta):
    """The step scaled, both joints alike, so that neither turns more than its most [rad]."""
    excess = max(abs(d_alpha) / most_alpha, abs(d_beta) / most_beta)
    if excess > 1.0:
        return d_alpha / excess, d_beta / excess
    return d_alpha, d_beta


@inlined
def within(angle, d, lower, upper):
    """A turn cut off at the joint's range [rad]."""
    return min(max(angle + d, lower), upper) - angle


@inlined
def straight(alpha, beta, to_alpha, to_beta, most_alpha, most_beta):
    """The step straight towards a configuration, both joints arriving together; the whole way if it is that near."""
    return limited(to_alpha - alpha, to_beta - beta, most_alpha, most_beta)
