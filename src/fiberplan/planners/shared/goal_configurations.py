"""Which elbow solution to go to: the faster one, min over parities of max_k |dq_k| / v_k (Makarem2014, section 3).

It is settled before anything moves, from the configurations that the problem allows, so that a plan ends where its
problem says. Descent of a fiber potential may still end in another one; planners judge that by the fiber and finish.
"""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane.neighbours import Neighbourhood, touching
from fiberplan.problem import Problem
from fiberplan.tolerances import EQUALITY


def faster_goals(problem: Problem, near: Neighbourhood) -> np.ndarray:
    """(n, 2) of the configurations a positioner may end in, the one its joints reach first [rad]; NaN without a goal.

    Those are its goal and, where the problem has any, its alternatives. Ties go to the goal, then to the first
    alternative. One that touches another's choice, or leaves its ranges, is not taken.
    """
    choices = choices_of(problem)
    return chosen(problem, near, choices, travel_times(problem, choices))


def choices_of(problem: Problem) -> np.ndarray:
    """(n, k, 2) the goal and its alternatives within the joint ranges, NaN-padded [rad]."""
    if problem.alternatives is None:
        return read_only(problem.goal[:, None])
    plane = problem.plane
    others = np.where(problem.has_goal[:, None, None], problem.alternatives, np.nan)
    inside = np.all((others >= plane.lower[:, None]) & (others <= plane.upper[:, None]), axis=2)
    return read_only(
        np.concatenate([problem.goal[:, None], np.where(np.expand_dims(inside, 2), others, np.nan)], axis=1)
    )


def travel_times(problem: Problem, choices: np.ndarray) -> np.ndarray:
    """(n, k) time of the slower joint to each of `choices` (n, k, 2) [s]; inf where there is none."""
    times = problem.plane.least_time(choices - problem.start[:, None]).max(axis=2)
    return np.where(np.isnan(times), np.inf, times)


def chosen(problem: Problem, near: Neighbourhood, choices: np.ndarray, cost: np.ndarray) -> np.ndarray:
    """The cheapest of each row's `choices` (n, k, 2) by `cost` (n, k); the goal where another choice would touch."""
    plane, goal = problem.plane, problem.goal
    cheapest = np.argmin(np.round(cost, 9), axis=1)
    taken = np.take_along_axis(choices, cheapest[:, None, None], axis=1)[:, 0]
    while True:  # goals as given clear each other, so giving up choices that touch ends
        pose = plane.with_obstacles(np.where(plane.online[:, None], taken, problem.start))
        other = np.flatnonzero((taken != goal).any(axis=1) & problem.has_goal)
        bad = other[touching(plane.arms, near, pose, other, problem.margin + EQUALITY) >= 0]
        if not len(bad):
            return read_only(taken)
        taken[bad] = goal[bad]


def other_parities(problem: Problem, choices: np.ndarray, goals: np.ndarray) -> np.ndarray:
    """(n, 2) for each of `goals` (n, 2) the first choice of the other elbow solution [rad]; NaN if there is none."""
    bend = problem.plane.zero[:, 1] + np.arctan2(problem.plane.fiber[:, 1], problem.plane.fiber[:, 0])
    side = np.sin(choices[:, :, 1] + bend[:, None]) >= 0
    differs = (side != (np.sin(goals[:, 1] + bend) >= 0)[:, None]) & np.isfinite(choices[:, :, 0])
    first = np.take_along_axis(choices, np.argmax(differs, axis=1)[:, None, None], axis=1)[:, 0]
    return np.where(differs.any(axis=1)[:, None], first, np.nan)
