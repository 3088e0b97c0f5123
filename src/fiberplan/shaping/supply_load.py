"""How many robots of a power supply move: at any one moment, or on average over a window of time.

A robot moves while a joint of it turns; rests within its path do not count. Between the moments at which robots start
or stop the number of those that move is constant, so its average over a sliding window is linear between the positions
at which an end of the window meets such a moment: the largest is at one of these, and only these are looked at.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fiberplan.arrays import number, texts
from fiberplan.errors import TrajectoryError
from fiberplan.motion import Trajectory
from fiberplan.tolerances import RANGE


class Stretches(NamedTuple):
    """When robots move, from rest to rest, sorted by robot and time."""

    owner: np.ndarray  #: (m,)
    begin: np.ndarray  #: (m,) [s]
    end: np.ndarray  #: (m,) [s]

    def of(self, robots: np.ndarray) -> "Stretches":
        """Those of some robots (n,) bool."""
        return Stretches(*(column[robots[self.owner]] for column in self))

    def total(self) -> float:
        """How long all robots move, added up [s]."""
        return float(np.sum(self.end - self.begin))


def stretches_of(trajectory: Trajectory) -> Stretches:
    """When robots move."""
    owner, times = trajectory.owner, trajectory.times
    turns = np.zeros(len(times) + 1, bool)  # from the knot before each to it
    turns[1:-1] = (np.abs(np.diff(trajectory.angles, axis=0)) > RANGE).any(axis=1) & (owner[1:] == owner[:-1])
    begins, ends = turns[1:] & ~turns[:-1], turns[:-1] & ~turns[1:]
    return Stretches(owner[begins], times[begins], times[ends])


def most_at_once(moves: Stretches, duration: float, window: float) -> float:
    """Robots that move at once, at most.

    Args:
        moves: of the robots that are counted.
        duration: of the motion [s].
        window: on average over so long [s]; 0: at any moment. No longer than the motion: rests before and after it
            are not counted.
    """
    begin, end = np.sort(moves.begin), np.sort(moves.end)
    window = min(window, duration)
    if not len(begin) or window == 0.0:  # who stops at a moment makes room for who starts then
        return float((np.arange(1, len(begin) + 1) - np.searchsorted(end, begin, side="right")).max(initial=0))
    moments = np.unique(np.concatenate([begin, end]))
    count = np.searchsorted(begin, moments, side="right") - np.searchsorted(end, moments, side="right")
    moved = np.concatenate([[0.0], np.cumsum(count[:-1] * np.diff(moments))])  # until each moment, added up
    first = np.clip(np.concatenate([moments, moments - window]), 0.0, duration - window)
    within = np.interp(first + window, moments, moved) - np.interp(first, moments, moved)
    return float(within.max() / window)


def load(trajectory: Trajectory, supplies: Sequence[str], window: float = 0.0) -> dict[str, float]:
    """The largest share of each supply's robots that moves at once, of those that move at all.

    Args:
        trajectory: any motion.
        supplies: (n,) by which supply each robot is driven.
        window: on average over so long [s]; 0: at any moment; inf: over the whole motion.

    Returns:
        by supply, in the order in which they are named first; 0 where nobody moves.

    Raises:
        TrajectoryError: another number of supplies than robots, or a window that is no time.
    """
    names, supply = numbered(supplies, trajectory.n)
    window = time_window(window)
    moves, found = stretches_of(trajectory), {}
    for k, name in enumerate(names):
        own = moves.of(supply == k)
        count = len(np.unique(own.owner))
        found[name] = most_at_once(own, trajectory.duration, window) / count if count else 0.0
    return found


def numbered(supplies: Sequence[str], n: int) -> tuple[tuple[str, ...], np.ndarray]:
    """The names of all supplies, in the order in which they are named first, and (n,) which one each robot has.

    Raises:
        TrajectoryError: not n of them.
    """
    given = texts(supplies, "supplies", TrajectoryError)
    if len(given) != n:
        raise TrajectoryError(f"{len(given)} supplies for {n} positioners")
    names = tuple(dict.fromkeys(given))
    place = {name: k for k, name in enumerate(names)}
    return names, np.array([place[name] for name in given], np.int64)


def time_window(window: float) -> float:
    """A window as a number [s].

    Raises:
        TrajectoryError: it is no time.
    """
    window = number(window, "s", "window", TrajectoryError)
    if not window >= 0.0:
        raise TrajectoryError(f"window must be a time of 0 s or more, got {window:g}")
    return window
