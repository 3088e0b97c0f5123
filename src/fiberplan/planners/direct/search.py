"""From a problem to paths that touch nowhere: repair at the bound, more time where that is short, and at last losses.

The steps begin as the slowest joint needs them. A pair that needs more, even if nobody else were there, gets it; so
does everybody when the repair makes no headway. A solution with more steps than that is then made shorter. What still
touches when time or work is up gives up goals: of the least total priority that settles every contact, exactly.
"""

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np

from fiberplan.planners.direct.narrow import (
    FINE,
    crowding_out,
    eased,
    leaves_goal,
    makes_room,
    steps_past_fixed,
)
from fiberplan.planners.direct.pairs import UNKNOWN
from fiberplan.planners.direct.paths import ON_ITS_WAY, Paths
from fiberplan.planners.direct.repair import SOLVED, SPENT, TOO_SHORT
from fiberplan.planners.direct.settling import give_up_one_of, settle
from fiberplan.planners.direct.untangle import apart, cluster_around, untangled
from fiberplan.planners.shared.threads import at_once

PATIENCE = 100  #: work in which the contacts do not get fewer, before there are more steps
SMALLEST_CLUSTER = 2
_LARGEST_CLUSTER = 8  # moved jointly
_CHUNK = 50  # replans between two checks of the clock
_GROWTH = 0.03  # of the steps, the first time; as much more every time
_FEW = 2  # contacts, of which each try may be a joint one
_SMALL_CHUNK = 10  # replans then
_LONGER = 0.03  # joint paths may take this much longer than everyone has, times the square of how often all got stuck
_HELD = 60  # conflicts after which one of a cluster may be replanned alone
_SECOND_WIND = 100  # replans for every goal given up


class DirectSearch(Paths):
    """Paths of all positioners on their lattices, becoming clear of each other."""

    slowest_pair: tuple[int, int] | None = None
    slowest_need = 0  #: steps that it needs alone
    slowest_past_fixed: int | None = None  #: needs more than by joint speeds, past what never moves
    need_past_fixed = 0  #: steps that it needs
    cluster_size = SMALLEST_CLUSTER  #: that is tried next

    def begin(self) -> None:
        """Everybody on the cheapest path of their own; those that need more steps past fixed arms get them."""
        fixed, able = self.lattice.fixed[self.pairs], self.plane.online & ~np.isnan(self.goal[:, 0])
        beside = np.zeros(len(self.lattice.fixed), bool)
        beside[self.pairs[fixed[:, 0], 1]] = beside[self.pairs[fixed[:, 1], 0]] = True
        who = np.flatnonzero(beside[: self.plane.n] & able)
        needs = steps_past_fixed(self, who)
        barred = []
        for k in np.flatnonzero((needs < 0) | (needs > self.most_steps)):
            i = int(who[k])
            needs[k] = leaves_goal(self, i)
            if needs[k] < 0:
                barred.append(i)
        for j in barred:
            for i in crowding_out(self, j):
                self.give_up(i, (j,))
                needs[who == i] = -1
        possible = np.where((needs >= 0) & (needs <= self.most_steps), needs, 0)
        if possible.max(initial=0) > self.steps:
            self.slowest_past_fixed, self.need_past_fixed = int(who[possible.argmax()]), int(possible.max())
            self.lengthen(self.need_past_fixed)
        self.least_steps = max(self.least_steps, self.steps)
        self.place(np.flatnonzero(self.plane.online), alone=True)

    def run(self, budget: int, proceed: Callable[[], bool]) -> bool:
        """Repair until nothing touches; False if `proceed` said to stop before that."""
        fewest, stuck, growth, last_resort = self.touching, 0, 1, False
        self.cluster_size = SMALLEST_CLUSTER
        while proceed():
            before = self.work
            result = self.attempt()
            if result == SOLVED:
                return True
            stuck += self.work - before
            if self.touching < fewest or eased(self):
                stuck, self.cluster_size = 0, SMALLEST_CLUSTER
            if result == TOO_SHORT:
                self._lengthen_for(self.short_pair)
            elif self.work > budget or (stuck > PATIENCE and self.steps >= self.most_steps):
                rescued = 0 if last_resort else self._untangle(self.in_contact, _LARGEST_CLUSTER, self.most_steps)
                last_resort = True
                rescued = rescued or makes_room(self, np.unique(self.pairs[self.in_contact]))
                budget = max(budget, self.work) + _SECOND_WIND * (rescued or len(settle(self)))
                fewest, stuck = self.touching, 0
            elif stuck > PATIENCE:
                if growth > 2:
                    longest = int(self.steps * (1 + _LONGER * growth**2))
                    self._untangle(self.in_contact, min(growth, _LARGEST_CLUSTER), longest)
                self.lengthen(min(max(self.steps + 1, int(self.steps * (1 + _GROWTH * growth))), self.most_steps))
                self.start_afresh()
                self.take_off_ways(np.unique(self.pairs[self.in_contact]))
                fewest, stuck, growth = self.touching, 0, growth + 1
                self.cluster_size = SMALLEST_CLUSTER
            fewest = min(fewest, self.touching)
        return False

    def attempt(self) -> int:
        """Repair for a while; where few contacts are left, try a joint path of those around, of one more every time."""
        result = self.repair(_CHUNK if self.touching > _FEW else _SMALL_CHUNK)
        if result == SPENT and self.touching <= _FEW and self.cluster_size <= _LARGEST_CLUSTER:
            found = self._untangle(self.in_contact, self.cluster_size, self.steps)
            self.cluster_size = SMALLEST_CLUSTER if found else self.cluster_size + 1
        return result

    def _untangle(self, pairs: Iterable[int], size: int, most: int) -> int:
        """Put clusters of `size` around some pairs on joint paths of at most so many steps; how many move now.

        Clusters that have no member in common are searched at the same time.
        """
        movable = [[i for i in self.pairs[pair].tolist() if not self.lattice.fixed[i]] for pair in pairs]
        left = [cluster_around(core, size, self.near, self.search, self.lattice) for core in movable]
        taken: set[int] = set()
        while left:
            clusters = apart(left)
            left = [members for members in left if members not in clusters]
            for members, path in zip(clusters, at_once([partial(self._joint_path, m) for m in clusters]), strict=True):
                if path is None or len(path) - 1 > min(most, self.most_steps):
                    continue
                taken |= set(members)
                self.lengthen(len(path) - 1)
                at_rest = np.repeat(path[-1:], self.steps + 1 - len(path), axis=0)
                self.lattice.path[members] = np.concatenate([path, at_rest]).swapaxes(0, 1)
                self.search.held[members] = _HELD
            left = [members for members in left if not taken & set(members)]
        if taken:
            self.update_contacts(np.array(sorted(taken)))
        return len(taken)

    def _joint_path(self, members: list[int]) -> np.ndarray | None:
        """A joint path (m, k, 2) [rad] of a cluster as if nobody else moved, if one is found."""
        goal, state = self.goal[members], self.search.state
        ends = np.where(np.isnan(goal), self.lattice.path[members, -1], goal)
        margin, seed = self.problem.margin, int(state[0] % np.uint64(2**31))
        return untangled(self.plane, self.pairs, self.lattice, members, ends, margin, self.duration, seed)

    def _lengthen_for(self, pair: int) -> None:
        """Find how many steps a pair needs that cannot be moved jointly; give up one of its goals if too many."""
        arms, apart = self.pairs[pair], self.search.joint_limits
        need = self.needed_alone(pair, apart[pair])
        coarse = arms[self.fineness[arms] < FINE]
        if need < 0 and need != UNKNOWN and self.refine(coarse, FINE):
            finer = self.needed_alone(pair, apart[pair])
            if 0 <= finer <= self.most_steps:
                need = finer
            else:  # finer lattices take longer to search, and do not help
                self.change_fineness(coarse, np.zeros(len(coarse), np.int64))
        self.search.needs[pair] = max(need, 1)  # not to be asked again
        if 0 <= need <= self.most_steps:
            self._note_bound(pair, need)
            self.lengthen(need)
            return
        free = need == UNKNOWN or any(self._untangle([pair], size, self.most_steps) for size in (2, 3))
        if not free and not self.take_off_ways(arms) and not makes_room(self, arms):
            give_up_one_of(self, pair)

    def _note_bound(self, pair: int, need: int) -> None:
        """No plan has fewer steps than a pair needs alone, where its clearance is not raised."""
        arms = self.pairs[pair]
        if need <= self.least_steps or (self.fineness[arms] == ON_ITS_WAY).any():  # on ways, others may need less
            return
        if self.search.joint_limits[pair] > self.limit:
            need = self.needed_alone(pair, self.limit)
        if need > self.least_steps:
            self.least_steps = self.slowest_need = need
            self.slowest_pair = int(arms[0]), int(arms[1])
