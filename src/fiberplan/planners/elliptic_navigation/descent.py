"""The compiled loop: every positioner asks for a step down its potential, and gets of it what is proven safe.

All ask from the same positions, as in the paper (simultaneous update). What only stands does not push: a positioner
that has come no nearer to its aim for a while (`Field.stall_time`), an offline one or an obstacle can be passed as near
as is safe, where a push from it would hold others off for ever. Neither do two that are both nearly at their goals,
because real goals are closer than the push reaches.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.arms import frame
from fiberplan.kernels.compile import kernel, leaf, record
from fiberplan.planners.elliptic_navigation.field import zone_push
from fiberplan.planners.shared.recording import sample
from fiberplan.planners.shared.safe_steps import grant, room_of, take
from fiberplan.planners.shared.step_limits import limited, within

THERE, STILL, STEPPED, FULL = 0, 1, 2, 3
"""Why the loop ended: all are where they should be; nobody moves; all steps are made; no room for knots."""

_NEARER = 0.05  # [s] coming nearer by this much is progress

AIM = record(
    [
        ("alpha", "f8"),  # where to go: the goal, or out of the way [rad]
        ("beta", "f8"),
        ("most_alpha", "f8"),  # largest turn in one step [rad]
        ("most_beta", "f8"),
        ("lower_alpha", "f8"),
        ("lower_beta", "f8"),
        ("upper_alpha", "f8"),
        ("upper_beta", "f8"),
        ("size", "f8"),  # of all zones as this positioner takes them; a smaller one goes first
        ("middle", "f8"),  # of the circle about all its zones, along the beta link [mm]
        ("reach", "f8"),  # and its radius [mm]
        ("moves", "?"),  # False: offline
        ("there", "?"),
        ("away", "f8"),  # time to the aim along a straight line [s]
        ("best", "f8"),  # the least that has been [s]
        ("quiet", "i8"),  # steps since
        ("refused", "f8"),  # travel of it and its neighbours when it was last refused any move [mm], or -1
        ("refused_alpha", "f8"),  # and what it wanted then [rad]
        ("refused_beta", "f8"),
    ]
)


class Scene(NamedTuple):
    """What everyone is doing; mutable."""

    zones: np.ndarray  # (n, z) ZONE
    aim: np.ndarray  # (n,) AIM
    frames: np.ndarray  # (n, 8) link frames at the beginning of the step
    clock: np.ndarray  # (2,) steps made; steps since anyone moved


@leaf
def _frame(scene, i):
    """Frames of positioner i at the beginning of the step."""
    row = scene.frames[i]
    return row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7]


@leaf
def _pushed_by(scene, field, i, j):
    """What positioner j pushes positioner i with: turns of both links [rad/s]."""
    me, other = scene.aim[i], scene.aim[j]
    weight = min(1.0, max(me.away, other.away) / field.near)
    weight *= max(0.0, 1.0 - other.quiet * field.dt / field.stall_time)
    first = second = 0.0
    if weight == 0.0:
        return first, second
    mine, theirs = _frame(scene, i), _frame(scene, j)
    dx = mine[2] + mine[6] * me.middle - theirs[2] - theirs[6] * other.middle
    dy = mine[3] + mine[7] * me.middle - theirs[3] - theirs[7] * other.middle
    far = me.size * (me.reach + other.reach) * field.D / field.d
    if dx * dx + dy * dy > far * far:
        return first, second
    for p in range(scene.zones.shape[1]):
        zone = scene.zones[i, p]
        share = weight * (field.lambda2 if zone.tip else field.lambda3)
        for q in range(scene.zones.shape[1]):
            facing = scene.zones[j, q]
            if (zone.category & facing.meets) != 0 or (facing.category & zone.meets) != 0:
                turn_1, turn_2 = zone_push(mine, zone, theirs, facing, me.size, field.D, field.d)
                first += share * turn_1
                second += share * turn_2
    return first, second


@leaf
def _ask(near, now, scene, field, i):
    """The step that positioner i wants: down its potential, at most at full speed, within its ranges."""
    pose, aim = now.pose[i], scene.aim[i]
    first = second = 0.0
    for k in range(near.offsets[i], near.offsets[i + 1]):
        j = near.near[k].arm
        if j < len(scene.aim):
            turn_1, turn_2 = _pushed_by(scene, field, i, j)
            first += turn_1
            second += turn_2
    da, db = aim.alpha - pose.alpha, aim.beta - pose.beta
    steps = max(abs(da) / aim.most_alpha, abs(db) / aim.most_beta)
    pose.lands = steps <= 1.0 and first == 0.0 and second == 0.0
    if not pose.lands:
        pull = field.lambda1 / max(steps, 1.0)
        da = pull * da + field.dt * (first + second)
        db = pull * db + field.dt * second
        da, db = limited(da, db, aim.most_alpha, aim.most_beta)
        da = within(pose.alpha, da, aim.lower_alpha, aim.upper_alpha)
        db = within(pose.beta, db, aim.lower_beta, aim.upper_beta)
    pose.wanted_alpha, pose.wanted_beta = da, db


@leaf
def _decide(arms, near, now, scene, i):
    """Grant what is safe; what was refused altogether is not tried again until someone around has moved."""
    pose, aim = now.pose[i], scene.aim[i]
    around = pose.travel
    for k in range(near.offsets[i], near.offsets[i + 1]):
        around += now.pose[near.near[k].arm].travel
    if aim.refused == around and aim.refused_alpha == pose.wanted_alpha and aim.refused_beta == pose.wanted_beta:
        return
    aim.refused = -1.0 if grant(arms, near, now, i) else around
    aim.refused_alpha, aim.refused_beta = pose.wanted_alpha, pose.wanted_beta


@leaf
def _go(arms, near, now, record, scene, field, i):
    """Make the granted step, and note how near the aim is; True if there was one."""
    pose, aim = now.pose[i], scene.aim[i]
    moved = pose.granted_alpha != 0.0 or pose.granted_beta != 0.0
    if moved:
        room = room_of(near, now, i)
        landed = pose.lands and pose.granted_alpha == pose.wanted_alpha and pose.granted_beta == pose.wanted_beta
        take(now, i)
        if landed:  # to the last bit
            pose.alpha, pose.beta = aim.alpha, aim.beta
        sample(arms, record, i, scene.clock[0], pose.alpha, pose.beta, room)
    look(now, scene, field, i)
    aim.quiet += 1
    if aim.away < aim.best - _NEARER:
        aim.best, aim.quiet = aim.away, 0
    return moved


@leaf
def look(now, scene, field, i):
    """Note how far positioner i is from its aim."""
    pose, aim = now.pose[i], scene.aim[i]
    steps = max(abs(aim.alpha - pose.alpha) / aim.most_alpha, abs(aim.beta - pose.beta) / aim.most_beta)
    aim.away = field.dt * steps
    aim.there = steps == 0.0


@kernel
def descend(arms, near, now, record, scene, field, steps):
    """Up to `steps` steps; returns why it ended."""
    n = len(scene.aim)
    for _ in range(steps):
        if record.used[0] + 2 * n > len(record.knots):
            return FULL
        scene.clock[0] += 1
        for i in range(n):
            bx, by, ex, ey, c1, s1, c2, s2, _, _, _, _ = frame(arms, i, now.pose[i].alpha, now.pose[i].beta)
            row = scene.frames[i]
            row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7] = bx, by, ex, ey, c1, s1, c2, s2
        for i in range(n):
            if scene.aim[i].moves:
                _ask(near, now, scene, field, i)
        for i in range(n):
            if scene.aim[i].moves:
                _decide(arms, near, now, scene, i)
        moved, there = 0, 0
        for i in range(n):
            if scene.aim[i].moves:
                moved += _go(arms, near, now, record, scene, field, i)
                there += scene.aim[i].there
            else:
                there += 1
        if there == n:
            return THERE
        scene.clock[1] = 0 if moved else scene.clock[1] + 1
        if scene.clock[1] * field.dt > field.stall_time:  # by then nobody pushes any more
            return STILL
    return STEPPED


@kernel
def look_around(now, scene, field):
    """Begin: note how far everyone is from its aim."""
    for i in range(len(scene.aim)):
        look(now, scene, field, i)
