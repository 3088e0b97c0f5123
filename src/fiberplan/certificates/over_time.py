"""How near each pair comes in each part of a motion, proven: what `verify` says of the whole, slice by slice.

A curve through sampled clearances may miss what happens between the samples. These bounds hold at every moment.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fiberplan.arrays import number, read_only
from fiberplan.certificates.bisection import judge
from fiberplan.certificates.path import as_motion, rounding
from fiberplan.certificates.safety import CAP, TOLERANCE
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory


class Slices(NamedTuple):
    """Lower bounds by pair and part of a motion."""

    times: np.ndarray  #: (k + 1,) between which the parts lie [s]
    pairs: np.ndarray  #: (m, 2) two positioners, or a positioner and obstacle -1 - k
    clearance: np.ndarray  #: (k, m) proven lower bounds [mm]


def clearance_over_time(
    plane: FocalPlane,
    trajectory: Trajectory,
    times: np.ndarray,
    margin: float = 0.0,
    position_error: float | np.ndarray = 0.0,
    pairs: np.ndarray | None = None,
) -> Slices:
    """Proven lower bounds of pairs' clearance in each part of a motion.

    Each is within `safety.TOLERANCE` of the true smallest; above margin + `safety.CAP` it is only known to be larger.
    Two that cannot move are left out.

    Args:
        plane: whose bodies move, and among which obstacles.
        trajectory: of all its positioners.
        times: (k + 1,) between which the parts lie [s], increasing.
        margin: clearance that is to be kept [mm].
        position_error: each arm may be off by this, shared or (n,) [mm].
        pairs: (m, 2) two positioners, or a positioner and obstacle -1 - k; all that could come within the margin unless
            given.

    Raises:
        TrajectoryError: another number of positioners than the focal plane has, or times that do not increase.
    """
    if trajectory.n != plane.n:
        raise TrajectoryError(f"the motion has {trajectory.n} positioners, the focal plane {plane.n}")
    margin = number(margin, "mm", "margin", TrajectoryError)
    times = read_only(times, unit="s", name="times", error=TrajectoryError)
    error = read_only(position_error, unit="mm", name="position error", error=TrajectoryError)
    errors = np.concatenate([np.broadcast_to(error, plane.n), np.zeros(len(plane.obstacles))])
    if pairs is None:
        arms = plane.arm_pairs_within(margin + 2.0 * float(errors.max(initial=0.0)) + 1e-6)
    else:
        arms = np.where(np.asarray(pairs) >= 0, pairs, plane.n - 1 - np.asarray(pairs)).reshape(-1, 2)
    moves = np.concatenate([plane.online, np.zeros(len(plane.obstacles), bool)])
    arms = read_only(arms[moves[arms].any(axis=1)], np.int64)
    found = []
    for begin, end in pairwise(times.tolist()):
        path = as_motion(plane.arms, trajectory.between(begin, end))
        room = read_only(errors + rounding(plane.arms, path.offsets, path.knots))
        found.append(judge(plane.arms, path, arms, room, margin, 0.0, TOLERANCE, margin + CAP)[:, 0])
    public = np.where(arms < plane.n, arms, plane.n - 1 - arms)
    return Slices(times, read_only(public, np.int64), read_only(np.array(found).reshape(len(found), len(arms))))
