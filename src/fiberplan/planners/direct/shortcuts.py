"""Paths made shorter: stretches of a joint, of a positioner or of a few together are replaced by even moves.

Partial shortcuts (Geraerts and Overmars, IJRR 26, 2007). A shortcut of a few together saves them time, and what they do
afterwards they do sooner; a shortcut of one joint or one positioner takes as long as what it replaces, but leads it out
of the others' way. Everybody else moves as before, and every step is tested in continuous time.
"""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.kernels.randoms import uniform
from fiberplan.planners.direct.contacts import first_contact
from fiberplan.tolerances import UNDER_LIMIT

_EVEN = 1e-9  # of a step


@leaf
def _arrival(path, members, steps):
    """The step after which none of `members` moves any more."""
    last = 0
    for i in members:
        k = steps
        while k > last and path[i, k, 0] == path[i, k - 1, 0] and path[i, k, 1] == path[i, k - 1, 1]:
            k -= 1
        last = max(last, k)
    return last


@leaf
def _is_clear(arms, near, path, members, moved, limit, first, last, blame):
    """Whether those of `members` that `moved` (k,) keep `limit` [mm] from everybody between two steps."""
    for m in range(len(members)):
        if not moved[m]:
            continue
        i = members[m]
        for q in range(near.offsets[i], near.offsets[i + 1]):
            j = near.near[q].arm
            seen = False
            for other in range(m):
                seen = seen or (moved[other] and members[other] == j)
            if not seen and first_contact(arms, path, i, j, limit, first, last) < last:
                blame[j] += 1
                return False
    return True


@leaf
def _replaced(path, old, members, turn, joints, a, b, steps):
    """Let `members` turn `joints` (k, 2) evenly from where they are at step a to where they are at step b.

    Their paths before are put into `old`. Returns by how many steps they are sooner: none if it is not all of them, and
    -1 if they could not turn that fast, with nothing changed.
    """
    needed, all_of_them = 1, True
    for m in range(len(members)):
        for d in range(2):
            all_of_them = all_of_them and joints[m, d]
            if joints[m, d]:
                far = abs(path[members[m], b, d] - path[members[m], a, d]) / turn[m, d]
                needed = max(needed, int(np.ceil(far - _EVEN)))
    saved = b - a - needed
    if saved < 0 or (all_of_them and saved == 0):
        return -1
    saved = saved if all_of_them else 0
    count = b - a - saved
    for m in range(len(members)):
        i = members[m]
        for k in range(a, steps + 1):
            for d in range(2):
                old[m, k, d] = path[i, k, d]
        for d in range(2):
            if joints[m, d]:
                for k in range(1, count):
                    path[i, a + k, d] = old[m, a, d] + (k / count) * (old[m, b, d] - old[m, a, d])
                for k in range(a + count, steps + 1):
                    path[i, k, d] = old[m, min(k + saved, steps), d]
    return saved


@kernel
def _shortcut(arms, near, path, members, turn, limit, tries, state, blame):
    """What `hurried` does; `turn` (k, 2) is how far each joint of the members turns in a step at most [rad]."""
    steps, count = path.shape[1] - 1, len(members)
    old = np.empty((count, steps + 1, 2))
    joints, moved = np.empty((count, 2), np.bool_), np.empty(count, np.bool_)
    arrival = _arrival(path, members, steps)
    for _ in range(tries):
        if arrival < 2:
            break
        kind, chosen, joint = uniform(state), int(uniform(state) * count), int(uniform(state) * 2)
        a, b = int(uniform(state) * (arrival + 1)), int(uniform(state) * (arrival + 1))
        a, b = min(a, b), max(a, b)
        if b - a < 2:
            continue
        for m in range(count):
            moved[m] = kind < 0.5 or m == chosen
            for d in range(2):
                joints[m, d] = moved[m] and (kind < 0.75 or d == joint)
        saved = _replaced(path, old, members, turn, joints, a, b, steps)
        if saved < 0:
            continue
        last = arrival if saved else b
        if _is_clear(arms, near, path, members, moved, limit, a, last, blame):
            arrival = _arrival(path, members, arrival)
            continue
        for m in range(count):
            for k in range(a, steps + 1):
                for d in range(2):
                    path[members[m], k, d] = old[m, k, d]
    return arrival


def arrivals(path: np.ndarray) -> np.ndarray:
    """(n,) the last step in which each of `path` (n, steps + 1, 2) moves; 0 if none."""
    moves = (path[:, 1:] != path[:, :-1]).any(axis=2)
    return np.where(moves.any(axis=1), moves.shape[1] - moves[:, ::-1].argmax(axis=1), 0)


def hurried(
    plane: FocalPlane,
    near: Neighbourhood,
    path: np.ndarray,
    members: np.ndarray,
    limit: float,
    duration: float,
    tries: int,
    state: np.ndarray,
    blame: np.ndarray,
) -> int:
    """Let `members` arrive sooner if shortcuts let them: in `path`, in place.

    Args:
        plane: the array.
        near: neighbour lists; who is in none is not seen.
        path: (arms, steps + 1, 2) everybody's paths, clear step by step [rad].
        members: (k,) positioners.
        limit: clearance to keep [mm].
        duration: of a step [s].
        tries: shortcuts to try.
        state: (1,) of the random generator.
        blame: (arms,) counts how often each arm refused a shortcut.

    Returns:
        the step at which all members have arrived.
    """
    turn = plane.max_speed[members] * (UNDER_LIMIT * duration)
    return int(_shortcut(plane.arms, near, path, members, turn, limit, tries, state, blame))
