"""Two positioners that block each other, moved jointly: every pair of paths that their lattices have.

The set of joint nodes that can be reached after each step is kept as machine words, one bit for every beta of the
second positioner, so that a step of all of them at once is a few shifts and masks. What is not reached within the
steps cannot be done in that time *on these lattices*; that is an estimate for the positioners, not a proof.

Words are kept only of the alpha nodes that both can be at after a step: `Block` says where they lie in a flat array.
So memory follows what is searched, and `joint_words` tells beforehand how much that is.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.arms import frame
from fiberplan.kernels.compile import inlined, leaf
from fiberplan.kernels.randoms import uniform
from fiberplan.planners.direct.blocked_nodes import (
    beta_motion,
    bit,
    blocked_betas,
    holds,
    link_directions,
    mark_blocked,
    node_frame,
)
from fiberplan.planners.direct.lattice import beta_at, between, put, window

UNKNOWN = -2  #: steps that a pair needs where finding out would take too long
_MOST_LOOKS = 2**29  # words times steps that finding out may take: a few seconds
_NONE = np.uint64(0)
_ONE = np.uint64(1)
_UNBOUNDED = 1 << 20  # steps, where there is no deadline


class Block(NamedTuple):
    """Where the words of joint nodes lie: alphas and betas of one positioner, then alphas of the other."""

    begin: int  #: of the block in its array
    low: int  #: first alpha node of the one
    low_other: int  #: and of the other
    betas: int  #: of the one
    width: int  #: how many alphas of the other


@inlined
def _row(block, a, b):
    """Where the words of node (a, b) would begin, if they began with alpha node 0 of the other."""
    return block.begin + ((a - block.low) * block.betas + b) * block.width - block.low_other


@inlined
def _block_after(lattice, i, j, k, steps, begin):
    """The block of the nodes that both can be at after step k, and where it ends."""
    low_i, high_i = window(lattice, i, k, steps)
    low_j, high_j = window(lattice, j, k, steps)
    width = max(high_j - low_j + 1, 0)
    betas = lattice.size[i, 1]
    return Block(begin, low_i, low_j, betas, width), begin + max(high_i - low_i + 1, 0) * betas * width


@inlined
def _block_of_all(lattice, i, j, steps):
    """The block of all nodes that both can pass in so many steps."""
    low_i, _ = between(lattice, i, 0, steps)
    low_j, high_j = between(lattice, j, 0, steps)
    return Block(0, low_i, low_j, lattice.size[i, 1], high_j - low_j + 1)


@leaf
def joint_words(lattice, i, j, steps, begins):
    """Words that `move_jointly` keeps of what is reached; fills `begins` (steps + 2,), where those of a step begin."""
    begins[0] = 0
    for k in range(steps + 1):
        _, begins[k + 1] = _block_after(lattice, i, j, k, steps, begins[k])
    return begins[steps + 1]


@leaf
def _mark_clear(arms, lattice, i, j, limit, trig_i, trig_j, steps, clear, again):
    """Fill `clear`: for every node (a, b) of i and alpha node c of j, the betas of j at which both keep `limit` [mm].

    Betas that i cannot have in so many steps are clear of nothing. `again`: it has been filled with a smaller limit,
    and what was not clear then is not clear now.
    """
    motion = beta_motion(arms, lattice, j)
    count = lattice.size[j, 1]
    every = ~_NONE if count == 64 else bit(count) - _ONE
    low_a, high_a = between(lattice, i, 0, steps)
    low_b, high_b = between(lattice, i, 1, steps)
    low_c, high_c = between(lattice, j, 0, steps)
    block = _block_of_all(lattice, i, j, steps)
    for a in range(low_a, high_a + 1):
        for b in range(lattice.size[i, 1]):
            row = _row(block, a, b)
            if b < low_b or b > high_b:
                for c in range(low_c, high_c + 1):
                    clear[row + c] = _NONE
                continue
            frame_i = node_frame(arms, i, trig_i, a, b)
            for c in range(low_c, high_c + 1):
                known = every & ~clear[row + c] if again else _NONE
                clear[row + c] = every & ~blocked_betas(arms, lattice, j, c, trig_j, motion, i, frame_i, limit, known)
    # the problem has checked that both starts and both goals are clear, which a larger limit must not deny
    row = _row(block, lattice.first[i, 0], lattice.first[i, 1])
    clear[row + lattice.first[j, 0]] |= bit(lattice.first[j, 1])
    if lattice.last[i, 0] >= 0 and lattice.last[j, 0] >= 0:
        row = _row(block, lattice.last[i, 0], lattice.last[i, 1])
        clear[row + lattice.last[j, 0]] |= bit(lattice.last[j, 1])


@inlined
def _add_shifted(source, shift, target):
    """Add the words of `source` to those of `target` that lie `shift` words before them: rows, word by word."""
    words, added = target[max(0, -shift) :], source[max(0, shift) :]
    for c in range(min(len(words), len(added))):
        words[c] |= added[c]


@leaf
def _advance(lattice, i, j, k, steps, reach, here, there, turned, clear, clear_block, blocked_i, blocked_j):
    """Fill block `there` of `reach` with where both can be after step k + 1; returns whether anywhere.

    Block `here` says where they can be after step k; `blocked_i` and `blocked_j` (A,) are the nodes of either that are
    blocked after step k + 1. Whole rows are joined at a time, which the compiler does several words at once.
    """
    low_i, high_i = window(lattice, i, k, steps)
    low_j, high_j = window(lattice, j, k, steps)
    next_low_i, next_high_i = window(lattice, i, k + 1, steps)
    next_low_j, next_high_j = window(lattice, j, k + 1, steps)
    betas = lattice.size[i, 1]
    pace_a, pace_b = lattice.pace[i, 0], lattice.pace[i, 1]
    pace_c, pace_d = lattice.pace[j, 0], lattice.pace[j, 1]
    width, turned_width = max(high_j - low_j + 1, 0), max(next_high_j - next_low_j + 1, 0)
    turned_block = Block(0, low_i, next_low_j, betas, turned_width)
    for a in range(low_i, high_i + 1):
        for b in range(betas):
            at, to = _row(here, a, b) + low_j, _row(turned_block, a, b) + next_low_j
            before, now = reach[at : at + width], turned[0, to : to + turned_width]
            now[:] = _NONE
            for shift in range(next_low_j - low_j - pace_c, next_low_j - low_j + pace_c + 1):
                _add_shifted(before, shift, now)
            for _ in range(pace_d):
                for c in range(len(now)):
                    now[c] |= (now[c] << _ONE) | (now[c] >> _ONE)
        for b in range(betas):
            to = _row(turned_block, a, b) + next_low_j
            now = turned[1, to : to + turned_width]
            now[:] = _NONE
            for y in range(max(b - pace_b, 0), min(b + pace_b, betas - 1) + 1):
                at = _row(turned_block, a, y) + next_low_j
                _add_shifted(turned[0, at : at + turned_width], 0, now)
    anywhere = _NONE
    shut = blocked_j[next_low_j : next_low_j + turned_width]
    for a in range(next_low_i, next_high_i + 1):
        for b in range(betas):
            to = _row(there, a, b) + next_low_j
            now = reach[to : to + turned_width]
            now[:] = _NONE
            if holds(blocked_i[a], b):
                continue
            for x in range(max(a - pace_a, low_i), min(a + pace_a, high_i) + 1):
                at = _row(turned_block, x, b) + next_low_j
                _add_shifted(turned[1, at : at + turned_width], 0, now)
            at = _row(clear_block, a, b) + next_low_j
            free = clear[at : at + turned_width]
            for c in range(len(now)):
                now[c] &= free[c] & ~shut[c]
                anywhere |= now[c]
    return anywhere != _NONE


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
            row = _row(block, a, b)
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
        block, _ = _block_after(lattice, i, j, k, steps, begins[k])
        best = -np.inf
        to_a, to_b, to_c, to_d = a, b, c, d
        for x in range(max(a - pace_a, low_i), min(a + pace_a, high_i) + 1):
            for z in range(max(c - pace_c, low_j), min(c + pace_c, high_j) + 1):
                for y in range(max(b - pace_b, 0), min(b + pace_b + 1, lattice.size[i, 1])):
                    for w in range(max(d - pace_d, 0), min(d + pace_d + 1, lattice.size[j, 1])):
                        if holds(reach[_row(block, x, y) + z], w):
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
def _mark_blocked_by_others(arms, near, lattice, i, partner, trig, limits, respect, steps, row, blocked, state):
    """Fill `blocked` with what the neighbours of i other than `partner` block, unless they are taken to make room.

    The more slack a neighbour has, the likelier it is taken to; with `respect` 1.5 none is, with 0 all are that can
    move.
    """
    motion = beta_motion(arms, lattice, i)
    for k in range(steps + 1):
        for a in range(lattice.size[i, 0]):
            blocked[k, a] = _NONE
    for q in range(near.offsets[i], near.offsets[i + 1]):
        m = near.near[q].arm
        if m == partner:
            continue
        if lattice.fixed[m] or uniform(state) * (0.5 + _slack(lattice, m, steps)) < respect:
            pair = near.near[q].pair
            mark_blocked(arms, lattice, i, trig, motion, m, pair, limits[pair], steps, row, blocked)


@leaf
def find_clear_nodes(arms, lattice, i, j, apart, scratch, steps, clear, again):
    """Fill `clear` (A B A,) with where positioners i and j clear each other by `apart` [mm], for `move_jointly`.

    `again`: it says where they clear each other by less.
    """
    link_directions(arms, lattice, i, scratch.trig)
    link_directions(arms, lattice, j, scratch.trig_other)
    _mark_clear(arms, lattice, i, j, apart, scratch.trig, scratch.trig_other, steps, clear, again)


@leaf
def move_jointly(arms, near, lattice, i, j, clear, clear_steps, limits, respect, variety, scratch, steps, state):
    """Put positioners i and j on paths clear of each other and of their neighbours, if there are any.

    `joint_words`, which has to fit into `scratch.reach`, comes first.

    Args:
        arms: the array.
        near: its neighbour lists.
        lattice: everybody's paths.
        i: one positioner.
        j: the other.
        clear: where they clear each other: `find_clear_nodes`,
        clear_steps: in so many steps, or fewer.
        limits: (pairs,) clearance to keep from others [mm].
        respect: how much the paths of neighbours count, from 1.5, all of them, to 0, only of those that cannot move.
        variety: from 0, the path that is folded most, to 1, anything like it.
        scratch: arrays to work in.
        steps: of all paths.
        state: (1,) of the random generator.

    Returns:
        whether there was a path.
    """
    link_directions(arms, lattice, i, scratch.trig)
    link_directions(arms, lattice, j, scratch.trig_other)
    trig_i, trig_j, reach, begins = scratch.trig, scratch.trig_other, scratch.reach, scratch.begins
    row, blocked, blocked_other = scratch.row, scratch.blocked, scratch.blocked_other
    _mark_blocked_by_others(arms, near, lattice, i, j, trig_i, limits, respect, steps, row, blocked, state)
    _mark_blocked_by_others(arms, near, lattice, j, i, trig_j, limits, respect, steps, row, blocked_other, state)
    clear_block = _block_of_all(lattice, i, j, clear_steps)
    here, end = _block_after(lattice, i, j, 0, steps, 0)
    _start_in(lattice, i, j, reach, here, end)
    for k in range(steps):
        there, _ = _block_after(lattice, i, j, k + 1, steps, begins[k + 1])
        if not _advance(
            lattice, i, j, k, steps, reach, here, there, scratch.turned, clear, clear_block, blocked[k + 1],
            blocked_other[k + 1],
        ):  # fmt: skip
            return False
        here = there
    if not _joint_end(lattice, i, j, reach, here, steps, scratch.end):
        return False
    _trace_back(arms, lattice, i, j, steps, reach, begins, scratch.end, variety, state)
    return True


@leaf
def _start_in(lattice, i, j, reach, block, end):
    """Both at their starts and nowhere else, in the words of `block`, which ends at `end`."""
    for word in range(block.begin, end):
        reach[word] = _NONE
    reach[_row(block, lattice.first[i, 0], lattice.first[i, 1]) + lattice.first[j, 0]] = bit(lattice.first[j, 1])


@leaf
def is_stationary(lattice, j):
    """True if arm j is fixed and its path never leaves its start."""
    if not lattice.fixed[j]:
        return False
    for k in range(1, lattice.path.shape[1]):
        if lattice.path[j, k, 0] != lattice.path[j, 0, 0] or lattice.path[j, k, 1] != lattice.path[j, 0, 1]:
            return False
    return True


@leaf
def _mark_blocked_by_stationary(arms, near, lattice, i, trig, limit, row):
    """Fill `row` (A,) with the nodes of positioner i that arms which never move block; its start and goal are not."""
    motion = beta_motion(arms, lattice, i)
    for a in range(lattice.size[i, 0]):
        row[a] = _NONE
    for q in range(near.offsets[i], near.offsets[i + 1]):
        j = near.near[q].arm
        if is_stationary(lattice, j):
            frame_j = frame(arms, j, lattice.path[j, 0, 0], lattice.path[j, 0, 1])
            for a in range(lattice.size[i, 0]):
                row[a] |= blocked_betas(arms, lattice, i, a, trig, motion, j, frame_j, limit)
    row[lattice.first[i, 0]] &= ~bit(lattice.first[i, 1])
    if lattice.last[i, 0] >= 0:
        row[lattice.last[i, 0]] &= ~bit(lattice.last[i, 1])


@leaf
def steps_alone(arms, near, lattice, i, j, apart, limit, scratch, most):
    """Steps that positioners i and j need past each other and what never moves; -1 if they never get there.

    `apart` is the clearance to keep from each other, `limit` from the rest [mm]. At most `most` steps are tried;
    `most + 1` says that it takes more, `UNKNOWN` that there are too many joint nodes to find out. Never means on these
    lattices.
    """
    trig_i, trig_j, reach, clear = scratch.trig, scratch.trig_other, scratch.reach, scratch.clear[0]
    scratch.clear_for[0].pair = -1
    size = lattice.size[i, 0] * lattice.size[i, 1] * lattice.size[j, 0]
    if 2 * size > len(reach) or size * most > _MOST_LOOKS:
        return UNKNOWN
    link_directions(arms, lattice, i, trig_i)
    link_directions(arms, lattice, j, trig_j)
    _mark_clear(arms, lattice, i, j, apart, trig_i, trig_j, _UNBOUNDED, clear, False)
    blocked_i, blocked_j = scratch.blocked[0], scratch.blocked_other[0]
    _mark_blocked_by_stationary(arms, near, lattice, i, trig_i, limit, blocked_i)
    _mark_blocked_by_stationary(arms, near, lattice, j, trig_j, limit, blocked_j)
    for word in range(2 * size):
        reach[word] = _NONE
    clear_block = _block_of_all(lattice, i, j, _UNBOUNDED)
    here, there = clear_block, Block(size, 0, 0, lattice.size[i, 1], lattice.size[j, 0])
    _start_in(lattice, i, j, reach, here, size)
    for k in range(most):
        _advance(
            lattice, i, j, k, _UNBOUNDED, reach, here, there, scratch.turned, clear, clear_block, blocked_i, blocked_j
        )
        low_i, high_i = window(lattice, i, k + 1, _UNBOUNDED)
        low_j, high_j = window(lattice, j, k + 1, _UNBOUNDED)
        grown = False
        for a in range(low_i, high_i + 1):
            for b in range(lattice.size[i, 1]):
                row, before = _row(there, a, b), _row(here, a, b)
                for c in range(low_j, high_j + 1):
                    if _ends_at(lattice, i, j, reach[row + c], a, b, c) != _NONE:
                        return k + 1
                    grown = grown or reach[row + c] != reach[before + c]
        if not grown:
            return -1
        here, there = there, here
    return most + 1


@leaf
def steps_past_fixed(arms, near, lattice, i, limit, scratch, most):
    """Steps that positioner i needs past those that never move, if nobody else were there; -1 if it never gets there.

    At most `most` are tried; `most + 1` says that it takes more.
    """
    trig, reached, row = scratch.trig, scratch.blocked, scratch.row
    link_directions(arms, lattice, i, trig)
    alphas, betas = lattice.size[i, 0], lattice.size[i, 1]
    every = ~_NONE if betas == 64 else bit(betas) - _ONE
    _mark_blocked_by_stationary(arms, near, lattice, i, trig, limit, row)
    for a in range(alphas):
        row[a] = every & ~row[a]
        reached[0, a] = _NONE
    goal_a, goal_b = lattice.last[i, 0], lattice.last[i, 1]
    reached[0, lattice.first[i, 0]] = bit(lattice.first[i, 1])
    pace_a, pace_b = lattice.pace[i, 0], lattice.pace[i, 1]
    pace = max(pace_a, pace_b)
    here = 0
    for k in range(most + 1):
        grown = False
        for part in range(pace):  # node by node, so that none that is blocked is passed over
            if holds(reached[here, goal_a], goal_b):
                return k + (part > 0)
            there, aside = 1 - here, part < pace_a
            for a in range(alphas):
                bits = _NONE
                for x in range(max(a - aside, 0), min(a + aside, alphas - 1) + 1):
                    bits |= reached[here, x]
                if part < pace_b:
                    bits |= (bits << _ONE) | (bits >> _ONE)
                bits = (bits & row[a]) | reached[here, a]
                grown = grown or bits != reached[here, a]
                reached[there, a] = bits
            here = there
        if not grown:
            return -1
    return most + 1
