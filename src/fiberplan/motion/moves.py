"""A motion as a list of moves, hardware-neutral: when each begins, how long it takes, how fast the joints turn.

The content of Sabater2018's Table 2. Every move after an arm's first costs one start-stop, whether the arm waited in
between, turned back or changed direction: from standing still a first start is free.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.motion.trajectory import Trajectory

_SAME = 1e-9  # relative difference of joint speeds that rounding makes
_STILL = 1e-12  # [rad/s]


class Move(NamedTuple):
    """An even motion of one positioner."""

    positioner: int
    segment: int  #: counted from 1
    start: float  #: [s]
    duration: float  #: [s]
    speed: tuple[float, float]  #: of both joints [rad/s]


def moves(trajectory: Trajectory) -> list[Move]:
    """All moves, positioner by positioner and by time; rests are what lies between."""
    found: list[Move] = []
    for i in range(trajectory.n):
        times, angles = trajectory.knots(i)
        speeds = np.diff(angles, axis=0) / np.diff(times)[:, None]
        segment, moving = 0, False
        for k, speed in enumerate(speeds):
            if not np.any(np.abs(speed) > _STILL):
                moving = False
                continue
            last = found[-1] if moving else None
            if last is not None and np.allclose(speed, last.speed, rtol=_SAME, atol=_STILL):
                found[-1] = last._replace(duration=float(times[k + 1]) - last.start)
                continue
            segment, moving = segment + 1, True
            span = float(times[k + 1] - times[k])
            found.append(Move(i, segment, float(times[k]), span, (float(speed[0]), float(speed[1]))))
    return found


def start_stops(trajectory: Trajectory) -> np.ndarray:
    """(n,) start-stops of each positioner by Sabater2018's rule: its moves but the first."""
    counts = np.bincount([move.positioner for move in moves(trajectory)], minlength=trajectory.n)
    return np.maximum(counts - 1, 0)
