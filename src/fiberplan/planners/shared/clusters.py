"""Positioners that could touch each other, grouped."""

from collections.abc import Iterable

from fiberplan.focal_plane.neighbours import Neighbourhood


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
            for j in near.around(i):
                if int(j) in left:
                    left.discard(int(j))
                    open_.append(int(j))
        groups.append(sorted(group))
    return groups
