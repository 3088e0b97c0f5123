"""Neighbour lists against brute force, and random numbers against published ones, with the compiler off."""

import numpy as np

from fiberplan.kernels.neighbours import box_pairs, neighbour_lists, neighbour_pairs, sort_into_cells
from fiberplan.kernels.randoms import uniform
from references import brute_boxes, brute_pairs


def fields():
    rng = np.random.default_rng(0)
    yield rng.uniform(0, 100, (40, 2)), rng.uniform(1, 6, 40)
    yield rng.uniform(-50, 50, (40, 2)) + [1e3, -2e3], rng.uniform(0, 3, 40)
    yield np.stack([rng.uniform(0, 300, 30), np.zeros(30)], axis=1), rng.uniform(0, 9, 30)
    yield np.stack([np.zeros(30), rng.uniform(0, 300, 30)], axis=1), rng.uniform(0, 9, 30)
    yield np.concatenate([rng.uniform(0, 20, (9, 2)), [[1e6, -1e6]]]), np.full(10, 3.0)
    yield np.full((45, 2), 7.5), np.full(45, 1.0)  # more pairs than there is room for at first
    yield np.array([[3.0, 4.0]]), np.array([2.0])
    yield np.array([[0.0, 0.0], [4.0, 0.0]]), np.array([2.0, 2.0])  # reaches touch
    yield rng.integers(0, 6, (30, 2)) * 10.0, np.full(30, 5.0)


def test_pairs():
    for position, reach in fields():
        for gap in (0.0, 2.0):
            found = neighbour_pairs(position, reach, gap)
            assert found.dtype == np.int64
            np.testing.assert_array_equal(found, brute_pairs(position, reach, gap))
    assert neighbour_pairs(np.empty((0, 2)), np.empty(0), 1.0).shape == (0, 2)


def test_boxes():
    rng = np.random.default_rng(1)
    for position, reach in fields():
        low = rng.choice(position, 9) + rng.normal(0, 20, (9, 2))
        size = rng.uniform(0, 1, (9, 2)) * rng.choice([0.0, 5.0, 60.0, 1e9], (9, 1))
        box = np.concatenate([low, low + size], axis=1)
        box[0] = [-1e300, -1e300, 1e300, 1e300]
        box[1] = [1e300, 1e300, 2e300, 2e300]
        for gap in (0.0, 2.0):
            np.testing.assert_array_equal(box_pairs(position, reach, box, gap), brute_boxes(position, reach, box, gap))
    assert box_pairs(np.empty((0, 2)), np.empty(0), np.zeros((1, 4)), 1.0).shape == (0, 2)
    assert box_pairs(np.zeros((1, 2)), np.ones(1), np.empty((0, 4)), 1.0).shape == (0, 2)


def test_cells_hold_whom_they_should_and_are_not_many():
    for position, _ in fields():
        for wanted in (1e-6, 3.0, 500.0):
            x0, y0, size, columns, rows, first, member = sort_into_cells(position, wanted)
            n = len(position)
            width, height = np.ptp(position, axis=0)
            assert (x0, y0) == tuple(position.min(axis=0))
            assert columns * rows <= 4 * n + 17 + 2 * n**0.5 + columns + rows
            assert size == wanted or size <= max(wanted, width / n, height / n, 1e-9) * 8
            assert size >= max(wanted, width / n, height / n)
            assert len(first) == columns * rows + 1
            np.testing.assert_array_equal(np.sort(member), np.arange(n))
            at = ((position - [x0, y0]) / size).astype(int)
            cell = at[:, 1] * columns + at[:, 0]
            for k in range(columns * rows):
                assert sorted(member[first[k] : first[k + 1]]) == np.flatnonzero(cell == k).tolist()


def test_cells_of_a_line_are_as_wide_as_asked_or_one_a_member():
    """Sparse and square: about n cells, not n^2; no wider than that asks for."""
    line = np.stack([np.linspace(0, 88, 11), np.zeros(11)], axis=1)
    _, _, size, columns, rows, _, _ = sort_into_cells(line, 1e-3)
    assert (size, columns, rows) == (8.0, 12, 1)
    _, _, size, columns, rows, _, _ = sort_into_cells(line[:, ::-1].copy(), 1e-3)
    assert (size, columns, rows) == (8.0, 1, 12)
    square = np.array([[0.0, 0.0], [100.0, 100.0], *np.full((8, 2), 50.0)])
    _, _, size, columns, rows, _, _ = sort_into_cells(square, 0.5)
    assert (size, columns, rows) == (20.0, 6, 6)  # 10, doubled until no more than 4 n + 16 are left
    _, _, size, _, _, _, _ = sort_into_cells(np.zeros((3, 2)), 0.0)
    assert size == 1e-9


def test_lists():
    rng = np.random.default_rng(3)
    pairs = neighbour_pairs(rng.uniform(0, 60, (30, 2)), np.full(30, 5.0), 0.0)
    offsets, near = neighbour_lists(33, pairs)
    assert offsets[-1] == 2 * len(pairs) == len(near) > 20
    for i in range(33):
        expected = [(int(b if a == i else a), k) for k, (a, b) in enumerate(pairs) if i in (a, b)]
        assert [tuple(map(int, row)) for row in near[offsets[i] : offsets[i + 1]]] == expected


def test_random_numbers_are_those_of_splitmix64():
    """The first outputs for seed 1234567, as published with the generator's reference code."""
    state = np.array([1234567], np.uint64)
    for word in (6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431):
        assert uniform(state) == (word >> 11) / 2.0**53
