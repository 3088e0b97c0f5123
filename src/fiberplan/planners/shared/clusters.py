"""Positioners that could touch each other, grouped."""

from collections.abc import Iterable

import numpy as np

from fiberplan.focal_plane.neighbours import Neighbourhood


def neighbours(near: Neighbourhood, i: int) -> np.ndarray:
    """Arms that positioner `i` could touch, in order."""
    return near.near["arm"][near.offsets[i] : near.offsets[i + 1]]


def clusters(near: Neighbourhood, who: Iterable[int]) -> list[list[int]]:
    """`who`, grouped so that no two in different groups could touch; groups and members in order."""
    left = {int(i) for i in who}
    groups = []
    for seed in sorted(left):
        if seed not in left:
            continue
        left.discard(seed)
        group, open_ = [], [seed]
        while open_:
            i = open_.pop()
            group.append(i)
            for j in neighbours(near, i):
                if int(j) in left:
                    left.discard(int(j))
                    open_.append(int(j))
        groups.append(sorted(group))
    return groups
