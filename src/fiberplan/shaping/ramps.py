"""Corners of a motion rounded by ramps of bounded acceleration.

A joint that changes its speed by dv at a knot is given a window T about that knot in which the speed changes evenly.
With T = dv / a the acceleration is a, and the joint is never farther than dv T / 8 from where it was. Windows lie in
the middle of their knots, so arms keep step with each other, and the whole motion comes half of the widest window
later. Where windows overlap, their accelerations add up; where that is too much, these windows are opened to the
widest. If all are equal, the motion is the average of the given one over that window: its speeds are no larger, and its
accelerations are at most the largest change of speed within the window by its length.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.shaping.knots import APART, angles_at, first_of_each
from fiberplan.tolerances import RANGE, SAME_SPEED, SPEED, UNDER_LIMIT

_TRIES = 24  # at opening windows; the last one opens all to twice the top speed over the acceleration
_WIDER = 1.2  # the widest window is opened by this factor where it is too narrow


class Ramps(NamedTuple):
    """A motion of bounded acceleration, in straight pieces between points of the true motion."""

    trajectory: Trajectory
    error: np.ndarray  #: (n, 2) largest distance of the true motion from the straight pieces [rad]
    delay: float  #: of all that happens, half of what the motion takes longer [s]


class _Corners(NamedTuple):
    """Changes of speed, positioner by positioner and by time."""

    owner: np.ndarray  # (c,)
    time: np.ndarray  # (c,) [s]
    change: np.ndarray  # (c, 2) of speed [rad/s]
    window: np.ndarray  # (c,) in which it happens [s]


class _Pieces(NamedTuple):
    """Stretches between knots."""

    owner: np.ndarray  # (k,)
    begin: np.ndarray  # (k,) [s]
    end: np.ndarray  # (k,) [s]


def ramped(trajectory: Trajectory, plane: FocalPlane, allowance: np.ndarray) -> Ramps:
    """The motion with corners rounded as the plane's `max_acceleration` asks for.

    Args:
        trajectory: a motion within the joints' speeds.
        plane: whose motors move.
        allowance: (n,) what a straight piece may leave out of a ramp [rad].
    """
    most = plane.limit("max_acceleration") * UNDER_LIMIT
    corners = _corners(trajectory, plane, most)
    narrow, widest = corners.window, float(corners.window.max(initial=0.0))
    wide = np.zeros(len(narrow), bool)
    bound = 2.0 * float((plane.max_speed / most).max())
    doubtful = np.ones(plane.n, bool)
    for turn in range(_TRIES):
        if turn == _TRIES - 1:
            wide[:], widest = True, bound
        corners = corners._replace(window=np.where(wide, widest, narrow))
        some = _Corners(*(part[doubtful[corners.owner]] for part in corners))
        pieces = _pieces(some)
        bad = _breaks_a_limit(trajectory, plane, most, some, pieces, widest)
        if not bad.any():
            break
        around = _around(corners, _Pieces(*(part[bad] for part in pieces)), widest)
        doubtful = np.zeros(plane.n, bool)
        doubtful[pieces.owner[bad]] = True
        if wide[around].all():
            widest = min(bound, _WIDER * widest)
            doubtful[corners.owner[wide]] = True
        wide[around] = True
    pieces = _cut(trajectory, plane, corners, _pieces(corners), widest)
    return _chopped(trajectory, plane, corners, pieces, widest, allowance)


def _corners(trajectory: Trajectory, plane: FocalPlane, most: np.ndarray) -> _Corners:
    """Knots at which a joint changes its speed, and how long that takes."""
    owner, times = trajectory.owner, trajectory.times
    same = owner[1:] == owner[:-1]
    speed = np.zeros((len(times) + 1, 2))  # row k: up to knot k
    speed[1:-1][same] = np.diff(trajectory.angles, axis=0)[same] / np.diff(times)[same, None]
    change = np.diff(speed, axis=0)
    kept = (np.abs(change) > SAME_SPEED * plane.max_speed[owner]).any(axis=1)
    owner, times, change = owner[kept], times[kept], change[kept]
    return _Corners(owner, times, change, (np.abs(change) / most[owner]).max(axis=1, initial=0.0))


def _pieces(corners: _Corners) -> _Pieces:
    """What lies between the ends of windows, positioner by positioner: there accelerations are even."""
    half = 0.5 * corners.window
    owner, times = np.tile(corners.owner, 2), np.concatenate([corners.time - half, corners.time + half])
    order = np.lexsort((times, owner))
    return _between(owner[order], times[order])


def _between(owner: np.ndarray, times: np.ndarray) -> _Pieces:
    """What lies between knots, sorted by owner and time."""
    kept = first_of_each(owner, times)
    owner, times = owner[kept], times[kept]
    same = owner[1:] == owner[:-1]
    return _Pieces(owner[:-1][same], times[:-1][same], times[1:][same])


def _cut(trajectory: Trajectory, plane: FocalPlane, corners: _Corners, pieces: _Pieces, widest: float) -> _Pieces:
    """The pieces, cut where a joint comes to its least speed or turns round, so that all of a piece is slow or none."""
    if plane.min_speed is None:
        return pieces
    owner, begin, end = pieces
    left, _ = _motion(trajectory, corners, owner, begin, widest)
    right, _ = _motion(trajectory, corners, owner, end, widest)
    _, acceleration = _motion(trajectory, corners, owner, 0.5 * (begin + end), widest)
    span = (end - begin)[:, None]
    first = (right - left) / span - 0.5 * acceleration * span
    owners, times = [owner, owner], [begin, end]
    for part in (-1.0, 0.0, 1.0):
        with np.errstate(divide="ignore", invalid="ignore"):
            after = (part * plane.min_speed[owner] - first) / acceleration
        row, joint = np.nonzero((after > APART) & (after < span - APART))
        owners.append(owner[row])
        times.append(begin[row] + after[row, joint])
    owner, at = np.concatenate(owners), np.concatenate(times)
    order = np.lexsort((at, owner))
    return _between(owner[order], at[order])


def _breaks_a_limit(
    trajectory: Trajectory, plane: FocalPlane, most: np.ndarray, corners: _Corners, pieces: _Pieces, widest: float
) -> np.ndarray:
    """(k,) which of the pieces are too sudden, too fast, or leave the range (in which a start need not be)."""
    owner, begin, end = pieces
    left, _ = _motion(trajectory, corners, owner, begin, widest)
    right, _ = _motion(trajectory, corners, owner, end, widest)
    _, acceleration = _motion(trajectory, corners, owner, 0.5 * (begin + end), widest)
    span = (end - begin)[:, None]
    fastest = np.abs(right - left) / span
    low, high = np.minimum(plane.lower, trajectory.start)[owner], np.maximum(plane.upper, trajectory.start)[owner]
    bad = np.abs(acceleration) > most[owner] * (1.0 + SPEED)
    bad |= fastest > plane.max_speed[owner] * (1.0 + 0.5 * SPEED)
    bad |= (right < low - RANGE) | (right > high + RANGE)
    return bad.any(axis=1)


def _chopped(
    trajectory: Trajectory,
    plane: FocalPlane,
    corners: _Corners,
    pieces: _Pieces,
    widest: float,
    allowance: np.ndarray,
) -> Ramps:
    """Straight pieces, short enough: a ramp of acceleration a leaves its chord of h seconds by a h^2 / 8."""
    owner, begin, end = pieces
    _, acceleration = _motion(trajectory, corners, owner, 0.5 * (begin + end), widest)
    steep = np.abs(acceleration)
    error = steep.max(axis=1, initial=0.0) * (end - begin) ** 2 / 8.0
    count = np.maximum(1, np.ceil(np.sqrt(error / allowance[owner]) - 1e-9)).astype(np.int64)
    which = np.repeat(np.arange(len(owner)), count)
    part = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    times = begin[which] + (end - begin)[which] * (part / count[which])
    last = np.append(owner[1:] != owner[:-1], True)[: len(owner)]
    rest = np.setdiff1d(np.arange(plane.n), owner)
    owners = np.concatenate([owner[which], owner[last], rest])
    times = np.concatenate([times, end[last], np.full(len(rest), -0.5 * widest)])
    angles, _ = _motion(trajectory, corners, owners, times, widest)
    left_out = np.zeros((plane.n, 2))
    np.maximum.at(left_out, owner, steep * ((end - begin) / count)[:, None] ** 2 / 8.0)
    delay = 0.5 * widest
    return Ramps(Trajectory.from_knots(owners, np.maximum(times + delay, 0.0), angles, plane.n), left_out, delay)


def _near(corners: _Corners, owner: np.ndarray, times: np.ndarray, widest: float) -> tuple[np.ndarray, np.ndarray]:
    """First and last + 1 of the corners of each `owner` whose windows could hold its time."""
    span = float(corners.time.max(initial=0.0)) + 4.0 * widest + 1.0
    key = corners.owner * span + corners.time
    reach = 0.5 * widest + 2.0 * APART
    return np.searchsorted(key, owner * span + times - reach), np.searchsorted(key, owner * span + times + reach)


def _around(corners: _Corners, pieces: _Pieces, widest: float) -> np.ndarray:
    """The corners that the widest window about the middle of any of the pieces would hold."""
    first, stop = _near(corners, pieces.owner, 0.5 * (pieces.begin + pieces.end), widest)
    count = stop - first
    return np.unique(np.arange(count.sum()) + np.repeat(first - (np.cumsum(count) - count), count))


def _motion(
    trajectory: Trajectory, corners: _Corners, owner: np.ndarray, times: np.ndarray, widest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Angles and accelerations (m, 2) of each `owner` (m,) at `times` (m,), the delay left out."""
    angles = angles_at(trajectory, owner, times)
    acceleration = np.zeros(angles.shape)
    first, stop = _near(corners, owner, times, widest)
    for k in range(int((stop - first).max(initial=0))):
        there = np.flatnonzero(first + k < stop)
        at = first[there] + k
        window = corners.window[at]
        rest = 0.5 * window - np.abs(times[there] - corners.time[at])
        inside = rest > 0
        there, at, window, rest = there[inside], at[inside], window[inside], rest[inside]
        angles[there] += corners.change[at] * (0.5 * rest**2 / window)[:, None]
        acceleration[there] += corners.change[at] / window[:, None]
    return angles, acceleration
