"""A few that block each other: a joint path, found at random or by way of folded, shortened, in whole steps.

What pairs cannot undo on their lattices is searched as if only those few and what never moves were there; everyone
else has to find a path around it. Small groups are searched by RRT-Connect in the joint space of all of them
(`fiberplan.planners.shared.rrt_connect`); any group may go by way of folded (`fiberplan.planners.greedy_fold`), which
takes long, but is found where passages are too narrow to be met at random. Shortcuts then take most of the detour out.
"""

from functools import partial

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.direct.lattice import Lattice
from fiberplan.planners.direct.repair import Search
from fiberplan.planners.direct.shortcuts import hurried
from fiberplan.planners.direct.trim import in_parts
from fiberplan.planners.greedy_fold.fold import Folding
from fiberplan.planners.shared.rrt_connect import joint_path
from fiberplan.planners.shared.threads import at_once
from fiberplan.tolerances import SLACK, UNDER_LIMIT

_DRAWS = 2  # searches, of which the shortest path is taken
_NODES = 2000  # of either tree: the passages left here are narrow
_FEW = 4  # searched at random, too
_FOLD_STEP = np.radians(1.0)  # of the fastest joint
_MOST_FOLD = np.radians(700.0)  # turned by then
_SHORTCUTS = 300  # tried for each member


def cluster_around(core: list[int], size: int, near: Neighbourhood, search: Search, lattice: Lattice) -> list[int]:
    """`core` and the neighbours that it has had most trouble with, `size` in all if there are as many."""
    trouble: dict[int, float] = {}
    for i in core:
        for entry in near.near[near.offsets[i] : near.offsets[i + 1]]:
            j = int(entry["arm"])
            if j not in core and not lattice.fixed[j]:
                trouble[j] = trouble.get(j, 0.0) + float(search.weight[entry["pair"]])
    others = sorted(trouble, key=lambda j: (-trouble[j], j))[: size - len(core)]
    return sorted([*core, *others])


def apart(clusters: list[list[int]]) -> list[list[int]]:
    """Those of `clusters` that have no member in common with one before them, from the first on."""
    chosen: list[list[int]] = []
    for members in clusters:
        if all(set(members).isdisjoint(others) for others in chosen):
            chosen.append(members)
    return chosen


def untangled(
    plane: FocalPlane,
    pairs: np.ndarray,
    lattice: Lattice,
    members: list[int],
    goal: np.ndarray,
    margin: float,
    duration: float,
    seed: int,
) -> np.ndarray | None:
    """A path of `members` from start to goal past each other and what never moves; None if none was found.

    Args:
        plane: the array.
        pairs: (m, 2) arms that could touch.
        lattice: everybody's paths.
        members: positioners.
        goal: (k, 2) where they should end [rad].
        margin: clearance to keep [mm].
        duration: of a step [s].
        seed: of the random search.

    Returns:
        (steps + 1, k, 2) [rad].
    """
    inside = np.zeros(len(lattice.fixed), bool)
    inside[members] = True
    seen = inside | lattice.fixed
    kept = pairs[(inside[pairs[:, 0]] & seen[pairs[:, 1]]) | (inside[pairs[:, 1]] & seen[pairs[:, 0]])]
    alone = Neighbourhood.from_pairs(len(lattice.fixed), kept)
    standing, who, standers = np.array(lattice.path[: plane.n, 0]), np.array(members), np.unique(kept)
    problem = plane, alone, who, standing, goal, margin

    def at_random(draw: int) -> tuple[np.ndarray, np.ndarray] | None:
        return joint_path(*problem, draw, _NODES)[0]

    draws = range(seed, seed + _DRAWS) if len(members) <= _FEW else ()
    searches = [partial(_by_way_of_folded, *problem, seed), *(partial(at_random, draw) for draw in draws)]
    found = []
    for times, angles in (way for way in at_once(searches) if way is not None):
        counts = np.maximum(1, np.ceil(np.diff(times) / (UNDER_LIMIT * duration) - 1e-9)).astype(int)
        path = np.empty((len(lattice.path), 1 + counts.sum(), 2))  # of which only what is seen is ever touched
        path[standers] = lattice.path[standers, :1]
        path[who] = in_parts(angles, counts).swapaxes(0, 1)  # a whole number of steps for every move
        tries, state, blame = _SHORTCUTS * len(members), np.array([seed], np.uint64), np.zeros(len(path), np.int64)
        arrival = hurried(plane, alone, path, who, margin + SLACK, duration, tries, state, blame)
        found.append(path[who, : arrival + 1].swapaxes(0, 1))
    return min(found, key=len, default=None)


def _by_way_of_folded(
    plane: FocalPlane,
    near: Neighbourhood,
    members: np.ndarray,
    standing: np.ndarray,
    goal: np.ndarray,
    margin: float,
    seed: int,
) -> tuple[np.ndarray, np.ndarray] | None:
    """Times (m,) [s] and angles (m, k, 2) [rad] by way of folded, of everybody in `near`; None if some get stuck."""
    movable = np.zeros(plane.n, bool)
    movable[members] = True
    folding = Folding(plane, margin, movable, near, _FOLD_STEP, _MOST_FOLD, skip_noops=True, relief="joint")
    rng, ends = np.random.default_rng(seed), standing.copy()
    ends[members] = goal
    out = folding.fold(standing, rng)
    back = folding.fold(ends, rng) if not len(out.stuck) else out
    if len(back.stuck):
        return None
    motion = out.trajectory.select(members).then(back.trajectory.select(members).reversed())
    times = np.unique(motion.times)
    return times, motion.sampled(times).swapaxes(0, 1)
