"""Where a motion is safe but motors make one of it that is not: those few are led past each other farther apart.

All others keep their paths, so what motors make of these stays proven, and each round leaves fewer that are too near.
"""

import dataclasses
from collections.abc import Mapping

import numpy as np

from fiberplan.plan import Outcome, Plan
from fiberplan.planners.amending.rerouting import reroute


def mended(plan: Plan, lacking: Mapping[tuple[int, int], float], room: np.ndarray) -> tuple[Plan, int]:
    """The plan with new paths for those that come too near, and how many pairs have one that has.

    Args:
        plan: of any planner; its outcomes stay as they are.
        lacking: pairs to be parted; obstacle k is -1 - k; the more is lacking, the sooner a pair is.
        room: (n,) thickness to leave about every arm, for those that get a new path [mm].
    """
    problem = plan.problem
    if problem.plane.kinematics.has_avoidance:
        return plan, 0
    assert problem.position_error is not None  # set on construction
    plane = problem.plane.thicker(problem.position_error + room)
    arrived = np.array([outcome is Outcome.ARRIVED for outcome in plan.outcomes])
    ends = np.where(arrived[:, None], plan.trajectory.end, np.nan)
    motion, moved, parted = plan.trajectory, set[int](), 0
    for pair, _ in sorted(lacking.items(), key=lambda item: (-item[1], item[0])):
        if moved & set(pair):
            parted += 1
            continue
        for i in pair:
            if i < 0 or not problem.plane.online[i] or np.isnan(ends[i, 0]):
                continue
            found = reroute(plane, problem.margin, motion, ends, i, 0.0, plan.seed)
            if found.motion is not None and i in found.moved:
                motion, parted = found.motion, parted + 1
                moved |= set(found.moved)
                break
    return dataclasses.replace(plan, trajectory=motion), parted
