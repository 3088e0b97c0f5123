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
    best = latest = _Trial(planner, problem, make, rounds, unit).done()
    asked, led, stubborn = latest.asked, latest.led, set(latest.best.lacking)
    for _ in range(_GIVEN_UP):
        stubborn = stubborn & set(latest.best.lacking) or set(latest.best.lacking)
        fewer = _without_those(problem, stubborn)
        if fewer is None:
            break
        problem, latest = fewer, _Trial(planner, fewer, make, rounds, unit).done()
        asked, led, best = asked + latest.asked, led + latest.led, min(best, latest, key=lambda one: _badness(one.best))
    anew = f", {led} pairs led past each other anew" if led else ""
    said = f"planned {asked} time{'s' if asked > 1 else ''}{anew}"
    return dataclasses.replace(best.best.plan, problem=best.problem, notes=(*best.best.plan.notes, said))


class _Trial:
    """What comes of one choice of goals: a plan that waits, is mended, and made anew, until all keep their distance."""

    def __init__(
        self, planner: Planner, problem: Problem, make: Callable[[Plan], Made], rounds: int, unit: float
    ) -> None:
        self._planner, self.problem, self._make, self._rounds, self._unit = planner, problem, make, rounds, unit
        self._most, self._given = _most_room(problem), np.zeros(problem.n)
        self._left, self._waits_left, self._same = _MENDS, _WAITS, 0
        self._plan = planner.plan(problem)
        self._kept = self._plan.kept
        self.asked = 1  #: times that the planner was
        self.led = 0  #: pairs that were led past each other anew
        self._made = self.best = make(self._plan)
        self._tries = Counter(self._made.lacking.keys())

    def done(self) -> "_Trial":
        """The same, with all that could be done."""
        while self._made.lacking or self._plan.kept < self._kept:
            if self._has_waited():
                continue
            if not (self._is_mended() or self._is_planned_again()):
                break
            before, self._made = self._made, self._make(self._plan)
            again = self._made.lacking and set(self._made.lacking) == set(before.lacking)
            self._same = self._same + 1 if again else 0
            self._tries.update(self._made.lacking.keys())
            self.best = min(self.best, self._made, key=_badness)
        return self

    def _has_waited(self) -> bool:
        """Whether nobody is too near any more, with one of each pair waiting."""
        if not (0 < len(self._made.lacking) <= _FEW and self._waits_left):
            return False
        late, self._waits_left = _waiting(self._made, self._make, self._unit), self._waits_left - 1
        if late is None or late.lacking:
            if late is not None and dict(late.lacking) == dict(self._made.lacking):
                self._waits_left = 0  # what motors make of it does not depend on who begins when
            return False
        self.led, self._made = self.led + len(self._made.lacking), late
        self.best = min(self.best, late, key=_badness)
        return True

    def _is_mended(self) -> bool:
        """Whether any pair is led past each other anew."""
        if not (self._made.lacking and self._left and self._same < _SAME):
            return False
        self._given = np.minimum(self._given + _missing(self._made.lacking, self.problem.n), self._most)
        turn, self._left = _MENDS - self._left, self._left - 1
        asked_of = dataclasses.replace(self._plan, problem=self.problem)
        mend, parted = mended(asked_of, self._made.lacking, self._given, _PACE**turn, other=bool(turn % 2))
        if parted:
            self._plan, self.led = mend, self.led + parted
        return parted > 0

    def _is_planned_again(self) -> bool:
        """Whether there is another plan, with more room: not where the same pairs have come too near too often."""
        lacking = self._made.lacking
        tries = min((self._tries[pair] for pair in lacking), default=0)
        if self.asked == self._rounds or self._same > _SAME or tries > _TRIES:
            return False
        more = np.maximum(self._given + _missing(lacking, self.problem.n), _ALL * 2.0**self.asked)
        self._given = np.minimum(more, self._most) if lacking else 0.5 * self._given  # safe, but somebody is lost
        slower = 1.0 - _SLOWER * max(0, self.asked - _PATIENT)
        self._plan = self._planner.plan(_roomier(self.problem, self._given, slower))
        self.asked, self._left, self._waits_left = self.asked + 1, _MENDS, _WAITS
        return True


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
    why = "its motors come too near others on any path that was tried"
    lost = least_loss(pairs, can, problem.weight)
    dropped = {i: Dropped.beside(plane, why, arms) for i, arms in lost.items()}
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
