"""Folding random fields: who arrives, how long it takes, and whether the motion is safe. Trial k uses seed k."""

from dataclasses import dataclass
from time import process_time

import numpy as np

from fiberplan.certificates import verify
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory
from fiberplan.planners.greedy_fold.walker import Walker
from fiberplan.reproductions.sayres2021.published import margin
from fiberplan.reproductions.sayres2021.rules import RULES, Rule
from fiberplan.scenes.uniform import uniform_field


@dataclass(frozen=True)
class Trial:
    """One field folded under one rule."""

    folded: float  #: share of positioners
    fold_time: float  #: of the motion, complete or not [s]
    proven: bool  #: its certificate holds: no contact, nothing undecided, ranges and speeds kept
    overlap: float  #: deepest proven contact: how far inside the margin two arms come [mm]; 0 if none

    @property
    def complete(self) -> bool:
        """Whether all folded; if not, the trial is deadlocked."""
        return self.folded == 1.0

    @classmethod
    def of(cls, plane: FocalPlane, walker: Walker, margin: float) -> "Trial":
        """Judge a finished walk."""
        motion = walker.trajectory()
        certificate = verify(plane, motion, margin)
        overlap = max((margin - contact.clearance for contact in certificate.contacts), default=0.0)
        return cls(1.0 - len(walker.stuck) / plane.n, motion.duration, certificate.ok, overlap)


Sweep = dict[tuple[Rule, float], list[Trial]]
"""Trials by rule and buffer [mm]."""


def sweep(plane: FocalPlane, buffers: list[float], step: float, trials: int) -> Sweep:
    """Fold the same fields under every rule, at each of `buffers` [mm]."""
    results: Sweep = {(rule, buffer): [] for rule in RULES for buffer in buffers}
    for buffer in buffers:
        near = Neighbourhood.of(plane, margin(buffer))
        for seed in range(trials):
            field = uniform_field(plane, seed, margin(buffer))
            for rule in RULES:
                walker = rule.walk(plane, field, margin(buffer), step, near)
                results[rule, buffer].append(Trial.of(plane, walker, margin(buffer)))
    return results


def run_times(plane: FocalPlane, steps: list[float], trials: int) -> dict[tuple[Rule, float], list[float]]:
    """CPU time of a fold [s] by rule and step [rad], at no margin, neighbour lists at hand and kernels compiled."""
    near = Neighbourhood.of(plane, 0.0)
    times: dict[tuple[Rule, float], list[float]] = {(rule, step): [] for rule in RULES for step in steps}
    for seed in range(trials):
        field = uniform_field(plane, seed)
        for rule, step in times:
            begun = process_time()
            rule.walk(plane, field, 0.0, step, near)
            times[rule, step].append(process_time() - begun)
    return times


def forward(plane: FocalPlane, rule: Rule, step: float, trials: int) -> list[float]:
    """Share of positioners that arrive when the same greedy walks from folded towards random targets instead."""
    arrived = []
    for seed in range(trials):
        towards = plane.replace(folded=uniform_field(plane, seed))
        walker = rule.walk(towards, plane.folded, 0.0, step, Neighbourhood.of(plane, 0.0))
        arrived.append(1.0 - len(walker.stuck) / plane.n)
    return arrived


def folds_at(plane: FocalPlane, rule: Rule, steps: list[float]) -> list[Trajectory]:
    """The first random field that folds at each of `steps` [rad]: its motions."""
    near = Neighbourhood.of(plane, 0.0)
    for seed in range(1000):
        field = uniform_field(plane, seed)
        walkers = [rule.walk(plane, field, 0.0, step, near) for step in steps]
        if not any(len(walker.stuck) for walker in walkers):
            return [walker.trajectory() for walker in walkers]
    raise RuntimeError("no field folds at all of these steps")


def turned(motion: Trajectory) -> np.ndarray:
    """(n,) how far each positioner's joints turn in all [rad]."""
    turn = np.abs(np.diff(motion.angles, axis=0)).sum(axis=1)
    turn[motion.offsets[1:-1] - 1] = 0.0  # from one positioner to the next
    return np.add.reduceat(np.append(turn, 0.0), motion.offsets[:-1])


def apart(plane: FocalPlane, first: Trajectory, second: Trajectory) -> np.ndarray:
    """(n,) largest distance between a fiber in one motion and in the other at the same time [mm]."""
    widest = np.zeros(plane.n)
    for t in np.linspace(0.0, max(first.duration, second.duration), 500):
        gap = plane.fibers(first.at(t)) - plane.fibers(second.at(t))
        widest = np.maximum(widest, np.hypot(*gap.T))
    return widest
