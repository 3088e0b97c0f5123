"""What a motor that cannot jump needs: bounded acceleration, and no speed between zero and a least one.

A motor without a limit has infinite acceleration and a least speed of zero. One with a least speed starts and stops at
it at once, and accelerates from there.
"""

import numpy as np


def least_time(turn: np.ndarray, speed: np.ndarray, acceleration: np.ndarray, slowest: np.ndarray) -> np.ndarray:
    """Least time [s] in which a joint turns by `turn` [rad] from rest to rest; all arrays broadcast.

    Without a least speed that is d / v + v / a where the turn d is long enough to reach speed v, else 2 sqrt(d / a).

    Args:
        turn: of either sign; NaN gives NaN.
        speed: largest [rad/s].
        acceleration: largest [rad/s^2]; inf: the joint is at full speed at once.
        slowest: speed at which it starts and stops at once [rad/s]. Turns too short for it take their time at full
            acceleration: they can be had by turning more, and back.
    """
    way = np.abs(turn)
    bounded = np.isfinite(acceleration)
    a = np.where(bounded, acceleration, 1.0)
    cruising = way >= (speed**2 - slowest**2) / a
    ramped = np.where(cruising, way / speed + (speed - slowest) ** 2 / (a * speed), 0.0)
    short = 2.0 * (np.sqrt(a * way + slowest**2) - slowest) / a
    return np.where(bounded, np.where(cruising, ramped, short), way / speed)
