"""Three or more that block each other: a joint path found at random, in whole steps.

What pairs cannot undo is searched by RRT-Connect in the joint space of all of them
(`fiberplan.planners.shared.rrt_connect`), as if only they and what never moves were there; everyone else has to find
a path around it.
"""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.direct.lattice import Lattice
from fiberplan.planners.direct.repair import Search
from fiberplan.planners.direct.trim import in_parts
from fiberplan.planners.shared.rrt_connect import joint_path
from fiberplan.tolerances import UNDER_LIMIT

_DRAWS = 2  # searches, of which the shortest path is taken
_NODES = 2000  # of either tree: the passages left here are narrow


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
    standing = np.array(lattice.path[: plane.n, 0])
    best = None
    for draw in range(_DRAWS):
        path, _ = joint_path(plane, alone, np.array(members), standing, goal, margin, seed + draw, _NODES)
        if path is None:
            continue
        times, angles = path
        counts = np.maximum(1, np.ceil(np.diff(times) / (UNDER_LIMIT * duration) - 1e-9)).astype(int)
        stepwise = in_parts(angles, counts)  # a whole number of steps for every move
        if best is None or len(stepwise) < len(best):
            best = stepwise
    return best
