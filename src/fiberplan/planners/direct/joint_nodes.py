"""The joint nodes of two positioners: machine words, one bit for every beta of the second.

So a step of all of them at once is a few shifts and masks. Words are kept only of the alpha nodes that both can be at
after a step: `Block` says where they lie in a flat array. So memory follows what is searched, and `joint_words` tells
beforehand how much that is.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.compile import inlined, leaf
from fiberplan.planners.direct.blocked_nodes import beta_motion, bit, blocked_betas, holds, node_frame
from fiberplan.planners.direct.lattice import between, window

_NONE = np.uint64(0)
_ONE = np.uint64(1)


class Block(NamedTuple):
    """Where the words of joint nodes lie: alphas and betas of one positioner, then alphas of the other."""

    begin: int  #: of the block in its array
    low: int  #: first alpha node of the one
    low_other: int  #: and of the other
    betas: int  #: of the one
    width: int  #: how many alphas of the other


@inlined
def row_of(block, a, b):
    """Where the words of node (a, b) would begin, if they began with alpha node 0 of the other."""
    return block.begin + ((a - block.low) * block.betas + b) * block.width - block.low_other


@inlined
def block_after(lattice, i, j, k, steps, begin):
    """The block of the nodes that both can be at after step k, and where it ends."""
    low_i, high_i = window(lattice, i, k, steps)
    low_j, high_j = window(lattice, j, k, steps)
    width = max(high_j - low_j + 1, 0)
    betas = lattice.size[i, 1]
    return Block(begin, low_i, low_j, betas, width), begin + max(high_i - low_i + 1, 0) * betas * width


@inlined
def block_of_all(lattice, i, j, steps):
    """The block of all nodes that both can pass in so many steps."""
    low_i, _ = between(lattice, i, 0, steps)
    low_j, high_j = between(lattice, j, 0, steps)
    return Block(0, low_i, low_j, lattice.size[i, 1], high_j - low_j + 1)


@leaf
def joint_words(lattice, i, j, steps, begins):
    """Words that `move_jointly` keeps of what is reached; fills `begins` (steps + 2,), where those of a step begin."""
    begins[0] = 0
    for k in range(steps + 1):
        _, begins[k + 1] = block_after(lattice, i, j, k, steps, begins[k])
    return begins[steps + 1]


@leaf
def mark_clear(arms, lattice, i, j, limit, trig_i, trig_j, steps, clear, again):
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
    block = block_of_all(lattice, i, j, steps)
    for a in range(low_a, high_a + 1):
        for b in range(lattice.size[i, 1]):
            row = row_of(block, a, b)
            if b < low_b or b > high_b:
                for c in range(low_c, high_c + 1):
                    clear[row + c] = _NONE
                continue
            frame_i = node_frame(arms, i, trig_i, a, b)
            for c in range(low_c, high_c + 1):
                known = every & ~clear[row + c] if again else _NONE
                clear[row + c] = every & ~blocked_betas(arms, lattice, j, c, trig_j, motion, i, frame_i, limit, known)
    # the problem has checked that both starts and both goals are clear, which a larger limit must not deny
    row = row_of(block, lattice.first[i, 0], lattice.first[i, 1])
    clear[row + lattice.first[j, 0]] |= bit(lattice.first[j, 1])
    if lattice.last[i, 0] >= 0 and lattice.last[j, 0] >= 0:
        row = row_of(block, lattice.last[i, 0], lattice.last[i, 1])
        clear[row + lattice.last[j, 0]] |= bit(lattice.last[j, 1])


@inlined
def _add_shifted(source, shift, target):
    """Add the words of `source` to those of `target` that lie `shift` words before them: rows, word by word."""
    words, added = target[max(0, -shift) :], source[max(0, shift) :]
    for c in range(min(len(words), len(added))):
        words[c] |= added[c]


@leaf
def advance(lattice, i, j, k, steps, reach, here, there, turned, clear, clear_block, blocked_i, blocked_j):
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
            at, to = row_of(here, a, b) + low_j, row_of(turned_block, a, b) + next_low_j
            before, now = reach[at : at + width], turned[0, to : to + turned_width]
            now[:] = _NONE
            for shift in range(next_low_j - low_j - pace_c, next_low_j - low_j + pace_c + 1):
                _add_shifted(before, shift, now)
            for _ in range(pace_d):
                for c in range(len(now)):
                    now[c] |= (now[c] << _ONE) | (now[c] >> _ONE)
        for b in range(betas):
            to = row_of(turned_block, a, b) + next_low_j
            now = turned[1, to : to + turned_width]
            now[:] = _NONE
            for y in range(max(b - pace_b, 0), min(b + pace_b, betas - 1) + 1):
                at = row_of(turned_block, a, y) + next_low_j
                _add_shifted(turned[0, at : at + turned_width], 0, now)
    anywhere = _NONE
    shut = blocked_j[next_low_j : next_low_j + turned_width]
    for a in range(next_low_i, next_high_i + 1):
        for b in range(betas):
            to = row_of(there, a, b) + next_low_j
            now = reach[to : to + turned_width]
            now[:] = _NONE
            if holds(blocked_i[a], b):
                continue
            for x in range(max(a - pace_a, low_i), min(a + pace_a, high_i) + 1):
                at = row_of(turned_block, x, b) + next_low_j
                _add_shifted(turned[1, at : at + turned_width], 0, now)
            at = row_of(clear_block, a, b) + next_low_j
            free = clear[at : at + turned_width]
            for c in range(len(now)):
                now[c] &= free[c] & ~shut[c]
                anywhere |= now[c]
    return anywhere != _NONE


@leaf
def start_in(lattice, i, j, reach, block, end):
    """Both at their starts and nowhere else, in the words of `block`, which ends at `end`."""
    for word in range(block.begin, end):
        reach[word] = _NONE
    reach[row_of(block, lattice.first[i, 0], lattice.first[i, 1]) + lattice.first[j, 0]] = bit(lattice.first[j, 1])
