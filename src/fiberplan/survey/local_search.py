"""Allocation without a solver: greedy, then local search by swaps.

An option that is not taken is put in, whatever it excludes is taken out, and what that makes room for - options of the
same positioners, on the same targets, or that touched one that is gone - goes in, best first, as long as it gains. What
comes out worse is undone. Undoing is local, so many places improve side by side and a step costs the same in any array:
iterated local search for independent sets of greatest weight (Andrade, Resende & Werneck 2012; Nogueira et al. 2018).
"""

from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.kernels.compile import inlined, kernel, leaf
from fiberplan.kernels.randoms import uniform
from fiberplan.survey.choices import Choices


class _Set(NamedTuple):
    """A set of options, and what has to be known of it: a step looks at many options, and changes few."""

    held: np.ndarray  #: (places,) the option at each place, -1: none
    size: np.ndarray  #: (groups,) members in each group
    total: np.ndarray  #: (levels,)
    rivals: np.ndarray  #: (m,) members that have to go before an option can come in
    in_group: np.ndarray  #: (m,) those of them that are of its own group
    loss: np.ndarray  #: (m, levels) what its rivals are worth


class _Room(NamedTuple):
    """Room to work in."""

    candidates: np.ndarray  #: (m,)
    seen: np.ndarray  #: (m,) the step in which an option became a candidate
    journal: np.ndarray  #: what was put in (option) and taken out (-1 - option) in this step
    counts: np.ndarray  #: (3,) of candidates, of the journal, of steps
    gain: np.ndarray  #: (3, levels) of the option at hand, of the best one, before the step


@inlined
def _is_in(choices, chosen, v):
    return chosen.held[choices.place[v, 0]] == v


@leaf
def _may_come(choices, chosen, v):
    """Whether option v can come in once its rivals are gone: its group is not full of others."""
    g = choices.group[v]
    return g < 0 or chosen.size[g] - chosen.in_group[v] < choices.need[g]


@inlined
def _tell(choices, chosen, v, u, sign):
    """Option v has u as a rival from now on (1), or no longer (-1)."""
    chosen.rivals[v] += sign
    if choices.group[u] >= 0 and choices.group[u] == choices.group[v]:
        chosen.in_group[v] += sign
    for level in range(choices.weight.shape[1]):
        chosen.loss[v, level] += sign * choices.weight[u, level]


@leaf
def _change(choices, chosen, u, sign):
    """Put option u in (1) or take it out (-1), and tell all that it excludes."""
    robot, target = choices.place[u, 0], choices.place[u, 1]
    chosen.held[robot] = chosen.held[target] = u if sign > 0 else -1
    if choices.group[u] >= 0:
        chosen.size[choices.group[u]] += sign
    for level in range(choices.weight.shape[1]):
        chosen.total[level] += sign * choices.weight[u, level]
    for k in range(choices.place_first[robot], choices.place_first[robot + 1]):
        _tell(choices, chosen, choices.at_place[k], u, sign)
    for k in range(choices.place_first[target], choices.place_first[target + 1]):
        if choices.place[choices.at_place[k], 0] != robot:  # told already
            _tell(choices, chosen, choices.at_place[k], u, sign)
    for k in range(choices.touch_first[u], choices.touch_first[u + 1]):
        _tell(choices, chosen, choices.touch[k], u, sign)


@leaf
def _order(a, b):
    """1 if a (levels,) is more than b at the first level at which they differ, -1 if less, 0 if they are equal."""
    for level in range(len(a)):
        if a[level] != b[level]:
            return 1 if a[level] > b[level] else -1
    return 0


@inlined
def _add(room, v):
    """Make option v a candidate of this step, once."""
    if room.seen[v] != room.counts[2]:
        room.seen[v] = room.counts[2]
        room.candidates[room.counts[0]] = v
        room.counts[0] += 1


@inlined
def _note(room, what):
    room.journal[room.counts[1]] = what
    room.counts[1] += 1


@leaf
def _remove(choices, chosen, u, room):
    """Take option u out; whatever it kept out becomes a candidate."""
    _change(choices, chosen, u, -1)
    _note(room, -1 - u)
    for p in range(2):
        place = choices.place[u, p]
        for k in range(choices.place_first[place], choices.place_first[place + 1]):
            _add(room, choices.at_place[k])
    for k in range(choices.touch_first[u], choices.touch_first[u + 1]):
        _add(room, choices.touch[k])


@leaf
def _insert(choices, chosen, v, room):
    """Put option v in and take its rivals out."""
    for p in range(2):
        u = chosen.held[choices.place[v, p]]
        if u >= 0:
            _remove(choices, chosen, u, room)
    if chosen.rivals[v]:
        for k in range(choices.touch_first[v], choices.touch_first[v + 1]):
            if _is_in(choices, chosen, choices.touch[k]):
                _remove(choices, chosen, choices.touch[k], room)
    _change(choices, chosen, v, 1)
    _note(room, v)


@leaf
def _refill(choices, chosen, room):
    """Put candidates in, the one that gains most first, until none gains."""
    levels = len(chosen.total)
    while room.counts[1] < len(room.journal) // 2:
        best = -1
        for level in range(levels):
            room.gain[1, level] = 0
        for k in range(room.counts[0]):
            v = room.candidates[k]
            for level in range(levels):
                room.gain[0, level] = choices.weight[v, level] - chosen.loss[v, level]
            if _order(room.gain[0], room.gain[1]) > 0 and _may_come(choices, chosen, v):
                best = v
                for level in range(levels):
                    room.gain[1, level] = room.gain[0, level]
        if best < 0:
            return
        _insert(choices, chosen, best, room)


@leaf
def _make_room_in_group(choices, chosen, v, room, n, draw):
    """If the group of option v is full, take out the member that `draw` (0 to 1) falls on, of n positioners."""
    g = choices.group[v]
    if g < 0 or chosen.size[g] < choices.need[g]:
        return
    for k in range(n):
        u = chosen.held[(int(draw * n) + k) % n]
        if u >= 0 and choices.group[u] == g:
            _remove(choices, chosen, u, room)
            return


@kernel
def _search(choices, chosen, n, order, around, steps, state, room):
    """Options in `order`, each that excludes none before it; then steps, each begun by an option of `around`."""
    for v in order:
        if not chosen.rivals[v] and _may_come(choices, chosen, v):
            _change(choices, chosen, v, 1)
    for _ in range(steps):
        v = around[int(uniform(state) * len(around))]
        draw = uniform(state)
        if _is_in(choices, chosen, v):
            continue
        room.counts[0], room.counts[1] = 0, 0
        room.counts[2] += 1
        room.gain[2] = chosen.total
        _make_room_in_group(choices, chosen, v, room, n, draw)
        if _may_come(choices, chosen, v):
            _insert(choices, chosen, v, room)
        _refill(choices, chosen, room)
        if _order(chosen.total, room.gain[2]) < 0:
            for k in range(room.counts[1] - 1, -1, -1):
                what = room.journal[k]
                _change(choices, chosen, what if what >= 0 else -1 - what, -1 if what >= 0 else 1)


def local_search(
    choices: Choices, steps: int, seed: int, begin: np.ndarray | None = None, around: np.ndarray | None = None
) -> np.ndarray:
    """A set of options, as indices in rising order, that no small swap makes better.

    Args:
        choices: what there is to choose from.
        steps: of work; a few microseconds each.
        seed: of the steps; the same seed finds the same set.
        begin: an allowed set to begin from; greedy, by weight, unless given.
        around: options that steps begin at; all unless given.
    """
    m, levels = choices.weight.shape
    n, places = int(choices.robot.max(initial=-1)) + 1, len(choices.place_first) - 1
    sizes = (len(choices.need), levels, m, m, (m, levels))
    chosen = _Set(np.full(places, -1, np.int64), *(np.zeros(size, np.int64) for size in sizes))
    room = _Room(
        np.empty(m, np.int64),
        np.full(m, -1, np.int64),
        np.empty(4 * n + 4096, np.int64),
        np.zeros(3, np.int64),
        np.zeros((3, levels), np.int64),
    )
    worth = np.asarray((choices.weight > 0).any(axis=1))
    order = greedy_order(choices) if begin is None else begin
    around = np.arange(m) if around is None else around
    order, around = (read_only(each[worth[each]], np.int64) for each in (order, around))
    state = np.array([seed], np.uint64)
    _search(choices, chosen, n, order, around, steps if len(around) else 0, state, room)
    return np.sort(chosen.held[:n][chosen.held[:n] >= 0])


def greedy_order(choices: Choices) -> np.ndarray:
    """(m,) options by falling weight, level by level; the first of equals first."""
    return np.lexsort(-choices.weight.T[::-1]) if len(choices.weight) else np.empty(0, np.int64)


def loss(choices: Choices, v: int, rivals: list[int]) -> tuple[int, ...]:
    """What it would cost, level by level, to take option v and give up its rivals."""
    return tuple((choices.weight[rivals].sum(axis=0) - choices.weight[v]).tolist())
