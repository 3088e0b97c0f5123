"""Where positioners stand in regular arrays."""

import numpy as np


def hexagonal_grid(rings: int, pitch: float) -> tuple[tuple[str, ...], np.ndarray]:
    """Ids (R+1C3: row, column) and positions (n, 2) [mm] of a filled hexagon, row by row from the lowest y."""
    ids, base = [], []
    for row in range(-rings, rings + 1):
        count = 2 * rings + 1 - abs(row)
        for column in range(count):
            ids.append(f"R{row:+d}C{column + 1}" if row else f"R0C{column + 1}")
            base.append(((column - (count - 1) / 2) * pitch, row * pitch * np.sqrt(3) / 2))
    return tuple(ids), np.array(base)
