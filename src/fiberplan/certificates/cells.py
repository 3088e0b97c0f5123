"""Cells of the joint space of one or two arms, and which of them a motion can be in after each step of time.

Joints in slots 0 and 1 are alpha and beta of one arm, in 2 and 3 those of another; a slot that nobody moves has one
cell. A joint turns by no more than the width of its cells in a step, so after it it is in the same cell or in one of
the two beside it. Cells are bits of words, those of the last slot: `words[w, a, b, c]` has cells 64 w to 64 w + 63. A
border of nothing is around the others, so cell k of these is at k + 1.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.arms import frame
from fiberplan.kernels.box_bounds import box_bounds
from fiberplan.kernels.compile import inlined, kernel, leaf

BITS = 64  #: of a word
_ROUND = 1e-9  # of a cell, by which it is taken to be wider, and [s] by which moments are off
_NONE = np.uint64(0)
_ONE = np.uint64(1)
_LAST = np.uint64(BITS - 1)


class Cells(NamedTuple):
    """Where joints begin and end, and the cells around there. Cell 0 has the start in its middle."""

    start: np.ndarray  # (4,) [rad]
    goal: np.ndarray  # (4,) [rad]; NaN: anywhere
    lower: np.ndarray  # (4,) range of the joint [rad]
    upper: np.ndarray  # (4,)
    speed: np.ndarray  # (4,) [rad/s]
    step: float  # [s]
    width: np.ndarray  # (4,) of cells [rad]
    first: np.ndarray  # (4,) number of the first cell
    size: np.ndarray  # (4,) how many cells there are


@inlined
def _within(w, low, high):
    """Bits of words w that are cells from `low` to `high`."""
    if low >= BITS * (w + 1) or high < BITS * w:
        return _NONE
    return (~_NONE << np.uint64(max(0, low - BITS * w))) & (~_NONE >> np.uint64(max(0, BITS * (w + 1) - 1 - high)))


@inlined
def _soonest(cells, m, near, far):
    """In how many seconds joint m can be between `near` and `far` from the start, and from there at the goal."""
    there = max(0.0, near - cells.start[m], cells.start[m] - far) / cells.speed[m]
    if np.isnan(cells.goal[m]):
        return there, 0.0
    return there, max(0.0, near - cells.goal[m], cells.goal[m] - far) / cells.speed[m]


@leaf
def _shut_block(words, block, moves, size):
    """No cell of a block is free."""
    low_a, low_b, low_c, low_d = 0, 0, 0, 0
    high_a, high_b, high_c, high_d = size[0], size[1], size[2], size[3]
    if moves[0]:
        low_a, high_a, low_b, high_b = block[0], block[0] + block[4], block[1], block[1] + block[5]
    if moves[1]:
        low_c, high_c, low_d, high_d = block[2], block[2] + block[6], block[3], block[3] + block[7]
    for w in range(low_d // BITS, (high_d - 1) // BITS + 1):
        others = ~_within(w, low_d, high_d - 1)
        for a in range(low_a, high_a):
            for b in range(low_b, high_b):
                row = words[w, a + 1, b + 1]
                for c in range(low_c, high_c):
                    row[c + 1] &= others


@kernel
def shut(arms, i, j, moves, pose, cells, seconds, margin, words, stack):
    """Strike from `words` all cells, of a motion that takes so long, in which arms i and j are nearer than the margin.

    Arm i has slots 0 and 1, and j has 2 and 3; `moves` (2,) says which of them moves, and the other stands at its
    `pose` (4,) [rad]. Blocks of cells are halved until they are clear or in contact all over. `stack` (s, 8) is for
    these: the first cells, and how many; where it is full, cells stay as they are.
    """
    at, half, top = np.empty(4), np.zeros(4), 1
    at[:] = pose
    for m in range(4):
        stack[0, m], stack[0, 4 + m] = 0, cells.size[m] if moves[m // 2] else 1
    while top > 0:
        top -= 1
        block = stack[top]
        there = back = 0.0
        for m in range(4):
            if moves[m // 2]:
                half[m] = (0.5 * block[4 + m] + _ROUND) * cells.width[m]
                at[m] = cells.start[m] + (cells.first[m] + block[m] - 0.5 + 0.5 * block[4 + m]) * cells.width[m]
                go, come = _soonest(cells, m, at[m] - half[m], at[m] + half[m])
                there, back = max(there, go), max(back, come)
        if there + back > seconds + _ROUND:
            continue
        frame_i, frame_j = frame(arms, i, at[0], at[1]), frame(arms, j, at[2], at[3])
        _, low, high, w0, w1, w2, w3 = box_bounds(
            arms, i, frame_i, half[0], half[1], j, frame_j, half[2], half[3], margin, margin
        )
        if low >= margin:
            continue
        if high < margin:
            _shut_block(words, block, moves, cells.size)
            continue
        joint, most = -1, -1.0
        for m in range(4):
            way = w0 if m == 0 else w1 if m == 1 else w2 if m == 2 else w3
            if moves[m // 2] and block[4 + m] > 1 and way > most:
                joint, most = m, way
        if joint < 0 or top + 2 > len(stack):
            continue
        lower = block[4 + joint] // 2
        stack[top + 1] = block
        block[4 + joint] = lower
        stack[top + 1, joint] += lower
        stack[top + 1, 4 + joint] -= lower
        top += 2


@inlined
def _cells_at(cells, m, t, seconds, first, last):
    """First and last cell of joint m in which a motion of so many seconds can be at t, of `first` to `last`."""
    low, high = max(cells.start[m] - cells.speed[m] * t, cells.lower[m]), cells.start[m] + cells.speed[m] * t
    high = min(high, cells.upper[m])
    if not np.isnan(cells.goal[m]):
        low = max(low, cells.goal[m] - cells.speed[m] * (seconds - t))
        high = min(high, cells.goal[m] + cells.speed[m] * (seconds - t))
    low = int(np.ceil((low - cells.start[m]) / cells.width[m] - 0.5 - _ROUND)) - cells.first[m]
    high = int(np.floor((high - cells.start[m]) / cells.width[m] + 0.5 + _ROUND)) - cells.first[m]
    return max(low, first), min(high, last)


@leaf
def _spread_last(words, w, a, b, first, last, raw, line):
    """Fill `line` with row (a, b) of words w, from column `first` to `last`, each cell spread to those beside it.

    That is in the last slot, from words before and after, too; and in the slot before it. `raw` is work space.
    """
    row = words[w, a, b, first - 1 : last + 2]
    for c in range(len(row)):
        raw[c] = row[c] | (row[c] << _ONE) | (row[c] >> _ONE)
    if w > 0:
        row = words[w - 1, a, b, first - 1 : last + 2]
        for c in range(len(row)):
            raw[c] |= row[c] >> _LAST
    if w + 1 < len(words):
        row = words[w + 1, a, b, first - 1 : last + 2]
        for c in range(len(row)):
            raw[c] |= row[c] << _LAST
    for c in range(len(row) - 2):
        line[c] = raw[c] | raw[c + 1] | raw[c + 2]


@leaf
def _spread(words, low_before, high_before, low, high, lines, out):
    """Fill `out` with `words`, each cell spread to those beside it in all slots but the first."""
    left, right = low[2] + 1, high[2] + 1  # columns
    for w in range(len(words)):
        for a in range(low_before[0] + 1, high_before[0] + 2):
            for b in range(low[1], high[1] + 3):  # one more on both sides
                line = lines[b % 3]
                if low_before[1] + 1 <= b <= high_before[1] + 1:
                    _spread_last(words, w, a, b, left, right, lines[3], line)
                else:
                    line[: right + 1 - left] = _NONE
                if b >= low[1] + 2:
                    row, one, two = out[w, a, b - 1, left : right + 1], lines[(b - 1) % 3], lines[(b - 2) % 3]
                    for c in range(len(row)):
                        row[c] = line[c] | one[c] | two[c]


@leaf
def _advance(free, here, low_before, high_before, low, high, lines, spread):
    """Spread the cells in `here` to all beside them that are free, within new windows; whether there are any."""
    _spread(here, low_before, high_before, low, high, lines, spread)
    some, left, right = _NONE, low[2] + 1, high[2] + 1
    for w in range(len(here)):
        for a in range(low_before[0] + 1, high_before[0] + 2):
            for b in range(low_before[1] + 1, high_before[1] + 2):
                here[w, a, b, low_before[2] + 1 : high_before[2] + 2] = _NONE
        within = _within(w, low[3], high[3])
        for a in range(low[0] + 1, high[0] + 2):
            for b in range(low[1] + 1, high[1] + 2):
                row, may = here[w, a, b, left : right + 1], free[w, a, b, left : right + 1]
                for p in range(max(a - 1, low_before[0] + 1), min(a + 1, high_before[0] + 1) + 1):
                    other = spread[w, p, b, left : right + 1]
                    for c in range(len(row)):
                        row[c] |= other[c]
                for c in range(len(row)):
                    row[c] &= may[c] & within
                    some |= row[c]
    return some != _NONE


@kernel
def first_step(cells, seconds, free, here, spread, lines):
    """After how many steps both can be at their goals, in a motion of no more than so many seconds; -1: never.

    `free` has the cells in which it can be, with the bits of others 0; `here` and `spread`, of the same size, and
    `lines` (4, columns) are work space, all zeros.
    """
    low, high = np.empty(4, np.int64), np.empty(4, np.int64)
    low_before, high_before = -cells.first, -cells.first
    d = -cells.first[3]
    here[d // BITS, 1 - cells.first[0], 1 - cells.first[1], 1 - cells.first[2]] = _ONE << np.uint64(d % BITS)
    for n in range(1, int(seconds / cells.step) + 2):
        t = min(n * cells.step, seconds)
        for m in range(4):
            first, last = max(0, low_before[m] - 1), min(cells.size[m] - 1, high_before[m] + 1)
            low[m], high[m] = _cells_at(cells, m, t, seconds, first, last)
            if low[m] > high[m]:
                return -1
        if not _advance(free, here, low_before, high_before, low, high, lines, spread):
            return -1
        if _is_at_goal(cells, t, here, low, high):
            return n
        low_before[:], high_before[:] = low, high
    return -1


@leaf
def _is_at_goal(cells, t, here, low, high):
    """Whether any cell that can be reached has the goal in it: those of the windows at the end of a motion."""
    low_a, high_a = _cells_at(cells, 0, t, t, low[0], high[0])
    low_b, high_b = _cells_at(cells, 1, t, t, low[1], high[1])
    low_c, high_c = _cells_at(cells, 2, t, t, low[2], high[2])
    low_d, high_d = _cells_at(cells, 3, t, t, low[3], high[3])
    for a in range(low_a, high_a + 1):
        for b in range(low_b, high_b + 1):
            for c in range(low_c, high_c + 1):
                for d in range(low_d, high_d + 1):
                    if (here[d // BITS, a + 1, b + 1, c + 1] >> np.uint64(d % BITS)) & _ONE:
                        return True
    return False
