"""The speed levels of a joint: whole multiples of one speed, so that the joint's places form a lattice.

In every tick a joint turns by k units, k from -K to K with K = 2^(bits - 1) - 1 (one code is left over). The unit is
top speed x tick / K, scaled a little, once per joint and motion, so that start and goal both lie on the lattice: then
the motion ends exactly at its goal, not within half a unit of it.
"""

import numpy as np

_LEAST_TOP = 0.93  # part of the top speed that a joint must keep to be scaled
_MOST_UNITS = 6  # more units than fit exactly that are tried


def top_level(bits: int) -> int:
    """The largest level that `bits` bits can tell."""
    return 2 ** (bits - 1) - 1


def units(turn: np.ndarray, speed: np.ndarray, tick: float, bits: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit (n, 2) [rad] and highest level in use (n, 2) of joints that turn by `turn` [rad] in all at `speed` [rad/s].

    The scale of least loss of top speed is taken; where each would lose more than 7 %, none is, and the joint
    ends up to half a unit off.
    """
    most = top_level(bits)
    whole = speed * tick / most
    fit = np.abs(turn) / whole
    unit, top = whole.copy(), np.full(turn.shape, most)
    best = np.where(fit < 1e-9, np.inf, 0.0)  # a joint that ends where it begins needs no scale
    for extra in range(-_MOST_UNITS, 3):
        count = np.ceil(fit - 1e-9) + extra
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = np.where(count > 0, fit / count, np.nan)
            levels = np.minimum(np.floor(most / scale + 1e-9), most)
            kept = levels * scale / most
        better = (kept >= _LEAST_TOP) & (kept > best + 1e-12) & (levels >= 1)
        unit, top, best = (
            np.where(better, whole * scale, unit),
            np.where(better, levels, top),
            np.where(better, kept, best),
        )
    return unit, top.astype(np.int64)
