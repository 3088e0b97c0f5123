"""Goals that are given up so that nothing touches: of the least total priority, exactly."""

import numpy as np

from fiberplan.planners.direct.paths import Paths
from fiberplan.problem.least_cover import least_loss


def settle(paths: Paths) -> list[int]:
    """Give up goals of the least priority that has a part in every contact; whose."""
    priority = paths.problem.priority
    assert priority is not None  # set on construction
    touching = [(int(a), int(b)) for a, b in paths.pairs[paths.in_contact]]
    # one without a goal to lose would be held instead: the last resort
    weight = np.where(np.isnan(paths.goal[:, 0]), priority.sum() + 1.0, priority)
    losses = least_loss(touching, ~paths.lattice.fixed, weight)
    for i, blockers in losses.items():
        paths.give_up(i, blockers)
    paths.update_contacts()
    return list(losses)


def give_up_one_of(paths: Paths, pair: int) -> None:
    """Give up the goal of whichever matters less of two that cannot both get there; who has none is no help held."""
    priority = paths.problem.priority
    assert priority is not None  # set on construction
    i, j = (int(arm) for arm in paths.pairs[pair])
    able = [arm for arm in (i, j) if not paths.lattice.fixed[arm]]
    loser = min(able, key=lambda arm: (np.isnan(paths.goal[arm, 0]), priority[arm], arm))
    paths.give_up(loser, (j if loser == i else i,))
    paths.update_contacts()


def stop_here(paths: Paths) -> None:
    """Make what there is safe, at any moment of the search: those that touch, or are under way, lose their goals.

    They get one replan each to make room; those that still touch are held at their starts.
    """
    paths.stop()
    before = set(paths.given_up)
    ends = paths.lattice.path[: paths.plane.n, -1]
    unfinished = paths.plane.online & ~np.isnan(paths.goal[:, 0]) & (ends != paths.goal).any(axis=1)
    for i in np.flatnonzero(unfinished):
        paths.give_up(int(i), ())
    paths.update_contacts()
    while paths.touching:
        lost = [i for i in settle(paths) if not paths.lattice.fixed[i]]
        paths.place(np.array(lost, np.int64))
    paths.out_of_time = set(paths.given_up) - before
