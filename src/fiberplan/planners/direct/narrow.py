"""Narrow places beside what never moves: finer lattices where those are too coarse, and ways of their own at last."""

import numpy as np

from fiberplan.certificates import proven_excluded, proven_unreachable
from fiberplan.focal_plane.neighbours import touching
from fiberplan.kernels.clearance import clearance
from fiberplan.planners.direct.passages import stepwise, way_past_fixed
from fiberplan.planners.direct.paths import FINEST, ON_ITS_WAY, Paths
from fiberplan.planners.shared.goal_configurations import choices_of
from fiberplan.tolerances import EQUALITY

FINE = 1  #: fineness at which needs are asked for where the coarse answer is that there is no path, or a long one
_SHORTER = 1.05  # times as long as its way has to be what a positioner's lattice offers for the way to count
_TOUGH = 8  # replans past what never moves before a lattice is too coarse


def steps_past_fixed(paths: Paths, who: np.ndarray) -> np.ndarray:
    """(m,) steps that positioners `who` (m,) need past what never moves, as fine as it takes; negative: no path."""

    def late() -> np.ndarray:
        return (needs < 0) | (needs > paths.steps)

    needs = paths.needed_past_fixed(who)
    if paths.refine(who[late()], FINE):
        needs[late()] = paths.needed_past_fixed(who[late()])
    for k in np.flatnonzero(late()):
        i = int(who[k])
        way = None if needs[k] < 0 and _is_barred(paths, i) else _way(paths, i)
        if way is not None and (needs[k] < 0 or _SHORTER * (len(way) - 1) < needs[k]):
            paths.put_on(i, way)
            needs[k] = len(way) - 1
    return needs


def eased(paths: Paths) -> bool:
    """Give finer lattices, then ways, to those that touch what never moves after many tries; whether any got one.

    Whose goal is proven to be out of reach then, goes elsewhere, or gives it up.
    """
    search, pairs = paths.search, paths.in_contact
    fixed = paths.lattice.fixed[paths.pairs[pairs]].any(axis=1)
    arms = np.unique(paths.pairs[pairs[fixed & (search.tries[pairs] > _TOUGH)]])
    tough = arms[~paths.lattice.fixed[arms]]
    changed = False
    for i in tough.tolist():
        if paths.fineness[i] < FINEST:
            changed |= paths.refine(np.array([i]), int(paths.fineness[i]) + 1)
        elif paths.fineness[i] < ON_ITS_WAY and i not in paths.off_ways and not np.isnan(paths.goal[i, 0]):
            if _gave_up(paths, i):
                changed = True
                continue
            way = _way(paths, i)
            if way is None:
                paths.off_ways.add(i)  # not to be looked for again
            elif len(way) - 1 <= paths.most_steps:
                paths.put_on(i, way)
                paths.lengthen(len(way) - 1)
                paths.place(np.array([i]))
                changed = True
    return changed


def _is_barred(paths: Paths, i: int) -> bool:
    """Whether what never moves is proven to bar positioner i from its goal; a way is sought for longer than a proof."""
    return proven_unreachable(paths.plane, i, paths.problem.start, paths.goal[i], paths.problem.margin)


def _gave_up(paths: Paths, i: int) -> bool:
    """Whether positioner i is proven to be barred from its goal; it goes elsewhere then, or has given up."""
    if not _is_barred(paths, i):
        return False
    paths.lengthen(leaves_goal(paths, i))
    paths.place(np.array([i]))
    return True


def leaves_goal(paths: Paths, i: int) -> int:
    """Let positioner i, barred by what never moves, go elsewhere or give up its goal; steps that it needs, or -1."""
    need = goes_elsewhere(paths, i)
    if need < 0:
        paths.give_up(i, tuple(int(j) for j in paths.near.around(i) if paths.lattice.fixed[j]))
    return need


def _way(paths: Paths, i: int) -> np.ndarray | None:
    """The way of positioner i past what never moves, step by step (m, 2) [rad]; None if none is found."""
    lattice = paths.lattice
    rest = np.where(lattice.fixed[:, None], lattice.path[:, 0], np.nan)
    way = way_past_fixed(paths.plane, paths.near, rest, i, paths.problem.start[i], paths.goal[i], paths.limit)
    return None if way is None else stepwise(paths.plane, paths.near, rest, i, way, paths.duration, paths.limit)


def goes_elsewhere(paths: Paths, i: int) -> int:
    """Let positioner i go to another configuration that counts as its goal; steps that it needs, or -1 without any."""
    problem, taken, least = paths.problem, paths.goal[i].copy(), paths.least_steps
    fineness = min(int(paths.fineness[i]), FINEST)
    choices = choices_of(problem)[i]
    for end in choices[np.isfinite(choices[:, 0]) & (choices != taken).any(axis=1)]:
        paths.goal[i] = end
        pose = paths.plane.with_obstacles(np.where(paths.plane.online[:, None], paths.goal, problem.start))
        if touching(paths.plane.arms, paths.near, pose, np.array([i]), problem.margin + EQUALITY)[0] >= 0:
            continue
        paths.change_fineness(np.array([i]), np.array([0]))
        need = int(steps_past_fixed(paths, np.array([i]))[0])
        if 0 <= need <= paths.most_steps:
            return need
    paths.goal[i], paths.least_steps = taken, least  # ways to goals that are not taken are no bounds
    paths.change_fineness(np.array([i]), np.array([fineness]))
    return -1


def makes_room(paths: Paths, who: np.ndarray) -> bool:
    """Let the first of arms `who` (m,) that can reach its target in another configuration; whether any could.

    For good: nobody does so twice.
    """
    for i in who.tolist():
        if paths.lattice.fixed[i] or i in paths.elsewhere or np.isnan(paths.goal[i, 0]):
            continue
        paths.elsewhere.add(i)
        need = goes_elsewhere(paths, i)
        if need >= 0:
            paths.lengthen(need)
            paths.place(np.array([i]))
            return True
    return False


def crowding_out(paths: Paths, j: int) -> list[int]:
    """Positioners at whose goals there is, proven, no place left for positioner j, which what never moves shuts in."""
    problem, plane = paths.problem, paths.plane
    found = []
    for i in paths.near.around(j):
        if i < plane.n and plane.online[i] and not np.isnan(paths.goal[i, 0]):
            goal, (alpha, beta) = paths.goal[i], problem.start[j]
            touches = not clearance(plane.arms, i, goal[0], goal[1], j, alpha, beta) >= paths.limit
            if touches and proven_excluded(plane, int(i), goal, j, problem.start, problem.margin):
                found.append(int(i))
    return found
