"""The joint nodes of two positioners: machine words, one bit for every beta of the second.

So a step of all of them at once is a few shifts and masks. Words are kept only of the alpha nodes that both can be at
after a step: `Block` says where they lie in a flat array. So memory follows what is searched, and `joint_words` tells
beforehand how much that is.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.compile import inlined, leaf
from fiberplan.planners.direct.blocked_nodes import bit, blocked_betas, holds, node_frame
from fiberplan.planners.direct.lattice import between, window

_NONE = np.uint64(0)
_ONE = np.uint64(1)
UNSEEN = np.uint64(1 << 63)  #: nobody has so many betas


class Block(NamedTuple):
    """Where the words of joint nodes lie: alphas and betas of one positioner, then alphas of the other."""

    begin: int  #: of the block in its array
    low: int  #: first alpha node of the one
    low_other: int  #: and of the other
    betas: int  #: of the one
    width: int  #: how many alphas of the other


class Apart(NamedTuple):
    """Where two positioners keep a clearance from each other, as far as that has been looked up."""

    words: np.ndarray  #: (A B A,) uint64; marked `UNSEEN`: no other betas are clear, but these need not be
    block: Block  #: of the words
    limit: float  #: the clearance [mm]
    motion: float  #: of the other from one beta node to the next, at most [mm]
    trig: np.ndarray  #: (A, B + 1, 2) link directions of the one at its nodes
    trig_other: np.ndarray  #: and of the other


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


@inlined
def look(arms, lattice, i, a, b, j, c, apart):
    """The betas of positioner j at its alpha node c at which it keeps the clearance `apart` from i at node (a, b).

    `apart` holds what is known already, in its words. Starts clear each other, and so do goals, whatever the clearance:
    the problem has checked that.
    """
    at = row_of(apart.block, a, b) + c
    known = ~(apart.words[at] & ~UNSEEN)
    frame_i = node_frame(arms, i, apart.trig, a, b)
    blocked = blocked_betas(arms, lattice, j, c, apart.trig_other, apart.motion, i, frame_i, apart.limit, known)
    clear = ~blocked & ~UNSEEN
    if a == lattice.first[i, 0] and b == lattice.first[i, 1] and c == lattice.first[j, 0]:
        clear |= bit(lattice.first[j, 1])
    if a == lattice.last[i, 0] and b == lattice.last[i, 1] and c == lattice.last[j, 0]:
        clear |= bit(lattice.last[j, 1])
    apart.words[at] = clear


@leaf
def forget_clear(lattice, i, j, steps, words, again):
    """Nothing is known in `words` of where i and j clear each other, of all nodes that they can have in so many steps.

    `again`: `words` are of a smaller clearance, and what was not clear then is not clear now.
    """
    low_a, high_a = between(lattice, i, 0, steps)
    low_b, high_b = between(lattice, i, 1, steps)
    low_d, high_d = between(lattice, j, 1, steps)
    block = block_of_all(lattice, i, j, steps)
    every = (bit(high_d - low_d + 1) - _ONE) << np.uint64(low_d)
    for a in range(low_a, high_a + 1):
        for b in range(lattice.size[i, 1]):
            row = row_of(block, a, b) + block.low_other
            for at in range(row, row + block.width):
                words[at] = (words[at] if again else every) | UNSEEN if low_b <= b <= high_b else _NONE


@inlined
def _add_shifted(source, shift, target):
    """Add the words of `source` to those of `target` that lie `shift` words before them: rows, word by word."""
    words, added = target[max(0, -shift) :], source[max(0, shift) :]
    for c in range(min(len(words), len(added))):
        words[c] |= added[c]


@leaf
def advance(arms, lattice, i, j, k, steps, reach, here, there, turned, apart, blocked_i, blocked_j):
    """Fill block `there` of `reach` with where both can be after step k + 1; returns whether anywhere.

    Block `here` says where they can be after step k; `blocked_i` and `blocked_j` (A,) are the nodes of either that are
    blocked after step k + 1. Whole rows are joined at a time, which the compiler does several words at once. Whether
    the two keep `apart` is looked up where they can get.
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
            at = row_of(apart.block, a, b) + next_low_j
            free, unseen = apart.words[at : at + turned_width], _NONE
            for c in range(len(now)):
                now[c] &= ~shut[c]
                unseen |= free[c] if now[c] != _NONE else _NONE
            if unseen & UNSEEN != _NONE:
                for c in range(len(now)):
                    if now[c] != _NONE and free[c] & UNSEEN != _NONE:
                        look(arms, lattice, i, a, b, j, next_low_j + c, apart)
            for c in range(len(now)):
                now[c] &= free[c] & ~UNSEEN
                anywhere |= now[c]
    return anywhere != _NONE


@leaf
def start_in(lattice, i, j, reach, block, end):
    """Both at their starts and nowhere else, in the words of `block`, which ends at `end`."""
    for word in range(block.begin, end):
        reach[word] = _NONE
    reach[row_of(block, lattice.first[i, 0], lattice.first[i, 1]) + lattice.first[j, 0]] = bit(lattice.first[j, 1])
