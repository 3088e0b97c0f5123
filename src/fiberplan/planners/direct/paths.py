"""Everybody's paths on their lattices: placed, repaired, given more steps, finer nodes or a way of their own."""

from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.direct.contacts import find_contacts
from fiberplan.planners.direct.lattice import Lattice, lengthened, make_lattice, on_its_way, refined
from fiberplan.planners.direct.nodes import MOST_STEPS, PACES, step_length
from fiberplan.planners.direct.pairs import UNKNOWN
from fiberplan.planners.direct.repair import (
    SOLVED,
    SPENT,
    make_search,
    needed_alone,
    needed_past_fixed,
    note_all,
    place_each,
    repair,
)
from fiberplan.planners.direct.scratch import make_scratch
from fiberplan.planners.shared.memory import refuse_large
from fiberplan.planners.shared.threads import in_parts_at_once
from fiberplan.problem import Problem
from fiberplan.tolerances import SLACK, UNDER_LIMIT

_LONGEST = 4  # times the steps that the slowest joint needs, unless `max_time` says otherwise
_JOINT_WORDS = 100_000  # of a joint replan that take as long as a single one
FINEST = len(PACES) - 1  #: fineness of a lattice
ON_ITS_WAY = FINEST + 1  #: in place of a fineness: there is nothing but one way


class Solution(NamedTuple):
    """Paths that touch nowhere."""

    steps: int
    lattice: Lattice

    def copied(self) -> "Solution":
        """The same, whose paths stay as they are."""
        return Solution(self.steps, self.lattice._replace(path=self.lattice.path.copy()))


class Paths:
    """Paths of all positioners, and the record of the repair."""

    def __init__(
        self, problem: Problem, near: Neighbourhood, goal: np.ndarray, turn: float, max_time: float | None, seed: int
    ):
        plane = problem.plane
        self.problem, self.plane, self.near, self._arms = problem, plane, near, plane.arms
        self.pairs = near.pairs
        self.goal = goal.copy()
        self.limit = problem.margin + SLACK
        self.given_up: dict[int, tuple[int, ...]] = {}  #: positioner -> arms that block it
        self.held: set[int] = set()  #: never leave their start
        self.elsewhere: set[int] = set()  #: were asked to reach their target in another configuration
        self.out_of_time: set[int] = set()  #: would have been searched on
        self.off_ways: set[int] = set()  #: were on ways of their own once, which others could not get past
        travel = np.nan_to_num(np.abs(goal - problem.start) / (plane.max_speed * UNDER_LIMIT)).max(axis=1)
        bound = float(travel.max(initial=0.0))
        length = step_length(plane, problem.start, goal, turn)
        longest = max(length.longest, bound / MOST_STEPS)
        self.steps = max(1, int(np.ceil(bound / longest - 1e-9)))
        self.duration = bound / self.steps if bound > 0 else longest  #: of a step [s]
        self.least_steps = self.steps  #: nobody has found that there are plans with fewer
        self.most_steps = _LONGEST * self.steps + 20
        if max_time is not None:
            self.most_steps = max(self.steps, int(min(max_time / self.duration + 1e-9, self.most_steps)))
        path = (len(plane.arms.arm), self.most_steps + 1, 2)
        refuse_large(2 * 8 * float(np.prod(path, dtype=float)), f"direct: paths of {path[0]} arms in {path[1]} steps")
        self._spacing = self.steps, length.widest  # what nodes were spaced by
        self.lattice = make_lattice(plane, problem.start, goal, plane.online, self.duration, *self._spacing)
        self.fineness = np.zeros(plane.n, np.int64)  #: of everybody's lattice
        self.widest_turn = float(np.nanmax(np.diff(self.lattice.alpha, axis=1), initial=0.0))  #: of an alpha [rad]
        self._scratch = make_scratch(self.lattice, len(near.near))
        self._barred: dict[int, float] = {}  # pairs without a path past each other at this clearance [mm]
        self.search = make_search(plane.n, len(self.pairs), self.limit, seed)

    @property
    def touching(self) -> int:
        """How many pairs still touch."""
        return int(self.search.touching[0])

    @property
    def in_contact(self) -> np.ndarray:
        """(m,) the pairs that still touch."""
        return self.search.open[: self.touching].copy()

    @property
    def work(self) -> int:
        """Single replans so far, joint ones counted as many."""
        work = self.search.work[0]
        return int(work["replans"] + work["joint_words"] // _JOINT_WORDS)

    @property
    def short_pair(self) -> int:
        """The pair that needs more steps, when the repair says that there is one."""
        return int(self.search.work[0]["short_pair"])

    def __str__(self) -> str:
        kept = int((~np.isnan(self.goal[:, 0])).sum())
        return f"{self.duration * self.steps:.1f} s, {kept} targets kept, {self.touching} contacts left"

    def place(self, who: np.ndarray, alone: bool = False) -> None:
        """Put positioners `who` (m,) on their cheapest paths past everyone else's, or as if nobody else were there."""
        if alone:
            in_parts_at_once(self._place_alone, who)
        else:
            place_each(self._arms, self.near, self.lattice, self.search, self._scratch, who, self.steps)
        self.update_contacts(who)

    def _place_alone(self, who: np.ndarray) -> None:
        """Put positioners `who` (m,) on their cheapest paths as if nobody else were there, wherever others are put."""
        nobody = self.near._replace(offsets=read_only(np.zeros_like(self.near.offsets), np.int64))
        place_each(self._arms, nobody, self.lattice, self.search, make_scratch(self.lattice, 0), who, self.steps)

    def update_contacts(self, who: np.ndarray | None = None) -> None:
        """Find all pairs that touch, or which of those of arms `who` (m,) do, the only ones with new paths."""
        which = np.arange(len(self.pairs)) if who is None else np.flatnonzero(np.isin(self.pairs, who).any(axis=1))
        in_parts_at_once(self._find_contacts, which)
        note_all(self.search)

    def _find_contacts(self, which: np.ndarray) -> None:
        """Find out in how many steps pairs `which` (m,) touch."""
        find_contacts(self._arms, self.lattice, self.pairs, which, self.limit, self.steps, self.search.contacts)

    def repair(self, most: int) -> int:
        """Repair until nothing touches, or so many replans; what `fiberplan.planners.direct.repair.repair` says."""
        result = repair(
            self._arms, self.near, self.lattice, self.pairs, self.search, self._scratch, self.limit, self.steps, most
        )
        if result == SOLVED:
            self.update_contacts()  # only pairs that were replanned are up to date, and success is of all
        return int(result) if result != SOLVED or not self.touching else SPENT

    def needed_past_fixed(self, who: np.ndarray) -> np.ndarray:
        """(m,) steps that positioners `who` (m,) need past what never moves; negative: there is no path."""
        arms, most = self._arms, self.most_steps
        return np.asarray(needed_past_fixed(arms, self.near, self.lattice, who, self._scratch, self.limit, most))

    def needed_alone(self, pair: int, apart: float) -> int:
        """Steps that a pair needs past each other, `apart` [mm], and what never moves, as `pairs.steps_alone` says.

        Who has no path has none at larger clearances either, so that is asked once of the same lattices.
        """
        if apart >= self._barred.get(pair, np.inf):
            return -1
        arms, near, lattice, scratch = self._arms, self.near, self.lattice, self._scratch
        need = int(needed_alone(arms, near, lattice, self.pairs, apart, scratch, pair, self.limit, self.most_steps))
        if need < 0 and need != UNKNOWN:
            self._barred[pair] = apart
        return need

    def lengthen(self, steps: int) -> None:
        """Let there be so many steps, if there are fewer."""
        if steps > self.steps:
            self.lattice = lengthened(self.lattice, steps)
            self._make_scratch(same_nodes=True)
            self.steps = steps

    @property
    def solution(self) -> Solution:
        """The paths as they are; those of `cut` are copies."""
        return Solution(self.steps, self.lattice)

    def go_back_to(self, solution: Solution) -> None:
        """Take the paths of a solution again."""
        same = self.lattice.beta is solution.lattice.beta  # nodes, as far as pairs that were searched jointly go
        self.steps, self.lattice = solution
        self._make_scratch(same_nodes=same)
        self.update_contacts()

    def cut(self, solution: Solution, steps: int) -> None:
        """Let there be so many steps, and paths as in a longer solution, but that late ones hurry."""
        self.steps = steps
        path = solution.lattice.path[:, : steps + 1].copy()
        self.lattice = solution.lattice._replace(path=path)
        self.search.held[:] = self.search.tries[:] = 0
        self.search.contacts[:] = 0  # of a solution
        raised = (self.search.needs > steps) & (self.search.joint_limits > self.limit)
        self.search.joint_limits[raised] = self.limit  # which may take fewer steps
        self.search.needs[raised] = 1
        late = ~np.isnan(self.goal[:, 0]) & (path[: self.plane.n, -1] != self.goal).any(axis=1)
        self.place(np.flatnonzero(late))

    def refine(self, who: np.ndarray, fineness: int) -> bool:
        """Give positioners `who` (m,) finer lattices, if theirs are coarser; whether any has got one."""
        who = np.unique(who[~self.lattice.fixed[who]])
        who = who[self.fineness[who] < fineness]
        if len(who):
            self.change_fineness(who, np.full(len(who), fineness))
        return len(who) > 0

    def change_fineness(self, who: np.ndarray, fineness: np.ndarray) -> None:
        """Give positioners `who` (m,) lattices of a `fineness` (m,), finer or coarser; their paths stay as they are."""
        self.fineness[who] = fineness
        pace, start = PACES[fineness], self.problem.start
        self.lattice = refined(self.lattice, self.plane, who, pace, start, self.goal, self.duration, *self._spacing)
        self._forget(who)

    def stop(self) -> None:
        """After an interrupt at any moment: as many steps as the paths have."""
        self.go_back_to(Solution(self.lattice.steps, self.lattice))

    def put_on(self, i: int, way: np.ndarray) -> None:
        """Let positioner i go a `way` (m, 2) [rad], step by step, and nowhere else."""
        self.fineness[i] = ON_ITS_WAY
        self.lattice = on_its_way(self.lattice, i, way)
        self.least_steps = max(self.least_steps, len(way) - 1)
        self._forget(np.array([i]))

    def take_off_ways(self, who: np.ndarray) -> bool:
        """Give those of arms `who` (m,) that are on ways of their own fine lattices again, for good; whether any were.

        A way is one of many, and others may have no path past it.
        """
        on_ways = [int(i) for i in who if i < self.plane.n and self.fineness[i] == ON_ITS_WAY]
        if on_ways:
            self.off_ways |= set(on_ways)
            self.change_fineness(np.array(on_ways), np.full(len(on_ways), FINEST))
        return len(on_ways) > 0

    def _make_scratch(self, same_nodes: bool) -> None:
        self._scratch = make_scratch(self.lattice, len(self.near.near), self._scratch, same_nodes)

    def _forget(self, who: np.ndarray) -> None:
        """Forget what was found on other lattices of positioners `who` (m,)."""
        self._make_scratch(same_nodes=False)
        search = self.search
        mine = np.isin(self.pairs, who).any(axis=1)
        self._unbar(who)
        search.limits[mine] = search.joint_limits[mine] = self.limit
        search.tries[mine] = search.joined[mine] = search.needs[mine] = 0

    def _unbar(self, who: np.ndarray) -> None:
        """Forget which pairs of arms `who` (m,) have no path: their lattices, or goals, are others now."""
        self._barred = {pair: apart for pair, apart in self._barred.items() if not np.isin(self.pairs[pair], who).any()}

    def start_afresh(self) -> None:
        """Forget what only made sense with fewer steps: clearances that were raised, and half of the weights."""
        search = self.search
        search.limits[:] = search.joint_limits[:] = self.limit
        search.weight[:] = 1.0 + 0.5 * (search.weight - 1.0)
        search.joined[:] = search.held[:] = 0

    def give_up(self, i: int, blockers: tuple[int, ...]) -> None:
        """Let positioner i end anywhere safe; if it was free to already, hold it at its start."""
        lattice = self.lattice
        self._scratch.clear_for["pair"] = -1  # those tables know of its goal
        lattice.path[i] = self.problem.start[i]
        if np.isnan(self.goal[i, 0]):
            self.held.add(i)
            lattice.fixed[i] = True
            if not np.isnan(self.problem.goal[i, 0]):
                self.given_up.setdefault(i, blockers)
            return
        self.given_up.setdefault(i, blockers)
        self._unbar(np.array([i]))
        self.goal[i] = np.nan
        lattice.last[i] = -1
