"""Plans for motors that cannot jump: planned, shaped, and planned again where the shape comes too near.

Planners keep little more than the margin and turn sharp corners, and a rounded corner is not the same path. So the
planner is given arms that are thicker than they are: those of pairs that came too near by what was missing, and all
others by a little more in each round, for in a new plan other pairs graze. No arm gets more room than its start and
goal leave. In late rounds joints get a little slower, too: corners of slower motions are softer.
"""

import dataclasses
from typing import Any

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.kernels.clearance import clearances
from fiberplan.plan import Plan
from fiberplan.planners import Planner
from fiberplan.problem import Problem
from fiberplan.shaping.shape import Shaped, shape
from fiberplan.tolerances import SCENE

ROUNDS = 8  #: times that a planner is asked
_MORE = 0.02  # [mm] each round, for a pair that came too near beyond what was missing
_ALL = 0.01  # [mm] for every arm in the second round, twice as much in each after it
_SLOWER = 0.01  # of a joint's speed, in each round ...
_PATIENT = 3  # ... after so many


def plan_for_motors(planner: Planner, problem: Problem, rounds: int = ROUNDS, **options: Any) -> Plan:
    """The planner's plan as motors with the plane's `max_acceleration` and `min_speed` can make it.

    Args:
        planner: any.
        problem: whose plane says what motors can do; without limits it is the planner's plan.
        rounds: times that the planner may be asked, until all pairs keep the margin.
        **options: of `shape`.

    Returns:
        the best plan that is proven, if one is; else that with the fewest pairs too near. Its notes say how often it
        was planned, and what motors cost.
    """
    plane = problem.plane
    plan = planner.plan(problem)
    if plane.max_acceleration is None and plane.min_speed is None:
        return plan
    room, shaped = np.zeros(plane.n), _shaped(plan, problem, options)
    best, asked, kept = (plan, shaped), 1, plan.kept
    while (shaped.lacking or plan.kept < kept) and asked < rounds:
        more = np.maximum(room + _missing(shaped, plane.n), _ALL * 2.0**asked)
        room = np.minimum(more, _most_room(problem)) if shaped.lacking else 0.5 * room  # safe, but somebody is lost
        plan = planner.plan(_roomier(problem, room, 1.0 - _SLOWER * max(0, asked - _PATIENT)))
        shaped = _shaped(plan, problem, options)
        asked += 1
        best = min(best, (plan, shaped), key=lambda each: (bool(each[1].lacking), -each[0].kept, len(each[1].lacking)))
    plan, shaped = best
    times = f"{asked} time{'s' if asked > 1 else ''}"
    said = f"shaped for its motors, {shaped.longer:.3f} s longer; planned {times}"
    return dataclasses.replace(plan, problem=problem, trajectory=shaped.trajectory, notes=(*plan.notes, said))


def _roomier(problem: Problem, room: np.ndarray, speed: float) -> Problem:
    """The problem with more room (n,) for arms [mm], and joints that have a part of their speed."""
    assert problem.position_error is not None  # set on construction
    plane = problem.plane
    slower = plane.max_speed * speed
    slowest = None if plane.min_speed is None else np.minimum(plane.min_speed, slower)
    return dataclasses.replace(
        problem,
        plane=plane.replace(max_speed=slower, min_speed=slowest),
        position_error=read_only(problem.position_error + room),
    )


def _shaped(plan: Plan, problem: Problem, options: dict[str, Any]) -> Shaped:
    assert problem.position_error is not None  # set on construction
    return shape(
        plan.trajectory,
        problem.plane,
        problem.margin,
        problem.position_error,
        problem.near_start == "open" or problem.needs_opening,
        **options,
    )


def _missing(shaped: Shaped, n: int) -> np.ndarray:
    """(n,) more room that each arm should have [mm]."""
    room = np.zeros(n)
    for pair, lacking in shaped.lacking.items():
        arms = [arm for arm in pair if arm >= 0]
        room[arms] = np.maximum(room[arms], (lacking + _MORE) / len(arms))
    return room


def _most_room(problem: Problem) -> np.ndarray:
    """(n,) room that each arm can have with everyone at the start, and at the goals, still clear of each other [mm]."""
    plane, error = problem.plane, problem.position_error
    assert error is not None  # set on construction
    pairs = plane.arm_pairs_within(problem.margin + 2.0 * float(error.max()) + 2.0)
    errors = np.concatenate([error, np.zeros(len(plane.obstacles))])
    ends = np.where(problem.has_goal[:, None], problem.goal, problem.start)
    room = np.full(len(errors), np.inf)
    for angles in (problem.start, ends):
        left = clearances(plane.arms, plane.with_obstacles(angles), pairs) - errors[pairs].sum(axis=1)
        left = np.maximum(0.0, left - problem.margin - SCENE)
        share = np.where(pairs[:, 1] >= plane.n, left, 0.5 * left)
        np.minimum.at(room, pairs[:, 0], share)
        np.minimum.at(room, pairs[:, 1], share)
    return np.minimum(room[: plane.n], 2.0)
