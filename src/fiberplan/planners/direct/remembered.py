"""Where neighbours block a positioner, remembered as long as their paths, and its own nodes, are what they were.

Most of a replan is to find out which nodes a neighbour blocks, and most neighbours stand on the same path as the last
time. What was asked is kept beside the answer, number by number, so that nobody has to tell what has changed. Both go
into rings of a fixed size: what is oldest is overwritten.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.compile import inlined, leaf, record
from fiberplan.planners.direct.blocked_nodes import mark_blocked
from fiberplan.planners.direct.lattice import Lattice, late_limit, window

_QUESTIONS = 2**20  # pairs of numbers: 16 MiB
_CELLS = 2**21  # 32 MiB, or what one answer may need
_OWN = 9  # pairs of numbers that tell a positioner's nodes, and how they are asked for

CELL = record(
    [
        ("step", "i4"),
        ("alpha", "i4"),  # node
        ("betas", "u8"),  # those that are blocked, a bit each; some of those that cannot be reached may be among them
    ]
)
_SLOT = record(
    [
        ("question", "i8"),  # where it is in all that was ever written
        ("numbers", "i8"),  # pairs of them; 0: nothing is known
        ("answer", "i8"),
        ("cells", "i8"),
    ]
)


class Remembered(NamedTuple):
    """Questions and answers; all of it changes."""

    slots: np.ndarray  # (neighbours,) the last answer for each entry of the neighbour lists
    questions: np.ndarray  # (_QUESTIONS, 2)
    cells: np.ndarray  # (cells,) CELL: answers
    written: np.ndarray  # (2,) how many of either, ever
    marked: np.ndarray  # (steps + 1, A) uint64, scratch


def remember(lattice: Lattice, neighbours: int, before: Remembered | None = None) -> Remembered:
    """Room for answers on neighbour lists of so many entries; what was known before stays known."""
    most = (lattice.steps + 1) * lattice.alpha.shape[1]
    marked = np.empty((lattice.steps + 1, lattice.alpha.shape[1]), np.uint64)
    if before is not None and len(before.cells) >= most:
        return before._replace(marked=marked)
    return Remembered(
        slots=np.zeros(neighbours, _SLOT),
        questions=np.empty((max(_QUESTIONS, lattice.steps + 1 + _OWN), 2)),
        cells=np.empty(max(_CELLS, most), CELL),
        written=np.zeros(2, np.int64),
        marked=marked,
    )


@inlined
def _room(written, which, count, size):
    """Where `count` entries go without a break, in all that was ever written."""
    begin = written[which]
    return begin if begin % size + count <= size else begin + size - begin % size


@leaf
def _ask(lattice, i, j, pair, limit, steps, questions, begin):
    """Write down all that the answer depends on; how many pairs of numbers that is."""
    at, sizes = begin % len(questions), lattice.size[i]
    alphas = ways = 0.0
    for a in range(sizes[0]):
        alphas += lattice.alpha[i, a]
        ways += lattice.ways[lattice.way[i], a]
    for d in range(2):
        questions[at, d] = lattice.first[i, d]
        questions[at + 1, d] = lattice.last[i, d]
        questions[at + 2, d] = sizes[d]
        questions[at + 3, d] = lattice.pace[i, d]
    questions[at + 4, 0], questions[at + 4, 1] = lattice.alpha[i, 0], lattice.alpha[i, sizes[0] - 1]
    questions[at + 5, 0], questions[at + 5, 1] = lattice.beta[i, 0], lattice.beta[i, sizes[1] - 1]
    questions[at + 6, 0], questions[at + 6, 1] = alphas, ways
    questions[at + 7, 0], questions[at + 7, 1] = limit, steps
    questions[at + 8, 0], questions[at + 8, 1] = lattice.delay, late_limit(lattice, pair)
    for k in range(steps + 1):
        questions[at + _OWN + k, 0], questions[at + _OWN + k, 1] = lattice.path[j, k, 0], lattice.path[j, k, 1]
    return _OWN + steps + 1


@inlined
def _same(questions, one, other, count):
    """Whether two questions are the same."""
    one, other = one % len(questions), other % len(questions)
    for m in range(count):
        if questions[one + m, 0] != questions[other + m, 0] or questions[one + m, 1] != questions[other + m, 1]:
            return False
    return True


@leaf
def blocked_cells(arms, near, lattice, i, q, trig, motion, limit, steps, row, known):
    """Which nodes of positioner i the neighbour of entry `q` blocks on its path: first and last + 1 of `known.cells`.

    `trig` and `motion` as for `mark_blocked`, `row` (A,) is scratch.
    """
    j, pair = near.near[q].arm, near.near[q].pair
    questions, cells, slot, marked = known.questions, known.cells, known.slots[q], known.marked
    asked = _room(known.written, 0, _OWN + steps + 1, len(questions))
    numbers = _ask(lattice, i, j, pair, limit, steps, questions, asked)
    kept = asked + numbers <= slot.question + len(questions) and known.written[1] <= slot.answer + len(cells)
    if slot.numbers == numbers and kept and _same(questions, asked, slot.question, numbers):
        begin = slot.answer % len(cells)
        return begin, begin + slot.cells
    for k in range(steps + 1):
        low, high = window(lattice, i, k, steps)
        for a in range(low, high + 1):
            marked[k, a] = np.uint64(0)
    mark_blocked(arms, lattice, i, trig, motion, j, pair, limit, steps, row, marked)
    count = 0
    for k in range(1, steps + 1):
        low, high = window(lattice, i, k, steps)
        for a in range(low, high + 1):
            count += marked[k, a] != np.uint64(0)
    answer = _room(known.written, 1, count, len(cells))
    at = begin = answer % len(cells)
    for k in range(1, steps + 1):
        low, high = window(lattice, i, k, steps)
        for a in range(low, high + 1):
            if marked[k, a] != np.uint64(0):
                cells[at].step, cells[at].alpha, cells[at].betas = k, a, marked[k, a]
                at += 1
    known.written[0], known.written[1] = asked + numbers, answer + count
    slot.question, slot.numbers, slot.answer, slot.cells = asked, numbers, answer, count
    return begin, at
