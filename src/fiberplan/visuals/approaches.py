"""How near arms come to each other over time, for curves and lists: sampled, beside bounds that are proven.

Only pairs that come within `CEILING` of the margin are looked at: a certificate tells clearances exactly up to there.
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.certificates import Certificate
from fiberplan.certificates.safety import CAP as CEILING
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.plan.closest import pair_bounds

SAMPLES = 40, 240  #: fewest and most moments of a curve
LOOKS = 4_000_000  #: clearances that a curve may cost
LISTED = 24  #: pairs whose nearest moment is found
_ZOOMS, _FINER = 3, 6  #: how often, and how much finer, the nearest moment of a pair is looked for


@dataclass(frozen=True)
class Approach:
    """Two at their nearest."""

    pair: tuple[int, int]  #: positioners; -1 - k is obstacle k
    time: float  #: at which they were seen nearest [s]
    clearance: float  #: then [mm]
    proven: float  #: bound over the whole motion [mm]


@dataclass(frozen=True, eq=False)
class Approaches:
    """The smallest clearance of any two over time, and the pairs that come nearest."""

    times: np.ndarray  #: (m,) [s]
    gaps: np.ndarray  #: (m,) smallest clearance then [mm], at most the margin and `CEILING`
    pairs: np.ndarray  #: (m, 2) whose it is; -1 - k is obstacle k; the same twice: nobody is so near
    closest: tuple[Approach, ...]  #: by what is proven, the nearest first
    near: np.ndarray  #: (k, 2) all pairs that come within `CEILING` of the margin, the nearest first
    bounds: np.ndarray  #: (k,) what is proven of each [mm]


def approaches(plane: FocalPlane, motion: Trajectory, certificate: Certificate, listed: int = LISTED) -> Approaches:
    """Sample how near arms come to each other, over all moments and for the pairs that come nearest.

    Two that cannot move are left out. Clearances are those of the arms where the motion has them, without what jitter
    and position errors can take.

    Args:
        plane: whose arms move.
        motion: of all its positioners.
        certificate: of this motion.
        listed: how many pairs to list.
    """
    public, bound = pair_bounds(plane, certificate)
    ceiling = certificate.margin + CEILING
    near = np.flatnonzero(bound < ceiling)
    near = near[np.argsort(bound[near], kind="stable")]
    public, bound = public[near], bound[near]
    arms = read_only(np.where(public < 0, plane.n - 1 - public, public), np.int64)
    if not len(arms):
        return Approaches(np.empty(0), np.empty(0), np.empty((0, 2), np.int64), (), public, bound)
    times = _moments(motion, len(arms))
    poses = np.moveaxis(motion.sampled(times), 1, 0)
    gaps = np.array([plane.clearance(pose, arms) for pose in poses])
    found = [_nearest(plane, motion, arms[k : k + 1], times, gaps[:, k]) for k in range(min(listed, len(arms)))]
    closest = tuple(
        Approach((int(public[k, 0]), int(public[k, 1])), time, gap, float(bound[k]))
        for k, (time, gap) in enumerate(found)
    )
    least = np.argmin(gaps, axis=1)
    smallest, whose = gaps[np.arange(len(times)), least], public[least]
    whose = np.where((smallest < ceiling)[:, None], whose, 0)
    deeper = [
        (one.time, one.clearance, one.pair) for one in closest if one.clearance < np.interp(one.time, times, smallest)
    ]
    if deeper:
        times = np.concatenate([times, [time for time, _, _ in deeper]])
        smallest = np.concatenate([smallest, [gap for _, gap, _ in deeper]])
        whose = np.concatenate([whose, [pair for _, _, pair in deeper]])
        order = np.argsort(times, kind="stable")
        times, smallest, whose = times[order], smallest[order], whose[order]
    return Approaches(times, np.minimum(smallest, ceiling), whose, closest, public, bound)


def _moments(motion: Trajectory, pairs: int) -> np.ndarray:
    """Times of a curve [s]: evenly spread, fewer where there are many pairs."""
    few, many = SAMPLES
    return np.linspace(0.0, motion.duration, int(np.clip(LOOKS // max(1, pairs), few, many)) if motion.duration else 1)


def _nearest(
    plane: FocalPlane, motion: Trajectory, pair: np.ndarray, times: np.ndarray, gaps: np.ndarray
) -> tuple[float, float]:
    """When a pair (1, 2) of arms is seen nearest [s], and its clearance then [mm]: samples, finer about the least."""
    who = pair[0][pair[0] < plane.n]
    knots = np.concatenate([motion.knots(int(i))[0] for i in who])
    pose = np.array(plane.folded)

    def looked(moments: np.ndarray) -> np.ndarray:
        out = np.empty(len(moments))
        for k, here in enumerate(np.moveaxis(motion.select(who).sampled(moments), 1, 0)):
            pose[who] = here
            out[k] = plane.clearance(pose, pair)[0]
        return out

    times, gaps = np.concatenate([times, knots]), np.concatenate([gaps, looked(knots)])
    order = np.argsort(times, kind="stable")
    times, gaps = times[order], gaps[order]
    for _ in range(_ZOOMS):
        k = int(np.argmin(gaps))
        begin, end = times[max(0, k - 1)], times[min(len(times) - 1, k + 1)]
        if not end > begin:
            break
        times = np.concatenate([times[k : k + 1], np.linspace(begin, end, _FINER)])
        gaps = np.concatenate([gaps[k : k + 1], looked(times[1:])])
        order = np.argsort(times, kind="stable")
        times, gaps = times[order], gaps[order]
    k = int(np.argmin(gaps))
    return float(times[k]), float(gaps[k])
