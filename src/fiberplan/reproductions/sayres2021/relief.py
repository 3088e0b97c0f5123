"""The deadlock relief that Sayres2021 used: give a random deadlocked robot another target, rerun, until all fold."""

from dataclasses import dataclass

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood, clearances_around
from fiberplan.reproductions.sayres2021 import published
from fiberplan.reproductions.sayres2021.rules import RULES, Rule
from fiberplan.reproductions.sayres2021.trials import Trial
from fiberplan.scenes.uniform import uniform_field
from fiberplan.tolerances import SCENE

_DRAWS = 1000  # random targets tried before another robot is picked
MOST_REPLACEMENTS = 1000  #: tried before a trial counts as unresolved


@dataclass(frozen=True, eq=False)
class Relieved:
    """A field that was changed until it folds."""

    replaced: tuple[int, ...]  #: who was given another target, in order; empty if the field folds by itself
    angles: np.ndarray  #: (n, 2) the field in the end [rad]
    trial: Trial  #: its fold

    @property
    def lost(self) -> float:
        """Share of the field's targets that were lost."""
        return len(set(self.replaced)) / len(self.angles)


def replace_until_folded(
    plane: FocalPlane,
    field: np.ndarray,
    margin: float,
    step: float,
    rule: Rule,
    near: Neighbourhood,
    rng: np.random.Generator,
) -> Relieved:
    """Fold `field` (n, 2) [rad]; while that deadlocks, replace the target of one deadlocked robot and begin again."""
    angles = np.array(field, float)
    replaced: list[int] = []
    walker = rule.walk(plane, angles, margin, step, near)
    for _ in range(MOST_REPLACEMENTS):
        if not len(walker.stuck):
            break
        robot = int(rng.choice(walker.stuck))
        draws = plane.kinematics.random(plane, rng, np.full(_DRAWS, robot))
        room = clearances_around(plane.arms, near, plane.with_obstacles(angles), robot, draws)
        clear = np.flatnonzero(room >= margin + SCENE)
        if len(clear):
            angles[robot] = draws[clear[0]]
            replaced.append(robot)
            walker = rule.walk(plane, angles, margin, step, near)
    return Relieved(tuple(replaced), angles, Trial.of(plane, walker, margin))


Reliefs = dict[tuple[Rule, float], list[Relieved]]
"""Relieved trials by rule and buffer [mm]."""


def relieve(plane: FocalPlane, buffers: list[float], step: float, trials: int) -> Reliefs:
    """Make the same random fields fold under every rule, at each of `buffers` [mm]."""
    results: Reliefs = {(rule, buffer): [] for rule in RULES for buffer in buffers}
    for rule, buffer in results:
        margin = published.margin(buffer)
        near = Neighbourhood.of(plane, margin)
        for seed in range(trials):
            field, rng = uniform_field(plane, seed, margin), np.random.default_rng([seed, 1])
            results[rule, buffer].append(replace_until_folded(plane, field, margin, step, rule, near, rng))
    return results
