"""Which pairs come closest in a plan, by what is proven of them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fiberplan.certificates import Certificate
from fiberplan.focal_plane import FocalPlane

if TYPE_CHECKING:
    from fiberplan.plan.plan import Plan


@dataclass(frozen=True)
class Close:
    """A pair and its least clearance over the whole motion."""

    pair: tuple[int, int]  #: positioners; -1 - k is obstacle k
    names: tuple[str, str]
    clearance: float  #: proven lower bound [mm]


def pair_bounds(plane: FocalPlane, certificate: Certificate) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (m, 2), obstacle k being -1 - k, and their least clearance over the whole motion, proven (m,) [mm].

    Two that cannot move are left out: how they stand is no merit of a motion.
    """
    online = plane.online
    fixed = np.asarray(certificate.obstacle_pairs).reshape(-1, 2) * [1, -1] - [0, 1]
    pairs = np.concatenate([np.asarray(certificate.pairs).reshape(-1, 2), fixed])
    gaps = np.concatenate([certificate.clearance, certificate.obstacle_clearance])
    movable = online[pairs[:, 0]] | ((pairs[:, 1] >= 0) & online[np.maximum(pairs[:, 1], 0)])
    return pairs[movable], gaps[movable]


def closest_pairs(plan: "Plan", count: int = 1) -> tuple[Close, ...]:
    """The `count` pairs of least proven clearance, the closest first; see `pair_bounds`."""
    plane, (pairs, gaps) = plan.problem.plane, pair_bounds(plan.problem.plane, plan.certificate)
    return tuple(
        Close((int(a), int(b)), (plane.label(int(a)), plane.label(int(b))), float(gap))
        for (a, b), gap in ((pairs[k], gaps[k]) for k in np.argsort(gaps, kind="stable")[:count])
    )
