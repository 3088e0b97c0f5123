"""A target of opportunity: one goal of a plan is changed, and as little as possible of the plan with it."""

import dataclasses
from collections.abc import Mapping
from time import process_time

import numpy as np
from numpy.typing import ArrayLike

from fiberplan.arrays import number, plain
from fiberplan.errors import PlanError, ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.planners.amending.rerouting import reroute
from fiberplan.planners.shared.requirements import require_two_links
from fiberplan.problem import Problem

_MOST_LONGER = 10.0  # makespans that may be added: more would be searched in ever longer steps


def amend(plan: Plan, positioner: int | str, goal: ArrayLike, longer: float = 0.05) -> Plan:
    """The plan with another goal for one positioner; only those that have to move otherwise, and all is certified anew.

    The positioner takes a new path through everyone else's motion, in the time that the plan takes, or its joints
    need. Where there is none, neighbours make room and end where they did; then all may take a little longer. If that
    fails too, it is `DEADLOCKED`: it and all others move as before, and `blockers` says which arms blocked it.

    Args:
        plan: a safe one, of any planner, complete or not.
        positioner: its index or id.
        goal: (2,) commanded alpha and beta [rad]; NaN: no target, so it moves as before, as safe as anywhere.
        longer: part of the makespan that may be added where there is no path without.

    Raises:
        ProblemError: no such positioner, an offline one, or one with a third link; or a goal that is out of range, half
            NaN, or in contact with another goal or with something at rest.
        PlanError: the plan is not safe as it is.
    """
    begun = process_time()
    longer = number(longer, "", "amend: longer", ProblemError)
    if not 0 <= longer <= _MOST_LONGER:
        raise ProblemError(f"amend: longer must be a part of the makespan, 0 to {_MOST_LONGER:g}, got {longer:g}")
    i = _index(plan.problem.plane, positioner)
    problem = _amended_problem(plan.problem, i, goal)
    outcomes, blockers = list(plan.outcomes), {k: arms for k, arms in plan.blockers.items() if k != i}
    motion, note = plan.trajectory, ""
    name = f"positioner '{problem.plane.ids[i]}'"
    if np.isnan(problem.goal[i, 0]):
        outcomes[i], note = Outcome.NO_TARGET, f"amended: {name} has no target any more"
    elif np.array_equal(motion.end[i], problem.goal[i]):
        outcomes[i], note = Outcome.ARRIVED, f"amended: {name} was on its way to this goal already"
    else:
        found = reroute(problem.roomy, problem.margin, motion, _ends(plan, problem, i), i, longer, plan.seed)
        if found.motion is not None:
            others = [problem.plane.ids[k] for k in found.moved if k != i]
            made_room = f"; {', '.join(others)} made room" if others else ""
            motion, outcomes[i], note = found.motion, Outcome.ARRIVED, f"amended: {name} has another goal{made_room}"
        else:
            outcomes[i], blockers[i] = Outcome.DEADLOCKED, found.blockers
            note = f"amended: no path was found to the new goal of {name}, which moves as before"
    timings = {**plan.timings, "amend": process_time() - begun}
    amended = _with(plan, problem, motion, outcomes, blockers, timings, note)
    if amended.certificate.ok:
        return amended
    if not plan.certificate.ok:
        raise PlanError(f"a plan that is not safe cannot be amended; it is {plan.certificate}")
    # proven on the patch but not on the whole: fall back to what is proven
    outcomes[i], blockers[i] = Outcome.DEADLOCKED, ()
    note = f"amended: no path to the new goal of {name} could be proven safe, so it moves as before"
    return _with(plan, problem, plan.trajectory, outcomes, blockers, timings, note)


def _with(
    plan: Plan,
    problem: Problem,
    motion: Trajectory,
    outcomes: list[Outcome],
    blockers: Mapping[int, tuple[int, ...]],
    timings: Mapping[str, float],
    note: str,
) -> Plan:
    return dataclasses.replace(
        plan,
        problem=problem,
        trajectory=motion,
        outcomes=tuple(outcomes),
        blockers=dict(sorted(blockers.items())),
        timings=timings,
        notes=(*plan.notes, note),
    )


def _index(plane: FocalPlane, positioner: int | str) -> int:
    """The index of a positioner that can move."""
    if isinstance(positioner, str):
        if positioner not in plane.names:
            raise ProblemError(f"amend: {plane.name} has no positioner '{positioner}'")
        i = plane.names[positioner]
    elif isinstance(positioner, int | np.integer) and not isinstance(positioner, bool):
        i = int(positioner)
        if not 0 <= i < plane.n:
            raise ProblemError(f"amend: {plane.name} has no positioner {i}; they are counted from 0 to {plane.n - 1}")
    else:
        raise ProblemError(f"amend: a positioner is named by its index or id, not by {positioner!r}")
    require_two_links("amend", plane)
    if not plane.online[i]:
        raise ProblemError(f"amend: positioner '{plane.ids[i]}' is offline and cannot be sent anywhere", (i,))
    return i


def _amended_problem(problem: Problem, i: int, goal: ArrayLike) -> Problem:
    """The problem with another goal for positioner `i`, all of it validated anew."""
    given = plain(goal, "rad", "amend: goal", ProblemError)
    try:
        angles = np.asarray(given, float)
    except (TypeError, ValueError):
        angles = np.empty(0)
    if angles.shape != (2,):
        raise ProblemError(f"amend: a goal is two angles, alpha and beta, got {goal!r}", (i,))
    requested = problem.requested.copy()
    requested[i] = angles
    alternatives = problem.alternatives
    if alternatives is not None:
        alternatives = np.array(alternatives)
        alternatives[i] = np.nan  # they reach the old target
    dropped = {k: why for k, why in problem.dropped.items() if k != i}
    wished = np.array(problem.wished)
    wished[i] = False
    return dataclasses.replace(
        problem, goal=requested, alternatives=alternatives, dropped=dropped, wished=wished, conflicts="raise"
    )


def _ends(plan: Plan, problem: Problem, i: int) -> np.ndarray:
    """(n, 2) where everybody has to end [rad]: those that arrived, where they did; NaN rows: anywhere safe."""
    ends = np.full((plan.problem.n, 2), np.nan)
    arrived = plan.having(Outcome.ARRIVED)
    ends[arrived] = plan.trajectory.end[arrived]
    ends[i] = problem.goal[i]
    return ends
