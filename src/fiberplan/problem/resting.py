"""Where to stand when there is nowhere to go: a safe place for every positioner without a goal.

Folded is best, because it is out of the way and needs no unfolding. Where an arm reaches over it, the next best is the
place nearest to folded that is clear of everyone who has a place already.
"""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood, clearances_around, touching

_ROOM = 0.5  # [mm] rather stand this much clearer than asked, if there is such a place
_BETAS, _ALPHAS = 19, 48  # how finely places are tried


def _places(plane: FocalPlane, i: int) -> np.ndarray:
    """Configurations (k, 2) [rad] that positioner `i` could stand at, folded first, then by distance from it."""
    folded = plane.folded[i]
    low, high = np.maximum(plane.lower[i], folded - 2 * np.pi), np.minimum(plane.upper[i], folded + 2 * np.pi)
    alphas = low[0] + np.arange(_ALPHAS) / _ALPHAS * min(high[0] - low[0], 2 * np.pi)
    betas = np.linspace(low[1], min(high[1], low[1] + 2 * np.pi), _BETAS)
    grid = np.stack(np.meshgrid(alphas, betas, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = np.concatenate([grid, np.stack([alphas, np.full(_ALPHAS, folded[1])], axis=1)])
    away = 2.0 * np.abs(grid[:, 1] - folded[1]) + np.abs(grid[:, 0] - folded[0])  # an unfolded beta is in more ways
    return np.concatenate([folded[None], grid[np.argsort(away, kind="stable")]])


def place_the_rest(
    plane: FocalPlane, known: np.ndarray, start: np.ndarray, near: Neighbourhood, limit: float
) -> tuple[np.ndarray, np.ndarray]:
    """Fill in a safe configuration for every NaN row.

    Args:
        plane: the array.
        known: (n, 2) configurations that are settled, NaN elsewhere [rad].
        start: (n, 2) where everyone stands now: the last resort [rad].
        near: neighbour lists for `limit`.
        limit: clearance to keep [mm].

    Returns:
        (n, 2) [rad], and the positioners for which no clear place was found: they are left at their start.
    """
    arms, everyone = plane.arms, plane.with_obstacles(known).copy()
    unplaced = np.flatnonzero(np.isnan(known[:, 0]))
    everyone[unplaced] = plane.folded[unplaced]
    # all at once, in the common case that folded is clear; only who touches is placed one by one
    contact = touching(arms, near, everyone, unplaced, limit)
    rest = unplaced[contact >= 0]
    everyone[rest] = np.nan
    nowhere = []
    for i in rest:
        places = np.concatenate([_places(plane, i), start[i][None]])
        room = clearances_around(arms, near, everyone, i, places)
        good = np.flatnonzero(room >= limit + _ROOM)
        if not len(good):
            good = np.flatnonzero(room >= limit)
        if len(good):
            everyone[i] = places[good[0]]
        else:
            everyone[i] = start[i]
            nowhere.append(i)
    return read_only(everyone[: plane.n]), np.array(nowhere, np.int64)
