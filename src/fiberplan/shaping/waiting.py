"""Two that motors bring too near each other on any path: one of them waits, on the path that it has.

Motors gather speed, so that arms which leave side by side do not part as soon as their paths do. Where other paths do
not help, a later beginning mostly does, and costs nothing: few need all the time that there is.
"""

from collections.abc import Mapping

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.shaping.delayed_pairs import Begin, DelayedPairs

_ROOMS = (0.3, 0.1, 0.0)  # [mm] beyond the margin that who waits should keep, for clocks are off, too; in turn


def waits(
    plane: FocalPlane,
    motion: Trajectory,
    lacking: Mapping[tuple[int, int], float],
    margin: float,
    error: np.ndarray,
    unit: float,
    longest: float,
) -> np.ndarray | None:
    """How much later one of each pair should begin, so that all keep their distance.

    Args:
        plane: whose positioners move.
        motion: what motors make of a plan.
        lacking: pairs that come too near, and what they lack [mm]; obstacle k is -1 - k.
        margin: clearance to keep [mm].
        error: (n,) each arm may be off by this [mm].
        unit: later by a whole number of these [s].
        longest: nobody ends later than that [s].

    Returns:
        (n,) [s]; None where there is a pair that is not helped by waiting.
    """
    ends = np.array([_end(*motion.knots(i)) for i in range(plane.n)])
    if any(i < 0 or ends[i] == 0.0 for pair in lacking for i in pair):
        return None  # past what stands, nothing changes later
    later, near = np.zeros(plane.n), [pair for pair, _ in sorted(lacking.items(), key=lambda each: (-each[1], each[0]))]
    for room in _ROOMS:
        pairs = DelayedPairs(plane, [motion], ends > 0.0, margin + room, error)
        for pair in near:
            if later[list(pair)].any():
                continue  # who waits is shown to keep its distance from everybody
            begins = [Begin(0, round(1000 * seconds)) for seconds in later]
            options = []
            for i in pair:
                for count in range(1, int((longest - ends[i]) / unit) + 1):
                    if not pairs.too_near({i: Begin(0, round(1000 * count * unit))}, begins):
                        options.append((ends[i] + count * unit, count, i))
                        break
            if options:
                _, count, i = min(options)
                later[i] = count * unit
    return later if all(later[list(pair)].any() for pair in near) else None


def beginning_later(motion: Trajectory, later: np.ndarray) -> Trajectory:
    """The motion in which each positioner begins `later` (n,) [s]; who does has no rest after its last turn."""
    knots = [motion.knots(i) for i in range(motion.n)]
    for i in np.flatnonzero(later):
        times, angles = knots[i]
        kept = times <= _end(times, angles)
        knots[i] = np.append(0.0, times[kept] + later[i]), np.concatenate([angles[:1], angles[kept]])
    offsets = np.cumsum([0, *(len(times) for times, _ in knots)])
    return Trajectory(offsets, *(np.concatenate([each[k] for each in knots]) for k in (0, 1)))


def _end(times: np.ndarray, angles: np.ndarray) -> float:
    """When the last turn ends [s]; 0 if there is none."""
    turns = np.flatnonzero((np.diff(angles, axis=0) != 0.0).any(axis=1))
    return float(times[turns[-1] + 1]) if len(turns) else 0.0
