"""The compiled loop of Makarem2014's navigation function: all fiber ends descend their potentials at once.

In every step each positioner that is awake asks for a turn, from the positions all have at the beginning of the step
(`literal` or `repaired`); the turns are granted as far as they are safe, taken, and recorded. A positioner that asks
for nothing falls asleep, and wakes when a neighbour moves within the range of repulsion; so a step costs nothing for
those that have arrived and are left in peace.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.compile import inlined, kernel, leaf
from fiberplan.planners.navigation_function.fiber_ends import away, place_end, through_joints
from fiberplan.planners.navigation_function.singular import nudged
from fiberplan.planners.shared.recording import sample
from fiberplan.planners.shared.repulsion import push
from fiberplan.planners.shared.safe_steps import grant, room_of, take
from fiberplan.planners.shared.step_limits import limited, straight, within

CONVERGED, STALLED, FULL, EXHAUSTED = 0, 1, 2, 3
"""Why the loop ended: all within convergence; nothing moves any more; no room for knots; no steps left."""

STILL = 1e-9  # [rad] a step that turns no joint by more is none


class Weights(NamedTuple):
    """The paper's parameters."""

    lambda1: float  # of attraction [1/mm^2]
    lambda2: float  # of repulsion
    D: float  # repulsion begins here [mm]
    d: float  # and grows without bound towards here [mm]
    dt: float  # of a step [s]
    convergence: float  # a fiber this near its target has converged [mm]


class Crowd(NamedTuple):
    """Who is awake; mutable."""

    active: np.ndarray  # (n,) those awake come first, in order of waking
    awake: np.ndarray  # (n,) bool
    restless: np.ndarray  # (n,) bool: stays awake even if it asks for nothing
    movable: np.ndarray  # (n,) bool: may move at all
    side: np.ndarray  # (n,) which way to leave a singular pose
    counters: np.ndarray  # (2,) steps so far, how many are awake


@inlined
def repelled(ends, i, D, d):
    """Sum of the pushes of all neighbours on fiber end i [1/mm]."""
    me = ends.end[i]
    fx, fy = 0.0, 0.0
    for k in range(ends.offsets[i], ends.offsets[i + 1]):
        other = ends.end[ends.near[k].arm]
        px, py = push(me.x - other.x, me.y - other.y, D, d)
        fx += px
        fy += py
    return fx, fy


@leaf
def _ask_literally(ends, now, weights, side, i):
    """What descent of the printed potential asks of arm i: minus its gradient by the joints, limited in speed."""
    me, pose = ends.end[i], now.pose[i]
    px, py = repelled(ends, i, weights.D, weights.d)
    fx, fy = weights.lambda2 * px, weights.lambda2 * py
    if not np.isnan(me.target_x):
        fx -= 2.0 * weights.lambda1 * (me.x - me.target_x)
        fy -= 2.0 * weights.lambda1 * (me.y - me.target_y)
    va, vb = through_joints(me, fx, fy)
    da, db = limited(va * weights.dt, vb * weights.dt, me.most_alpha, me.most_beta)
    if px == 0.0 and py == 0.0 and away(me) > weights.convergence:
        da, db = nudged(da, db, pose.beta, me.lower_beta, me.upper_beta, side, 0.5 * me.most_beta, 1e-3 * me.most_beta)
    pose.wanted_alpha = within(pose.alpha, da, me.lower_alpha, me.upper_alpha)
    pose.wanted_beta = within(pose.beta, db, me.lower_beta, me.upper_beta)
    pose.lands = False


@inlined
def wake(crowd, i):
    """Put a sleeper on the list of those awake."""
    if not crowd.awake[i] and crowd.movable[i]:
        crowd.awake[i] = True
        crowd.active[crowd.counters[1]] = i
        crowd.counters[1] += 1


@leaf
def wake_around(ends, crowd, i, D):
    """Wake the sleepers whom fiber end i has come near."""
    me = ends.end[i]
    for k in range(ends.offsets[i], ends.offsets[i + 1]):
        j = ends.near[k].arm
        if not crowd.awake[j]:
            dx, dy = me.x - ends.end[j].x, me.y - ends.end[j].y
            if dx * dx + dy * dy < D * D:
                wake(crowd, j)


@leaf
def advance(arms, near, now, record, ends, crowd, D):
    """Grant, take and record what has been asked; returns whether anyone moved. Who neither asks nor moves sleeps."""
    crowd.counters[0] += 1
    step, count = crowd.counters[0], crowd.counters[1]
    for k in range(count):
        i = crowd.active[k if step % 2 == 0 else count - 1 - k]
        pose = now.pose[i]
        pose.blocker = -1
        if abs(pose.wanted_alpha) > STILL or abs(pose.wanted_beta) > STILL:
            grant(arms, near, now, i)
    moved = False
    kept = 0
    for k in range(count):
        i = crowd.active[k]
        pose = now.pose[i]
        asked = abs(pose.wanted_alpha) > STILL or abs(pose.wanted_beta) > STILL
        if pose.granted_alpha != 0.0 or pose.granted_beta != 0.0:
            moved = True
            room = room_of(near, now, i)
            take(now, i)
            sample(arms, record, i, step, pose.alpha, pose.beta, room)
            place_end(arms, ends, i, pose.alpha, pose.beta)
        if asked or crowd.restless[i]:
            crowd.active[kept] = i
            kept += 1
        else:
            crowd.awake[i] = False
    crowd.counters[1] = kept
    for k in range(kept):
        wake_around(ends, crowd, crowd.active[k], D)
    return moved


@leaf
def converged(ends, crowd, distance):
    """Whether every fiber with a target is within `distance` of it [mm]."""
    missing = 0
    for i in range(len(ends.end)):
        if crowd.movable[i] and away(ends.end[i]) > distance:
            missing += 1
    return missing == 0


@kernel
def descend_literally(arms, near, now, record, ends, crowd, weights, last_step):
    """Descend until all have converged; returns why it ended."""
    while not converged(ends, crowd, weights.convergence):
        if crowd.counters[0] >= last_step:
            return EXHAUSTED
        if crowd.counters[1] == 0:
            return STALLED
        if record.used[0] + 2 * crowd.counters[1] > len(record.knots):
            return FULL
        for k in range(crowd.counters[1]):
            i = crowd.active[k]
            _ask_literally(ends, now, weights, crowd.side[i], i)
        advance(arms, near, now, record, ends, crowd, weights.D)
    return CONVERGED


@kernel
def settle(arms, near, now, record, ends, crowd, goals, last_step):
    """The last stretch: who has a row in `goals` (n, 2) [rad] goes straight there, exactly; returns why it ended."""
    moved = True
    while True:
        crowd.counters[1] = 0
        for i in range(len(goals)):
            pose, end = now.pose[i], ends.end[i]
            crowd.awake[i] = False
            if crowd.movable[i] and (abs(goals[i, 0] - pose.alpha) > STILL or abs(goals[i, 1] - pose.beta) > STILL):
                da, db = straight(pose.alpha, pose.beta, goals[i, 0], goals[i, 1], end.most_alpha, end.most_beta)
                pose.wanted_alpha, pose.wanted_beta = da, db
                pose.lands = abs(goals[i, 0] - pose.alpha - da) < STILL and abs(goals[i, 1] - pose.beta - db) < STILL
                crowd.active[crowd.counters[1]] = i
                crowd.counters[1] += 1
        if crowd.counters[1] == 0:
            return CONVERGED
        if crowd.counters[0] >= last_step:
            return EXHAUSTED
        if not moved:
            return STALLED
        if record.used[0] + 2 * crowd.counters[1] > len(record.knots):
            return FULL
        moved = advance(arms, near, now, record, ends, crowd, 0.0)
