"""Joint search for a few positioners that are in each other's way, everyone else standing still.

RRT-Connect (Kuffner and LaValle, ICRA 2000) in the joint space of all of them at once: two trees, from where they stand
and from where they should be, grow towards random configurations and towards each other. Distance is travel time. An
edge is an even move of all members together, tested over its whole length. No proof comes of failure.
"""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.kernels.compile import inlined, kernel, leaf
from fiberplan.kernels.randoms import uniform
from fiberplan.kernels.sweep import swept_clear
from fiberplan.tolerances import SLACK

_STEP = np.radians(8.0)  # of the fastest joint, for one edge
_NODES = 500  # of either tree; most ways out take under 100, and a search that needs more rarely ends
_EDGES_PER_NODE = 8  # edges tested before giving up, for every node allowed
_GOAL_BIAS = 0.1
_INSTANT = 1e-9  # [s] nodes closer than this are one
_ROUNDS = 3  # of shortening what was found
_SHORTENINGS = 3  # an edge that is refused is tried at a quarter of its length, and so on: ways out can be narrow


@leaf
def _edge_is_clear(arms, near, rest, members, place, p, q, limit, blame):
    """Whether the members may move evenly together from p to q (2 k,), past each other and all who rest.

    `place[i]` is the place of arm i among the members, or -1; `rest` (n, 2) is where the others stand. `blame` counts
    how often each arm refused.
    """
    for a in range(len(members)):
        i = members[a]
        da, db = q[2 * a] - p[2 * a], q[2 * a + 1] - p[2 * a + 1]
        for k in range(near.offsets[i], near.offsets[i + 1]):
            j = near.near[k].arm
            b = place[j]
            if b >= 0:
                if b < a:
                    continue
                c0, d0 = p[2 * b], p[2 * b + 1]
                dc, dd = q[2 * b] - c0, q[2 * b + 1] - d0
            else:
                c0, d0, dc, dd = rest[j, 0], rest[j, 1], 0.0, 0.0
            if not swept_clear(arms, i, p[2 * a], p[2 * a + 1], da, db, j, c0, d0, dc, dd, limit, 0.0, 0.0):
                blame[j] += 1
                return False
    return True


@inlined
def _travel_time(p, q, slowness, enough):
    """Time of an even move from p to q [s], or some time of at least `enough` where it takes that long."""
    longest, d = 0.0, 0
    while d < len(p) and longest < enough:
        longest = max(longest, abs(q[d] - p[d]) * slowness[d])
        d += 1
    return longest


@leaf
def _nearest(nodes, count, goal, slowness):
    """Of so many nodes the one from which an even move to `goal` is shortest."""
    nearest, shortest = 0, np.inf
    for k in range(count):
        far = _travel_time(nodes[k], goal, slowness, shortest)
        if far < shortest:
            nearest, shortest = k, far
    return nearest


@leaf
def _extend(
    arms, near, rest, members, place, nodes, parent, nearest, count, goal, slowness, step, limit, reached, blame
):
    """Grow a tree one edge from node `nearest` towards `goal`; returns how many nodes it has, the new one the last.

    `reached[0]` is 1 if the goal itself was added, -1 if nothing could be; `reached[1]` counts the edges tested.
    """
    shortest = _travel_time(nodes[nearest], goal, slowness, np.inf)
    part = 1.0 if shortest <= step else step / shortest
    for _ in range(_SHORTENINGS):
        for d in range(len(goal)):
            nodes[count, d] = nodes[nearest, d] + part * (goal[d] - nodes[nearest, d])
        reached[1] += 1
        if _edge_is_clear(arms, near, rest, members, place, nodes[nearest], nodes[count], limit, blame):
            parent[count] = nearest
            reached[0] = 1 if part == 1.0 else 0
            return count + 1
        part *= 0.25
    reached[0] = -1
    return count


@kernel
def _rrt_connect(arms, near, rest, members, place, start, goal, lower, upper, slowness, step, limit, seed, most, blame):
    """A chain of configurations (m, 2 k) from start to goal with clear edges; empty if none was found."""
    size = len(start)
    nodes = np.empty((2, most + 1, size))
    parent = np.empty((2, most + 1), np.int64)
    counts = np.ones(2, np.int64)
    nodes[0, 0], nodes[1, 0] = start, goal
    parent[:, 0] = -1
    state = np.empty(1, np.uint64)
    state[0] = seed
    target = np.empty(size)
    reached = np.zeros(2, np.int64)
    side = 0
    met = False
    while not met and counts.max() < most and reached[1] < _EDGES_PER_NODE * most:
        if uniform(state) < _GOAL_BIAS:
            target[:] = nodes[1 - side, 0]
        else:
            for d in range(size):
                target[d] = lower[d] + uniform(state) * (upper[d] - lower[d])
        counts[side] = _extend(
            arms,
            near,
            rest,
            members,
            place,
            nodes[side],
            parent[side],
            _nearest(nodes[side], counts[side], target, slowness),
            counts[side],
            target,
            slowness,
            step,
            limit,
            reached,
            blame,
        )
        if reached[0] >= 0:
            target[:] = nodes[side, counts[side] - 1]
            other = 1 - side
            reached[0] = 0
            nearest = _nearest(nodes[other], counts[other], target, slowness)
            while reached[0] == 0 and counts[other] < most:
                counts[other] = _extend(
                    arms, near, rest, members, place, nodes[other], parent[other], nearest, counts[other], target,
                    slowness, step, limit, reached, blame,
                )  # fmt: skip
                nearest = counts[other] - 1  # each is nearer than all before
            met = reached[0] == 1
        side = 1 - side
    if not met:
        return np.empty((0, size))
    chain = np.empty((counts.sum(), size))
    length = 0
    k = counts[0] - 1
    while k >= 0:
        chain[length] = nodes[0, k]
        length += 1
        k = parent[0, k]
    chain[:length] = chain[:length][::-1].copy()
    k = parent[1, counts[1] - 1]  # the last node of each tree is where they met
    while k >= 0:
        chain[length] = nodes[1, k]
        length += 1
        k = parent[1, k]
    return chain[:length].copy()


@kernel
def _shorten(arms, near, rest, members, place, chain, limit, blame):
    """The chain with every stretch replaced that an even move can replace, from its nodes."""
    kept = np.empty_like(chain)
    kept[0] = chain[0]
    count, a = 1, 0
    while a < len(chain) - 1:
        b = len(chain) - 1
        while b > a + 1 and not _edge_is_clear(arms, near, rest, members, place, chain[a], chain[b], limit, blame):
            b -= 1
        kept[count] = chain[b]
        count += 1
        a = b
    return kept[:count].copy()


@kernel
def _subdivided(chain, slowness, step):
    """The same chain with nodes at most `step` [s] apart."""
    pieces = np.empty(len(chain) - 1, np.int64)
    for k in range(len(chain) - 1):
        pieces[k] = max(1, int(np.ceil(_travel_time(chain[k], chain[k + 1], slowness, np.inf) / step)))
    out = np.empty((pieces.sum() + 1, chain.shape[1]))
    count = 0
    for k in range(len(chain) - 1):
        for m in range(pieces[k]):
            part = m / pieces[k]
            for d in range(chain.shape[1]):
                out[count, d] = chain[k, d] + part * (chain[k + 1, d] - chain[k, d])
            count += 1
    out[count] = chain[len(chain) - 1]
    return out


def joint_path(
    plane: FocalPlane,
    near: Neighbourhood,
    members: np.ndarray,
    angles: np.ndarray,
    goal: np.ndarray,
    margin: float,
    seed: int,
    most: int = _NODES,
) -> tuple[tuple[np.ndarray, np.ndarray] | None, np.ndarray]:
    """Move `members` together from `angles` to `goal`, everyone else standing at `angles`.

    Args:
        plane: the array.
        near: neighbour lists at `margin`.
        members: (k,) positioners.
        angles: (n, 2) where everyone is [rad].
        goal: (k, 2) where the members should be [rad].
        margin: clearance to keep [mm].
        seed: of the random search.
        most: nodes of each tree before giving up.

    Returns:
        times (m,) at the members' top speeds [s] and angles (m, k, 2) [rad], or None if no way was found; and how
        often each arm stood in the way of an edge (arms,), which tells whom to take in next.
    """
    members = np.asarray(members, np.int64)
    place = np.full(len(plane.arms.arm), -1)
    place[members] = np.arange(len(members))
    folded = plane.folded[members]
    lower = np.maximum(plane.lower[members], folded - 2 * np.pi).ravel()
    upper = np.minimum(plane.upper[members], folded + 2 * np.pi).ravel()
    speed = plane.max_speed[members].ravel()
    slowness = 1.0 / speed
    start, end = np.ascontiguousarray(angles[members]).ravel(), np.ascontiguousarray(goal, float).ravel()
    shared = (plane.arms, near, np.array(plane.with_obstacles(angles)), members, place)
    blame = np.zeros(len(plane.arms.arm), np.int64)
    step = _STEP / float(speed.max())
    limit = margin + SLACK
    chain = _rrt_connect(*shared, start, end, lower, upper, slowness, step, limit, np.uint64(seed), most, blame)
    if not len(chain):
        return None, blame
    for _ in range(_ROUNDS):
        chain = _shorten(*shared, _subdivided(chain, slowness, step), limit, blame)
    spans = np.abs(np.diff(chain, axis=0) / speed).max(axis=1)
    moves = spans > _INSTANT  # the trees meet in a node of each, and members may be at their goal already
    chain = np.concatenate([chain[:1], chain[1:][moves]])
    if len(chain) > 1:
        chain[-1] = end  # exactly, also where the last of several nodes that are one was left out
    times = np.concatenate([[0.0], np.cumsum(spans[moves])])
    return (times, chain.reshape(len(chain), -1, 2)), blame
