"""Which configuration each positioner goes to when time is limited, and which goals are out of reach in that time."""

from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane.neighbours import Neighbourhood, touching
from fiberplan.planners.shared.goal_configurations import choices_of, chosen, travel_times
from fiberplan.problem import Problem
from fiberplan.problem.configuration_choice import clear_choice
from fiberplan.tolerances import EQUALITY, RANGE, SPEED

_LATE = 1e9  # [s] added to the time of configurations that are too far, so that any other is preferred


class Goals(NamedTuple):
    """Where everyone goes."""

    angles: np.ndarray  #: (n, 2) [rad]; NaN: anywhere safe
    infeasible: np.ndarray  #: (n,) whose every configuration is too far, even alone and at full speed
    given_up: np.ndarray  #: (n,) whose configurations in time touch those of others: no proof


def goals_in_time(problem: Problem, near: Neighbourhood, max_time: float | None) -> Goals:
    """The quickest configurations that do not touch each other, of those that can be reached by `max_time` [s] if any.

    Those whose goal is late make their neighbours choose anew: all together the first configurations, in the order of
    their times, that are in time and touch nobody.
    """
    choices = choices_of(problem)
    times = travel_times(problem, choices)
    nobody = np.zeros(problem.n, bool)
    if max_time is None:
        return Goals(chosen(problem, near, choices, times), nobody, nobody)
    in_time = times <= max_time * (1.0 + SPEED)
    infeasible = problem.has_goal & (_quickest(problem) > max_time * (1.0 + SPEED))
    taken = np.array(chosen(problem, near, choices, np.where(in_time, times, times + _LATE)))
    taken[infeasible] = np.nan
    late = problem.has_goal & ~infeasible & ~_is_in_time(problem, taken, max_time)
    priority = problem.priority
    assert priority is not None  # set on construction
    order = sorted(np.flatnonzero(late).tolist(), key=lambda i: (-priority[i], i))
    taken[late] = np.nan  # what nobody goes to is in nobody's way
    for i in order:
        _choose_around(problem, near, choices, np.where(in_time, times, np.inf), taken, i)
    return Goals(read_only(taken), infeasible, late & np.isnan(taken[:, 0]))


def _is_in_time(problem: Problem, angles: np.ndarray, max_time: float) -> np.ndarray:
    """(n,) whether positioners can be at `angles` (n, 2) [rad] by `max_time` [s]; not at NaN."""
    return travel_times(problem, angles[:, None])[:, 0] <= max_time * (1.0 + SPEED)


def _quickest(problem: Problem) -> np.ndarray:
    """(n,) time to the nearest of all configurations that count as the goal, at full speed [s]; inf without a goal."""
    goal, plane = problem.goal[:, None], problem.plane
    ends = goal if problem.alternatives is None else np.concatenate([goal, problem.alternatives], axis=1)
    inside = np.all((ends >= plane.lower[:, None] - RANGE) & (ends <= plane.upper[:, None] + RANGE), axis=2)
    times = np.where(inside & problem.has_goal[:, None], travel_times(problem, ends), np.inf)
    return np.asarray(times.min(axis=1))


def _choose_around(
    problem: Problem, near: Neighbourhood, choices: np.ndarray, times: np.ndarray, taken: np.ndarray, i: int
) -> None:
    """Give positioner `i` a configuration in time, its neighbours another one where that helps; change `taken` so."""
    plane, limit = problem.plane, problem.margin + EQUALITY
    beside = [int(j) for j in near.around(i) if j < problem.n and np.isfinite(taken[j, 0])]
    members = np.array([i, *beside])
    pose = np.array(plane.with_obstacles(np.where(plane.online[:, None], taken, problem.start)))
    pose[members] = np.nan
    options = []
    for j in members:
        own = choices[j][np.argsort(times[j], kind="stable")][: int(np.isfinite(times[j]).sum())]
        if j != i:  # as it is, if that will do
            own = np.concatenate([taken[[j]], own[(own != taken[j]).any(axis=1)]])
        clear = np.zeros(len(own), bool)
        for k, angles in enumerate(own):
            pose[j] = angles
            clear[k] = touching(plane.arms, near, read_only(pose), np.array([j]), limit)[0] < 0
        pose[j] = np.nan
        options.append(own[clear])
    if all(map(len, options)):
        choice, _ = clear_choice(plane, members, options, limit)
        if choice is not None:
            taken[members] = choice
