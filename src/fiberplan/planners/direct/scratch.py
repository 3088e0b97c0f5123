"""Arrays that the repair works in, so that no step allocates; and what it keeps of where pairs clear each other."""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.compile import leaf
from fiberplan.planners.direct.joint_nodes import forget_clear
from fiberplan.planners.direct.lattice import Lattice
from fiberplan.planners.direct.nodes import MOST_PACE
from fiberplan.planners.direct.remembered import Remembered, remember

_MOST_WORDS = 2**26  # of joint nodes that are kept: 512 MiB; a pair that needs more is not moved jointly
_MOST_TABLES = 12  # of where two clear each other: a few pairs are moved again and again

TABLE = np.dtype(
    (
        np.record,
        [
            ("pair", "i8"),  # -1: none
            ("steps", "i8"),
            ("apart", "f8"),  # [mm]
            ("used", "i8"),  # the larger, the later
        ],
    )
)


class Scratch(NamedTuple):
    """Arrays to work in, so that no step allocates."""

    price: np.ndarray  # (steps + 1, A, B) float32
    cost: np.ndarray  # the same
    turned_alone: np.ndarray  # (A, B) float32
    bias: np.ndarray  # (B,) float32
    row: np.ndarray  # (A,) uint64
    blocked: np.ndarray  # (steps + 1, A) uint64
    blocked_other: np.ndarray
    trig: np.ndarray  # (A, B + 1, 2)
    trig_other: np.ndarray
    reach: np.ndarray  # (words,) uint64: joint nodes after each step
    begins: np.ndarray  # (steps + 2,) where those of each step begin
    before: np.ndarray  # (words,) uint64: those nodes for one alpha, with room around them
    turned: np.ndarray  # the same
    planes: np.ndarray  # (A, words) uint64: the same for each alpha
    clear: np.ndarray  # (tables, A B A) uint64: where pairs clear each other, of the pairs moved jointly last
    clear_for: np.ndarray  # (tables,) TABLE: of which pair, and so on
    end: np.ndarray  # (4,)
    known: Remembered  # which nodes neighbours block


def make_scratch(lattice: Lattice, neighbours: int, before: Scratch | None = None, same_nodes: bool = True) -> Scratch:
    """Room for the largest lattice, and for the joint nodes of any pair up to a limit.

    Of `reach` only what a pair needs is ever touched, so only that much memory is taken. What `before` knows stays
    known: where pairs clear each other, if it is of the same lattices, and which nodes are blocked, on lists of so many
    `neighbours`.
    """
    a, b, k = lattice.alpha.shape[1], lattice.beta.shape[1], lattice.steps + 1
    word = np.uint64
    tables = np.zeros(max(1, min(_MOST_TABLES, _MOST_WORDS // (2 * a * b * a))), TABLE)
    tables["pair"] = -1
    if before is not None and same_nodes and before.clear.shape == (len(tables), a * b * a):
        clear, tables = before.clear, before.clear_for
    else:
        clear = np.empty((len(tables), a * b * a), word)
    plane = (b + 2 * MOST_PACE) * (a + 2 * MOST_PACE) + 2 * MOST_PACE
    return Scratch(
        price=np.empty((k, a, b), np.float32),
        cost=np.empty((k, a, b), np.float32),
        turned_alone=np.empty((a, b), np.float32),
        bias=np.empty(b, np.float32),
        row=np.empty(a, word),
        blocked=np.empty((k, a), word),
        blocked_other=np.empty((k, a), word),
        trig=np.empty((a, b + 1, 2)),
        trig_other=np.empty((a, b + 1, 2)),
        reach=np.empty(min(_MOST_WORDS, k * a * b * a), word),
        begins=np.empty(k + 1, np.int64),
        before=np.empty(plane, word),
        turned=np.empty(plane, word),
        planes=np.empty((a, plane), word),
        clear=clear,
        clear_for=tables,
        end=np.empty(4, np.int64),
        known=remember(lattice, neighbours, None if before is None else before.known),
    )


@leaf
def table_for(lattice, i, j, pair, apart, scratch, steps):
    """Which of the tables in `scratch.clear` is for where i and j clear each other by `apart` [mm]; empty if new.

    One for more steps serves as well; one for a smaller clearance knows what is not clear.
    """
    tables = scratch.clear_for
    latest = mine = 0
    for m in range(len(tables)):
        latest = max(latest, tables[m].used)
        if tables[m].used < tables[mine].used:
            mine = m
    again = False
    for m in range(len(tables)):
        here = tables[m]
        fits = here.pair == pair and here.steps >= steps and here.apart <= apart
        if fits and (not again or here.apart > tables[mine].apart):
            mine, again = m, True
    here = tables[mine]
    here.used = latest + 1
    if not again or here.apart < apart:
        steps = here.steps if again else steps
        here.pair, here.steps, here.apart = pair, steps, apart
        forget_clear(lattice, i, j, steps, scratch.clear[mine], again)
    return mine
