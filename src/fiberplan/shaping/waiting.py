"""Two that motors bring too near each other on any path: one of them waits, on the path that it has.

Motors gather speed, so that arms which leave side by side do not part as soon as their paths do. Where other paths do
not help, a later beginning mostly does, and costs nothing: few need all the time that there is.
"""

import itertools
from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.shaping.delayed_pairs import Begin, DelayedPairs, begun_later
from fiberplan.shaping.supply_load import stretches_of

_ROOMS = (0.3, 0.1, 0.0)  # [mm] beyond the margin that who waits should keep, for clocks are off, too; in turn


def waits(
    plane: FocalPlane,
    motion: Trajectory,
    lacking: Mapping[tuple[int, int], float],
    margin: float,
    error: np.ndarray,
    unit: float,
    longest: Sequence[float],
) -> np.ndarray | None:
    """How much later one of each pair should begin, so that all keep their distance.

    Args:
        plane: whose positioners move.
        motion: what motors make of a plan.
        lacking: pairs that come too near, and what they lack [mm]; obstacle k is -1 - k.
        margin: clearance to keep [mm].
        error: (n,) each arm may be off by this [mm].
        unit: later by a whole number of these [s].
        longest: nobody who waits ends later than the first of these, or else than the next [s].

    Returns:
        (n,) [s]; None where there is a pair that is not helped by waiting.
    """
    moves, ends = stretches_of(motion), np.zeros(plane.n)
    ends[moves.owner] = moves.end  # the last one written is the latest
    if any(i < 0 or ends[i] == 0.0 for pair in lacking for i in pair):
        return None  # past what stands, nothing changes later
    near = [pair for pair, _ in sorted(lacking.items(), key=lambda each: (-each[1], each[0]))]
    rooms = cache(lambda room: DelayedPairs(plane, [motion], ends > 0.0, margin + room, error))
    for latest in longest:
        later = np.zeros(plane.n)
        for room, pair in itertools.product(_ROOMS, near):
            if later[list(pair)].any():
                continue  # who waits is shown to keep its distance from everybody
            options = [
                (ends[i] + wait, wait, i)
                for i in pair
                if (wait := _shortest_wait(i, rooms(room), later, ends[i], unit, latest)) is not None
            ]
            if options:
                _, wait, i = min(options)
                later[i] = wait
        if all(later[list(pair)].any() for pair in near):
            return later
    return None


def _shortest_wait(
    i: int, pairs: DelayedPairs, later: np.ndarray, end: float, unit: float, latest: float
) -> float | None:
    """How much later positioner i has to begin, to keep its distance from all others [s]; None: that is too late."""
    begins = [Begin(0, round(1000 * seconds)) for seconds in later]
    for count in range(1, int((latest - end) / unit) + 1):
        if not pairs.too_near({i: Begin(0, round(1000 * count * unit))}, begins):
            return count * unit
    return None


def beginning_later(motion: Trajectory, later: np.ndarray) -> Trajectory:
    """The motion in which each positioner begins `later` (n,) [s], and rests where it stands until then."""
    made, late = begun_later(motion, later), np.flatnonzero(later)
    owner, times = np.append(late, made.owner), np.append(np.zeros(len(late)), made.times)
    return Trajectory.from_knots(owner, times, np.concatenate([motion.start[late], made.angles]), motion.n)
