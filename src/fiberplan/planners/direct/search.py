"""From a problem to paths that touch nowhere: repair at the bound, more time where that is short, and at last losses.

The steps begin as the slowest joint needs them. A pair that needs more, even if nobody else were there, gets it; so
does everybody when the repair makes no headway. What still touches when time or work is up gives up goals: of the
least total priority that settles every contact, exactly.
"""

from collections.abc import Callable

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.direct.contacts import contacts_of_all
from fiberplan.planners.direct.lattice import MOST_STEPS, lengthened, make_lattice, step_length
from fiberplan.planners.direct.pairs import UNKNOWN
from fiberplan.planners.direct.repair import (
    HELD,
    SOLVED,
    TOO_SHORT,
    make_scratch,
    make_search,
    needed_alone,
    needed_past_fixed,
    note_all,
    place_each,
    repair,
)
from fiberplan.planners.direct.untangle import cluster_around, untangled
from fiberplan.planners.shared.memory import refuse_large
from fiberplan.problem import Problem
from fiberplan.problem.least_cover import least_loss
from fiberplan.tolerances import SLACK, UNDER_LIMIT

_CHUNK = 100  # replans between two checks of the clock
_PATIENCE = 400  # replans without a growing number of steps, and
_PATIENCE_PER_CONTACT = 3  # as many more for each pair that touched at first
_LONGEST = 4  # times the steps that the slowest joint needs, unless `max_time` says otherwise
_JOINT_WORK = 20  # single replans that a joint one counts as
_LARGEST_CLUSTER = 4  # moved jointly
_LONGER = 0.03  # joint paths may take this much longer than everyone has, times the square of how often all got stuck
_SECOND_WIND = 100  # replans for every goal given up


class DirectSearch:
    """Paths of all positioners on their lattices, becoming clear of each other."""

    def __init__(
        self,
        problem: Problem,
        near: Neighbourhood,
        goal: np.ndarray,
        turn: float,
        max_time: float | None,
        seed: int,
    ):
        plane = problem.plane
        self.problem, self.plane, self.near, self._arms = problem, plane, near, plane.arms
        self.pairs = near.pairs
        self.goal = goal.copy()
        self.limit = problem.margin + SLACK
        self.given_up: dict[int, tuple[int, ...]] = {}  #: positioner -> arms that block it
        self.held: set[int] = set()  #: never leave their start
        self.slowest_pair: tuple[int, int] | None = None
        self.slowest_need = 0  #: steps that it needs alone
        self.slowest_past_fixed: int | None = None  #: needs more than by joint speeds, past what never moves
        self.need_past_fixed = 0  #: steps that it needs
        travel = np.nan_to_num(np.abs(goal - problem.start) / (plane.max_speed * UNDER_LIMIT)).max(axis=1)
        bound = float(travel.max(initial=0.0))
        length = step_length(plane, problem.start, goal, turn)
        longest = max(length.longest, bound / MOST_STEPS)
        self.steps = max(1, int(np.ceil(bound / longest - 1e-9)))
        self.duration = bound / self.steps if bound > 0 else longest  #: of a step [s]
        self._most_steps = _LONGEST * self.steps + 20
        if max_time is not None:
            self._most_steps = max(self.steps, int(min(max_time / self.duration + 1e-9, self._most_steps)))
        path = (len(plane.arms.arm), self._most_steps + 1, 2)
        refuse_large(2 * 8 * float(np.prod(path, dtype=float)), f"direct: paths of {path[0]} arms in {path[1]} steps")
        self.lattice = make_lattice(plane, problem.start, goal, plane.online, self.duration, self.steps, length.widest)
        self.widest_turn = float(np.nanmax(np.diff(self.lattice.alpha, axis=1), initial=0.0))  #: of an alpha [rad]
        self._scratch = make_scratch(self.lattice)
        self.search = make_search(plane.n, len(self.pairs), self.limit, seed)

    @property
    def touching(self) -> int:
        """Pairs that still touch."""
        return int(self.search.touching[0])

    @property
    def work(self) -> int:
        """Single replans so far, joint ones counted as many."""
        work = self.search.work[0]
        return int(work["replans"] + _JOINT_WORK * work["joint_moves"])

    def __str__(self) -> str:
        kept = int((~np.isnan(self.goal[:, 0])).sum())
        return f"{self.duration * self.steps:.1f} s, {kept} targets kept, {self.touching} contacts left"

    def begin(self) -> None:
        """Everybody on the cheapest path of their own; those that need more steps past fixed arms get them."""
        online = np.flatnonzero(self.plane.online)
        kernel_arguments = (self._arms, self.near, self.lattice)
        nobody = self.near._replace(offsets=read_only(np.zeros_like(self.near.offsets), np.int64))
        fixed = self.lattice.fixed[self.pairs]
        beside = np.zeros(len(self.lattice.fixed), bool)
        beside[self.pairs[fixed[:, 0], 1]] = beside[self.pairs[fixed[:, 1], 0]] = True
        who = np.flatnonzero(beside[: self.plane.n] & self.plane.online & ~np.isnan(self.goal[:, 0]))
        needs = needed_past_fixed(*kernel_arguments, who, self._scratch, self.limit, self._most_steps)
        for i in who[(needs < 0) | (needs > self._most_steps)]:
            fixed_near = [int(j) for j in self.near.around(i) if self.lattice.fixed[j]]
            self._give_up(int(i), tuple(fixed_near))
        possible = np.where(needs <= self._most_steps, needs, 0)
        if possible.max(initial=0) > self.steps:
            self.slowest_past_fixed, self.need_past_fixed = int(who[possible.argmax()]), int(possible.max())
            self._lengthen(self.need_past_fixed)
        place_each(self._arms, nobody, self.lattice, self.search, self._scratch, online, self.steps)
        self._update_all_contacts()

    def _update_all_contacts(self) -> None:
        contacts_of_all(self._arms, self.lattice, self.pairs, self.limit, self.steps, self.search.contacts)
        note_all(self.search)

    def _lengthen(self, steps: int) -> None:
        if steps > self.steps:
            self.lattice = lengthened(self.lattice, steps)
            self._scratch = make_scratch(self.lattice)
            self.steps = steps

    def run(self, budget: int, proceed: Callable[[], bool]) -> bool:
        """Repair until nothing touches; False if `proceed` said to stop before that."""
        patience = _PATIENCE + _PATIENCE_PER_CONTACT * self.touching
        stuck, growth, last_resort = 0, 1, False
        while proceed():
            result = repair(
                self._arms, self.near, self.lattice, self.pairs, self.search, self._scratch, self.limit, self.steps,
                _CHUNK,
            )  # fmt: skip
            if result == SOLVED:
                self._update_all_contacts()  # `repair` updates only the pairs that it touched, and success is of all
                if not self.touching:
                    return True
            stuck += _CHUNK
            if result == TOO_SHORT:
                self._lengthen_for(int(self.search.work[0]["short_pair"]))
            elif self.work > budget or (stuck > patience and self.steps >= self._most_steps):
                untangled = 0 if last_resort else self._untangle(_LARGEST_CLUSTER, self._most_steps)
                last_resort = True
                budget = max(budget, self.work) + _SECOND_WIND * (untangled or len(self._settle()))
                stuck = 0
            elif stuck > patience:
                self._untangle(min(2 + growth, _LARGEST_CLUSTER), int(self.steps * (1 + _LONGER * growth**2)))
                self._lengthen(min(self.steps + growth, self._most_steps))
                stuck, growth, patience = 0, growth + 1, _PATIENCE
        return False

    def _untangle(self, size: int, most: int) -> int:
        """Put clusters of `size` around pairs that touch on joint paths of at most so many steps; how many move now."""
        lattice, search, goal = self.lattice, self.search, self.goal
        taken: set[int] = set()
        for p in search.open[: self.touching].tolist():
            movable = [i for i in self.pairs[p].tolist() if not lattice.fixed[i]]
            members = cluster_around(movable, size, self.near, search, lattice)
            if taken & set(members):
                continue
            ends = np.where(np.isnan(goal[members]), lattice.path[members, -1], goal[members])
            margin, seed = self.problem.margin, int(search.state[0] % np.uint64(2**31))
            path = untangled(self.plane, self.pairs, lattice, members, ends, margin, self.duration, seed)
            if path is None or len(path) - 1 > min(most, self._most_steps):
                continue
            taken |= set(members)
            self._lengthen(len(path) - 1)
            lattice = self.lattice
            at_rest = np.repeat(path[-1:], self.steps + 1 - len(path), axis=0)
            lattice.path[members] = np.concatenate([path, at_rest]).swapaxes(0, 1)
            search.held[members] = HELD
        if taken:
            self._update_all_contacts()
        return len(taken)

    def _lengthen_for(self, pair: int) -> None:
        """Find how many steps a pair needs that cannot be moved jointly; give up one of its goals if too many."""
        need = needed_alone(
            self._arms, self.near, self.lattice, self.pairs, self.search, self._scratch, pair, self.limit,
            self._most_steps,
        )  # fmt: skip
        if need == UNKNOWN:
            self.search.needs[pair] = 1  # not to be asked again
        elif need < 0 or need > self._most_steps:
            self._give_up_for(pair)
        else:
            self.search.needs[pair] = need
            if need > self.steps:
                self.slowest_pair, self.slowest_need = tuple(self.pairs[pair].tolist()), need
                self._lengthen(need)

    def _give_up_for(self, pair: int) -> None:
        """Give up the goal of whichever matters less of two that cannot both get there."""
        priority = self.problem.priority
        assert priority is not None  # set on construction
        i, j = (int(arm) for arm in self.pairs[pair])
        able = [arm for arm in (i, j) if not self.lattice.fixed[arm]]
        loser = min(able, key=lambda arm: (not np.isnan(self.goal[arm, 0]), priority[arm], arm))
        self._give_up(loser, (j if loser == i else i,))
        self._update_all_contacts()

    def _settle(self) -> list[int]:
        """Give up goals of the least priority that has a part in every contact; whose."""
        priority = self.problem.priority
        assert priority is not None  # set on construction
        touching = [(int(a), int(b)) for a, b in self.pairs[self.search.open[: self.touching]]]
        # one without a goal to lose would be held instead: the last resort
        weight = np.where(np.isnan(self.goal[:, 0]), priority.sum() + 1.0, priority)
        losses = least_loss(touching, ~self.lattice.fixed, weight)
        for i, blockers in losses.items():
            self._give_up(i, blockers)
        self._update_all_contacts()
        return list(losses)

    def _give_up(self, i: int, blockers: tuple[int, ...]) -> None:
        """Let positioner i end anywhere safe; if it was free to already, hold it at its start."""
        lattice = self.lattice
        lattice.path[i] = self.problem.start[i]
        if np.isnan(self.goal[i, 0]):
            self.held.add(i)
            lattice.fixed[i] = True
            if not np.isnan(self.problem.goal[i, 0]):
                self.given_up.setdefault(i, blockers)
            return
        self.given_up.setdefault(i, blockers)
        self.goal[i] = np.nan
        lattice.last[i] = -1

    def stop_here(self) -> None:
        """Make what there is safe, at any moment of the search: those that touch, or are under way, lose their goals.

        They get one replan each to make room; those that still touch are held at their starts.
        """
        lattice = self.lattice
        self.steps = lattice.steps
        self._scratch = make_scratch(lattice)
        ends = lattice.path[: self.plane.n, -1]
        unfinished = self.plane.online & ~np.isnan(self.goal[:, 0]) & (ends != self.goal).any(axis=1)
        for i in np.flatnonzero(unfinished):
            self._give_up(int(i), ())
        self._update_all_contacts()
        while self.touching:
            lost = [i for i in self._settle() if not lattice.fixed[i]]
            who = np.array(lost, np.int64)
            place_each(self._arms, self.near, lattice, self.search, self._scratch, who, self.steps)
            self._update_all_contacts()
