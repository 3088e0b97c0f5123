"""Boxes of several widths that tile a joint space, against the same painted cell by cell."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import label

from fiberplan.certificates.tiling import Tiling

LEVELS = 4
COUNT = np.array([3, 2])
LOW, HIGH = np.array([-1.0, 2.0]), np.array([0.5, 3.0])
pytestmark = pytest.mark.small


def painted(rng):
    """A tiling in which a third of the boxes of each level are clear, a third are halved; (cells, undecided layer)."""
    tiling = Tiling(LOW, HIGH, COUNT)
    fine = 2 ** (LEVELS - 1)
    cells = np.zeros(COUNT * fine, int)  # 1: clear, 2: undecided
    layer = tiling.whole()
    for level in range(LEVELS):
        kind = rng.integers(0, 3, len(layer))
        side = fine >> level
        for cell, k in zip(layer.cells, kind, strict=True):
            a, b = cell * side
            cells[a : a + side, b : b + side] = k
        tiling.add_clear(layer[kind == 1])
        undecided = layer[kind == 2]
        layer = undecided.halved()
    return tiling, cells, undecided


def places(rng, cells):
    """Two places (2,) inside cells that are not blocked, and the cells."""
    able = np.argwhere(cells > 0)
    chosen = able[rng.choice(len(able), 2)]
    return LOW + (chosen + rng.uniform(0.1, 0.9, (2, 2))) * (HIGH - LOW) / cells.shape, chosen


def aimed(tiling, layer, goal):
    return replace(layer, goal=tiling.holds(layer, goal))


def aim(tiling, goal):
    tiling.clear[:] = [aimed(tiling, layer, goal) for layer in tiling.clear]


def test_what_is_joined():
    rng, joined = np.random.default_rng(0), []
    for _ in range(60):
        tiling, cells, undecided = painted(rng)
        (start, goal), (a, b) = places(rng, cells)
        aim(tiling, goal)
        undecided = aimed(tiling, undecided, goal)
        for able, given in ((cells > 0, undecided), (cells == 1, None)):
            region = label(able, np.ones((3, 3)))[0]
            same = region[tuple(a)] == region[tuple(b)] != 0
            assert tiling.joined(start, given) == same
            joined.append(same)
    assert 0.2 < np.mean(joined) < 0.9


def test_what_is_left_out_joins_nothing():
    """With the undecided boxes that are kept, the ends are joined just when they are with all of them."""
    rng, dropped = np.random.default_rng(1), 0
    for _ in range(60):
        tiling, cells, undecided = painted(rng)
        (start, goal), _ = places(rng, cells)
        aim(tiling, goal)
        undecided = aimed(tiling, undecided, goal)
        kept = tiling.joins(undecided, start)
        assert tiling.joined(start, undecided[kept]) == tiling.joined(start, undecided)
        dropped += np.count_nonzero(~kept)
    assert dropped > 60


def test_an_end_on_an_edge_is_in_the_boxes_on_both_sides():
    tiling = Tiling(LOW, HIGH, COUNT)
    whole = tiling.whole()
    tiling.add_clear(whole[(whole.cells == [0, 0]).all(axis=1)])
    for shift, held in ((0.0, True), (1e-11, True), (1e-7, False)):
        corner = LOW + tiling.width(0) + shift
        aim(tiling, corner)
        assert tiling.joined(LOW + 0.1) == held
    aim(tiling, LOW + 0.1)
    assert tiling.joined(LOW - 9.0)  # what is outside counts as at the end of the range


def test_a_joint_that_cannot_turn():
    tiling = Tiling(np.zeros(2), np.array([1.0, 0.0]), np.array([2, 1]))
    tiling.add_clear(tiling.whole())
    aim(tiling, np.array([0.9, 0.0]))
    assert tiling.joined(np.array([0.1, 0.0]))
    assert tiling.middles(tiling.clear[0]).tolist() == [[0.25, 0.0], [0.75, 0.0]]
