"""A motion in segments of one length, in each of which every motor makes a whole number of steps."""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.shaping.following import TAIL, followed
from fiberplan.shaping.knots import with_bends
from fiberplan.tolerances import RAMP

_FIRST = 7  #: this part of the change between segments may come on top of the least steps at the ends of strokes
_FAR = 2.0**40  # steps: a range that ends farther away does not end
_WHOLE = 1e-6  # of a step: a limit this close to a whole number of steps is one


def step_rules(plane: FocalPlane, step: np.ndarray, segment: float) -> tuple[np.ndarray, ...]:
    """What each joint (n, 2) can do in a segment [s], in steps of `step` (n, 2) [rad]: `StepRules`, (n, 2) each.

    Raises:
        TrajectoryError: a joint that cannot make a single step within its limits.
    """
    unit = segment / step
    least = np.ceil(plane.limit("min_speed") * unit - _WHOLE).astype(np.int64)
    most = np.floor(plane.max_speed * unit + _WHOLE).astype(np.int64)
    acceleration = plane.limit("max_acceleration")
    change = np.minimum(np.minimum(acceleration * segment, np.sqrt(8.0 * RAMP * acceleration)) * unit, 2.0 * most)
    change = np.floor(change + _WHOLE).astype(np.int64)
    first = np.minimum(most, least + change // _FIRST)
    bad = (first < np.maximum(least, 1)) | (change < 2)
    if bad.any():
        i, joint = np.argwhere(bad)[0]
        raise TrajectoryError(
            f"shape: positioner '{plane.ids[i]}': {('alpha', 'beta')[joint]} makes {least[i, joint]} to "
            f"{most[i, joint]} steps in {segment:g} s, {change[i, joint]} more or fewer than before: it cannot start"
        )
    return least, most, change, first


def in_whole_steps(
    trajectory: Trajectory, plane: FocalPlane, step: np.ndarray, segment: float, follow: np.ndarray
) -> tuple[Trajectory, np.ndarray]:
    """The motion in whole steps, and these (segments, n, 2); it ends within half a step of where it should.

    Args:
        trajectory: a motion within the limits, or nearly.
        plane: whose motors move.
        step: (n, 2) turn of one step [rad].
        segment: [s].
        follow: (n,) how far joints may turn in one go where they should turn more slowly than they can [rad].

    Raises:
        TrajectoryError: limits under which a joint cannot get where it should.
    """
    rules = step_rules(plane, step, segment)
    count = int(np.ceil(trajectory.duration / segment - 1e-9))
    places = np.rint(
        (trajectory.sampled(np.arange(count + 1) * segment) - trajectory.start[:, None]) / step[:, None]
    ).astype(np.int64)
    wanted = read_only(np.diff(places, axis=1).transpose(0, 2, 1).reshape(2 * plane.n, count), np.int64)
    longest = np.maximum(1, np.rint(follow[:, None] / (np.maximum(rules[0], 1) * step))).astype(np.int64)
    low, high = ((edge - trajectory.start) / step for edge in (plane.lower, plane.upper))
    low, high = np.ceil(np.maximum(low, -_FAR) - _WHOLE), np.floor(np.minimum(high, _FAR) + _WHOLE)
    each = (read_only(given.ravel(), np.int64) for given in (longest, low, high))
    made = np.zeros((len(wanted), count + TAIL), np.int64)
    done = followed(*(read_only(rule.ravel(), np.int64) for rule in rules), wanted, *each, made)
    if not done.all():
        i = int(np.argmin(done)) // 2
        raise TrajectoryError(
            f"shape: positioner '{plane.ids[i]}' cannot end where it should in whole steps within its range"
        )
    used = int(np.flatnonzero(made.any(axis=0))[-1]) + 1 if made.any() else 0
    steps = made[:, :used].reshape(plane.n, 2, used).transpose(2, 0, 1)
    places = np.concatenate([np.zeros((1, plane.n, 2), np.int64), np.cumsum(steps, axis=0)])
    angles = (trajectory.start + places * step).transpose(1, 0, 2).reshape(-1, 2)
    owner, times = np.repeat(np.arange(plane.n), used + 1), np.tile(np.arange(used + 1) * segment, plane.n)
    return with_bends(owner, times, angles, plane), read_only(steps, np.int64)
