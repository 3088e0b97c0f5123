"""What to do with the few that a walk leaves stuck: they fold again, past the others as these fold.

A group is the stuck and who stood in their way. Its members forget what they did and are given paths one after the
other (`timed_search`), each past the recorded motions of everyone outside and past the members before it. In another
order there may be paths where there are none in this one, and with a neighbour that refused often as one more member,
too. So relief takes no time of its own: it goes on beside the others' folding.
"""

from collections.abc import Iterator

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory
from fiberplan.planners.greedy_fold.deadlock import Fold, stuck_groups
from fiberplan.planners.greedy_fold.timed_search import path_in_time

# Coarse steps first: arms that pass each other closely leave no room for those that are planned after them. At 2.0 mm,
# parked at (10, 170), 9 deg leaves 7 of 88 stuck, 6 deg 15, 3 deg 38; 7.5 deg frees some that 9 does not.
# The first of a group may have to wait, so that the others can get out of its path before they fold themselves.
_ATTEMPTS = np.radians([[9.0, 0.0], [7.5, 0.0], [9.0, 60.0], [9.0, 120.0]])  # step, and turn for which the first waits
_LARGEST_GROUP = 6
_GROWTHS = 3  # how often a group takes in one more
_SEARCHES = 120  # for one group: of 134 that were freed at 2.0 and 2.5 mm the hardest took 94
_LONGEST = 1.1  # times the fold as it would be if nobody were stuck: when all have to be folded

Knots = tuple[np.ndarray, np.ndarray]  # times (m,) [s] and angles (m, 2) [rad] of one positioner


class TimedRelief:
    """Frees whom a walk left stuck; `relieved` does it all."""

    def __init__(self, plane: FocalPlane, near: Neighbourhood, margin: float, movable: np.ndarray, walked: Fold):
        self._plane, self._near, self._margin, self._movable, self._walked = plane, near, margin, movable, walked
        self._stuck = set(map(int, walked.stuck))
        self._begin = walked.trajectory.start
        alone = (np.abs(plane.folded - self._begin) / plane.max_speed)[movable].max(initial=0.0)
        self._horizon = _LONGEST * max(walked.trajectory.duration, float(alone))  # [s]
        self._changed: dict[int, Knots] = {}  # who moves otherwise than in the walk
        self._searches = 0  # for the group at hand

    def relieved(self) -> Fold:
        """The walk in which as many groups as possible fold too, ended when all have arrived."""
        for group in stuck_groups(self._walked, self._movable):
            self._free(group)
        stuck = np.array([i for i in self._walked.stuck if i not in self._changed], np.int64)
        blockers = {i: j for i, j in self._walked.blockers.items() if i not in self._changed}
        return Fold(self._motion(), stuck, blockers)

    def _free(self, group: list[int]) -> None:
        """Find paths for a group, taking in whoever refused most if there are none."""
        self._searches = 0
        members = list(group)
        for _ in range(_GROWTHS + 1):
            refusals = np.zeros(len(self._near.offsets) - 1, np.int64)
            for step, wait in _ATTEMPTS.tolist():
                for order in self._orders(members):
                    if self._searches >= _SEARCHES or self._plan(order, step, wait, refusals):
                        return
            refusals = np.where(self._movable, refusals[: self._plane.n], 0)
            refusals[members] = 0
            if not refusals.any() or len(members) >= _LARGEST_GROUP:
                return
            members.append(int(np.argmax(refusals)))

    def _orders(self, members: list[int]) -> Iterator[list[int]]:
        """In which orders to plan a group: first the stuck alone, then everyone first once, both ways round."""
        stuck = [i for i in members if i in self._stuck]
        if len(stuck) < len(members):
            yield stuck
        for k in range(len(members)):
            turned = members[k:] + members[:k]
            yield turned
            if len(turned) > 2:
                yield turned[::-1]

    def _plan(self, order: list[int], step: float, wait: float, refusals: np.ndarray) -> bool:
        """Plan some positioners in this order, and keep that if all find a path; `refusals` (arms,) counts."""
        found: dict[int, Knots] = {}
        for place, i in enumerate(order):
            passing = [int(j) for j in self._near.around(i) if j not in order[place + 1 :]]
            others = [(j, *(found.get(j) or self._knots(j))) for j in passing]
            self._searches += 1
            path, refused = path_in_time(
                self._plane, i, self._begin[i], others, self._margin, self._horizon, step, 0.0 if place else wait
            )
            np.add.at(refusals, passing, refused)
            if path is None:
                return False
            found[i] = path
        self._changed |= found
        return True

    def _knots(self, arm: int) -> Knots:
        """How an arm moves; an obstacle has no knots."""
        if arm >= self._plane.n:
            return np.empty(0), np.empty((0, 2))
        return self._changed.get(arm) or self._walked.trajectory.knots(arm)

    def _motion(self) -> Trajectory:
        """Everyone's motion until the last has arrived."""
        if not self._changed:
            return self._walked.trajectory
        walked, n = self._walked.trajectory, self._plane.n
        anew = np.zeros(n, bool)
        anew[list(self._changed)] = True
        kept = ~anew[walked.owner]
        counts = [len(times) for times, _ in self._changed.values()]
        owner = np.concatenate([walked.owner[kept], np.repeat(list(self._changed), counts)])
        times = np.concatenate([walked.times[kept], *(times for times, _ in self._changed.values())])
        angles = np.concatenate([walked.angles[kept], *(angles for _, angles in self._changed.values())])
        motion = Trajectory.from_knots(owner, times, angles, n)
        moves = np.any(motion.angles != np.repeat(motion.end, np.diff(motion.offsets), axis=0), axis=1)
        until = float(motion.times[np.flatnonzero(moves) + 1].max(initial=0.0))
        ended = Trajectory.from_knots(motion.owner, np.minimum(motion.times, until), motion.angles, n)
        return ended
