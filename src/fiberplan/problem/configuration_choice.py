"""Of several configurations that reach the same targets, which to take so that no two arms touch."""

from collections.abc import Sequence

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.clearance import clearance

_LOOKS = 20_000  # combinations tried before the search is given up


def clear_choice(
    plane: FocalPlane, who: np.ndarray, options: Sequence[np.ndarray], limit: float
) -> tuple[np.ndarray | None, tuple[int, int]]:
    """The first configurations, in the order of each arm's options, that keep `limit` [mm] from each other.

    Args:
        plane: the array.
        who: (m,) arms.
        options: for each of them (k, 2) configurations [rad], best first; NaN rows do not count.
        limit: clearance to keep [mm].

    Returns:
        (m, 2) [rad], or None; and if None, the first two of `who`, by position, that no options keep apart (the two
        that are hardest to, where every pair alone could be).
    """
    arms = plane.arms
    good = [option[np.isfinite(option[:, 0])] for option in options]

    def clear(a: int, p: int, b: int, q: int) -> bool:
        return bool(clearance(arms, who[a], *good[a][p], who[b], *good[b][q]) >= limit)

    m = len(who)
    table = {
        (a, b): np.array([[clear(a, p, b, q) for q in range(len(good[b]))] for p in range(len(good[a]))], bool)
        for a in range(m)
        for b in range(a)
    }
    for (a, b), free in table.items():
        if not free.any():
            return None, (b, a)
    chosen: list[int] = []
    looks, tried = 0, 0
    while len(chosen) < m:
        a = len(chosen)
        while tried < len(good[a]) and not all(table[a, b][tried, chosen[b]] for b in range(a)):
            tried += 1
        looks += 1
        if tried < len(good[a]):
            chosen.append(tried)
            tried = 0
        elif chosen and looks < _LOOKS:
            tried = chosen.pop() + 1
        else:
            _, a, b = min((free.mean(), a, b) for (a, b), free in table.items())
            return None, (b, a)
    return np.array([good[a][p] for a, p in enumerate(chosen)]), (-1, -1)


def clear_goals(
    plane: FocalPlane, goal: np.ndarray, alternatives: np.ndarray, limit: float
) -> tuple[np.ndarray, tuple[int, ...]]:
    """Goals (n, 2) [rad] taken from `goal` and `alternatives` (n, k, 2) so that they keep `limit` [mm].

    Returns:
        The goals, and no positioners; or `goal` and two whose every configuration touches the other's. Where no two
        are at fault but all together are, `goal` comes back with no positioners, and what touches is seen at the goal.
    """
    who = np.flatnonzero(np.isfinite(goal[:, 0]))
    options = [np.concatenate([goal[[i]], alternatives[i]]) for i in who]
    choice, (a, b) = clear_choice(plane, who, options, limit)
    if choice is None:
        alone, _ = clear_choice(plane, who[[a, b]], [options[a], options[b]], limit)
        return goal, () if alone is not None else (int(who[a]), int(who[b]))
    chosen = goal.copy()
    chosen[who] = choice
    return chosen, ()
