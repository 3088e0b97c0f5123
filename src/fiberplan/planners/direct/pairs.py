"""Two positioners that block each other, moved jointly: every pair of paths that their lattices have.

The set of joint nodes that can be reached after each step (`fiberplan.planners.direct.joint_nodes`) is kept for a whole
move. What is not reached within the steps cannot be done in that time *on these lattices*; that is an estimate for the
positioners, not a proof.
"""

import numpy as np

from fiberplan.kernels.compile import inlined, leaf
from fiberplan.kernels.randoms import uniform
from fiberplan.planners.direct.blocked_nodes import beta_motion, bit, holds, link_directions
from fiberplan.planners.direct.joint_nodes import (
    Apart,
    Block,
    advance,
    block_after,
    block_of_all,
    forget_clear,
    row_of,
    start_in,
)
from fiberplan.planners.direct.lattice import beta_at, in_time, put, window
from fiberplan.planners.direct.past_fixed import mark_blocked_by_stationary
from fiberplan.planners.direct.remembered import blocked_cells

UNKNOWN = -2  #: steps that a pair needs where finding out would take too long
_MOST_LOOKS = 2**29  # words times steps that finding out may take: a few seconds
_NONE = np.uint64(0)
_UNBOUNDED = 1 << 20  # steps, where there is no deadline


@leaf
def _ends_at(lattice, i, j, bits, a, b, c):
    """Of the betas `bits` of positioner j, those in which both end rightly, with i at (a, b) and j at alpha node c."""
    if lattice.last[i, 0] >= 0 and (a != lattice.last[i, 0] or b != lattice.last[i, 1]):
        return _NONE
    if lattice.last[j, 0] < 0:
        return bits
    return bits & bit(lattice.last[j, 1]) if c == lattice.last[j, 0] else _NONE


@leaf
def _joint_end(lattice, i, j, reach, block, steps, end):
    """Fill `end` (4,) with a joint node in which both end rightly; returns whether there is one."""
    low_i, high_i = window(lattice, i, steps, steps)
    low_j, high_j = window(lattice, j, steps, steps)
    for a in range(low_i, high_i + 1):
        for b in range(lattice.size[i, 1]):
            row = row_of(block, a, b)
            for c in range(low_j, high_j + 1):
                bits = _ends_at(lattice, i, j, reach[row + c], a, b, c)
                if bits != _NONE:
                    d = 0
                    while not holds(bits, d):
                        d += 1
                    end[0], end[1], end[2], end[3] = a, b, c, d
                    return True
    return False


@inlined
def _foldedness(arms, lattice, i, a, b):
    return -np.cos(beta_at(lattice, i, a, b) + arms.arm[i].beta_zero)


@leaf
def _trace_back(arms, lattice, i, j, steps, reach, begins, end, variety, state):
    """Put both on a path to `end`: looking back, whatever is more folded, so that they retract early and extend late.

    With some `variety` (0 to 1) they are folded less eagerly, and prefer one sense of turning alpha.
    """
    a, b, c, d = end[0], end[1], end[2], end[3]
    eager_i, eager_j = 1.0 - variety * uniform(state), 1.0 - variety * uniform(state)
    aside_i, aside_j = 0.1 * variety * (uniform(state) - 0.5), 0.1 * variety * (uniform(state) - 0.5)
    pace_a, pace_b = lattice.pace[i, 0], lattice.pace[i, 1]
    pace_c, pace_d = lattice.pace[j, 0], lattice.pace[j, 1]
    put(lattice, i, steps, a, b)
    put(lattice, j, steps, c, d)
    for k in range(steps - 1, -1, -1):
        low_i, high_i = window(lattice, i, k, steps)
        low_j, high_j = window(lattice, j, k, steps)
        block, _ = block_after(lattice, i, j, k, steps, begins[k])
        best = -np.inf
        to_a, to_b, to_c, to_d = a, b, c, d
        for x in range(max(a - pace_a, low_i), min(a + pace_a, high_i) + 1):
            for z in range(max(c - pace_c, low_j), min(c + pace_c, high_j) + 1):
                for y in range(max(b - pace_b, 0), min(b + pace_b + 1, lattice.size[i, 1])):
                    for w in range(max(d - pace_d, 0), min(d + pace_d + 1, lattice.size[j, 1])):
                        if holds(reach[row_of(block, x, y) + z], w):
                            value = eager_i * _foldedness(arms, lattice, i, x, y)
                            value += (
                                eager_j * _foldedness(arms, lattice, j, z, w)
                                + aside_i * (x - a) / pace_a
                                + aside_j * (z - c) / pace_c
                            )
                            value -= 0.02 * (abs(x - a) / pace_a + abs(z - c) / pace_c - uniform(state))
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
    far_a = abs(lattice.last[i, 0] - lattice.first[i, 0]) / lattice.pace[i, 0]
    far_b = abs(lattice.last[i, 1] - lattice.first[i, 1]) / lattice.pace[i, 1]
    return 1.0 - max(far_a, far_b) / steps


@leaf
def _mark_blocked_by_others(arms, near, lattice, i, partner, trig, limits, respect, steps, scratch, blocked, state):
    """Fill `blocked` with what the neighbours of i other than `partner` block, unless they are taken to make room.

    The more slack a neighbour has, the likelier it is taken to; with `respect` 1.5 none is, with 0 all are that can
    move.
    """
    motion, known = beta_motion(arms, lattice, i), scratch.known
    for k in range(steps + 1):
        for a in range(lattice.size[i, 0]):
            blocked[k, a] = _NONE
    for q in range(near.offsets[i], near.offsets[i + 1]):
        m = near.near[q].arm
        if m == partner:
            continue
        if lattice.fixed[m] or uniform(state) * (0.5 + _slack(lattice, m, steps)) < respect:
            pair = near.near[q].pair
            begin, end = blocked_cells(arms, near, lattice, i, q, trig, motion, limits[pair], steps, scratch.row, known)
            for c in range(begin, end):
                blocked[known.cells[c].step, known.cells[c].alpha] |= known.cells[c].betas


@leaf
def kept_apart(arms, lattice, i, j, limit, words, steps, scratch):
    """What `words` know of where positioners i and j clear each other by `limit` [mm], of nodes in so many steps.

    Only for leaves: these do not count references to arrays that they are handed, or handed back.
    """
    link_directions(arms, lattice, i, scratch.trig)
    link_directions(arms, lattice, j, scratch.trig_other)
    block, motion = block_of_all(lattice, i, j, steps), beta_motion(arms, lattice, j)
    return Apart(words, block, limit, motion, scratch.trig, scratch.trig_other)


@leaf
def move_jointly(arms, near, lattice, i, j, words, table, limits, respect, variety, scratch, steps, state):
    """Put positioners i and j on paths clear of each other and of their neighbours, if there are any.

    `joint_words`, which has to fit into `scratch.reach`, comes first.

    Args:
        arms: the array.
        near: its neighbour lists.
        lattice: everybody's paths.
        i: one positioner.
        j: the other.
        words: what is known of where they clear each other; more after this.
        table: a TABLE of it.
        limits: (pairs,) clearance to keep from others [mm].
        respect: how much the paths of neighbours count, from 1.5, all of them, to 0, only of those that cannot move.
        variety: from 0, the path that is folded most, to 1, anything like it.
        scratch: arrays to work in.
        steps: of all paths.
        state: (1,) of the random generator.

    Returns:
        whether there was a path.
    """
    if not (in_time(lattice, i, steps) and in_time(lattice, j, steps)):
        return False
    apart = kept_apart(arms, lattice, i, j, table.apart, words, table.steps, scratch)
    trig_i, trig_j, reach, begins = scratch.trig, scratch.trig_other, scratch.reach, scratch.begins
    blocked, blocked_other = scratch.blocked, scratch.blocked_other
    _mark_blocked_by_others(arms, near, lattice, i, j, trig_i, limits, respect, steps, scratch, blocked, state)
    _mark_blocked_by_others(arms, near, lattice, j, i, trig_j, limits, respect, steps, scratch, blocked_other, state)
    here, end = block_after(lattice, i, j, 0, steps, 0)
    start_in(lattice, i, j, reach, here, end)
    for k in range(steps):
        there, _ = block_after(lattice, i, j, k + 1, steps, begins[k + 1])
        shut, shut_other = blocked[k + 1], blocked_other[k + 1]
        if not advance(arms, lattice, i, j, k, steps, here, there, scratch, apart, shut, shut_other):
            return False
        here = there
    if not _joint_end(lattice, i, j, reach, here, steps, scratch.end):
        return False
    _trace_back(arms, lattice, i, j, steps, reach, begins, scratch.end, variety, state)
    return True


@leaf
def steps_alone(arms, near, lattice, i, j, apart, limit, scratch, most):
    """Steps that positioners i and j need past each other and what never moves; -1 if they never get there.

    `apart` is the clearance to keep from each other, `limit` from the rest [mm]. At most `most` steps are tried;
    `most + 1` says that it takes more, `UNKNOWN` that there are too many joint nodes to find out. Never means on these
    lattices.
    """
    trig_i, trig_j, reach, words = scratch.trig, scratch.trig_other, scratch.reach, scratch.clear[0]
    scratch.clear_for[0].pair = -1
    size = lattice.size[i, 0] * lattice.size[i, 1] * lattice.size[j, 0]
    if 2 * size > len(reach) or size * most > _MOST_LOOKS:
        return UNKNOWN
    forget_clear(lattice, i, j, _UNBOUNDED, words, False)
    known = kept_apart(arms, lattice, i, j, apart, words, _UNBOUNDED, scratch)
    blocked_i, blocked_j = scratch.blocked[0], scratch.blocked_other[0]
    mark_blocked_by_stationary(arms, near, lattice, i, trig_i, limit, blocked_i)
    mark_blocked_by_stationary(arms, near, lattice, j, trig_j, limit, blocked_j)
    for word in range(2 * size):
        reach[word] = _NONE
    here, there = known.block, Block(size, 0, 0, lattice.size[i, 1], lattice.size[j, 0])
    start_in(lattice, i, j, reach, here, size)
    for k in range(most):
        advance(arms, lattice, i, j, k, _UNBOUNDED, here, there, scratch, known, blocked_i, blocked_j)
        low_i, high_i = window(lattice, i, k + 1, _UNBOUNDED)
        low_j, high_j = window(lattice, j, k + 1, _UNBOUNDED)
        grown = False
        for a in range(low_i, high_i + 1):
            for b in range(lattice.size[i, 1]):
                row, before = row_of(there, a, b), row_of(here, a, b)
                for c in range(low_j, high_j + 1):
                    if _ends_at(lattice, i, j, reach[row + c], a, b, c) != _NONE:
                        return k + 1
                    grown = grown or reach[row + c] != reach[before + c]
        if not grown:
            return -1
        here, there = there, here
    return most + 1
