"""Which elbow solution to go to: the faster one, min over parities of max_k |dq_k| / v_k (Makarem2014, section 3).

It is settled before anything moves, from the configurations that the problem allows, so that a plan ends where its
problem says. Descent of a fiber potential may still end in another one; planners judge that by the fiber and finish.
"""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.neighbourhood import Neighbourhood, touching
from fiberplan.problem import EQUALITY, Problem


def faster_goals(problem: Problem, near: Neighbourhood) -> np.ndarray:
    """(n, 2) of the configurations a positioner may end in, the one its joints reach first [rad]; NaN without a goal.

    Those are its goal and, where the problem has any, its alternatives. Ties go to the goal, then to the first
    alternative. One that touches another's choice, or leaves its ranges, is not taken.
    """
    plane, goal = problem.plane, problem.goal
    if problem.alternatives is None:
        return goal
    others = np.where(problem.has_goal[:, None, None], problem.alternatives, np.nan)
    inside = np.all((others >= plane.lower[:, None]) & (others <= plane.upper[:, None]), axis=2)
    choices = np.concatenate([goal[:, None], np.where(np.expand_dims(inside, 2), others, np.nan)], axis=1)
    times = (np.abs(choices - problem.start[:, None]) / plane.max_speed[:, None]).max(axis=2)
    quickest = np.argmin(np.where(np.isnan(times), np.inf, np.round(times, 9)), axis=1)
    chosen = np.take_along_axis(choices, quickest[:, None, None], axis=1)[:, 0]
    while True:  # goals as given clear each other, so giving up choices that touch ends
        pose = plane.with_obstacles(np.where(plane.online[:, None], chosen, problem.start))
        other = np.flatnonzero((chosen != goal).any(axis=1) & problem.has_goal)
        bad = other[touching(plane.arms, near, pose, other, problem.margin + EQUALITY) >= 0]
        if not len(bad):
            return read_only(chosen)
        chosen[bad] = goal[bad]
