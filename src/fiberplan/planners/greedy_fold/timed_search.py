"""A path to folded for one positioner past others that are moving: A* over (alpha, beta, time).

Time goes in equal steps. In each, a joint turns by a whole step of the lattice, either way, or not at all, so what is
left of the way is a whole number of steps too, and that is the estimate A* needs. The lattice of a joint is anchored
at folded, and shifted from the start on, so that both are on it. Whether an edge is clear of everyone's recorded motion
is asked only when the search comes to it, over its whole length.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import frame, motion
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import inlined, kernel, leaf, record
from fiberplan.planners.shared.straighten import KNOT, clear_of, first_at, pose
from fiberplan.tolerances import SLACK, UNDER_LIMIT

_MOST_STEPS = 400  # of time, whatever the speeds
_MOST_EDGES = 2_500  # tested before a search is given up
_MOST_SAMPLES = 60  # of one edge against one neighbour; one that takes more counts as not clear

_CLOSED = 2**16  # room for nodes
_SCATTER = np.int64(0x9E3779B97F4A7C15 - 2**64)  # odd, and far from any power of 2: near keys get far apart
# turns in steps, 1 away from folded; what is pushed last is searched first
_AWAY = np.array([[1, 1], [1, 0], [0, 1], [1, -1], [-1, 1], [0, 0], [-1, 0], [0, -1], [-1, -1]])
_AWAY.setflags(write=False)

ENTRY = record([("a", "i4"), ("b", "i4"), ("step", "i4"), ("parent", "i4"), ("next", "i4")])


class Passing(NamedTuple):
    """Those next to a positioner, as they move."""

    arm: np.ndarray  # (m,)
    first: np.ndarray  # (m,) their knots
    last: np.ndarray  # (m,) one past
    knots: np.ndarray  # (k + 2,) KNOT; the last two are for the edge that is tested


class Joint(NamedTuple):
    """The lattice of one joint [rad]."""

    folded: float
    start: float
    place: int  # of the start: folded is 0
    step: float
    lower: float
    upper: float


@inlined
def _angle(joint, place):
    """The joint's angle at a place of its lattice [rad]."""
    beyond = place >= joint.place if joint.start >= joint.folded else place <= joint.place
    if (beyond and joint.place != 0) or place == 0 == joint.place:
        return joint.start + (place - joint.place) * joint.step
    return joint.folded + place * joint.step


@leaf
def _edge_is_clear(arms, i, passing, frames, moved, step, dt, limit, blame):
    """Whether arm i may move along the edge in the last two of `passing.knots`, during time step `step`."""
    knots = passing.knots
    a, b = len(knots) - 2, len(knots) - 1
    frame_i = frame(arms, i, knots[b].alpha, knots[b].beta)
    mine = motion(arms, i, knots[b].alpha - knots[a].alpha, knots[b].beta - knots[a].beta)
    knots[a].time, knots[b].time = step * dt, (step + 1) * dt
    for k in range(len(passing.arm)):
        j = passing.arm[k]
        row = frames[k, step + 1]
        frame_j = (row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], 0.0, 0.0, 0.0, 0.0)
        gap = frames_clearance(arms, i, frame_i, j, frame_j)
        if gap - limit > mine + moved[k, step]:
            continue
        first, last = first_at(knots, passing.first[k], passing.last[k], knots[a].time), passing.last[k]
        if not (gap >= limit and clear_of(arms, knots, i, a, b, j, first, last, limit, _MOST_SAMPLES)):
            blame[k] += 1
            return False
    return True


@leaf
def _follow(arms, passing, dt, frames, moved):
    """Fill in frames (m, steps + 1, 8) of those passing at every step, and how far they move in it (m, steps) [mm]."""
    knots = passing.knots
    for k in range(len(passing.arm)):
        j, c, last = passing.arm[k], passing.first[k], passing.last[k]
        for step in range(frames.shape[1]):
            t, alpha, beta, travel = step * dt, 0.0, 0.0, 0.0
            if c < last:
                before = t - dt
                while c + 1 < last and knots[c + 1].time <= t:
                    travel += _between(arms, knots, j, c, before, knots[c + 1].time)
                    c += 1
                if c + 1 < last:
                    travel += _between(arms, knots, j, c, before, t)
                alpha, beta = pose(knots, c, last, t)
            row = frames[k, step]
            bx, by, ex, ey, c1, s1, c2, s2, _, _, _, _ = frame(arms, j, alpha, beta)
            row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7] = bx, by, ex, ey, c1, s1, c2, s2
            if step > 0:
                moved[k, step - 1] = travel * (1.0 + 1e-9)


@inlined
def _between(arms, knots, j, c, t0, t1):
    """How far arm j moves between t0 and t1 [s] on its way from knot c to the next [mm]."""
    here, after = knots[c], knots[c + 1]
    part = (min(t1, after.time) - max(t0, here.time)) / (after.time - here.time)
    return max(0.0, part) * motion(arms, j, after.alpha - here.alpha, after.beta - here.beta)


@leaf
def _set_edge(knots, alpha, beta, a, b, to_a, to_b):
    """Put the edge from places (a, b) to (to_a, to_b) into the last two of `knots`."""
    begin, end = knots[len(knots) - 2], knots[len(knots) - 1]
    begin.alpha, begin.beta = _angle(alpha, a), _angle(beta, b)
    end.alpha, end.beta = _angle(alpha, to_a), _angle(beta, to_b)


@leaf
def _free_from(arms, i, passing, frames, moved, alpha, beta, dt, limit, blame):
    """First step from which arm i may rest folded for good."""
    _set_edge(passing.knots, alpha, beta, 0, 0, 0, 0)
    step = moved.shape[1]
    while step > 0 and _edge_is_clear(arms, i, passing, frames, moved, step - 1, dt, limit, blame):
        step -= 1
    return step


@leaf
def _is_new(closed, a, b, step):
    """Whether a node is met for the first time; it is not the next time."""
    key = ((np.int64(a) + 2**20) << 42) | ((np.int64(b) + 2**20) << 20) | np.int64(step)
    place = (key * _SCATTER) >> 20
    while True:
        place &= len(closed) - 1
        if closed[place] == key:
            return False
        if closed[place] < 0:
            closed[place] = key
            return True
        place += 1


@leaf
def _push(entries, heads, count, a, b, step, parent, total):
    """Entry number `count`: a node to come to, whose path takes `total` steps at least."""
    entry = entries[count]
    entry.a, entry.b, entry.step, entry.parent, entry.next = a, b, step, parent, heads[total]
    heads[total] = count


@kernel
def search(arms, i, passing, alpha, beta, dt, steps, wait, limit, blame):
    """Places (k, 2) of arm i from step `wait` on until it rests folded, or none; `blame` (m,) counts refusals."""
    frames = np.empty((len(passing.arm), steps + 1, 8))
    moved = np.empty((len(passing.arm), steps))
    _follow(arms, passing, dt, frames, moved)
    free = _free_from(arms, i, passing, frames, moved, alpha, beta, dt, limit, blame)
    entries = np.empty(9 * _MOST_EDGES + 1, ENTRY)
    closed = np.full(_CLOSED, -1, np.int64)
    heads = np.full(steps + 1, -1, np.int32)
    count, tested = 1, 0
    total = max(wait + max(abs(alpha.place), abs(beta.place)), free)
    if total > steps:
        return np.empty((0, 2), np.int64)
    _set_edge(passing.knots, alpha, beta, alpha.place, beta.place, alpha.place, beta.place)
    for step in range(wait):
        if not _edge_is_clear(arms, i, passing, frames, moved, step, dt, limit, blame):
            return np.empty((0, 2), np.int64)
    _push(entries, heads, 0, alpha.place, beta.place, wait, -1, total)
    while total <= steps and tested < _MOST_EDGES:
        k = heads[total]
        if k < 0:
            total += 1
            continue
        heads[total] = entries[k].next
        a, b, step, parent = entries[k].a, entries[k].b, entries[k].step, entries[k].parent
        if parent >= 0:
            _set_edge(passing.knots, alpha, beta, entries[parent].a, entries[parent].b, a, b)
            tested += 1
            if not _edge_is_clear(arms, i, passing, frames, moved, step - 1, dt, limit, blame):
                continue
        if not _is_new(closed, a, b, step):
            continue
        if a == 0 and b == 0 and step >= free:
            path = np.empty((step + 1, 2), np.int64)
            path[:, 0], path[:, 1] = alpha.place, beta.place
            while k >= 0:
                entry = entries[k]
                path[entry.step, 0], path[entry.step, 1], k = entry.a, entry.b, entry.parent
            return path
        for rank in range(9):
            to_a, to_b = a + _AWAY[rank, 0] * (1 if a >= 0 else -1), b + _AWAY[rank, 1] * (1 if b >= 0 else -1)
            to_alpha, to_beta = _angle(alpha, to_a), _angle(beta, to_b)
            within = alpha.lower <= to_alpha <= alpha.upper and beta.lower <= to_beta <= beta.upper
            most = max(step + 1 + max(abs(to_a), abs(to_b)), free)
            if within and most <= steps:
                _push(entries, heads, count, to_a, to_b, step + 1, k, most)
                count += 1
    return np.empty((0, 2), np.int64)


def _joint(plane: FocalPlane, i: int, joint: int, start: float, dt: float) -> Joint:
    """The lattice of one joint of positioner `i`, which turns by a step in `dt` [s]."""
    folded, step = float(plane.folded[i, joint]), float(plane.max_speed[i, joint]) * UNDER_LIMIT * dt
    away = start - folded
    place = int(np.sign(away) * np.ceil(abs(away) / step * (1.0 - 1e-12)))
    lower, upper = float(plane.lower[i, joint]), float(plane.upper[i, joint])
    return Joint(folded, start, place, step, max(lower, folded - 2 * np.pi), min(upper, folded + 2 * np.pi))


def path_in_time(
    plane: FocalPlane,
    i: int,
    start: np.ndarray,
    others: list[tuple[int, np.ndarray, np.ndarray]],
    margin: float,
    horizon: float,
    step: float,
    wait: float = 0.0,
) -> tuple[tuple[np.ndarray, np.ndarray] | None, np.ndarray]:
    """Move positioner `i` from `start` (2,) to folded, past `others`, each (arm, times (m,) [s], angles (m, 2) [rad]).

    `step` is the turn of its faster joint from one moment of the search to the next, and `wait` how far it could turn
    before it sets out [rad].

    Returns:
        times (m,) [s] and angles (m, 2) [rad] of a motion that rests at folded by `horizon` [s], or None if there
        seems to be none; and how often each of the others refused an edge (len(others),).
    """
    dt = max(step / float(plane.max_speed[i].max()) / UNDER_LIMIT, horizon / _MOST_STEPS)
    alpha, beta = (_joint(plane, i, joint, float(start[joint]), dt) for joint in (0, 1))
    counts = np.array([len(times) for _, times, _ in others], np.int64)
    last = np.cumsum(counts)
    knots = np.empty(int(counts.sum()) + 2, KNOT)
    for (_, times, angles), end, count in zip(others, last, counts, strict=True):
        own = knots[end - count : end]
        own["time"], own["alpha"], own["beta"] = times, angles[:, 0], angles[:, 1]
    passing = Passing(np.array([arm for arm, _, _ in others], np.int64), last - counts, last, knots)
    blame = np.zeros(len(others), np.int64)
    places = search(
        plane.arms, i, passing, alpha, beta, dt, int(horizon / dt), round(wait / step), margin + SLACK, blame
    )
    if not len(places):
        return None, blame
    angles = np.stack([[_angle(joint, p) for p in own] for joint, own in zip((alpha, beta), places.T, strict=True)], 1)
    return (np.arange(len(places)) * dt, angles), blame
