"""From anywhere to folded: the greedy walk, and what helps where it gets stuck."""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.greedy_fold.joint_relief import Fold, JointRelief
from fiberplan.planners.greedy_fold.ranked_moves import EXHAUSTED, FOLDED
from fiberplan.planners.greedy_fold.walker import Walker

RELIEFS = ("joint", "reverse", "replace", "none")
_PATIENCE = np.radians(20.0)  # turn without progress that counts as deadlock
_CONTRARY = np.radians([10.0, 60.0])  # for how long a deadlocked positioner's ranking is reversed
_RELIEF_TRAVEL = 3.0  # how many times `max_travel` may be walked when rankings are reversed


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
    expendable: np.ndarray | None = None,
) -> Fold:
    """Walk from `angles` to folded, with relief; the settings are those of `GreedyFold`.

    `expendable` (n,) are the priorities by which a positioner may be given up to let others pass: it is then folded
    from the beginning. None: no one may, because they begin where they begin.
    """
    patience = None if relief == "none" else _PATIENCE
    walker = Walker(plane, angles, margin, step, movable, skip_noops=skip_noops, patience=patience, neighbourhood=near)
    travel = max_travel * (_RELIEF_TRAVEL if relief == "reverse" else 1.0)
    while walker.run(travel) not in (FOLDED, EXHAUSTED) and relief == "reverse":
        walker.reverse_ranking(int(rng.choice(walker.stuck)), rng.uniform(*_CONTRARY))
    if relief == "joint" and len(walker.stuck):
        return JointRelief(plane, near, margin, movable, walker, expendable, int(rng.integers(2**32))).fold()
    return Fold(walker.trajectory(), walker.stuck, walker.blockers)
