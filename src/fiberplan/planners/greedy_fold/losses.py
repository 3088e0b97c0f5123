"""Who is given up when not all can arrive, so that the plan is still safe and begins where it must.

A positioner that gets stuck on the reversed way from its goal first loses its goal, and stands at rest out of the way
instead. If that does not help, or if it is stuck on the way from its start, it is held at its start: it never moves,
and goals that touch it there are dropped. Each round gives up at least one more, so this ends; with everyone held, the
motion is none.
"""

import numpy as np

from fiberplan.focal_plane.neighbours import Neighbourhood, clearance_around
from fiberplan.kernels.clearance import clearance
from fiberplan.plan import Outcome
from fiberplan.plan.outcomes import all_blockers, settled_outcome
from fiberplan.planners.greedy_fold.deadlock import Fold
from fiberplan.planners.shared.clusters import clusters
from fiberplan.problem import Problem
from fiberplan.problem.resting import place_the_rest
from fiberplan.tolerances import EQUALITY

_REPLACEMENTS = 10  # targets tried for one positioner before it is held
_DRAWS = 1000  # random configurations tried for a replacement target


class Losses:
    """What has been given up so far, and what that leaves to plan."""

    def __init__(self, problem: Problem, near: Neighbourhood):
        self._problem, self._near = problem, near
        self._limit = problem.margin + EQUALITY
        self._goal = problem.goal.copy()  # replaced goals included
        self._given_up: dict[int, tuple[int, ...]] = {}
        self._dropped: dict[int, tuple[int, ...]] = {}
        self._replaced: set[int] = set()
        self._replacements = np.zeros(problem.n, np.int64)
        self._rested: set[int] = set()  # no goal to give up any more: the next time they are held
        self.movable = problem.plane.online.copy()  #: (n,) who is not held at the start

    def end(self) -> np.ndarray:
        """(n, 2) a configuration to end in: the goals that are kept, and a safe place for everyone else [rad]."""
        problem = self._problem
        while True:
            known = np.where(self.movable[:, None], self._goal, problem.start)
            self._drop_goals_on_held(known)
            known = np.where(self.movable[:, None], self._goal, problem.start)
            end, nowhere = place_the_rest(problem.plane, known, problem.start, self._near, self._limit)
            if not len(nowhere):
                return end
            for i in nowhere:
                self._hold(int(i), ())

    def _drop_goals_on_held(self, known: np.ndarray) -> None:
        """Drop goals that touch a positioner which is held."""
        plane = self._problem.plane
        held = np.flatnonzero(~self.movable & plane.online)
        if not len(held):
            return
        others = np.flatnonzero(self.movable & ~np.isnan(known[:, 0]))
        goals = plane.with_obstacles(known)
        for i in map(int, others):
            on = [int(j) for j in np.intersect1d(self._near.around(i), held)]
            touched = [j for j in on if not self._clear_of(i, j, goals)]
            if touched:
                self._dropped.setdefault(i, tuple(touched))
                self._lose_goal(i)

    def _clear_of(self, i: int, j: int, angles: np.ndarray) -> bool:
        """Whether two arms clear each other at `angles`."""
        gap = clearance(self._problem.plane.arms, i, angles[i, 0], angles[i, 1], j, angles[j, 0], angles[j, 1])
        return bool(gap >= self._limit)

    def _lose_goal(self, i: int) -> None:
        self._goal[i] = np.nan
        self._rested.add(i)

    def _hold(self, i: int, blockers: tuple[int, ...]) -> None:
        if not np.isnan(self._problem.goal[i, 0]):
            self._given_up.setdefault(i, blockers)
        self._lose_goal(i)
        self.movable[i] = False

    def give_up(self, out: Fold, back: Fold) -> None:
        """Give up one positioner of every cluster of stuck ones: the one of least priority."""
        priority = self._problem.priority
        assert priority is not None  # set on construction
        for fold, from_start in ((out, True), (back, False)):
            for cluster in clusters(self._near, fold.stuck):
                i = min(cluster, key=lambda c: (priority[c], c))
                blockers = self._blockers_of(fold, i)
                if from_start or i in self._rested or np.isnan(self._goal[i, 0]):
                    self._hold(i, blockers)
                elif self.movable[i]:
                    self._given_up.setdefault(i, blockers)
                    self._lose_goal(i)

    def record(self, back: Fold) -> None:
        """Note who was given up on the way back from the goals, so that others get there."""
        for i in back.given_up:
            if not np.isnan(self._problem.goal[i, 0]):
                self._given_up.setdefault(i, self._blockers_of(back, i))
            self._lose_goal(i)

    def _blockers_of(self, fold: Fold, i: int) -> tuple[int, ...]:
        return (self._problem.plane.public(fold.blockers[i]),) if i in fold.blockers else ()

    def replace_target(self, i: int, blockers: dict[int, int], rng: np.random.Generator) -> None:
        """Give positioner `i` another, random target (its own is lost).

        It is held instead if it has none of its own, if no clear one is found, or after ten of them.
        """
        plane = self._problem.plane
        self._replacements[i] += 1
        if np.isnan(self._problem.goal[i, 0]) or self._replacements[i] > _REPLACEMENTS:
            self._hold(i, ())
            return
        by = blockers.get(i)
        self._given_up.setdefault(i, () if by is None else (self._problem.plane.public(by),))
        self._goal[i] = np.nan
        end = plane.with_obstacles(self.end())
        draws = plane.kinematics.random(plane, rng, np.full(_DRAWS, i))
        for alpha, beta in draws:
            if clearance_around(plane.arms, self._near, end, i, alpha, beta) >= self._limit + EQUALITY:
                self._goal[i] = alpha, beta
                self._replaced.add(i)
                return
        self._hold(i, ())

    def outcomes(self, ends: np.ndarray) -> tuple[Outcome, ...]:
        """An outcome for every positioner, the first that fits; `ends` (n, 2) is where all end [rad]."""
        problem = self._problem
        there = (ends == problem.goal).all(axis=1)  # also those that were given up and never had to move

        def outcome(i: int) -> Outcome:
            settled = settled_outcome(problem, i)
            if settled is not None or there[i]:
                return settled or Outcome.ARRIVED
            if i in self._dropped:
                return Outcome.DROPPED
            return Outcome.DEADLOCKED if i in self._given_up else Outcome.ARRIVED

        return tuple(outcome(i) for i in range(problem.n))

    def blockers(self, ends: np.ndarray) -> dict[int, tuple[int, ...]]:
        """Positioner that does not arrive -> who stood in its way; `ends` (n, 2) is where all end [rad]."""
        there = (ends == self._problem.goal).all(axis=1)
        lost = {i: arms for i, arms in (self._given_up | self._dropped).items() if not there[i]}
        return all_blockers(self._problem, lost)

    def notes(self) -> list[str]:
        """What the outcomes do not say."""
        ids = self._problem.plane.ids
        held = [i for i in np.flatnonzero(~self.movable) if self._problem.plane.online[i]]
        notes = []
        if held:
            notes.append("held at the start: " + ", ".join(ids[i] for i in held))
        if self._replaced:
            notes.append("sent to another, random target: " + ", ".join(ids[i] for i in sorted(self._replaced)))
        return notes
