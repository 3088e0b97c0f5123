"""A made-up field of targets clustered as galaxies are, with one target for each positioner that can reach one.

Clusters follow a Thomas process: centres fall uniformly, each with a Poisson number of members scattered about it by a
Gaussian, over a thinner uniform field. Source: Neyman & Scott 1958 (galaxies), Thomas 1949 (the Gaussian case). The
numbers are chosen to make a crowded field, not measured on a survey.
"""

import numpy as np
from scipy.spatial import KDTree

from fiberplan.arrays import number, read_only
from fiberplan.arrays.seeds import generator
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.inverse_kinematics import solutions
from fiberplan.kernels.clearance import clearances
from fiberplan.problem import Targets
from fiberplan.tolerances import SCENE

PER_CLUSTER = 30.0  #: mean members of a cluster
SPREAD = 0.5  #: standard deviation of a cluster, in patrol radii
CLUSTERED = 0.6  #: part of the targets in clusters
CANDIDATES = 20.0  #: mean targets in a patrol disc
PRIORITIES = (1.0, 2.0, 5.0)  #: of faint, ordinary and rare targets ...
SHARES = (0.7, 0.25, 0.05)  #: ... and how many there are of each


def clustered_targets(plane: FocalPlane, seed: int, margin: float = 0.0) -> Targets:
    """One reachable target per online positioner, where there is one, of the highest priority that fits.

    Positioners choose in turn, those with fewest choices first; one prefers targets at which it touches neither
    obstacles nor whoever chose before it. Where none is so it takes one that touches, and `Problem` with
    ``conflicts="drop"`` decides.

    Args:
        plane: whose positioners to give targets.
        seed: of the field; the same seed gives the same field.
        margin: clearance to keep at the goals [mm].

    Raises:
        TargetError: no positioner reaches a target.
        ProblemError: a seed that is none.
    """
    margin = number(margin, "mm", "margin", ProblemError)
    rng = generator(seed)
    points = _thomas_process(plane, rng)
    priority = rng.choice(PRIORITIES, size=len(points), p=SHARES)
    who, which, angles = _reachable(plane, points)
    chosen = _choose(plane, who, which, angles, priority, margin)
    rows = np.array(sorted(chosen), np.int64)
    kept = np.array([chosen[i] for i in rows.tolist()], np.int64)
    return Targets(
        x=points[kept, 0],
        y=points[kept, 1],
        positioner=tuple(plane.ids[i] for i in rows),
        priority=priority[kept],
        source=f"clustered field {seed}",
        notes=(f"targets: a Thomas process with seed {seed}, made up",),
    )


def _patrol(plane: FocalPlane) -> np.ndarray:
    """(n,) patrol radius of the default fiber [mm]."""
    return plane.length + np.hypot(plane.fiber[:, 0], plane.fiber[:, 1])


def _thomas_process(plane: FocalPlane, rng: np.random.Generator) -> np.ndarray:
    """Targets (m, 2) [mm] over the disc that holds all patrol zones."""
    patrol = float(_patrol(plane).max())
    middle = (plane.base.max(axis=0) + plane.base.min(axis=0)) / 2
    radius = float(np.hypot(*(plane.base - middle).T).max()) + patrol
    mean = CANDIDATES * (radius / patrol) ** 2

    def scattered(count: int) -> np.ndarray:
        r, phi = radius * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
        return middle + np.stack([r * np.cos(phi), r * np.sin(phi)], axis=1)

    centres = scattered(rng.poisson(mean * CLUSTERED / PER_CLUSTER))
    members = rng.poisson(PER_CLUSTER, size=len(centres))
    clustered = np.repeat(centres, members, axis=0)
    clustered = clustered + rng.normal(scale=SPREAD * patrol, size=clustered.shape)
    return np.concatenate([clustered, scattered(rng.poisson(mean * (1 - CLUSTERED)))])


def _reachable(plane: FocalPlane, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of positioner (m,) and target (m,) within its reach, with the quickest angles (m, 2) [rad]."""
    found = KDTree(points).query_ball_point(plane.base, _patrol(plane), return_sorted=True)
    online = np.flatnonzero(plane.online)
    who = np.repeat(online, [len(found[i]) for i in online])
    which = np.array([k for i in online for k in found[i]], np.int64)
    if not len(who):
        return who, which, np.empty((0, 2))
    angles = solutions(plane, who, points[which], plane.fiber[who], np.zeros(len(who)))[:, 0]
    can = np.isfinite(angles[:, 0])
    return who[can], which[can], angles[can]


def _choose(
    plane: FocalPlane, who: np.ndarray, which: np.ndarray, angles: np.ndarray, priority: np.ndarray, margin: float
) -> dict[int, int]:
    """Positioner -> target."""
    limit = margin + SCENE
    pairs = plane.arm_pairs_within(limit)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    neighbours = np.split(both, np.searchsorted(both[:, 0], np.arange(1, plane.n + len(plane.obstacles))))
    pose = plane.with_obstacles(np.where(plane.online[:, None], np.nan, plane.folded)).copy()
    seen = pose.view()
    seen.setflags(write=False)  # as everywhere else, so that the kernel is compiled once

    choices = np.split(np.arange(len(who)), np.searchsorted(who, np.arange(1, plane.n)))
    chosen: dict[int, int] = {}
    taken: set[int] = set()
    for i in np.argsort([len(c) for c in choices], kind="stable"):
        free = [k for k in choices[i] if int(which[k]) not in taken]
        if not free:
            continue
        ranked = sorted(free, key=lambda k: -priority[which[k]])
        near = read_only(neighbours[i][np.isfinite(pose[neighbours[i][:, 1], 0])], np.int64)
        best = ranked[0]
        for k in ranked:
            pose[i] = angles[k]
            if np.all(clearances(plane.arms, seen, near) >= limit):
                best = k
                break
        pose[i] = angles[best]
        chosen[int(i)] = int(which[best])
        taken.add(int(which[best]))
    return chosen
