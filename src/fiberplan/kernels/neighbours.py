"""Neighbour lists in O(n): positioners are sorted into square cells, and only adjacent cells are compared."""

import numpy as np

from fiberplan.kernels.compile import kernel, record


@kernel
def grown(pairs):
    """The same pairs with room for twice as many."""
    more = np.empty((2 * len(pairs), 2), np.int64)
    more[: len(pairs)] = pairs
    return more


@kernel
def sort_into_cells(position, size):
    """Positions in square cells of at least `size` [mm], about n of them at most, however sparse the positions.

    Returns:
        (lower corner x, y, cell size, columns, rows, first (columns * rows + 1,), member (n,)).
    """
    n = len(position)
    x0, y0 = position[:, 0].min(), position[:, 1].min()
    width, height = position[:, 0].max() - x0, position[:, 1].max() - y0
    size = max(size, width / n, height / n, 1e-9)
    while (width / size) * (height / size) > 4.0 * n + 16.0:
        size *= 2.0
    columns, rows = int(width / size) + 1, int(height / size) + 1
    cell = np.empty(n, np.int64)
    first = np.zeros(columns * rows + 1, np.int64)
    for i in range(n):
        cell[i] = int((position[i, 1] - y0) / size) * columns + int((position[i, 0] - x0) / size)
        first[cell[i] + 1] += 1
    first = np.cumsum(first)
    member = np.empty(n, np.int64)
    filled = first[:-1].copy()
    for i in range(n):
        member[filled[cell[i]]] = i
        filled[cell[i]] += 1
    return x0, y0, size, columns, rows, first, member


@kernel
def neighbour_pairs(position, reach, gap):
    """Pairs (i < j) of positioners whose reach circles come within `gap` of each other, sorted.

    Args:
        position: (n, 2) [mm].
        reach: (n,) [mm].
        gap: [mm].

    Returns:
        (m, 2) int64.
    """
    n = len(position)
    pairs = np.empty((16 * n + 1, 2), np.int64)
    count = 0
    if n < 2:
        return pairs[:0].copy()
    x0, y0, size, columns, rows, first, member = sort_into_cells(position, 2.0 * reach.max() + gap)
    for i in range(n):
        begin = count
        column, row = int((position[i, 0] - x0) / size), int((position[i, 1] - y0) / size)
        for r in range(max(0, row - 1), min(rows, row + 2)):
            for c in range(max(0, column - 1), min(columns, column + 2)):
                for k in range(first[r * columns + c], first[r * columns + c + 1]):
                    j = member[k]
                    far = reach[i] + reach[j] + gap
                    dx, dy = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
                    if j > i and dx * dx + dy * dy < far * far:
                        if count == len(pairs):
                            pairs = grown(pairs)
                        pairs[count, 0], pairs[count, 1] = i, j
                        count += 1
        pairs[begin:count, 1] = np.sort(pairs[begin:count, 1])
    return pairs[:count].copy()


@kernel
def box_pairs(position, reach, box, gap):
    """Pairs (i, k) of a positioner and a box that its reach circle comes within `gap` of, sorted by k.

    Args:
        position: (n, 2) [mm].
        reach: (n,) [mm].
        box: (b, 4) x low, y low, x high, y high [mm]; boxes may be far larger than a positioner's reach.
        gap: [mm].

    Returns:
        (m, 2) int64.
    """
    n = len(position)
    pairs = np.empty((8 * len(box) + 1, 2), np.int64)
    count = 0
    if n == 0 or len(box) == 0:
        return pairs[:0].copy()
    far = reach.max() + gap
    x0, y0, size, columns, rows, first, member = sort_into_cells(position, 2.0 * far)
    for k in range(len(box)):
        begin = count
        # the clamps keep far-off boxes within int range
        low_c = int(max(0.0, min(columns - 1.0, np.floor((box[k, 0] - far - x0) / size))))
        high_c = int(max(0.0, min(columns - 1.0, np.floor((box[k, 2] + far - x0) / size))))
        low_r = int(max(0.0, min(rows - 1.0, np.floor((box[k, 1] - far - y0) / size))))
        high_r = int(max(0.0, min(rows - 1.0, np.floor((box[k, 3] + far - y0) / size))))
        for r in range(low_r, high_r + 1):
            for c in range(low_c, high_c + 1):
                for m in range(first[r * columns + c], first[r * columns + c + 1]):
                    i = member[m]
                    dx = max(0.0, box[k, 0] - position[i, 0], position[i, 0] - box[k, 2])
                    dy = max(0.0, box[k, 1] - position[i, 1], position[i, 1] - box[k, 3])
                    if dx * dx + dy * dy < (reach[i] + gap) ** 2:
                        if count == len(pairs):
                            pairs = grown(pairs)
                        pairs[count, 0], pairs[count, 1] = i, k
                        count += 1
        pairs[begin:count, 0] = np.sort(pairs[begin:count, 0])
    return pairs[:count].copy()


NEAR = record([("arm", "i4"), ("pair", "i4")])  # a neighbour, and which pair it makes


@kernel
def neighbour_lists(n, pairs):
    """Pairs as lists: those of arm i are near[offsets[i]:offsets[i + 1]], in pair order; (offsets, near)."""
    offsets = np.zeros(n + 1, np.int64)
    for k in range(len(pairs)):
        offsets[pairs[k, 0] + 1] += 1
        offsets[pairs[k, 1] + 1] += 1
    offsets = np.cumsum(offsets)
    filled = offsets[:-1].copy()
    near = np.empty(2 * len(pairs), NEAR)
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        near[filled[i]].arm, near[filled[i]].pair = j, k
        filled[i] += 1
        near[filled[j]].arm, near[filled[j]].pair = i, k
        filled[j] += 1
    return offsets, near
