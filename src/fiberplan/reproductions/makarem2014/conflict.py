"""Fig. 7 and 8: three positioners in a conflict that one of them ends by making room for another."""

from dataclasses import dataclass

import numpy as np

from fiberplan.plan import Outcome, Plan
from fiberplan.reproductions.makarem2014 import scenes
from fiberplan.reproductions.makarem2014.rules import LITERAL

MADE_WAY = 0.5  #: [mm] a fiber that goes this much farther from its target again makes room
CLOSE = 2.5  #: [mm] two fiber ends that come this near are in each other's way
MOST_SEEDS = 2000
SAMPLES = 600


@dataclass(frozen=True, eq=False)
class Conflict:
    """The motion, sampled."""

    plan: Plan
    times: np.ndarray  #: (k,) [s]
    fibers: np.ndarray  #: (k, 3, 2) [mm]
    elbows: np.ndarray  #: (k, 3, 2) [mm]
    speeds: np.ndarray  #: (k, 3, 2) of the joints just after each time [rad/s]

    @property
    def targets(self) -> np.ndarray:
        """(3, 2) [mm]."""
        return self.plan.problem.plane.fibers(self.plan.problem.goal)

    @property
    def detours(self) -> np.ndarray:
        """(3,) how far each fiber at most went away from its target again after it had come near [mm]."""
        away = np.hypot(*np.moveaxis(self.fibers - self.targets, -1, 0))
        return (away - np.minimum.accumulate(away, axis=0)).max(axis=0)

    @property
    def closest(self) -> np.ndarray:
        """(3,) smallest distance of each two fiber ends [mm]."""
        i, j = np.array([0, 0, 1]), np.array([1, 2, 2])
        return np.hypot(*np.moveaxis(self.fibers[:, i] - self.fibers[:, j], -1, 0)).min(axis=0)

    @classmethod
    def of(cls, seed: int) -> "Conflict":
        """The scene of that seed under the literal rule."""
        plan = LITERAL.plan(scenes.crowded_three(seed))
        plane, motion = plan.problem.plane, plan.trajectory
        times = np.linspace(0.0, motion.duration, SAMPLES)
        angles = np.array([motion.at(t) for t in times])
        fibers, elbows = (np.array([place(a) for a in angles]) for place in (plane.fibers, plane.elbows))
        speeds = np.gradient(angles, times, axis=0) if motion.duration > 0 else np.zeros_like(angles)
        return cls(plan, times, fibers, elbows, speeds)


def find_conflict(first: int = 0) -> int:
    """The first seed from `first` on in which all three are in a conflict and converge, one after making room."""
    for seed in range(first, MOST_SEEDS):
        conflict = Conflict.of(seed)
        converge = set(conflict.plan.outcomes) == {Outcome.ARRIVED}
        if converge and conflict.detours.max() > MADE_WAY and np.all(np.sort(conflict.closest)[:2] < CLOSE):
            return seed
    raise RuntimeError(f"none of {MOST_SEEDS} scenes has three in a conflict that ends")
