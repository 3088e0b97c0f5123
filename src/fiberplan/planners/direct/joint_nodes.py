"""The joint nodes of two positioners: machine words, one bit for every beta of the second.

So a step of all of them at once is a few shifts and masks. Words are kept only of the alpha nodes that both can be at
after a step: `Block` says where they lie in a flat array. So memory follows what is searched, and `joint_words` tells
beforehand how much that is.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.compile import inlined, leaf
from fiberplan.planners.direct.blocked_nodes import bit, blocked_betas, holds, node_frame
from fiberplan.planners.direct.lattice import between, window, window_of

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


@leaf
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
def _spread(words, first, stride, pace, spread):
    """Fill `spread` with words from `first` on, and with those up to `pace` times `stride` before and after each."""
    before, here, after = words[first - stride :], words[first:], words[first + stride :]
    for m in range(len(spread)):
        spread[m] = before[m] | here[m] | after[m]
    for far in range(2, pace + 1):
        before, after = words[first - far * stride :], words[first + far * stride :]
        for m in range(len(spread)):
            spread[m] |= before[m] | after[m]


@inlined
def _join(planes, first, last, joined):
    """Fill `joined` (m,) with what is in any of rows `first` to `last` of `planes`."""
    one, two, three = planes[first], planes[min(first + 1, last)], planes[min(first + 2, last)]
    for m in range(len(joined)):
        joined[m] = one[m] | two[m] | three[m]
    for x in range(first + 3, last + 1):
        more = planes[x]
        for m in range(len(joined)):
            joined[m] |= more[m]


@leaf
def _turn_both(lattice, i, j, k, steps, here, scratch):
    """Fill `scratch.planes` with where both can be after step k + 1 but for the alpha of i; block `here` is before.

    A plane for every alpha of i after step k: a row for every beta that it can have after step k + 1, and in it a word
    for every alpha of j after that step, with as many on either side as j's alpha may turn in a step: those are to be
    left alone.
    """
    low_i, high_i = window(lattice, i, k, steps)
    low_b, high_b = window_of(lattice, i, 1, k, steps)
    low_j, high_j = window(lattice, j, k, steps)
    next_low_b, next_high_b = window_of(lattice, i, 1, k + 1, steps)
    next_low_j, next_high_j = window(lattice, j, k + 1, steps)
    pace_b, pace_c, pace_d = lattice.pace[i, 1], lattice.pace[j, 0], lattice.pace[j, 1]
    row = max(next_high_j - next_low_j + 1, 0) + 2 * pace_c
    top = min(low_b, next_low_b) - pace_b  # the beta of the first row of a plane that is large enough for all
    size = (max(high_b, next_high_b) + pace_b - top + 1) * row
    from_c, to_c = max(low_j, next_low_j - pace_c), min(high_j, next_high_j + pace_c)
    before, turned = scratch.before, scratch.turned
    for a in range(low_i, high_i + 1):
        for m in range(size + 2 * pace_c):
            before[m] = _NONE
        for b in range(low_b, high_b + 1):
            at, to = row_of(here, a, b) + from_c, pace_c + (b - top) * row + pace_c + from_c - next_low_j
            for m in range(to_c - from_c + 1):
                before[to + m] = scratch.reach[at + m]
        _spread(before, pace_c, 1, pace_c, turned[pace_c : pace_c + size])
        for _ in range(pace_d):
            for m in range(pace_c, pace_c + size):
                turned[m] |= (turned[m] << _ONE) | (turned[m] >> _ONE)
        first, count = pace_c + (next_low_b - top) * row, max(next_high_b - next_low_b + 1, 0) * row
        _spread(turned, first, row, pace_b, scratch.planes[a - low_i, :count])


@leaf
def advance(arms, lattice, i, j, k, steps, here, there, scratch, apart, blocked_i, blocked_j):
    """Fill block `there` of `scratch.reach` with where both can be after step k + 1; returns whether anywhere.

    Block `here` says where they can be after step k; `blocked_i` and `blocked_j` (A,) are the nodes of either that are
    blocked after step k + 1. Whole planes are joined at a time, which the compiler does several words at once. Whether
    the two keep `apart` is looked up where they can get.
    """
    low_i, high_i = window(lattice, i, k, steps)
    next_low_i, next_high_i = window(lattice, i, k + 1, steps)
    next_low_b, next_high_b = window_of(lattice, i, 1, k + 1, steps)
    next_low_j, next_high_j = window(lattice, j, k + 1, steps)
    pace_a, pace_c = lattice.pace[i, 0], lattice.pace[j, 0]
    width = max(next_high_j - next_low_j + 1, 0)
    row = width + 2 * pace_c
    _turn_both(lattice, i, j, k, steps, here, scratch)
    anywhere, joined = _NONE, scratch.turned[: max(next_high_b - next_low_b + 1, 0) * row]
    shut = blocked_j[next_low_j : next_low_j + width]
    for a in range(next_low_i, next_high_i + 1):
        _join(scratch.planes, max(a - pace_a, low_i) - low_i, min(a + pace_a, high_i) - low_i, joined)
        for b in range(lattice.size[i, 1]):
            to = row_of(there, a, b) + next_low_j
            now = scratch.reach[to : to + width]
            if holds(blocked_i[a], b) or b < next_low_b or b > next_high_b:
                now[:] = _NONE
                continue
            at, mine = row_of(apart.block, a, b) + next_low_j, (b - next_low_b) * row + pace_c
            free, got, unseen = apart.words[at : at + width], joined[mine : mine + width], _NONE
            for c in range(len(now)):
                now[c] = got[c] & ~shut[c]
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
