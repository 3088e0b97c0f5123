"""Where a motion is safe but motors make one of it that is not: those few are led past each other farther apart.

All others keep their paths, so what motors make of these stays proven, and each round leaves fewer that are too near.
"""

import dataclasses
from collections.abc import Mapping

import numpy as np

from fiberplan.plan import Outcome, Plan
from fiberplan.planners.amending.rerouting import reroute
from fiberplan.tolerances import UNDER_LIMIT


def mended(
    plan: Plan, lacking: Mapping[tuple[int, int], float], room: np.ndarray, pace: float = 1.0, other: bool = False
) -> tuple[Plan, int]:
    """The plan with new paths for those that come too near, and how many pairs have one that has.

    Args:
        plan: of any planner; its outcomes stay as they are.
        lacking: pairs to be parted; obstacle k is -1 - k; the more is lacking, the sooner a pair is.
        room: (n,) thickness to leave about every arm, for those that get a new path [mm].
        pace: part of their speed that joints of new paths have, where that gets them to their ends in time: what is
            slower loses less to clocks and corners.
        other: begin with the second of each pair.
    """
    problem = plan.problem
    if problem.plane.kinematics.has_avoidance:
        return plan, 0
    assert problem.position_error is not None  # set on construction
    plane = problem.plane.thicker(problem.position_error + room)
    arrived = np.array([outcome is Outcome.ARRIVED for outcome in plan.outcomes])
    ends = np.where(arrived[:, None], plan.trajectory.end, np.nan)
    least = np.abs(ends - plan.trajectory.start) / (plane.max_speed * max(plan.makespan, 1e-9))
    paces = np.clip(np.nan_to_num(least.max(axis=1), nan=1.0) / UNDER_LIMIT, pace, 1.0)
    plane = plane.replace(max_speed=plane.max_speed * paces[:, None], min_speed=None)
    motion, moved, parted = plan.trajectory, set[int](), 0
    for pair, _ in sorted(lacking.items(), key=lambda item: (-item[1], item[0])):
        if moved & set(pair):
            parted += 1
            continue
        for i in pair[::-1] if other else pair:
            if i < 0 or not plane.online[i] or np.isnan(ends[i, 0]):
                continue
            found = reroute(plane, problem.margin, motion, ends, i, 0.0, plan.seed)
            if found.motion is not None and i in found.moved:
                motion, parted = found.motion, parted + 1
                moved |= set(found.moved)
                break
    return dataclasses.replace(plan, trajectory=motion), parted
