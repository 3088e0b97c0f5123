"""A new path for one positioner past everyone else's, which they keep; where there is none, a few make room.

The search is the direct planner's (`fiberplan.planners.direct`), on a patch of the array: the one positioner takes the
cheapest path past its neighbours; those that it still touches are freed, and contacts among the freed are repaired;
those that they touch are freed next. All that are not freed move as before, and so do those freed for nothing.
What is found on the lattice is proven on the patch by `fiberplan.verify`; a pair that fails is kept farther apart.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.certificates import verify
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory
from fiberplan.planners.amending.subarray import patch_around, with_part
from fiberplan.planners.direct.contacts import find_contacts
from fiberplan.planners.direct.lattice import Lattice, make_lattice
from fiberplan.planners.direct.nodes import step_length
from fiberplan.planners.direct.repair import (
    SOLVED,
    Search,
    make_search,
    note_all,
    place_each,
    repair,
)
from fiberplan.planners.direct.scratch import make_scratch
from fiberplan.planners.direct.trim import as_trajectory
from fiberplan.planners.shared.straighten import straighten
from fiberplan.tolerances import NEAR as NEAR_MARGIN
from fiberplan.tolerances import SLACK, UNDER_LIMIT

_TURN = np.radians(6.0)  # of the fastest joint in a step
_MOST_STEPS = 120, 400  # a motion that lasts longer is searched in longer steps: at first, and later
_FEWEST_STEPS = 20  # where some are to be added
_REPAIRS = (5, 30, 60, 120, 120)  # replans in each round; before the next, those in contact are freed
_JOINTLY = 2  # from this round on pairs may be moved jointly, which is expensive
_MOST_JOINTLY = 6  # such moves in all rounds
_CHUNK = 5  # replans between two checks of how many there were
_MOST_FREED = 10
_PROOFS = 4  # of one result; between them, pairs that failed are kept farther apart
_CLOSE, _BLOCKED = 10.0, 1000.0  # prices of a step in contact with what could make room and what cannot
_INFLATION = 0.2  # [mm] for a pair that failed its proof


class Rerouted(NamedTuple):
    """What came of it."""

    motion: Trajectory | None  #: of everybody; None: no path was found
    moved: tuple[int, ...]  #: positioners that move otherwise than before
    blockers: tuple[int, ...]  #: without a path: arms that blocked it; -1 - k is obstacle k


def reroute(
    plane: FocalPlane, margin: float, motion: Trajectory, ends: np.ndarray, amended: int, longer: float, seed: int
) -> Rerouted:
    """Lead positioner `amended` to its end, everyone else as before as far as that goes.

    Args:
        plane: whose bodies keep clear of each other.
        margin: clearance to keep [mm].
        motion: of everybody so far; those that are not rerouted keep it, safe or not.
        ends: (n, 2) where everybody has to end [rad]; NaN rows: anywhere safe.
        amended: the positioner.
        longer: part of the motion's duration that may be added where there is no path without.
        seed: of the order of repairs.
    """
    needed = float((np.abs(ends[amended] - motion.start[amended]) / plane.max_speed[amended]).max()) / UNDER_LIMIT
    horizon = max(motion.duration, needed)
    blockers: tuple[int, ...] = ()
    for added in sorted({0.0, longer}):
        free, jointly = [amended], _MOST_JOINTLY
        for turn, most in enumerate(_REPAIRS):
            attempt = _Attempt(
                plane, margin, motion, ends, free, horizon, added, turn, jointly * (turn >= _JOINTLY), seed
            )
            found = attempt.run(amended, most)
            jointly = max(0, jointly - attempt.moved_jointly)
            if found is not None:
                return Rerouted(*found, ())
            blockers = blockers or attempt.in_contact_with([amended])
            others = [j for j in attempt.in_contact_with(free) if j >= 0 and plane.online[j] and j not in free]
            free = [*free, *others][:_MOST_FREED]
    return Rerouted(None, (), blockers)


class _Attempt:
    """The paths of a few free positioners among others that move as before."""

    def __init__(
        self,
        whole: FocalPlane,
        margin: float,
        motion: Trajectory,
        ends: np.ndarray,
        free: list[int],
        horizon: float,
        added: float,
        turn: int,
        jointly: int,
        seed: int,
    ):
        self._motion, self._margin, self._limit = motion, margin, margin + SLACK
        self._patch = patch = patch_around(whole, np.array(free), margin + NEAR_MARGIN)
        self._free = np.flatnonzero(np.isin(patch.who, free))
        plane, start = patch.plane, motion.start[patch.who]
        movable = np.isin(np.arange(plane.n), self._free)
        goal = np.where(movable[:, None], ends[patch.who], start)
        length = step_length(plane, start, goal, _TURN)
        longest = max(length.longest, (1.0 + added) * horizon / _MOST_STEPS[turn > 0])
        if added:
            longest = min(longest, horizon / _FEWEST_STEPS)
        steps = max(1, int(np.ceil(horizon / longest - 1e-9)))
        self._duration = horizon / steps
        steps += int(added * steps)
        self._before = motion.select(patch.who)
        self._lattice: Lattice = make_lattice(plane, start, goal, movable, self._duration, steps, length.widest)
        self._lattice.path[: plane.n] = self._before.sampled(self._duration * np.arange(steps + 1))
        self._as_before = self._lattice.path.copy()
        self._jointly = jointly
        self._near = Neighbourhood.of(plane, margin)
        self._pairs = self._near.pairs
        self._search: Search = make_search(plane.n, len(self._pairs), self._limit, seed)
        able = np.concatenate([plane.online, np.zeros(len(plane.obstacles), bool)])
        self._search.weight[:] = np.where(able[self._pairs].all(axis=1), _CLOSE, _BLOCKED)
        self._search.needs[:] = 1  # how long a pair needs alone is not asked here
        if not jointly:
            self._search.tries[:] = -sum(_REPAIRS)

    @property
    def moved_jointly(self) -> int:
        """How often pairs were moved jointly."""
        return int(self._search.work[0]["joint_moves"])

    def run(self, amended: int, most: int) -> tuple[Trajectory, tuple[int, ...]] | None:
        """Everybody's motion and which positioners it changes, if `most` replans find paths that are proven."""
        lattice, search, arms, patch = self._lattice, self._search, self._patch.plane.arms, self._patch
        scratch = make_scratch(lattice, len(self._near.near))
        first, every = np.flatnonzero(patch.who == amended), np.arange(len(self._pairs))
        place_each(arms, self._near, lattice, search, scratch, first, lattice.steps)
        find_contacts(arms, lattice, self._pairs, every, self._limit, lattice.steps, search.contacts)
        for _ in range(_PROOFS):
            note_all(search)
            for _ in range(0, most, _CHUNK):
                result = repair(
                    arms, self._near, lattice, self._pairs, search, scratch, self._limit, lattice.steps, _CHUNK
                )
                if result == SOLVED or self.moved_jointly > self._jointly:
                    break
            if result != SOLVED:
                return None
            changed = [i for i in self._free if not np.array_equal(lattice.path[i], self._as_before[i])]
            motion = self._as_motion(np.array(changed, np.int64))
            failed = self._failed(motion)
            if not len(failed):
                moved = patch.who[changed]
                part = motion.select(np.array(changed, np.int64))
                return with_part(self._motion, moved, part), tuple(int(i) for i in moved)
            search.limits[failed] += _INFLATION
            search.contacts[failed] = 1
        return None

    def _as_motion(self, changed: np.ndarray) -> Trajectory:
        """The patch's motion, those that `changed` along their new paths, with few knots."""
        new = as_trajectory(self._lattice.path[changed], self._duration)
        motion = with_part(self._before, changed, new)
        return straighten(self._patch.plane, motion, self._margin, self._near, changed)

    def _failed(self, motion: Trajectory) -> np.ndarray:
        """Pairs with a free positioner that are not proven safe."""
        certificate = verify(self._patch.plane, motion, self._margin)
        fixed, arm = self._lattice.fixed, self._patch.plane.arm
        pairs = {(c.pair[0], arm(c.pair[1])) for c in (*certificate.contacts, *certificate.undecided)}
        failed = [tuple(pair) in pairs and not (fixed[pair[0]] and fixed[pair[1]]) for pair in self._pairs.tolist()]
        return np.flatnonzero(failed)

    def in_contact_with(self, positioners: list[int]) -> tuple[int, ...]:
        """Arms that `positioners` touched last, themselves left out; obstacle k is -1 - k."""
        found: list[int] = []
        for i, j in self._pairs[self._search.contacts > 0].tolist():
            arms = [self._patch.whole(self._patch.plane.public(arm)) for arm in (i, j)]
            found += [b for a, b in (arms, arms[::-1]) if a in positioners]
        return tuple(sorted(set(found)))
