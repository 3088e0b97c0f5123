"""Fewer iterations for the same turns: each as soon as its own turns before it and those of neighbours let it.

Of two neighbours the turns stay in their order; they go at the same time where that is clear whatever the speeds. So
whatever a pair did one after the other was shown to be clear before, or is shown here.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fiberplan.certificates.any_speed import clear_at_any_speed
from fiberplan.focal_plane import FocalPlane
from fiberplan.tolerances import SLACK


class _Turn(NamedTuple):
    """What a positioner does in one iteration."""

    who: int
    begin: np.ndarray  #: (2,) [rad]
    end: np.ndarray  #: (2,) [rad]


def without_waiting(
    plane: FocalPlane, places: Sequence[np.ndarray], margin: float, error: np.ndarray
) -> list[np.ndarray]:
    """(n, 2) where everyone is after each iteration, of as few as come easily [rad].

    Args:
        plane: an array of arms of two links.
        places: (n, 2) at first, and after each iteration [rad].
        margin: clearance to keep [mm].
        error: (n,) how far each arm may be off [mm].
    """
    turns: list[_Turn] = []
    own: list[list[int]] = [[] for _ in range(plane.n)]
    for k in range(1, len(places)):
        for i in np.flatnonzero((places[k] != places[k - 1]).any(axis=1)).tolist():
            own[i].append(len(turns))
            turns.append(_Turn(i, places[k - 1][i], places[k][i]))
    near = plane.pairs_within(margin + 2.0 * float(error.max(initial=0.0)) + SLACK).tolist()
    both = np.array([(a, b) for i, j in near for a in own[i] for b in own[j]], np.int64).reshape(-1, 2)
    who, begin, end = (np.array([turn[k] for turn in turns])[both] for k in range(3))
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    clear, _ = clear_at_any_speed(plane, who, low, high, margin, error)
    waits: list[list[tuple[int, int]]] = [[] for _ in turns]  # for which turn before, and how many iterations
    for (a, b), at_once in zip(both.tolist(), clear.tolist(), strict=True):
        waits[max(a, b)].append((min(a, b), 0 if at_once else 1))
    for mine in own:
        for first, second in pairwise(mine):
            waits[second].append((first, 1))
    when = np.zeros(len(turns), np.int64)
    for k, before in enumerate(waits):
        when[k] = max((when[other] + later for other, later in before), default=0)
    at, found = places[0].copy(), []
    for iteration in range(int(when.max(initial=-1)) + 1):
        for k in np.flatnonzero(when == iteration).tolist():
            at[turns[k].who] = turns[k].end
        found.append(at.copy())
    return found
