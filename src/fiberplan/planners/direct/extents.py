"""How far the bodies of an arm extend: circles that say quickly that two cannot meet."""

import numpy as np

from fiberplan.kernels.arms import Arms
from fiberplan.kernels.compile import kernel


@kernel
def _find_extents(arms, circle, first_link):
    """Fill what `extents` returns."""
    for i in range(len(circle)):
        for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
            piece = arms.piece[p]
            if piece.link == 1:
                for v in range(piece.first, piece.last):
                    far = np.hypot(arms.vertices[v, 0], arms.vertices[v, 1]) + piece.radius
                    first_link[i] = max(first_link[i], far)
        for link in (0, 2):
            low_x = low_y = np.inf
            high_x = high_y = -np.inf
            for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
                if arms.piece[p].link == link:
                    for v in range(arms.piece[p].first, arms.piece[p].last):
                        low_x, high_x = min(low_x, arms.vertices[v, 0]), max(high_x, arms.vertices[v, 0])
                        low_y, high_y = min(low_y, arms.vertices[v, 1]), max(high_y, arms.vertices[v, 1])
            if low_x > high_x:
                continue
            x, y, radius = 0.5 * (low_x + high_x), 0.5 * (low_y + high_y), 0.0
            for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
                if arms.piece[p].link == link:
                    for v in range(arms.piece[p].first, arms.piece[p].last):
                        far = np.hypot(arms.vertices[v, 0] - x, arms.vertices[v, 1] - y) + arms.piece[p].radius
                        radius = max(radius, far)
            circle[i, 0], circle[i, 1], circle[i, 2] = x, y, radius


def extents(arms: Arms) -> tuple[np.ndarray, np.ndarray]:
    """Circles (arms, 3) about the bodies of each last link or obstacle, and reach (arms,) of those on first links."""
    count = len(arms.arm)
    circle, first_link = np.tile([0.0, 0.0, -np.inf], (count, 1)), np.full(count, -1.0)
    _find_extents(arms, circle, first_link)
    return circle, first_link
