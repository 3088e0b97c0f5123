"""The way of one positioner past what never moves: found on a fine grid, every edge tested in continuous time.

Lattices of the search are coarse, and between two nodes of theirs a positioner may touch what neither node touches.
Here its joint space is flooded cell by cell from the start, finer and finer until the goal is reached, and the way
found is pulled straight. Where nothing is reached on the finest grid there may still be a way: no proof.
"""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood, clearance_around
from fiberplan.kernels.arms import motion
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.kernels.sweep import swept_clear
from fiberplan.planners.direct.trim import in_parts
from fiberplan.tolerances import UNDER_LIMIT

_SPACINGS = np.radians((1.0, 0.5, 0.25))  # of the faster joint
_MOST_CELLS = 2**21  # of a grid: 34 MB, and a few seconds
_ASIDE = 2.0 * np.pi  # [rad] beyond start and goal that a joint may turn
_PARTS = 16  # of a step, in which a corner of a way is missed by at most one
_UNSEEN, _BEGIN = -2, -1


@leaf
def _is_clear(arms, near, rest, i, p, q, slack, limit):
    """Whether arm i may move evenly from p to q (2,); `slack` [mm] is what one of them has beyond the limit."""
    da, db = q[0] - p[0], q[1] - p[1]
    if slack >= motion(arms, i, da, db):
        return True
    for k in range(near.offsets[i], near.offsets[i + 1]):
        j = near.near[k].arm
        if np.isnan(rest[j, 0]):
            continue
        if not swept_clear(arms, i, p[0], p[1], da, db, j, rest[j, 0], rest[j, 1], 0.0, 0.0, limit, 0.0, 0.0):
            return False
    return True


@leaf
def _slack_at(arms, near, rest, i, low, spacing, a, b, limit, slack):
    """Clearance beyond the limit at cell (a, b), found once [mm]."""
    if np.isnan(slack[a, b]):
        alpha, beta = low[0] + a * spacing[0], low[1] + b * spacing[1]
        slack[a, b] = clearance_around(arms, near, rest, i, alpha, beta) - limit
    return slack[a, b]


@kernel
def _flood(arms, near, rest, i, start, goal, low, spacing, limit, came, slack, queue):
    """Fill `came` (A, B) with where each cell was reached from; returns whether cell `goal` (2,) was."""
    count_a, count_b = came.shape
    p, q = np.empty(2), np.empty(2)
    first_a, first_b = int(np.floor((start[0] - low[0]) / spacing[0])), int(np.floor((start[1] - low[1]) / spacing[1]))
    head = tail = 0
    for a in range(max(first_a, 0), min(first_a + 2, count_a)):
        for b in range(max(first_b, 0), min(first_b + 2, count_b)):
            q[0], q[1] = low[0] + a * spacing[0], low[1] + b * spacing[1]
            room = _slack_at(arms, near, rest, i, low, spacing, a, b, limit, slack)
            if room >= 0.0 and _is_clear(arms, near, rest, i, start, q, room, limit):
                came[a, b] = _BEGIN
                queue[tail] = a * count_b + b
                tail += 1
    while head < tail:
        cell = queue[head]
        head += 1
        a, b = cell // count_b, cell % count_b
        if a == goal[0] and b == goal[1]:
            return True
        p[0], p[1] = low[0] + a * spacing[0], low[1] + b * spacing[1]
        for x in range(max(a - 1, 0), min(a + 2, count_a)):
            for y in range(max(b - 1, 0), min(b + 2, count_b)):
                if came[x, y] != _UNSEEN:
                    continue
                room = _slack_at(arms, near, rest, i, low, spacing, x, y, limit, slack)
                if not room >= 0.0:
                    continue
                q[0], q[1] = low[0] + x * spacing[0], low[1] + y * spacing[1]
                if _is_clear(arms, near, rest, i, p, q, max(room, slack[a, b]), limit):
                    came[x, y] = cell
                    queue[tail] = x * count_b + y
                    tail += 1
    return False


@kernel
def _pulled_straight(arms, near, rest, i, chain, limit):
    """The chain (m, 2) with stretches replaced by even moves, the longest that can be found by halving."""
    kept = np.empty_like(chain)
    kept[0] = chain[0]
    count, a = 1, 0
    while a < len(chain) - 1:
        b = len(chain) - 1
        while b > a + 1 and not _is_clear(arms, near, rest, i, chain[a], chain[b], -1.0, limit):
            b = a + (b - a) // 2
        kept[count] = chain[b]
        count += 1
        a = b
    return kept[:count].copy()


def way_past_fixed(
    plane: FocalPlane,
    near: Neighbourhood,
    rest: np.ndarray,
    i: int,
    start: np.ndarray,
    goal: np.ndarray,
    limit: float,
) -> np.ndarray | None:
    """Knots (m, 2) [rad] of a way of positioner `i` from `start` to `goal` (2,) that keeps `limit` [mm], in even moves.

    Args:
        plane: the array.
        near: its neighbour lists.
        rest: (arms, 2) where those stand that never move [rad]; NaN: of no account.
        i: the positioner.
        start: where it stands [rad].
        goal: where it goes [rad].
        limit: clearance to keep [mm].

    Returns:
        the knots, which take the shortest time on the grid where the way is found; None where none was.
    """
    speed = plane.max_speed[i]
    lower = np.maximum(plane.lower[i], np.minimum(start, goal) - _ASIDE)
    upper = np.minimum(plane.upper[i], np.maximum(start, goal) + _ASIDE)
    for fine in _SPACINGS:
        spacing = fine * speed / speed.max()
        before = np.floor((goal - lower) / spacing + 1e-9).astype(np.int64)
        count = before + np.floor((upper - goal) / spacing + 1e-9).astype(np.int64) + 1
        if count.prod() > _MOST_CELLS:
            return None
        low = goal - before * spacing
        came = np.full(count, _UNSEEN, np.int32)
        slack, queue = np.full(count, np.nan, np.float32), np.empty(count.prod(), np.int64)
        if not _flood(plane.arms, near, rest, i, start, before, low, spacing, limit, came, slack, queue):
            continue
        cell, cells = int(before[0] * count[1] + before[1]), []
        while cell != _BEGIN:
            cells.append(divmod(cell, int(count[1])))
            cell = int(came[cells[-1]])
        chain = np.concatenate([start[None], low + np.array(cells[::-1]) * spacing])
        chain[-1] = goal
        way = _pulled_straight(plane.arms, near, rest, i, chain, limit)
        return _pulled_straight(plane.arms, near, rest, i, _split(way, spacing), limit)
    return None


def _split(way: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """The same way with knots at most `spacing` (2,) apart [rad]."""
    counts = np.maximum(1, np.ceil((np.abs(np.diff(way, axis=0)) / spacing).max(axis=1) - 1e-9)).astype(int)
    return in_parts(way, counts)


@kernel
def _fewest_steps(arms, near, rest, i, way, turn, limit):
    """Of the places (m, 2) of a way those to be at after each step, at most `turn` (2,) apart: as few as can be."""
    count = len(way)
    steps, before = np.full(count, count), np.zeros(count, np.int64)
    steps[0] = 0
    for k in range(count - 1):
        room = clearance_around(arms, near, rest, i, way[k, 0], way[k, 1]) - limit
        for m in range(k + 1, count):
            if abs(way[m, 0] - way[k, 0]) > turn[0] or abs(way[m, 1] - way[k, 1]) > turn[1]:
                break
            if steps[k] + 1 < steps[m] and (m == k + 1 or _is_clear(arms, near, rest, i, way[k], way[m], room, limit)):
                steps[m], before[m] = steps[k] + 1, k
    kept = np.empty((steps[count - 1] + 1, 2))
    k = count - 1
    for place in range(len(kept) - 1, -1, -1):
        kept[place] = way[k]
        k = before[k]
    return kept


def stepwise(
    plane: FocalPlane, near: Neighbourhood, rest: np.ndarray, i: int, way: np.ndarray, duration: float, limit: float
) -> np.ndarray:
    """Places (m, 2) [rad] along a way that `way_past_fixed` found, each `duration` [s] or less from the one before.

    Even moves from place to place keep `limit` [mm] as the way does.
    """
    turn = plane.max_speed[i] * (UNDER_LIMIT * duration)
    places = _split(way, turn / _PARTS)
    return read_only(_fewest_steps(plane.arms, near, rest, i, places, turn * (1.0 + 1e-12), limit))
