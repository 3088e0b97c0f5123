"""Allocation without a solver: greedy, then local search by swaps.

An option that is not taken is put in, whatever it excludes is taken out, and what that makes room for - options of the
same positioners, on the same targets, or that touched one that is gone - goes in, best first, as long as it gains. What
comes out worse is undone. Undoing is local, so many places improve side by side and a step costs the same in any array:
iterated local search for independent sets of greatest weight (Andrade, Resende & Werneck 2012; Nogueira et al. 2018).
"""

from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.kernels.randoms import uniform
from fiberplan.survey.choices import Choices


class _Set(NamedTuple):
    """A set of options, and what has to be known of it."""

    of_robot: np.ndarray  #: (n,) option of each positioner, -1: none
    of_target: np.ndarray  #: (targets,) option on each target, -1: none
    size: np.ndarray  #: (groups,) members in each group
    filled: np.ndarray  #: (combinations,) members of each combination that was ruled out
    total: np.ndarray  #: (levels,)


class _Room(NamedTuple):
    """Room to work in."""

    rivals: np.ndarray  #: (n,)
    candidates: np.ndarray  #: (m,)
    seen: np.ndarray  #: (m,) the step in which an option became a candidate
    journal: np.ndarray  #: what was put in (option) and taken out (-1 - option) in this step
    counts: np.ndarray  #: (3,) of candidates, of the journal, of steps
    gain: np.ndarray  #: (3, levels) of the option at hand, of the best one, before the step


@leaf
def _is_in(choices, chosen, v):
    return chosen.of_robot[choices.robot[v]] == v


@leaf
def _rivals(choices, chosen, v, rivals):
    """Members that have to go before option v can come in; how many, -1 if it cannot, its group being full."""
    count = 0
    u = chosen.of_robot[choices.robot[v]]
    if u >= 0:
        rivals[count] = u
        count += 1
    w = chosen.of_target[choices.target[v]]
    if w >= 0 and w != u:
        rivals[count] = w
        count += 1
    for k in range(choices.touch_first[v], choices.touch_first[v + 1]):
        t = choices.touch[k]
        if t != w and chosen.of_robot[choices.robot[t]] == t:
            rivals[count] = t
            count += 1
    for k in range(choices.out_first[v], choices.out_first[v + 1]):
        c = choices.out[k]
        first, last = choices.ruled_first[c], choices.ruled_first[c + 1]
        if chosen.filled[c] < last - first - 1:
            continue
        gone = False
        for a in range(first, last):
            for b in range(count):
                gone = gone or rivals[b] == choices.ruled[a]
        if not gone:
            other = -1
            for a in range(first, last):
                if choices.ruled[a] != v:
                    other = choices.ruled[a]
                    break
            if other < 0:
                return -1
            rivals[count] = other
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
def _put(choices, chosen, v):
    chosen.of_robot[choices.robot[v]] = v
    chosen.of_target[choices.target[v]] = v
    if choices.group[v] >= 0:
        chosen.size[choices.group[v]] += 1
    for k in range(choices.out_first[v], choices.out_first[v + 1]):
        chosen.filled[choices.out[k]] += 1
    for level in range(choices.weight.shape[1]):
        chosen.total[level] += choices.weight[v, level]


@leaf
def _take(choices, chosen, v):
    chosen.of_robot[choices.robot[v]] = -1
    chosen.of_target[choices.target[v]] = -1
    if choices.group[v] >= 0:
        chosen.size[choices.group[v]] -= 1
    for k in range(choices.out_first[v], choices.out_first[v + 1]):
        chosen.filled[choices.out[k]] -= 1
    for level in range(choices.weight.shape[1]):
        chosen.total[level] -= choices.weight[v, level]


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


@leaf
def _add(room, v):
    """Make option v a candidate of this step, once."""
    if room.seen[v] != room.counts[2]:
        room.seen[v] = room.counts[2]
        room.candidates[room.counts[0]] = v
        room.counts[0] += 1


@leaf
def _note(room, what):
    room.journal[room.counts[1]] = what
    room.counts[1] += 1


@leaf
def _remove(choices, chosen, u, room):
    """Take option u out; whatever it kept out becomes a candidate."""
    _take(choices, chosen, u)
    _note(room, -1 - u)
    i, t = choices.robot[u], choices.target[u]
    for v in range(choices.of_robot[i], choices.of_robot[i + 1]):
        _add(room, v)
    for k in range(choices.target_first[t], choices.target_first[t + 1]):
        _add(room, choices.of_target[k])
    for k in range(choices.touch_first[u], choices.touch_first[u + 1]):
        _add(room, choices.touch[k])


@leaf
def _insert(choices, chosen, v, room):
    """Put option v in and take its rivals out."""
    count = _rivals(choices, chosen, v, room.rivals)
    for b in range(count):
        _remove(choices, chosen, room.rivals[b], room)
    _put(choices, chosen, v)
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
def _make_room_in_group(choices, chosen, v, room, draw):
    """If the group of option v is full, take out the member that `draw` (0 to 1) falls on."""
    g, n = choices.group[v], len(chosen.of_robot)
    if g < 0 or chosen.size[g] < choices.need[g] or choices.need[g] == 0:
        return
    for k in range(n):
        u = chosen.of_robot[(int(draw * n) + k) % n]
        if u >= 0 and choices.group[u] == g:
            _remove(choices, chosen, u, room)
            return


@leaf
def _undo(choices, chosen, room):
    for k in range(room.counts[1] - 1, -1, -1):
        what = room.journal[k]
        if what >= 0:
            _take(choices, chosen, what)
        else:
            _put(choices, chosen, -1 - what)


@kernel
def _greedy(choices, chosen, order, room):
    """Options in this order, each that excludes none of those before it and is worth something."""
    for v in order:
        if _rivals(choices, chosen, v, room.rivals) == 0 and _gain_of(choices, chosen, v, room, room.gain[0]):
            room.gain[1] = 0
            if _order(room.gain[0], room.gain[1]) > 0:
                _put(choices, chosen, v)


@kernel
def _improve(choices, chosen, around, steps, state, room):
    """So many steps, each begun by an option of `around` (k,)."""
    for _ in range(steps):
        v = around[int(uniform(state) * len(around))]
        draw = uniform(state)
        if _is_in(choices, chosen, v):
            continue
        room.counts[0], room.counts[1] = 0, 0
        room.counts[2] += 1
        room.gain[2] = chosen.total
        _make_room_in_group(choices, chosen, v, room, draw)
        if _rivals(choices, chosen, v, room.rivals) >= 0:
            _insert(choices, chosen, v, room)
        _refill(choices, chosen, room)
        if _order(chosen.total, room.gain[2]) < 0:
            _undo(choices, chosen, room)


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
    n = len(choices.of_robot) - 1
    chosen = _Set(
        np.full(n, -1, np.int64),
        np.full(len(choices.target_first) - 1, -1, np.int64),
        np.zeros(len(choices.need), np.int64),
        np.zeros(len(choices.ruled_first) - 1, np.int64),
        np.zeros(levels, np.int64),
    )
    room = _Room(
        np.empty(n + len(choices.out) + 2, np.int64),
        np.empty(m, np.int64),
        np.full(m, -1, np.int64),
        np.empty(4 * n + 4096, np.int64),
        np.zeros(3, np.int64),
        np.zeros((3, levels), np.int64),
    )
    order = greedy_order(choices) if begin is None else begin
    _greedy(choices, chosen, read_only(order, np.int64), room)
    around = np.arange(m) if around is None else around
    if len(around):
        state = np.array([seed], np.uint64)
        _improve(choices, chosen, read_only(around, np.int64), steps, state, room)
    return np.sort(chosen.of_robot[chosen.of_robot >= 0])


def greedy_order(choices: Choices) -> np.ndarray:
    """(m,) options by falling weight, level by level; the first of equals first."""
    return np.lexsort([-column for column in choices.weight.T[::-1]])


def loss(choices: Choices, v: int, rivals: list[int]) -> tuple[int, ...]:
    """What it would cost, level by level, to take option v and give up its rivals."""
    return tuple((choices.weight[rivals].sum(axis=0) - choices.weight[v]).tolist())
