"""Sabater2018's roadmap of one arm: direct, over one grid point, or over two that are joined by a random middle edge.

Edges are straight in joint space. The first question asked of an arm, whether a configuration is in its zone of
avoidance, is answered for the whole edge at once. Paths are tried in the order of their estimated travel time.
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.four_bar import leaves_range
from fiberplan.tolerances import UNDER_LIMIT


@dataclass(frozen=True, eq=False)
class Path:
    """A way in joint space, cut into steps of the clock."""

    configurations: np.ndarray  #: (k + 1, 2) at each step [rad]
    vertex: np.ndarray  #: (k + 1,) whether a step is an intermediate vertex
    estimate: float  #: travel time if nothing is in the way [s]
    through: int  #: how many intermediate vertices


def travel_time(plane: FocalPlane, i: int, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Time (...) [s] of straight edges of arm `i` between configurations (..., 2) [rad]."""
    return (np.abs(end - start) / (plane.max_speed[i] * UNDER_LIMIT)).max(axis=-1)


def cells(plane: FocalPlane, i: int, grid: tuple[int, int]) -> np.ndarray:
    """Middles (k, 2) [rad] of the cells of an even grid over the joint ranges, outside the zone of avoidance."""
    low = np.maximum(plane.lower[i], plane.folded[i] - 2 * np.pi)
    high = np.minimum(plane.upper[i], plane.folded[i] + 2 * np.pi)
    axes = [low[k] + (np.arange(grid[k]) + 0.5) / grid[k] * (high[k] - low[k]) for k in range(2)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    arms = plane.arms
    return points[[bool(np.isnan(leaves_range(arms, i, a, b, 0.0, 0.0)[0])) for a, b in points]]


def middle_edges(count: int, edges: int, rng: np.random.Generator) -> np.ndarray:
    """Random disjoint pairs (m, 2) of `count` grid points, at most `edges` of them."""
    order = rng.permutation(count)
    return order[: 2 * min(edges, count // 2)].reshape(-1, 2)


def cut(plane: FocalPlane, i: int, corners: np.ndarray, dt: float, most: int) -> Path | None:
    """The way over `corners` (c, 2) [rad] in steps of `dt` [s]; None if it takes more than `most` steps.

    A way that would enter the zone of avoidance is none either.
    """
    times = travel_time(plane, i, corners[:-1], corners[1:])
    counts = np.ceil(times / dt - 1e-12).astype(np.int64)
    if counts.sum() > most:
        return None
    for start, turn in zip(corners[:-1], np.diff(corners, axis=0), strict=True):
        if not np.isnan(leaves_range(plane.arms, i, *start, *turn)[0]):
            return None
    pieces, vertex = [corners[:1]], np.zeros(counts.sum() + 1, bool)
    for start, end, count in zip(corners[:-1], corners[1:], counts, strict=True):
        part = np.arange(1, count + 1)[:, None] / max(count, 1)
        piece = start + part * (end - start)
        piece[-1:] = end
        pieces.append(piece)
    vertex[np.cumsum(counts)[:-1]] = True
    vertex[[0, -1]] = False  # an edge of no length is no vertex to stop at
    return Path(np.concatenate(pieces), vertex, float(times.sum()), len(corners) - 2)


def paths(
    plane: FocalPlane,
    i: int,
    start: np.ndarray,
    goal: np.ndarray,
    points: np.ndarray,
    pairs: np.ndarray,
    dt: float,
    most: int,
) -> list[Path]:
    """All paths of at most `most` steps from `start` to `goal`, quickest first (ties: in the order of the grid).

    Args:
        plane: the array.
        i: the arm.
        start: (2,) [rad].
        goal: (2,) [rad].
        points: (k, 2) intermediate vertices [rad].
        pairs: (m, 2) of them that are joined.
        dt: step [s].
        most: steps.
    """
    ways = [np.stack([start, goal])]
    ways += [np.stack([start, v, goal]) for v in points]
    ways += [np.stack([start, points[v], points[w], goal]) for a, b in pairs for v, w in ((a, b), (b, a))]
    found = [path for way in ways if (path := cut(plane, i, way, dt, most)) is not None]
    return sorted(found, key=lambda path: path.estimate)
