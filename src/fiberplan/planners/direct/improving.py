"""From a solution to a better one: shorter, or such that who is late is not touched; the best so far is kept."""

from collections import Counter
from collections.abc import Callable

import numpy as np

from fiberplan.kernels.clearance import clearances
from fiberplan.kernels.randoms import uniform
from fiberplan.planners.direct.lattice import fewest_steps
from fiberplan.planners.direct.paths import Solution
from fiberplan.planners.direct.repair import SOLVED, TOO_SHORT
from fiberplan.planners.direct.search import PATIENCE, SMALLEST_CLUSTER, DirectSearch
from fiberplan.planners.direct.shortcuts import arrivals, hurried
from fiberplan.tolerances import SLACK

_CUTS = 4  # tries to make a solution shorter,
_LEAST_CUT_WORK = 500  # for as much work as it took to find it, and at least this
_SHORTCUTS = 60  # for each of those that hurry together
_IN_VAIN = 200  # times that one who arrives last hurries, before that is given up
_MOST_TOGETHER = 5  # who hurry
_MOST_SHORTCUTS = 100_000  # in all: a few seconds
_GROWTH = 0.03  # of the steps, the first time; as much more every time
_PART = 0.8  # of the clearance at rest, that arms which are late keep
_LATEST = 2.0  # times as many steps as without, for arms that may be late, at most


def shorten(search: DirectSearch, proceed: Callable[[], bool]) -> None:
    """From a solution, look for shorter ones; interrupted at any moment, keep the shortest so far.

    Shortcuts come first, since they are soon done, and again where the rest has found other paths.
    """
    _hurry(search, proceed)
    before = search.steps
    _cut(search, proceed)
    if search.steps < before:
        _hurry(search, proceed)


def _cut(search: DirectSearch, proceed: Callable[[], bool]) -> None:
    """Look for a solution with half as many steps too many; where that gets stuck, a quarter, and so on."""
    best, most, tries = search.solution, search.work + max(search.work, _LEAST_CUT_WORK), _CUTS
    least = max(search.least_steps, fewest_steps(search.lattice))  # who went elsewhere may need more
    cut = (best.steps - least + 1) // 2
    try:
        while cut >= 1 and tries and search.work < most and proceed():
            tries -= 1
            search.cut(best, best.steps - cut)
            if _is_repaired(search, proceed):
                best = search.solution
                cut = (best.steps - least + 1) // 2
            else:
                cut //= 2
    finally:
        search.go_back_to(best)


def _hurry(search: DirectSearch, proceed: Callable[[], bool]) -> None:
    """Let those that arrive last arrive sooner, by shortcuts of theirs and of those that are in their way."""
    if search.lattice.delay > 0:  # shortcuts know nothing of who is late
        return
    path, state = search.lattice.path[:, : search.steps + 1].copy(), search.search.state
    in_vain, refused, tried = np.zeros(len(path), np.int64), np.zeros(len(path), np.int64), 0
    in_the_way: dict[int, Counter[int]] = {}  # how often who refused shortcuts of whom
    while True:
        arrival = arrivals(path)
        last = int(arrival.max())
        if last < search.steps:
            shorter = path[:, : last + 1].copy()
            search.go_back_to(Solution(last, search.lattice._replace(path=shorter)))
        late = np.flatnonzero(arrival == last)
        if last <= search.least_steps or in_vain[late].max() > _IN_VAIN or not proceed():
            return
        if tried > _MOST_SHORTCUTS:
            return
        for i in late.tolist():
            known = in_the_way.setdefault(i, Counter())
            together = np.array([i, *_some_of(known, int(in_vain[i]) % _MOST_TOGETHER, search)])
            tries = _SHORTCUTS * len(together)
            tried += tries
            hurried(search.plane, search.near, path, together, search.limit, search.duration, tries, state, refused)
            for j in {int(j) for member in together for j in search.near.around(member)}:
                if not search.lattice.fixed[j] and j != i:
                    known[j] += int(refused[j])
                refused[j] = 0
            in_vain[i] = 0 if arrivals(path[i : i + 1])[0] < last else in_vain[i] + 1
            if in_vain[i] > _IN_VAIN:
                break


def _some_of(known: Counter[int], most: int, search: DirectSearch) -> list[int]:
    """At most so many of those that are known to be in the way, often or by chance."""
    weights = {j: times * uniform(search.search.state) for j, times in sorted(known.items()) if times}
    return sorted(weights, key=lambda j: -weights[j])[:most]


def react(search: DirectSearch, seconds: float, apart: float, proceed: Callable[[], bool]) -> bool:
    """From a solution, look for one in which arms that are this late [s] still keep `apart` [mm].

    Paths get longer where that gets stuck. False, with the solution as it was, if there is none in time.
    """
    before, steps = search.solution.copied(), search.steps
    if seconds >= steps * search.duration:  # paths would have to be apart altogether
        return False
    search.lengthen(fewest_steps(search.lattice))  # shortcuts may have been quicker than nodes are
    path = search.lattice.path
    ends = (clearances(search.plane.arms, path[:, k].copy(), search.pairs) for k in (0, search.steps))
    room = np.clip(_PART * np.minimum(*ends), SLACK, apart)  # no more than they have before and after
    search.lattice = search.lattice._replace(delay=int(np.ceil(seconds / search.duration)), apart=room)
    search.update_contacts()
    most, growth = min(search.most_steps, int(_LATEST * steps)), 1
    while proceed():
        if _is_repaired(search, proceed):
            return True
        if search.steps >= most:
            break
        search.lengthen(min(search.steps + max(1, int(steps * _GROWTH * growth)), most))
        search.start_afresh()
        growth += 1
    search.go_back_to(before)
    return False


def _is_repaired(search: DirectSearch, proceed: Callable[[], bool]) -> bool:
    """Whether repair finds a solution, with the steps that there are, before it gets stuck."""
    fewest, stuck = search.touching, 0
    search.cluster_size = SMALLEST_CLUSTER
    while stuck < PATIENCE and proceed():
        before = search.work
        result = search.attempt()
        if result in (SOLVED, TOO_SHORT):
            return result == SOLVED
        stuck = 0 if search.touching < fewest else stuck + search.work - before
        fewest = min(fewest, search.touching)
    return False
