"""Discs in the focal plane, such as places where no fiber may end."""

import numpy as np


def discs_at(discs: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Which disc each point lies in (m,), the first of several; -1 for none and for NaN.

    Args:
        discs: (k, 3) x, y, radius [mm].
        points: (m, 2) [mm].
    """
    found = np.full(len(points), -1, np.int64)
    there = np.flatnonzero(np.isfinite(points).all(axis=1))
    if len(discs) and len(there):
        from scipy.spatial import cKDTree  # slow to import, and few planes have any

        radius = discs[:, 2]
        near = cKDTree(discs[:, :2]).query_ball_point(points[there], max(0.0, radius.max()))
        for k, around in zip(there, near, strict=True):
            away = np.hypot(*(discs[around, :2] - points[k]).T)
            inside = [disc for disc, d in zip(around, away, strict=True) if d < radius[disc]]
            found[k] = min(inside, default=-1)
    return found
