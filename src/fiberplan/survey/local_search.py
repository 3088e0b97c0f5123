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
    """A set of options, and what has to be known of it."""

    held: np.ndarray  #: (places,) the option at each place, -1: none
    size: np.ndarray  #: (groups,) members in each group
    total: np.ndarray  #: (levels,)


class _Room(NamedTuple):
    """Room to work in."""

    rivals: np.ndarray  #: (n + 2,)
    candidates: np.ndarray  #: (m,)
    seen: np.ndarray  #: (m,) the step in which an option became a candidate
    journal: np.ndarray  #: what was put in (option) and taken out (-1 - option) in this step
    counts: np.ndarray  #: (3,) of candidates, of the journal, of steps
    gain: np.ndarray  #: (3, levels) of the option at hand, of the best one, before the step


@inlined
def _is_in(choices, chosen, v):
    return chosen.held[choices.place[v, 0]] == v


@leaf
def _rivals(choices, chosen, v, rivals):
    """Members that have to go before option v can come in; how many, -1 if it cannot, its group being full."""
    count = 0
    u, w = chosen.held[choices.place[v, 0]], chosen.held[choices.place[v, 1]]
    if u >= 0:
        rivals[count] = u
        count += 1
    if w >= 0 and w != u:
        rivals[count] = w
        count += 1
    for k in range(choices.touch_first[v], choices.touch_first[v + 1]):
        t = choices.touch[k]
        if t != w and _is_in(choices, chosen, t):
            rivals[count] = t
            count += 1
    g = choices.group[v]
    if g >= 0:
        inside = chosen.size[g]
        for b in range(count):
            if choices.group[rivals[b]] == g:
                inside -= 1
        if inside >= choices.need[g]:
            return -1
    return count


@leaf
def _change(choices, chosen, v, sign):
    """Put option v in (1) or take it out (-1)."""
    for k in range(2):
        chosen.held[choices.place[v, k]] = v if sign > 0 else -1
    if choices.group[v] >= 0:
        chosen.size[choices.group[v]] += sign
    for level in range(choices.weight.shape[1]):
        chosen.total[level] += sign * choices.weight[v, level]


@leaf
def _order(a, b):
    """1 if a (levels,) is more than b at the first level at which they differ, -1 if less, 0 if they are equal."""
    for level in range(len(a)):
        if a[level] != b[level]:
            return 1 if a[level] > b[level] else -1
    return 0


@leaf
def _gain_of(choices, chosen, v, room, gain):
    """What putting option v in would add to each level; False if it cannot come in."""
    count = _rivals(choices, chosen, v, room.rivals)
    for level in range(len(gain)):
        gain[level] = choices.weight[v, level]
        for b in range(count):
            gain[level] -= choices.weight[room.rivals[b], level]
    return count >= 0


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
    count = _rivals(choices, chosen, v, room.rivals)
    for b in range(count):
        _remove(choices, chosen, room.rivals[b], room)
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
            if _is_in(choices, chosen, v) or not _gain_of(choices, chosen, v, room, room.gain[0]):
                continue
            if _order(room.gain[0], room.gain[1]) > 0:
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
        if _rivals(choices, chosen, v, room.rivals) == 0:
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
        if _rivals(choices, chosen, v, room.rivals) >= 0:
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
        steps: of work; about 2 microseconds each.
        seed: of the steps; the same seed finds the same set.
        begin: an allowed set to begin from; greedy, by weight, unless given.
        around: options that steps begin at; all unless given.
    """
    m, levels = choices.weight.shape
    n, places = int(choices.robot.max(initial=-1)) + 1, len(choices.place_first) - 1
    chosen = _Set(np.full(places, -1, np.int64), np.zeros(len(choices.need), np.int64), np.zeros(levels, np.int64))
    room = _Room(
        np.empty(n + 2, np.int64),
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
