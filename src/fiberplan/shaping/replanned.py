"""Plans for motors that cannot jump: planned, made fit for motors, and mended where that comes too near.

Planners keep little more than the margin and turn sharp corners, and what motors make of a path is not the same path.
Those that came too near are led past each other anew, farther apart by what was missing, while all others keep their
paths (`fiberplan.planners.amending.mending`). Where that ends in nothing, the planner is asked again, with arms that
are thicker than they are: those of pairs that came too near by what was missing, and all others by a little more in
each round, for in a new plan other pairs graze. No arm gets more room than its start and goal leave. In late rounds
joints get a little slower, too: corners of slower motions are softer.
"""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.kernels.clearance import clearances
from fiberplan.plan import Plan
from fiberplan.planners import Planner
from fiberplan.planners.amending import mended
from fiberplan.problem import Problem
from fiberplan.shaping.shape import shape
from fiberplan.tolerances import SCENE

ROUNDS = 8  #: times that a planner is asked
_MENDS = 12  # rounds of mending of what it says each time
_PACE = 0.92  # of the joints' speeds that new paths have in each of these, where that is in time
_MORE = 0.02  # [mm] each round, for a pair that came too near beyond what was missing
_ALL = 0.01  # [mm] for every arm in the second round, twice as much in each after it
_SLOWER = 0.01  # of a joint's speed, in each round ...
_PATIENT = 3  # ... after so many
_MOST = 2.0  # [mm] no arm gets more room


class Made(NamedTuple):
    """What motors make of a plan."""

    plan: Plan  #: to be kept: as it was, or as it was shaped
    lacking: Mapping[tuple[int, int], float]  #: pairs not proven to keep the margin, and what they lack [mm]


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
    if plane.max_acceleration is None and plane.min_speed is None:
        return planner.plan(problem)
    error = problem.position_error
    assert error is not None  # set on construction
    opening = problem.near_start == "open" or problem.needs_opening

    def shaped(plan: Plan) -> Made:
        made = shape(plan.trajectory, plane, problem.margin, error, opening, **options)
        said = f"shaped for its motors, {made.longer:.3f} s longer"
        kept = dataclasses.replace(plan, problem=problem, trajectory=made.trajectory, notes=(*plan.notes, said))
        return Made(kept, made.lacking)

    return replanned(planner, problem, shaped, rounds)


def replanned(planner: Planner, problem: Problem, make: Callable[[Plan], Made], rounds: int = ROUNDS) -> Plan:
    """The planner's plan, mended and planned again until what motors make of it keeps the margin.

    Args:
        planner: any.
        problem: whose goals to reach, and how far apart to stay.
        make: what motors make of a plan.
        rounds: times that the planner may be asked.

    Returns:
        the best plan, as `make` made it; its last note says how often it was planned and mended.
    """
    most = _most_room(problem)
    given = np.zeros(problem.n)
    plan = planner.plan(problem)
    made, asked, led, kept = make(plan), 1, 0, plan.kept
    best, left = made, _MENDS
    while made.lacking or plan.kept < kept:
        missing = _missing(made.lacking, problem.n)
        parted = 0
        if made.lacking and left:
            given, left, turn = np.minimum(given + missing, most), left - 1, _MENDS - left
            asked_of = dataclasses.replace(plan, problem=problem)
            mend, parted = mended(asked_of, made.lacking, given, _PACE**turn, other=bool(turn % 2))
        if parted:
            plan, led = mend, led + parted
        elif asked == rounds:
            break
        else:
            more = np.maximum(given + missing, _ALL * 2.0**asked)
            given = np.minimum(more, most) if made.lacking else 0.5 * given  # safe, but somebody is lost
            plan = planner.plan(_roomier(problem, given, 1.0 - _SLOWER * max(0, asked - _PATIENT)))
            asked, left = asked + 1, _MENDS
        made = make(plan)
        best = min(best, made, key=lambda each: (bool(each.lacking), -each.plan.kept, len(each.lacking)))
    anew = f", {led} pairs led past each other anew" if led else ""
    said = f"planned {asked} time{'s' if asked > 1 else ''}{anew}"
    return dataclasses.replace(best.plan, problem=problem, notes=(*best.plan.notes, said))


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


def _missing(lacking: Mapping[tuple[int, int], float], n: int) -> np.ndarray:
    """(n,) more room that each arm should have [mm]."""
    room = np.zeros(n)
    for pair, gap in lacking.items():
        arms = [arm for arm in pair if arm >= 0]
        room[arms] = np.maximum(room[arms], (gap + _MORE) / len(arms))
    return room


def _most_room(problem: Problem) -> np.ndarray:
    """(n,) room that each arm can have with everyone at the start, and at the goals, still clear of each other [mm]."""
    plane, error = problem.plane, problem.position_error
    assert error is not None  # set on construction
    pairs = plane.arm_pairs_within(problem.margin + 2.0 * float(error.max()) + _MOST)
    errors = np.concatenate([error, np.zeros(len(plane.obstacles))])
    ends = np.where(problem.has_goal[:, None], problem.goal, problem.start)
    room = np.full(len(errors), np.inf)
    for angles in (problem.start, ends):
        left = clearances(plane.arms, plane.with_obstacles(angles), pairs) - errors[pairs].sum(axis=1)
        left = np.maximum(0.0, left - problem.margin - SCENE)
        share = np.where(pairs[:, 1] >= plane.n, left, 0.5 * left)
        np.minimum.at(room, pairs[:, 0], share)
        np.minimum.at(room, pairs[:, 1], share)
    return np.minimum(room[: plane.n], _MOST)
