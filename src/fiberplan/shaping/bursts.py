"""A joint that should turn more slowly than its motor can turns at its least speed for part of the time, and rests.

A stretch of a motion in which a joint turns one way, and slower than that, is cut into cells of the same length. In
each of them the joint turns as far as it should, all at once: in the middle, or where the stretch joins on to a faster
part of the motion, there, so that it need not stop. So it is where it was at the end of each cell, and in between off
by no more than a cell's turn. More cells follow more closely, and start and stop more often.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.shaping.knots import merged
from fiberplan.tolerances import RANGE, SPEED

_SHORTEST = 0.02  # [s] no turn is made of shorter ones than this
_FASTER = 1.0001  # times the least speed: room for knots that come to lie at one time


class _Slow(NamedTuple):
    """Stretches in which one joint turns one way, slower than it can."""

    owner: np.ndarray  # (s,)
    begin: np.ndarray  # (s,) [s]
    span: np.ndarray  # (s,) [s]
    angle: np.ndarray  # (s,) at the beginning [rad]
    turn: np.ndarray  # (s,) [rad]
    after_fast: np.ndarray  # (s,) whether it turns faster the same way just before
    before_fast: np.ndarray  # (s,) and just after


def no_slower(trajectory: Trajectory, plane: FocalPlane, follow: np.ndarray) -> Trajectory:
    """The motion without speeds between zero and the plane's `min_speed`, of the same duration.

    Args:
        trajectory: any motion.
        plane: whose motors move.
        follow: (n,) how far joints may be from where they were, unless turns would get too short [rad].
    """
    if plane.min_speed is None:
        return trajectory
    made = [_one_joint(trajectory, plane, joint, follow) for joint in (0, 1)]
    return merged(made[0], made[1], plane)


def _one_joint(trajectory: Trajectory, plane: FocalPlane, joint: int, follow: np.ndarray) -> Trajectory:
    """The motion with the slow stretches of one joint cut up; the other joint's angles are of no use."""
    least = plane.limit("min_speed")[:, joint]
    slow, inner = _slow(trajectory, joint, least)
    owner, times, angles = _cells(slow, np.minimum(_FASTER * least, plane.max_speed[:, joint]), follow)
    kept = ~inner
    owner, times = np.concatenate([trajectory.owner[kept], owner]), np.concatenate([trajectory.times[kept], times])
    angles = np.concatenate([trajectory.angles[kept, joint], angles])
    return Trajectory.from_knots(owner, times, np.stack([angles, angles], axis=1), plane.n)


def _slow(trajectory: Trajectory, joint: int, least: np.ndarray) -> tuple[_Slow, np.ndarray]:
    """Slow stretches, and (k,) which knots lie within one."""
    owner, times, angles = trajectory.owner, trajectory.times, trajectory.angles[:, joint]
    same = owner[1:] == owner[:-1]
    turn, span = np.where(same, np.diff(angles), 0.0), np.where(same, np.diff(times), 1.0)
    turns = np.abs(turn) > RANGE
    slow = turns & (np.abs(turn) < least[owner[:-1]] * span * (1.0 - SPEED))
    way = np.where(turns, np.sign(turn), 0.0)
    joined = np.zeros(len(owner), bool)  # knot k: pieces k - 1 and k are of one stretch
    joined[1:-1] = slow[1:] & slow[:-1] & same[1:] & same[:-1] & (way[1:] == way[:-1])
    first = np.flatnonzero(slow & ~joined[:-1])
    last = np.flatnonzero(slow & ~joined[1:])
    fast = np.where(slow, 0.0, way)
    before = np.where(first > 0, fast[first - 1], 0.0) * (owner[np.maximum(first - 1, 0)] == owner[first])
    after = np.append(fast, 0.0)[last + 1]
    stretches = _Slow(
        owner[first],
        times[first],
        times[last + 1] - times[first],
        angles[first],
        angles[last + 1] - angles[first],
        before == way[first],
        after == way[first],
    )
    return stretches, joined


def _cells(slow: _Slow, speed: np.ndarray, follow: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Knots where each turn within a stretch begins and ends: owner, time, angle."""
    seconds = np.minimum(np.abs(slow.turn) / speed[slow.owner], slow.span)
    between = slow.after_fast & slow.before_fast
    off = np.abs(slow.turn) * (1.0 - seconds / slow.span) * np.where(slow.after_fast ^ slow.before_fast, 1.0, 0.5)
    most = np.maximum(1.0, np.floor(seconds / _SHORTEST))
    count = np.clip(np.ceil(off / follow[slow.owner]), 1.0, most).astype(np.int64)
    count = np.maximum(count, np.where(between, 2, 1))
    which = np.repeat(np.arange(len(count)), count)
    k = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    n = count[which]
    idle = ((slow.span - seconds) / count)[which]
    early = slow.after_fast[which] & (~slow.before_fast[which] | (k == 0))
    late = slow.before_fast[which] & (~slow.after_fast[which] | (k == n - 1))
    start = slow.begin[which] + slow.span[which] * (k / n) + idle * np.where(early, 0.0, np.where(late, 1.0, 0.5))
    end = start + (seconds / count)[which]
    angle, turn = slow.angle[which], slow.turn[which]
    owner = np.concatenate([slow.owner[which], slow.owner[which]])
    return owner, np.concatenate([start, end]), np.concatenate([angle + turn * (k / n), angle + turn * ((k + 1) / n)])
