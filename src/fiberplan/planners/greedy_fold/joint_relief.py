"""What to do when the greedy walk ends with a few positioners stuck: a joint way out for each group of them.

Groups are small (a stuck positioner and whoever refuses it its best move), so the search is a matter of milliseconds.
Where there seems to be no way, and it is a way back from goals, one positioner of the group can be given up: it is
folded from the beginning, provided that this is clear of everyone's recorded motion, and the rest of the group tries
again. So nothing has to be walked anew.
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.kernels.compile import kernel
from fiberplan.motion import Trajectory
from fiberplan.planners.greedy_fold.deadlock import Fold, stuck_groups
from fiberplan.planners.shared.rrt_connect import joint_path
from fiberplan.planners.shared.straighten import as_knots, clear_of
from fiberplan.tolerances import SLACK, UNDER_LIMIT

_LARGEST_GROUP = 6  # that is searched jointly
_SEARCHES = 8  # for every group, on average: failing searches are what takes long
_MOST_CANDIDATES = 3  # of a group, for being given up
_GROWTHS = 3  # how often a group takes in one more when no joint way is found
_MOST_SAMPLES = 5000  # of a whole recorded motion; one that takes more counts as not clear


@dataclass(frozen=True, eq=False)
class Way:
    """A joint way to folded for a few positioners."""

    members: list[int]
    times: np.ndarray  #: (m,) [s]
    angles: np.ndarray  #: (m, k, 2) [rad]


@kernel
def _rests_clear(arms, knots, offsets, near, i, limit):
    """Whether arm i, resting at the last two of `knots`, keeps `limit` [mm] from its neighbours' motions."""
    a, b = len(knots) - 2, len(knots) - 1
    for k in range(near.offsets[i], near.offsets[i + 1]):
        j = near.near[k].arm
        first = last = 0
        if j < len(offsets) - 1:
            first, last = offsets[j], offsets[j + 1]
        if not clear_of(arms, knots, i, a, b, j, first, last, limit, _MOST_SAMPLES):
            return False
    return True


class JointRelief:
    """Continues a stuck walk; `fold` does it all."""

    def __init__(
        self,
        plane: FocalPlane,
        near: Neighbourhood,
        margin: float,
        movable: np.ndarray,
        walked: Fold,
        expendable: np.ndarray | None,
        seed: int,
    ):
        self._plane, self._near, self._margin, self._movable, self._seed = plane, near, margin, movable, seed
        self._expendable = expendable
        self._stuck, self._blockers, self._walked = walked.stuck, walked.blockers, walked.trajectory
        self._groups = stuck_groups(walked, movable)
        self._stood = np.array(self._walked.end)  # where the walk ended
        self._angles = np.array(self._walked.end)  # where everyone is after the ways found so far
        self._done_at = np.zeros(plane.n)  # when everyone has arrived for good, after the walk [s]
        self._ways: list[tuple[Way, float]] = []
        self._given_up: list[int] = []
        self._searches_left = 0
        self._knots: np.ndarray | None = None

    def fold(self) -> Fold:
        """Find a way for every group that has one.

        Each group sees the others as they are when its turn comes, and sets out when those next to it have arrived. One
        that found no way gets another chance when one next to it found one.
        """
        waiting = self._groups
        self._searches_left = _SEARCHES * (len(waiting) + 1)
        changed = set(range(self._plane.n))  # where something is different from the last time a search failed there
        while any(changed.intersection(group) for group in waiting):
            before, changed = changed, set()
            for group in [g for g in waiting if before.intersection(g)]:
                if self._free(group):
                    waiting.remove(group)
                    changed |= self._around(group)
        if self._expendable is not None:
            for group in waiting:
                self._free_some(group)
        away = np.any(self._angles[self._stuck] != self._plane.folded[self._stuck], axis=1)
        stuck = self._stuck[away]
        blockers = {i: self._blockers[i] for i in (*map(int, stuck), *self._given_up) if i in self._blockers}
        return Fold(self._motion(), stuck, blockers, tuple(sorted(self._given_up)))

    def _around(self, members: list[int]) -> set[int]:
        """The members and all positioners next to them."""
        near = {int(j) for i in members for j in self._near.around(i) if j < self._plane.n}
        return near | set(members)

    def _free(self, group: list[int]) -> bool:
        """Find a joint way to folded, taking in whoever stood in the way most if there is none; False if none."""
        plane, members = self._plane, group
        if np.array_equal(self._angles[group], plane.folded[group]):
            return True  # another group has taken them all in
        for growth in range(_GROWTHS + 1):
            if len(members) > _LARGEST_GROUP or self._searches_left <= 0:
                return False
            self._searches_left -= 1
            path, blame = joint_path(
                plane,
                self._near,
                np.array(members),
                self._angles,
                plane.folded[members],
                self._margin,
                self._seed + growth,
            )
            if path is not None:
                times = path[0] / UNDER_LIMIT
                begin = float(self._done_at[list(self._around(members))].max())
                self._ways.append((Way(members, times, path[1]), begin))
                self._done_at[members] = begin + times[-1]
                self._angles[members] = plane.folded[members]
                return True
            outside = np.where(self._movable, blame[: plane.n], 0)
            outside[members] = 0
            if not outside.any():
                return False
            members = sorted([*members, int(np.argmax(outside))])
        return False

    def _free_some(self, group: list[int]) -> None:
        """Free the rest of a group by giving up one of its members: of those that help, the one that matters least."""
        assert self._expendable is not None  # or this is not called
        rank, stuck = self._expendable, set(map(int, self._stuck))
        candidates = sorted((i for i in group if i in stuck), key=lambda i: (rank[i], i))
        for i in [i for i in candidates if self._may_rest(i)][:_MOST_CANDIDATES]:
            if self._free_without(group, i):
                return

    def _free_without(self, group: list[int], i: int) -> bool:
        """Give up positioner `i` if that frees the rest of its group."""
        stood = self._angles[i].copy()
        self._angles[i] = self._plane.folded[i]
        if self._free([k for k in group if k != i]):
            self._given_up.append(i)
            return True
        self._angles[i] = stood
        return False

    def _may_rest(self, i: int) -> bool:
        """Whether positioner `i` could have been folded all along, for all that the others have done."""
        around = self._around([i])
        if any(around.intersection(way.members) for way, _ in self._ways) or around.intersection(self._given_up):
            return False
        if not self._walked.duration > 0:
            return False
        if self._knots is None:
            knots = as_knots(self._walked)
            self._knots = np.concatenate([knots, np.zeros(2, knots.dtype)])
        self._knots["alpha"][-2:], self._knots["beta"][-2:] = self._plane.folded[i]
        self._knots["time"][-2:] = 0.0, self._walked.duration
        limit = self._margin + 2 * SLACK
        return bool(_rests_clear(self._plane.arms, self._knots, self._walked.offsets, self._near, i, limit))

    def _motion(self) -> Trajectory:
        """The walk, with those given up at rest, then the ways."""
        walked = self._walked
        if self._given_up:
            at_rest = np.zeros(self._plane.n, bool)
            at_rest[self._given_up] = True
            owner = walked.owner
            angles = np.where(at_rest[owner][:, None], self._plane.folded[owner], walked.angles)
            walked = Trajectory(walked.offsets, walked.times, read_only(angles))
            self._stood[self._given_up] = self._plane.folded[self._given_up]
        return walked.then(_together(self._stood, self._ways)) if self._ways else walked


def _together(angles: np.ndarray, ways: list[tuple[Way, float]]) -> Trajectory:
    """One motion of everyone: each way from its beginning [s] on, the others at rest."""
    owner, times, knots = [np.arange(len(angles))], [np.zeros(len(angles))], [angles]
    for way, begin in ways:
        for k, i in enumerate(way.members):
            owner.append(np.full(len(way.times), i))
            times.append(begin + way.times)
            knots.append(way.angles[:, k])
    return Trajectory.from_knots(np.concatenate(owner), np.concatenate(times), np.concatenate(knots), len(angles))
