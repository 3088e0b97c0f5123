"""A joint way for the few that a field leaves stuck: searched, not descended, and appended to the motion.

Groups of stuck positioners that could touch one another are searched jointly, everyone else standing where the field
ended (`fiberplan.planners.shared.rrt_connect`); a group for which there is no way takes in whoever refused it most.
Groups that could not touch move at the same time, others one after the other.
"""

import numpy as np

from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory
from fiberplan.planners.shared.clusters import clusters
from fiberplan.planners.shared.rrt_connect import joint_path
from fiberplan.problem import Problem
from fiberplan.tolerances import UNDER_LIMIT

_LARGEST = 6  # members of a group
_GROWTHS = 3  # how often it takes in one more


def append_joint_ways(
    problem: Problem, near: Neighbourhood, trajectory: Trajectory, goals: np.ndarray, stuck: np.ndarray, seed: int
) -> Trajectory:
    """The motion, then joint ways of `stuck` (k,) to their `goals` (n, 2) [rad], where any are found."""
    angles = np.array(trajectory.end)
    begins = np.zeros(problem.n)  # earliest time at which a positioner's neighbours are all at rest [s]
    begins[:] = trajectory.duration
    owners, times, knots = [], [], []
    for group in clusters(near, stuck):
        found = _way(problem, near, angles, goals, group, seed)
        if found is None:
            continue
        members, when, ways = found
        when = when / UNDER_LIMIT + begins[members].max()
        for place, i in enumerate(members):
            moves = np.concatenate([[True], np.any(np.diff(ways[:, place], axis=0) != 0, axis=1)])
            if not moves[1:].any():
                continue
            owners.append(np.full(len(when), i))
            times.append(when)
            knots.append(ways[:, place])
            angles[i] = ways[-1, place]
        around = {int(j) for i in members for j in near.around(i)} | set(members)
        around = {j for i in around for j in (i, *near.around(i))}  # who may be a member of a group that meets it
        for j in around:
            if j < problem.n:
                begins[j] = max(begins[j], when[-1])
    if not owners:
        return trajectory
    owner = np.concatenate([trajectory.owner, *owners])
    time = np.concatenate([trajectory.times, *times])
    pose = np.concatenate([trajectory.angles, *knots])
    return Trajectory.from_knots(owner, time, pose, trajectory.n)


def _way(
    problem: Problem, near: Neighbourhood, angles: np.ndarray, goals: np.ndarray, group: list[int], seed: int
) -> tuple[list[int], np.ndarray, np.ndarray] | None:
    """Members, times (m,) [s] and angles (m, k, 2) [rad] of a way for a group, grown if need be; None: not found."""
    members = list(group)
    for _ in range(_GROWTHS + 1):
        if len(members) > _LARGEST:
            return None
        ends = np.where(np.isnan(goals[members]), angles[members], goals[members])
        found, blame = joint_path(problem.plane, near, np.array(members), angles, ends, problem.margin, seed)
        if found is not None:
            return members, found[0], found[1]
        blame[members] = 0
        worst = int(np.argmax(blame))
        if not blame[worst] or worst >= problem.n or not problem.plane.online[worst]:
            return None
        members.append(worst)
    return None
