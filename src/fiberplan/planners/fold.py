"""From anywhere to folded: the greedy walk, and what helps where it gets stuck."""

from dataclasses import dataclass

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.neighbourhood import Neighbourhood
from fiberplan.planners.clusters import clusters, neighbours
from fiberplan.planners.coupled import joint_path
from fiberplan.planners.greedy_walk import SPEED_ALLOWANCE, Walker
from fiberplan.planners.ranked_moves import EXHAUSTED, FOLDED
from fiberplan.trajectory import Trajectory

RELIEFS = ("joint", "reverse", "replace", "none")
_PATIENCE = np.radians(20.0)  # turn without progress that counts as deadlock
_CONTRARY = np.radians([10.0, 60.0])  # for how long a deadlocked positioner's ranking is reversed
_RELIEF_TRAVEL = 3.0  # how many times `max_travel` may be walked when rankings are reversed
_LARGEST_CLUSTER = 6  # that is searched jointly
_GROWTHS = 2  # how often a cluster takes in those next to it when no joint way is found


@dataclass(frozen=True, eq=False)
class Fold:
    """A motion towards folded, and who did not get there."""

    trajectory: Trajectory
    stuck: np.ndarray  #: positioners that are not folded at its end
    blockers: dict[int, int]  #: stuck positioner -> arm in its way


def fold(
    plane: FocalPlane,
    angles: np.ndarray,
    margin: float,
    movable: np.ndarray,
    near: Neighbourhood,
    rng: np.random.Generator,
    *,
    step: float,
    max_travel: float,
    skip_noops: bool,
    relief: str,
) -> Fold:
    """Walk from `angles` to folded, with relief; the settings are those of `GreedyFold`."""
    patience = None if relief == "none" else _PATIENCE
    walker = Walker(plane, angles, margin, step, movable, skip_noops=skip_noops, patience=patience, neighbourhood=near)
    travel = max_travel * (_RELIEF_TRAVEL if relief == "reverse" else 1.0)
    while walker.run(travel) not in (FOLDED, EXHAUSTED) and relief == "reverse":
        walker.reverse_ranking(int(rng.choice(walker.stuck)), rng.uniform(*_CONTRARY))
    if relief == "joint" and len(walker.stuck):
        return _resolve(plane, walker, margin, movable, near, int(rng.integers(2**32)))
    return Fold(walker.trajectory(), walker.stuck, walker.blockers)


def _resolve(
    plane: FocalPlane, walker: Walker, margin: float, movable: np.ndarray, near: Neighbourhood, seed: int
) -> Fold:
    """Continue a stuck walk: every cluster of stuck positioners searches a joint way to folded.

    Clusters cannot touch each other, so their ways out run at the same time, unless one had to grow.
    """
    angles = walker.angles
    motion = walker.trajectory()
    left: list[int] = []
    taken: set[int] = set()
    ways: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for cluster in clusters(near, walker.stuck):
        found = _way_out(plane, near, cluster, angles, margin, movable, taken, seed)
        if found is None:
            left += cluster
            continue
        ways.append(found)
        taken |= {int(j) for i in found[0] for j in (i, *neighbours(near, i))}
    if ways:
        motion = motion.then(_together(angles, ways))
    blockers = walker.blockers
    return Fold(motion, np.array(sorted(left), np.int64), {i: blockers[i] for i in left if i in blockers})


def _way_out(
    plane: FocalPlane,
    near: Neighbourhood,
    cluster: list[int],
    angles: np.ndarray,
    margin: float,
    movable: np.ndarray,
    taken: set[int],
    seed: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Members, times [s] and angles (m, k, 2) [rad] of a joint way to folded, growing the cluster if need be."""
    members = list(cluster)
    for growth in range(_GROWTHS + 1):
        if len(members) > _LARGEST_CLUSTER or taken.intersection(members):
            return None
        path = joint_path(plane, near, np.array(members), angles, plane.folded[members], margin, seed + growth)
        if path is not None:
            return np.array(members), path[0] / SPEED_ALLOWANCE, path[1]
        grown = _nearest(plane, near, members, angles, movable)
        if grown is None:
            return None
        members = sorted([*members, grown])
    return None


def _nearest(
    plane: FocalPlane, near: Neighbourhood, members: list[int], angles: np.ndarray, movable: np.ndarray
) -> int | None:
    """The movable positioner outside the cluster whose elbow is nearest to one of its members' fibers."""
    around = {int(j) for i in members for j in neighbours(near, i) if j < plane.n and movable[j]} - set(members)
    if not around:
        return None
    elbows, fibers = plane.elbows(angles), plane.fibers(angles)[members]
    return min(around, key=lambda j: (float(np.linalg.norm(fibers - elbows[j], axis=1).min()), j))


def _together(angles: np.ndarray, ways: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> Trajectory:
    """One motion of everyone: the members' ways at the same time, the others at rest."""
    n = len(angles)
    times, knots = [np.zeros(1)] * n, [angles[i][None] for i in range(n)]
    for members, way_times, way in ways:
        for k, i in enumerate(members):
            times[i], knots[i] = way_times, way[:, k]
    offsets = np.concatenate([[0], np.cumsum([len(t) for t in times])])
    return Trajectory(offsets, np.concatenate(times), np.concatenate(knots))
