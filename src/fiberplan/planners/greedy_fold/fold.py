"""From anywhere to folded: the greedy walk, and what helps where it gets stuck."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood, touching
from fiberplan.planners.greedy_fold.deadlock import Fold
from fiberplan.planners.greedy_fold.joint_relief import JointRelief
from fiberplan.planners.greedy_fold.ranked_moves import EXHAUSTED, FOLDED
from fiberplan.planners.greedy_fold.timed_relief import TimedRelief
from fiberplan.planners.greedy_fold.walker import Walker
from fiberplan.tolerances import EQUALITY

RELIEFS = ("joint", "reverse", "replace", "none")
_PATIENCE = np.radians(20.0)  # turn without progress that counts as deadlock
_CONTRARY = np.radians([10.0, 60.0])  # for how long a deadlocked positioner's ranking is reversed
_RELIEF_TRAVEL = 3.0  # how many times `max_travel` may be walked when rankings are reversed
_FEW = 0.02  # part of the positioners: if more are stuck, the way they were sent is not worth mending


@dataclass(frozen=True, eq=False)
class Folding:
    """A fold that is asked for; the settings are those of `GreedyFold`."""

    plane: FocalPlane
    margin: float  #: [mm]
    movable: np.ndarray  #: (n,)
    near: Neighbourhood
    step: float  #: [rad]
    max_travel: float  #: [rad]
    skip_noops: bool
    relief: str
    expendable: np.ndarray | None = None  #: (n,) priorities by which a positioner may be given up to let others pass:
    #: it is then folded from the beginning. None: no one may, because they begin where they begin.

    def fold(self, angles: np.ndarray, rng: np.random.Generator) -> Fold:
        """Walk from `angles` (n, 2) [rad] to folded, with relief.

        Where all alphas turn the same way, few get stuck. So if a park state that asks for both ways leaves some stuck,
        all go to one that does not, and from there, all the same way again, to where they are parked.
        """
        walked = self._walk(angles, rng)
        if self.relief != "joint" or not len(walked.stuck):
            return walked
        few = len(walked.stuck) <= _FEW * self.plane.n
        found = self._in_time(walked) if few else walked
        if not len(found.stuck):
            return found
        detour = self._towards_coherent(angles, rng)
        if detour is not None and len(detour[1].stuck) < len(found.stuck):
            return self._onward(*detour, rng)
        return self._jointly(found if few else self._in_time(walked), rng)

    def _walk(self, angles: np.ndarray, rng: np.random.Generator) -> Fold:
        walker = Walker(
            self.plane,
            angles,
            self.margin,
            self.step,
            self.movable,
            skip_noops=self.skip_noops,
            patience=None if self.relief == "none" else _PATIENCE,
            neighbourhood=self.near,
        )
        travel = self.max_travel * (_RELIEF_TRAVEL if self.relief == "reverse" else 1.0)
        while walker.run(travel) not in (FOLDED, EXHAUSTED) and self.relief == "reverse":
            walker.reverse_ranking(int(rng.choice(walker.stuck)), rng.uniform(*_CONTRARY))
        return Fold(walker.trajectory(), walker.stuck, walker.blockers)

    def _in_time(self, walked: Fold) -> Fold:
        return TimedRelief(self.plane, self.near, self.margin, self.movable, walked).relieved()

    def _jointly(self, walked: Fold, rng: np.random.Generator) -> Fold:
        if not len(walked.stuck):
            return walked
        seed = int(rng.integers(2**32))
        return JointRelief(self.plane, self.near, self.margin, self.movable, walked, self.expendable, seed).fold()

    def _towards_coherent(self, angles: np.ndarray, rng: np.random.Generator) -> "tuple[Folding, Fold] | None":
        """The fold to the state to which all alphas turn the same way; None if there is no other such state."""
        plane, movable = self.plane, self.movable
        hub = np.where(movable[:, None], _coherent(plane), plane.folded)
        if np.array_equal(hub, plane.folded):
            return None
        standing = plane.with_obstacles(np.where(movable[:, None], hub, angles))
        touched = touching(plane.arms, self.near, standing, np.flatnonzero(movable), self.margin + EQUALITY)
        if np.any(touched >= 0):
            return None
        there = dataclasses.replace(self, plane=plane.replace(folded=hub))
        return there, there._in_time(there._walk(angles, rng))

    def _onward(self, there: "Folding", walked: Fold, rng: np.random.Generator) -> Fold:
        """A fold to the coherent state with what it left stuck freed jointly, and then everyone's from there."""
        first = there._jointly(walked, rng)
        arrived = self.movable.copy()
        arrived[first.stuck] = False
        onward = dataclasses.replace(self, movable=arrived, expendable=None)
        second = onward._jointly(onward._in_time(onward._walk(first.trajectory.end, rng)), rng)
        return Fold(
            first.trajectory.then(second.trajectory),
            np.sort(np.concatenate([first.stuck, second.stuck])),
            second.blockers | first.blockers,
            first.given_up,
        )


def _coherent(plane: FocalPlane) -> np.ndarray:
    """The state (n, 2) [rad] that is easy to fold to: arms folded back, all alphas at the end that elbows trail to."""
    lower, upper = np.maximum(plane.lower, plane.folded - 2 * np.pi), np.minimum(plane.upper, plane.folded + 2 * np.pi)
    right = lower[:, 1] + upper[:, 1] >= 0.0
    beta = np.clip(np.where(right, np.pi, -np.pi) - plane.zero[:, 1], lower[:, 1], upper[:, 1])
    return np.stack([np.where(right, lower[:, 0], upper[:, 0]), beta], axis=1)
