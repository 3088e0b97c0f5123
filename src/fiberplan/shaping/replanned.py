"""Plans for motors that cannot jump: planned, made fit for motors, and mended where that comes too near.

Planners keep little more than the margin and turn sharp corners, and what motors make of a path is not the same path.
Those that came too near are led past each other anew, farther apart by what was missing, while all others keep their
paths (`fiberplan.planners.amending.mending`), or one of them waits on the path that it has (`waiting`). Where that
ends in nothing, the planner is asked again, with arms that are thicker than they are: those of pairs that came too
near by what was missing, and all others by a little more in each round, for in a new plan other pairs graze. No arm
gets more room than its start and goal leave. In late rounds joints get a little slower, too: corners of slower motions
are softer. Where the same pairs come too near all the same, one of each gives up its goal, where that is allowed, and
all is planned without.
"""

import dataclasses
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import PlanError
from fiberplan.kernels.clearance import clearances
from fiberplan.plan import Plan
from fiberplan.planners import Planner
from fiberplan.planners.amending import mended
from fiberplan.problem import Dropped, Problem
from fiberplan.problem.least_cover import least_loss
from fiberplan.shaping.shape import shape
from fiberplan.shaping.waiting import beginning_later, waits
from fiberplan.tolerances import SCENE

ROUNDS = 8  #: times that a planner is asked
_MENDS = 12  # rounds of mending of what it says each time
_PACE = 0.92  # of the joints' speeds that new paths have in each of these, where that is in time
_MORE = 0.02  # [mm] each round, for a pair that came too near beyond what was missing
_ALL = 0.01  # [mm] for every arm in the second round, twice as much in each after it
_SLOWER = 0.01  # of a joint's speed, in each round ...
_PATIENT = 3  # ... after so many
UNIT = 0.1  #: who waits begins later by a whole number of these, unless a controller has its own [s]
_FEW = 12  # pairs, of which one each may wait,
_WAITS = 4  # times after the planner was asked
_WAITS_END = (1.0, 1.05)  # times the makespan, by which who waits has to end, in turn
_SAME = 4  # times that the same pairs come too near, before mending gives up; and planning, one time more
_TRIES = 10  # times that each of the pairs that are left has come too near, before planning gives up
_GIVEN_UP = 3  # times that goals are given up
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


def replanned(
    planner: Planner, problem: Problem, make: Callable[[Plan], Made], rounds: int = ROUNDS, unit: float = UNIT
) -> Plan:
    """The planner's plan, mended and planned again until what motors make of it keeps the margin.

    Pairs that come too near whatever is tried lose a goal, where conflicts are dropped.

    Args:
        planner: any.
        problem: whose goals to reach, and how far apart to stay.
        make: what motors make of a plan.
        rounds: times that the planner may be asked, for each choice of goals.
        unit: who waits for another begins later by a whole number of these [s].

    Returns:
        the best plan, as `make` made it; its last note says how often it was planned and mended.
    """
    best = latest = _tried(planner, problem, make, rounds, unit)
    asked, led, stubborn = latest.asked, latest.led, set(latest.best.lacking)
    for _ in range(_GIVEN_UP):
        stubborn = stubborn & set(latest.best.lacking) or set(latest.best.lacking)
        fewer = _without_those(problem, stubborn)
        if fewer is None:
            break
        problem, latest = fewer, _tried(planner, fewer, make, rounds, unit)
        asked, led, best = asked + latest.asked, led + latest.led, min(best, latest, key=lambda one: _badness(one.best))
    anew = f", {led} pairs led past each other anew" if led else ""
    said = f"planned {asked} time{'s' if asked > 1 else ''}{anew}"
    return dataclasses.replace(best.best.plan, problem=best.problem, notes=(*best.best.plan.notes, said))


class _Tried(NamedTuple):
    """What came of one choice of goals."""

    best: Made
    problem: Problem  #: with that choice
    asked: int  #: times that the planner was
    led: int  #: pairs that were led past each other anew


def _tried(planner: Planner, problem: Problem, make: Callable[[Plan], Made], rounds: int, unit: float) -> _Tried:
    most = _most_room(problem)
    given = np.zeros(problem.n)
    plan = planner.plan(problem)
    made, asked, led, kept = make(plan), 1, 0, plan.kept
    best, left, waits_left, same, tries = made, _MENDS, _WAITS, 0, Counter(made.lacking.keys())
    while made.lacking or plan.kept < kept:
        if 0 < len(made.lacking) <= _FEW and waits_left:
            late, waits_left = _waiting(made, make, unit), waits_left - 1
            if late is not None and not late.lacking:
                led, made = led + len(made.lacking), late
                best = min(best, made, key=_badness)
                continue
            if late is not None and dict(late.lacking) == dict(made.lacking):
                waits_left = 0  # what motors make of it does not depend on who begins when
        missing, parted = _missing(made.lacking, problem.n), 0
        if made.lacking and left and same < _SAME:
            given, left, turn = np.minimum(given + missing, most), left - 1, _MENDS - left
            asked_of = dataclasses.replace(plan, problem=problem)
            mend, parted = mended(asked_of, made.lacking, given, _PACE**turn, other=bool(turn % 2))
        if parted:
            plan, led = mend, led + parted
        elif asked == rounds or same > _SAME or min((tries[pair] for pair in made.lacking), default=0) > _TRIES:
            break
        else:
            more = np.maximum(given + missing, _ALL * 2.0**asked)
            given = np.minimum(more, most) if made.lacking else 0.5 * given  # safe, but somebody is lost
            plan = planner.plan(_roomier(problem, given, 1.0 - _SLOWER * max(0, asked - _PATIENT)))
            asked, left, waits_left = asked + 1, _MENDS, _WAITS
        before, made = made, make(plan)
        same = same + 1 if made.lacking and set(made.lacking) == set(before.lacking) else 0
        tries.update(made.lacking.keys())
        best = min(best, made, key=_badness)
    return _Tried(best, problem, asked, led)


def _waiting(made: Made, make: Callable[[Plan], Made], unit: float) -> Made | None:
    """The same with one of each pair waiting; None where that cannot help all, or takes the controller too long."""
    plan, problem = made.plan, made.plan.problem
    assert problem.position_error is not None  # set on construction
    motion, longest = plan.trajectory, [part * plan.makespan for part in _WAITS_END]
    later = waits(problem.plane, motion, made.lacking, problem.margin, problem.position_error, unit, longest)
    if later is None:
        return None
    try:
        return make(dataclasses.replace(plan, trajectory=beginning_later(motion, later)))
    except PlanError:
        return None


def _badness(made: Made) -> tuple[bool, float, int]:
    return bool(made.lacking), -made.plan.kept, len(made.lacking)


def _without_those(problem: Problem, near: Iterable[tuple[int, int]]) -> Problem | None:
    """The problem without goals of pairs that come too near; None where there are no such, or none may be given up."""
    plane = problem.plane
    can = np.append(problem.has_goal & plane.online, np.zeros(len(plane.obstacles), bool))
    pairs = [(plane.arm(i), plane.arm(j)) for i, j in sorted(near)]
    pairs = [(i, j) for i, j in pairs if can[i] or can[j]]
    if problem.conflicts == "raise" or not pairs:
        return None
    dropped = {}
    for i, blockers in least_loss(pairs, can, problem.weight).items():
        touched = tuple(plane.public(arm) for arm in blockers)
        beside = " and ".join(map(plane.label, touched))
        dropped[i] = Dropped(f"its motors come too near others on any path that was tried: {beside}", touched)
    return problem.giving_up(dropped)


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
