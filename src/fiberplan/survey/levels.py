"""What options are worth, level by level: required positions, then each tier's priorities, then short motion.

Priorities are made whole numbers, so that sums are exact and the same in any order. The cost of an option's motion
grows as a high power of its time, since what counts in the end is the slowest.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.problem import Problem
from fiberplan.survey.catalogue import Catalogue
from fiberplan.survey.options import Options

_DIGITS = 6  #: of priorities that count after the point, where all of them have no more
_PARTS = 1_000_000  #: of the largest priority, to which others are rounded where they have more digits; and of motion
_POWER = 8  #: of an option's time, which is its cost: design/allocation.md


class Levels(NamedTuple):
    """Levels, the first of which counts most."""

    weight: np.ndarray  #: (m, levels) whole numbers of each option; the last level is motion
    tiers: tuple[int, ...]  #: tiers in order; their levels are the last before motion
    scale: tuple[float, ...]  #: of each tier: its whole numbers for a priority of 1

    @property
    def first_tier(self) -> int:
        """Level of the first tier; those before it are of required positions."""
        return self.weight.shape[1] - 1 - len(self.tiers)

    @classmethod
    def of(cls, there: Problem, catalogue: Catalogue, options: Options, group: np.ndarray) -> "Levels":
        """What each of `options` is worth; one of a `group` (m,) counts as a required position, and has no tier."""
        required = group >= 0
        columns = [required.astype(np.int64)] if required.any() else []
        tier = catalogue.tier[options.target]
        tiers = np.unique(tier[~required]).tolist()
        scales = []
        for each in tiers:
            mine = (tier == each) & ~required
            scale = _scale(catalogue.priority[options.target[mine]])
            worth = np.rint(catalogue.priority[options.target] * scale)
            columns.append(np.where(mine, worth, 0).astype(np.int64))
            scales.append(scale)
        columns.append(-motion_cost(there, options))
        return cls(read_only(np.stack(columns, axis=1), np.int64), tuple(tiers), tuple(scales))


def _scale(priority: np.ndarray) -> float:
    """By how much these priorities (k,) are multiplied to be whole numbers."""
    for digits in range(_DIGITS + 1):
        shifted = priority * 10.0**digits
        if np.abs(shifted).max(initial=0.0) < 2.0**40 and np.allclose(shifted, np.rint(shifted), rtol=0, atol=1e-6):
            return 10.0**digits
    return _PARTS / float(priority.max())


def travel_times(there: Problem, options: Options) -> np.ndarray:
    """(m,) least time from the start to each option [s]."""
    who = options.positioner
    turn = options.angles - there.start[who]
    return there.plane.least_time(turn, who).max(axis=1)


def motion_cost(there: Problem, options: Options) -> np.ndarray:
    """(m,) of 0 to 1,000,000: the time of each option's motion as a part of the slowest one's, to a high power."""
    times = travel_times(there, options)
    return np.rint(_PARTS * (times / max(times.max(initial=0.0), 1e-9)) ** _POWER).astype(np.int64)
