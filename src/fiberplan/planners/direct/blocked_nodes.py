"""Where a positioner cannot be because of another one: sets of lattice nodes, one machine word of betas per alpha.

A node is blocked when the clearance there, bodies and all, is less than a limit. If the clearance at one beta exceeds
the limit by c, every beta is free too to which no body point moves farther than c; if it falls short by c, every such
beta is blocked.
"""

import numpy as np

from fiberplan.kernels.arms import frame, point
from fiberplan.kernels.clearance import clearance_within, meet
from fiberplan.kernels.compile import inlined, leaf
from fiberplan.planners.direct.lattice import beta_at, late_limit, window, window_of

_ONE = np.uint64(1)
_NONE = np.uint64(0)
_ROOM = 1e-6  # [mm] for rounding
_LEAP = 8.0  # betas that one clearance may vouch for: measuring larger ones exactly costs more than it saves


@inlined
def bit(b):
    """The set of beta node b alone."""
    return _ONE << np.uint64(b)


@inlined
def holds(bits, b):
    """Whether beta node b is in a set."""
    return (bits >> np.uint64(b)) & _ONE != _NONE


@leaf
def link_directions(arms, lattice, i, trig):
    """Cosine and sine of the links of positioner i at its nodes: trig[a, 0] of link 1, trig[a, 1 + b] of link 2."""
    arm = arms.arm[i]
    for a in range(lattice.size[i, 0]):
        first = lattice.alpha[i, a] + arm.alpha_zero
        trig[a, 0, 0], trig[a, 0, 1] = np.cos(first), np.sin(first)
        for b in range(lattice.size[i, 1]):
            second = first + beta_at(lattice, i, a, b) + arm.beta_zero
            trig[a, b + 1, 0], trig[a, b + 1, 1] = np.cos(second), np.sin(second)


@inlined
def node_frame(arms, i, trig, a, b):
    """Link frames of positioner i at its node (a, b)."""
    arm = arms.arm[i]
    c1, s1 = trig[a, 0, 0], trig[a, 0, 1]
    ex, ey = arm.x + arm.length * c1, arm.y + arm.length * s1
    return arm.x, arm.y, ex, ey, c1, s1, trig[a, b + 1, 0], trig[a, b + 1, 1], 0.0, 0.0, 0.0, 0.0


@inlined
def beta_motion(arms, lattice, i):
    """Bound on how far a body point of positioner i moves from one beta node to the next [mm]."""
    widest = 0.0
    for b in range(lattice.size[i, 1] - 1):
        widest = max(widest, lattice.beta[i, b + 1] - lattice.beta[i, b])
    return max(arms.arm[i].reach_beta * widest, 1e-9)


@inlined
def circle_at(lattice, j, frame_j):
    """Center of the circle about the bodies of arm j's last link [mm]."""
    u, v = lattice.circle[j, 0], lattice.circle[j, 1]
    if j < len(lattice.size):
        return frame_j[2] + frame_j[6] * u - frame_j[7] * v, frame_j[3] + frame_j[7] * u + frame_j[6] * v
    return frame_j[0] + u, frame_j[1] + v


@inlined
def _apart(ax, ay, bx, by, gap):
    return (ax - bx) * (ax - bx) + (ay - by) * (ay - by) > gap * gap


@inlined
def cannot_meet(arms, lattice, i, ex, ey, j, frame_j, limit):
    """Whether arm i, wherever its beta is and with its elbow at (ex, ey), surely clears arm j by `limit` [mm]."""
    cx, cy = circle_at(lattice, j, frame_j)
    mine = np.hypot(lattice.circle[i, 0], lattice.circle[i, 1]) + lattice.circle[i, 2]
    theirs = lattice.circle[j, 2] + limit
    if not _apart(cx, cy, ex, ey, mine + theirs):
        return False
    first_i, first_j = lattice.first_link[i], lattice.first_link[j]
    if first_i < 0.0 and first_j < 0.0:
        return True
    x, y = arms.arm[i].x, arms.arm[i].y
    return (
        (first_i < 0.0 or _apart(cx, cy, x, y, first_i + theirs))
        and (first_j < 0.0 or _apart(frame_j[0], frame_j[1], ex, ey, mine + first_j + limit))
        and (first_i < 0.0 or first_j < 0.0 or _apart(frame_j[0], frame_j[1], x, y, first_i + first_j + limit))
    )


@leaf
def _betas_to_check(arms, lattice, i, a, trig, j, frame_j, limit):
    """The beta nodes of positioner i at its alpha node `a` at which circles about its pieces come near those of arm j.

    Nearer than `limit` [mm], that is. Pieces of the first link are near at all betas or none.
    """
    bits, count, arm = _NONE, lattice.size[i, 1], arms.arm[i]
    c1, s1 = trig[a, 0, 0], trig[a, 0, 1]
    ex, ey = arm.x + arm.length * c1, arm.y + arm.length * s1
    for p in range(arm.first_piece, arm.last_piece):
        mine = arms.piece[p]
        for q in range(arms.arm[j].first_piece, arms.arm[j].last_piece):
            if not meet(arms, p, q):
                continue
            theirs = arms.piece[q]
            x, y = point(frame_j, theirs.link, theirs.u, theirs.v)
            near = mine.extent + mine.radius + theirs.extent + theirs.radius + limit + _ROOM
            if not near > 0.0:
                return ~_NONE
            if mine.link != 2:
                c, s = (c1, s1) if mine.link == 1 else (1.0, 0.0)
                if _apart(arm.x + c * mine.u - s * mine.v, arm.y + s * mine.u + c * mine.v, x, y, near):
                    continue
                return ~_NONE
            # the circles are nearer than that where link 2 points to (c, s) with c along + s across >= least
            u, v, x, y = mine.u, mine.v, x - ex, y - ey
            along, across = u * x + v * y, u * y - v * x
            least = 0.5 * (u * u + v * v + x * x + y * y - near * near)
            if least > 0.0 and least * least > along * along + across * across:
                continue
            for b in range(count):
                if trig[a, b + 1, 0] * along + trig[a, b + 1, 1] * across >= least:
                    bits |= bit(b)
    return bits


@leaf
def blocked_betas(arms, lattice, i, a, trig, motion, j, frame_j, limit, known):
    """The beta nodes of positioner i at its alpha node `a` that do not clear arm j by `limit` [mm].

    `known` ones are taken to be among them.
    """
    bits = known
    x, y = arms.arm[i].x + arms.arm[i].length * trig[a, 0, 0], arms.arm[i].y + arms.arm[i].length * trig[a, 0, 1]
    if cannot_meet(arms, lattice, i, x, y, j, frame_j, limit):
        return bits
    doubtful = _betas_to_check(arms, lattice, i, a, trig, j, frame_j, limit) & ~known
    b = 0
    while b < lattice.size[i, 1]:
        if not holds(doubtful, b):
            b += 1
            continue
        at = node_frame(arms, i, trig, a, b)
        gap = clearance_within(arms, i, at, j, frame_j, limit, limit + _LEAP * motion)
        if gap >= limit:
            b += 1 + int((gap - limit) / motion)
        else:
            count = 1 + (int((limit - gap) / motion) if gap < limit else 0)  # as deep in contact as that vouches for
            count = min(count, lattice.size[i, 1] - b)
            bits |= (~_NONE if count >= 64 else bit(count) - _ONE) << np.uint64(b)
            b += count
    return bits


@inlined
def _rests_until(lattice, j, k, steps):
    """The last step up to which arm j stays where it is after step k."""
    while (
        k < steps
        and lattice.path[j, k + 1, 0] == lattice.path[j, k, 0]
        and lattice.path[j, k + 1, 1] == lattice.path[j, k, 1]
    ):
        k += 1
    return k


@inlined
def _unreached(lattice, i, first, last, steps):
    """The beta nodes that positioner i cannot be at after any of the steps `first` to `last`, on a path of `steps`."""
    low, high = window_of(lattice, i, 1, first, steps)
    for k in range(first + 1, last + 1):
        a, b = window_of(lattice, i, 1, k, steps)
        low, high = min(low, a), max(high, b)
    if high < low:
        return ~_NONE
    reached = (~_NONE if high - low >= 63 else bit(high - low + 1) - _ONE) << np.uint64(low)
    return ~reached


@leaf
def _mark_late(arms, lattice, i, trig, motion, j, apart, steps, row, blocked):
    """Add the nodes of positioner i that arm j blocks where it is a few steps before or after, if that counts."""
    first = 0
    while first <= steps and lattice.delay > 0:
        last = _rests_until(lattice, j, first, steps)
        begin, end = max(1, first - lattice.delay), min(steps, last + lattice.delay)
        low, high = lattice.size[i, 0], -1
        for k in range(begin, end + 1):
            a, b = window(lattice, i, k, steps)
            low, high = min(low, a), max(high, b)
        frame_j = frame(arms, j, lattice.path[j, first, 0], lattice.path[j, first, 1])
        for a in range(low, high + 1):
            row[a] = blocked_betas(arms, lattice, i, a, trig, motion, j, frame_j, apart, _NONE)
        for k in range(begin, end + 1):
            a, b = window(lattice, i, k, steps)
            for m in range(a, b + 1):
                blocked[k, m] |= row[m]
        first = last + 1


@leaf
def mark_blocked(arms, lattice, i, trig, motion, j, pair, limit, steps, row, blocked):
    """Add to `blocked` (steps + 1, A) the nodes of positioner i that arm j on its path blocks after each step.

    `row` (A,) is scratch: while j waits, what it blocks is found once.
    """
    _mark_late(arms, lattice, i, trig, motion, j, late_limit(lattice, pair), steps, row, blocked)
    known_low, known_high, rests = 0, -1, 0
    for k in range(1, steps + 1):
        if k > rests:
            rests = _rests_until(lattice, j, k, steps)
            frame_j = frame(arms, j, lattice.path[j, k, 0], lattice.path[j, k, 1])
            elsewhere = _unreached(lattice, i, k, rests, steps)
            known_low, known_high = 0, -1
        low, high = window(lattice, i, k, steps)
        for a in range(low, high + 1):
            if known_low <= a <= known_high:
                continue
            row[a] = blocked_betas(arms, lattice, i, a, trig, motion, j, frame_j, limit, elsewhere) & ~elsewhere
        for a in range(low, high + 1):
            blocked[k, a] |= row[a]
        if known_high < known_low:
            known_low, known_high = low, high
        elif low <= known_high + 1 and high >= known_low - 1:
            known_low, known_high = min(low, known_low), max(high, known_high)
        else:
            known_low, known_high = low, high
