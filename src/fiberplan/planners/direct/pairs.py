"""Two positioners that are in each other's way, moved together: every pair of ways that their lattices have.

The set of joint nodes that can be reached after each step is kept as machine words, one bit for every beta of the
second positioner, so that a step of all of them at once is a few shifts and masks. What is not reached within the
steps cannot be done in that time *on these lattices*; that is an estimate for the positioners, not a proof.
"""

import numpy as np

from fiberplan.kernels.arms import frame
from fiberplan.kernels.compile import inlined, leaf
from fiberplan.kernels.randoms import uniform
from fiberplan.planners.direct.blocked_nodes import (
    beta_motion,
    bit,
    cast_shadow,
    holds,
    link_directions,
    node_frame,
    shut_betas,
)
from fiberplan.planners.direct.lattice import between, put, window

_NONE = np.uint64(0)
_ONE = np.uint64(1)
_UNBOUNDED = 1 << 20  # steps, where there is no deadline


@leaf
def _clear_together(arms, lattice, i, j, limit, trig_i, trig_j, steps, clear):
    """Fill clear[a, b, c]: betas of positioner j at its alpha node c that clear i at its node (a, b).

    Nodes that neither can pass in so many steps are left as they are, but for betas that i cannot have: none are clear.
    """
    motion = beta_motion(arms, lattice, j)
    count = lattice.size[j, 1]
    every = ~_NONE if count == 64 else bit(count) - _ONE
    low_a, high_a = between(lattice, i, 0, steps)
    low_b, high_b = between(lattice, i, 1, steps)
    low_c, high_c = between(lattice, j, 0, steps)
    for a in range(low_a, high_a + 1):
        for b in range(lattice.size[i, 1]):
            if b < low_b or b > high_b:
                for c in range(low_c, high_c + 1):
                    clear[a, b, c] = _NONE
                continue
            frame_i = node_frame(arms, i, trig_i, a, b)
            for c in range(low_c, high_c + 1):
                clear[a, b, c] = every & ~shut_betas(arms, lattice, j, c, trig_j, motion, i, frame_i, limit)
    # both starts and both goals are clear, whatever the limit of the search
    clear[lattice.first[i, 0], lattice.first[i, 1], lattice.first[j, 0]] |= bit(lattice.first[j, 1])
    if lattice.last[i, 0] >= 0 and lattice.last[j, 0] >= 0:
        clear[lattice.last[i, 0], lattice.last[i, 1], lattice.last[j, 0]] |= bit(lattice.last[j, 1])


@leaf
def _advance(lattice, i, j, k, steps, here, there, turned, clear, shut_i, shut_j):
    """Where both can be after step k + 1, `there`, if they can be `here` after step k; returns whether anywhere.

    `shut_i` and `shut_j` (A,) are the nodes of either that are shut after step k + 1.
    """
    low_i, high_i = window(lattice, i, k, steps)
    low_j, high_j = window(lattice, j, k, steps)
    next_low_i, next_high_i = window(lattice, i, k + 1, steps)
    next_low_j, next_high_j = window(lattice, j, k + 1, steps)
    betas = lattice.size[i, 1]
    for a in range(low_i, high_i + 1):
        for b in range(betas):
            for c in range(next_low_j, next_high_j + 1):
                bits = _NONE
                for d in range(max(c - 1, low_j), min(c + 1, high_j) + 1):
                    bits |= here[a, b, d]
                turned[0, a, b, c] = bits | (bits << _ONE) | (bits >> _ONE)
        for b in range(betas):
            before, after = max(b - 1, 0), min(b + 1, betas - 1)
            for c in range(next_low_j, next_high_j + 1):
                turned[1, a, b, c] = turned[0, a, b, c] | turned[0, a, before, c] | turned[0, a, after, c]
    anywhere = _NONE
    for a in range(next_low_i, next_high_i + 1):
        for b in range(betas):
            closed = holds(shut_i[a], b)
            for c in range(next_low_j, next_high_j + 1):
                bits = _NONE
                if not closed:
                    for d in range(max(a - 1, low_i), min(a + 1, high_i) + 1):
                        bits |= turned[1, d, b, c]
                    bits &= clear[a, b, c] & ~shut_j[c]
                there[a, b, c] = bits
                anywhere |= bits
    return anywhere != _NONE


@leaf
def _ends_at(lattice, i, j, reached, a, b, c):
    """Betas of positioner j in which both end rightly, with i at node (a, b) and j at alpha node c."""
    if lattice.last[i, 0] >= 0 and (a != lattice.last[i, 0] or b != lattice.last[i, 1]):
        return _NONE
    if lattice.last[j, 0] < 0:
        return reached[a, b, c]
    return reached[a, b, c] & bit(lattice.last[j, 1]) if c == lattice.last[j, 0] else _NONE


@leaf
def _joint_end(lattice, i, j, reached, steps, end):
    """Fill `end` (4,) with a joint node in which both end rightly; returns whether there is one."""
    low_i, high_i = window(lattice, i, steps, steps)
    low_j, high_j = window(lattice, j, steps, steps)
    for a in range(low_i, high_i + 1):
        for b in range(lattice.size[i, 1]):
            for c in range(low_j, high_j + 1):
                bits = _ends_at(lattice, i, j, reached, a, b, c)
                if bits != _NONE:
                    d = 0
                    while not holds(bits, d):
                        d += 1
                    end[0], end[1], end[2], end[3] = a, b, c, d
                    return True
    return False


@inlined
def _foldedness(arms, lattice, i, b):
    return -np.cos(lattice.beta[i, b] + arms.arm[i].beta_zero)


@leaf
def _trace_back(arms, lattice, i, j, steps, reach, end, variety, state):
    """Put both on a way to `end`: looking back, whatever is more folded, so that they retract early and extend late.

    With some `variety` (0 to 1) they are folded less eagerly, and turn alpha rather one way.
    """
    a, b, c, d = end[0], end[1], end[2], end[3]
    eager_i, eager_j = 1.0 - variety * uniform(state), 1.0 - variety * uniform(state)
    aside_i, aside_j = 0.1 * variety * (uniform(state) - 0.5), 0.1 * variety * (uniform(state) - 0.5)
    put(lattice, i, steps, a, b)
    put(lattice, j, steps, c, d)
    for k in range(steps - 1, -1, -1):
        low_i, high_i = window(lattice, i, k, steps)
        low_j, high_j = window(lattice, j, k, steps)
        best = -np.inf
        to_a, to_b, to_c, to_d = a, b, c, d
        for x in range(max(a - 1, low_i), min(a + 1, high_i) + 1):
            for z in range(max(c - 1, low_j), min(c + 1, high_j) + 1):
                for y in range(max(b - 1, 0), min(b + 2, lattice.size[i, 1])):
                    for w in range(max(d - 1, 0), min(d + 2, lattice.size[j, 1])):
                        if holds(reach[k, x, y, z], w):
                            value = eager_i * _foldedness(arms, lattice, i, y)
                            value += eager_j * _foldedness(arms, lattice, j, w) + aside_i * (x - a) + aside_j * (z - c)
                            value -= 0.02 * (abs(x - a) + abs(z - c) - uniform(state))
                            if value > best:
                                best = value
                                to_a, to_b, to_c, to_d = x, y, z, w
        a, b, c, d = to_a, to_b, to_c, to_d
        put(lattice, i, k, a, b)
        put(lattice, j, k, c, d)


@inlined
def _slack(lattice, i, steps):
    """Part of the steps in which positioner i need not move."""
    if lattice.last[i, 0] < 0:
        return 1.0
    far = max(abs(lattice.last[i, 0] - lattice.first[i, 0]), abs(lattice.last[i, 1] - lattice.first[i, 1]))
    return 1.0 - far / steps


@leaf
def _shut_out(arms, near, lattice, me, other, trig, limits, respect, steps, row, shut, state):
    """Fill `shut` with what the neighbours of `me` other than `other` shut, unless they are taken to make room.

    The more slack a neighbour has, the rather it is; with `respect` 1.5 none is, with 0 all are that can move.
    """
    motion = beta_motion(arms, lattice, me)
    for k in range(steps + 1):
        for a in range(lattice.size[me, 0]):
            shut[k, a] = _NONE
    for q in range(near.offsets[me], near.offsets[me + 1]):
        m = near.near[q].arm
        if m == other:
            continue
        if lattice.fixed[m] or uniform(state) * (0.5 + _slack(lattice, m, steps)) < respect:
            cast_shadow(arms, lattice, me, trig, motion, m, limits[near.near[q].pair], steps, row, shut)


@leaf
def look_at_pair(arms, lattice, i, j, apart, scratch, steps):
    """Find where positioners i and j clear each other by `apart` [mm]: what `move_together` stands on, in `scratch`."""
    link_directions(arms, lattice, i, scratch.trig)
    link_directions(arms, lattice, j, scratch.trig_other)
    _clear_together(arms, lattice, i, j, apart, scratch.trig, scratch.trig_other, steps, scratch.clear)


@leaf
def move_together(arms, near, lattice, i, j, limits, respect, variety, scratch, steps, state):
    """Put positioners i and j on ways clear of each other and of their neighbours, if there are any.

    `look_at_pair` comes first.

    Args:
        arms: the array.
        near: its neighbour lists.
        lattice: everybody's ways.
        i: one positioner.
        j: the other.
        limits: (pairs,) clearance to keep from others [mm].
        respect: how much the ways of neighbours count, from 1.5, all of them, to 0, only of those that cannot move.
        variety: from 0, the way that is folded most, to 1, anything like it.
        scratch: arrays to work in.
        steps: of all ways.
        state: (1,) of the random generator.

    Returns:
        whether there was a way.
    """
    trig_i, trig_j, reach, clear = scratch.trig, scratch.trig_other, scratch.reach, scratch.clear
    _shut_out(arms, near, lattice, i, j, trig_i, limits, respect, steps, scratch.row, scratch.shut, state)
    _shut_out(arms, near, lattice, j, i, trig_j, limits, respect, steps, scratch.row, scratch.shut_other, state)
    _stand_at_start(lattice, i, j, steps, reach[0])
    for k in range(steps):
        if not _advance(
            lattice, i, j, k, steps, reach[k], reach[k + 1], scratch.turned_both, clear,
            scratch.shut[k + 1], scratch.shut_other[k + 1],
        ):  # fmt: skip
            return False
    if not _joint_end(lattice, i, j, reach[steps], steps, scratch.end):
        return False
    _trace_back(arms, lattice, i, j, steps, reach, scratch.end, variety, state)
    return True


@leaf
def _stand_at_start(lattice, i, j, steps, reached):
    low_i, high_i = window(lattice, i, 0, steps)
    low_j, high_j = window(lattice, j, 0, steps)
    for a in range(low_i, high_i + 1):
        for b in range(lattice.size[i, 1]):
            for c in range(low_j, high_j + 1):
                reached[a, b, c] = _NONE
    reached[lattice.first[i, 0], lattice.first[i, 1], lattice.first[j, 0]] = bit(lattice.first[j, 1])


@leaf
def _stands(lattice, j):
    """Whether arm j never moves and will not; one on its way for good does."""
    if not lattice.fixed[j]:
        return False
    for k in range(1, lattice.path.shape[1]):
        if lattice.path[j, k, 0] != lattice.path[j, 0, 0] or lattice.path[j, k, 1] != lattice.path[j, 0, 1]:
            return False
    return True


@leaf
def _shut_for_good(arms, near, lattice, i, trig, limit, row):
    """Fill `row` (A,) with the nodes of positioner i that arms which never move shut; its start and goal are not."""
    motion = beta_motion(arms, lattice, i)
    for a in range(lattice.size[i, 0]):
        row[a] = _NONE
    for q in range(near.offsets[i], near.offsets[i + 1]):
        j = near.near[q].arm
        if _stands(lattice, j):
            frame_j = frame(arms, j, lattice.path[j, 0, 0], lattice.path[j, 0, 1])
            for a in range(lattice.size[i, 0]):
                row[a] |= shut_betas(arms, lattice, i, a, trig, motion, j, frame_j, limit)
    row[lattice.first[i, 0]] &= ~bit(lattice.first[i, 1])
    if lattice.last[i, 0] >= 0:
        row[lattice.last[i, 0]] &= ~bit(lattice.last[i, 1])


@leaf
def steps_alone(arms, near, lattice, i, j, apart, limit, scratch, most):
    """Steps that positioners i and j need past each other and what never moves; -1 if they never get there.

    `apart` is the clearance to keep from each other, `limit` from the rest [mm]. At most `most` steps are tried;
    `most + 1` says that it takes more. Never means on these lattices.
    """
    trig_i, trig_j, reach, clear = scratch.trig, scratch.trig_other, scratch.reach, scratch.clear
    link_directions(arms, lattice, i, trig_i)
    link_directions(arms, lattice, j, trig_j)
    _clear_together(arms, lattice, i, j, apart, trig_i, trig_j, _UNBOUNDED, clear)
    _shut_for_good(arms, near, lattice, i, trig_i, limit, scratch.shut[0])
    _shut_for_good(arms, near, lattice, j, trig_j, limit, scratch.shut_other[0])
    for n in range(2):
        for a in range(lattice.size[i, 0]):
            for b in range(lattice.size[i, 1]):
                for c in range(lattice.size[j, 0]):
                    reach[n, a, b, c] = _NONE
    _stand_at_start(lattice, i, j, _UNBOUNDED, reach[0])
    shut_i, shut_j = scratch.shut[0], scratch.shut_other[0]
    for k in range(most):
        here, there = reach[k % 2], reach[(k + 1) % 2]
        _advance(lattice, i, j, k, _UNBOUNDED, here, there, scratch.turned_both, clear, shut_i, shut_j)
        low_i, high_i = window(lattice, i, k + 1, _UNBOUNDED)
        low_j, high_j = window(lattice, j, k + 1, _UNBOUNDED)
        grown = False
        for a in range(low_i, high_i + 1):
            for b in range(lattice.size[i, 1]):
                for c in range(low_j, high_j + 1):
                    if _ends_at(lattice, i, j, there, a, b, c) != _NONE:
                        return k + 1
                    grown = grown or there[a, b, c] != here[a, b, c]
        if not grown:
            return -1
    return most + 1


@leaf
def steps_past_fixed(arms, near, lattice, i, limit, scratch, most):
    """Steps that positioner i needs past those that never move, if nobody else were there; -1 if it never gets there.

    At most `most` are tried; `most + 1` says that it takes more.
    """
    trig, shut, row = scratch.trig, scratch.shut, scratch.row
    link_directions(arms, lattice, i, trig)
    alphas, betas = lattice.size[i, 0], lattice.size[i, 1]
    every = ~_NONE if betas == 64 else bit(betas) - _ONE
    _shut_for_good(arms, near, lattice, i, trig, limit, row)
    for a in range(alphas):
        row[a] = every & ~row[a]
        shut[0, a] = _NONE
    goal_a, goal_b = lattice.last[i, 0], lattice.last[i, 1]
    shut[0, lattice.first[i, 0]] = bit(lattice.first[i, 1])
    for k in range(most + 1):
        here, there = k % 2, (k + 1) % 2
        if holds(shut[here, goal_a], goal_b):
            return k
        grown = False
        for a in range(alphas):
            bits = shut[here, a]
            for x in range(max(a - 1, 0), min(a + 1, alphas - 1) + 1):
                beside = shut[here, x]
                bits |= beside | (beside << _ONE) | (beside >> _ONE)
            bits = (bits & row[a]) | shut[here, a]
            grown = grown or bits != shut[here, a]
            shut[there, a] = bits
        if not grown:
            return -1
    return most + 1
