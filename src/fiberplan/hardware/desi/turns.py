"""What a motor makes of its steps: an even turn in creep; at cruise up to its speed, along, and to rest.

Ramps are 33 increments of 12 ticks, here seven straight lines each.
"""

from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np

_REDUCTION = (60 / 14) ** 4  # 46 and 14 teeth, four planetary stages
_TICKS = 18_000.0  # a second
_INCREMENTS, _LENGTH = 33, 12  # of a ramp, and ticks in one
_CUTS = (0, 5, 10, 14, 19, 24, 28, 33)  # increments between which a ramp is taken as straight
_LINEAR_RAMP = 2 * 505.0 / 180_000.0  # [s]


class Turn(NamedTuple):
    """What one axis does in a row."""

    times: np.ndarray  #: (k,) since the row's begin [s]
    angles: np.ndarray  #: (k,) since the row's begin, of the shaft [deg]
    error: float  #: how far off straight lines between them may be [deg]


@lru_cache(4096)  # pieces of a plan become rows that are alike
def axis_turn(steps: int, cruise: bool, linear: bool) -> Turn:
    """The turn of one axis."""
    way = -np.sign(steps) / _REDUCTION  # motors turn the other way than shafts
    count = abs(steps)
    if not count:
        return Turn(np.zeros(1), np.zeros(1), 0.0)
    if linear and cruise:
        return _ramped(count * 10.0, count / 18_000.0, _linear_ramp(), way)
    if cruise:
        return _ramped(count * 3.3, count / _TICKS, _ramp(), way)
    return Turn(np.array([0.0, 2 * count / _TICKS]), np.array([0.0, way * count / 10]), 0.0)


@cache
def _ramp() -> tuple[np.ndarray, np.ndarray, float]:
    """Times [s] and angles [deg of the motor] of a ramp at its cuts, and how far off lines between them are."""
    n = np.array(_CUTS)
    pace = 3.3 * _TICKS / (_INCREMENTS * _LENGTH / _TICKS)  # [deg of the motor / s^2]
    times = n * _LENGTH / _TICKS
    return times, _LENGTH * 0.1 * n * (n + 1) / 2, pace * np.diff(times).max() ** 2 / 8


@cache
def _linear_ramp() -> tuple[np.ndarray, np.ndarray, float]:
    """The same of a linear motor, which gains speed evenly."""
    times = np.linspace(0.0, _LINEAR_RAMP, len(_CUTS))
    pace = 2 * 505.0 / _LINEAR_RAMP**2
    return times, pace * times**2 / 2, pace * times[1] ** 2 / 8


def _ramped(cruise: float, seconds: float, ramp: tuple[np.ndarray, np.ndarray, float], way: float) -> Turn:
    """Up, along at full speed, down: angles of the motor [deg]."""
    times, angles, error = ramp
    later, farther = times[-1] + seconds, angles[-1] + cruise
    down_times, down = later + times[-1] - times[::-1], farther + angles[-1] - angles[::-1]
    keep = 1 if not cruise else 0
    return Turn(
        np.concatenate([times, down_times[keep:]]), way * np.concatenate([angles, down[keep:]]), abs(way) * error
    )


def largest_errors(linear: np.ndarray) -> np.ndarray:
    """(n, 2) how far joints may be off whatever their rows, of positioners of which some are `linear` (n,) [rad]."""
    rotary = axis_turn(1, True, False).error
    phi = np.where(linear, axis_turn(1, True, True).error, rotary)
    return np.radians(np.stack([np.full(len(linear), rotary), phi], axis=1))
