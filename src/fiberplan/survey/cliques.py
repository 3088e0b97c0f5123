"""Sets of options of which at most one can be taken: the constraints that make a relaxation tight.

An option excludes the other options of its positioner, those on its target, and those it touches. Options of one
neighbour that touch one and the same option are a clique with it, since they are of one positioner. Each such clique is
grown as far as it goes, over third positioners and targets: on sparse fields this takes the bound of the linear
relaxation from 2 % above the best allocation to 0.2 % (`design/allocation.md`).
"""

import numpy as np
from scipy.sparse import csr_array

from fiberplan.arrays import read_only
from fiberplan.kernels.compile import kernel
from fiberplan.survey.choices import Choices


def cliques(choices: Choices) -> csr_array:
    """(cliques, m) of ones: maximal cliques that together hold every two options that exclude each other."""
    m = len(choices.place)
    if not m:
        return csr_array((0, 0))
    excludes = _exclusion(choices)
    first, member = _seeds(choices)
    grown = _grown_cliques(
        read_only(excludes.indptr, np.int64), read_only(excludes.indices, np.int64), first, read_only(member, np.int64)
    )
    parts = np.split(grown[1], grown[0][1:-1])
    distinct = list({part.tobytes(): part for part in parts}.values())
    ends = np.cumsum([0, *map(len, distinct)])
    members = np.concatenate(distinct)
    return csr_array((np.ones(len(members)), members, ends), shape=(len(distinct), m))


def _exclusion(choices: Choices) -> csr_array:
    """(m, m) nonzero where two options exclude each other."""
    m, places = len(choices.place), len(choices.place_first) - 1
    taken = csr_array((np.ones(2 * m), choices.place.ravel(), np.arange(0, 2 * m + 1, 2)), shape=(m, places))
    every = (taken @ taken.T + choices.touching).tocsr()
    every.setdiag(0)
    every.eliminate_zeros()
    every.sort_indices()
    return every


def _seeds(choices: Choices) -> tuple[np.ndarray, np.ndarray]:
    """Cliques as lists: the options at one place, and an option with those of one neighbour that it touches."""
    option = np.repeat(np.arange(len(choices.place)), np.diff(choices.touch_first))
    robot = choices.robot[choices.touch]
    begins = np.ones(len(option), bool)
    begins[1:] = (option[1:] != option[:-1]) | (robot[1:] != robot[:-1])
    heads = np.flatnonzero(begins)
    members = np.insert(choices.touch, heads, option[heads])
    sizes = np.concatenate([np.diff(choices.place_first), np.diff(np.append(heads, len(option))) + 1])
    first = np.concatenate([[0], np.cumsum(sizes[sizes > 0])])
    return read_only(first, np.int64), np.concatenate([choices.at_place, members])


@kernel
def _grown_cliques(first, other, seed_first, seed):
    """Each of the cliques `seed` with whatever else fits in, the option with most partners first; as lists, sorted."""
    m = len(first) - 1
    shared = np.zeros(m, np.int64)  # how many members of the clique an option is excluded by
    fits = np.zeros(m, np.bool_)
    open_ = np.empty(m, np.int64)
    ends = np.zeros(len(seed_first), np.int64)
    members = np.empty(4 * len(seed) + 16, np.int64)
    for c in range(len(seed_first) - 1):
        begin = ends[c]
        size = seed_first[c + 1] - seed_first[c]
        count = 0
        for k in range(seed_first[c], seed_first[c + 1]):
            for e in range(first[seed[k]], first[seed[k] + 1]):
                shared[other[e]] += 1
                if shared[other[e]] == size:
                    open_[count] = other[e]
                    fits[other[e]] = True
                    count += 1
        for k in range(seed_first[c], seed_first[c + 1]):
            for e in range(first[seed[k]], first[seed[k] + 1]):
                shared[other[e]] = 0
        most = size + count
        if begin + most > len(members):
            more = np.empty(2 * (begin + most), np.int64)
            more[:begin] = members[:begin]
            members = more
        members[begin : begin + size] = seed[seed_first[c] : seed_first[c + 1]]
        while count:
            best, partners = -1, -1
            for k in range(count):
                found = 0
                for e in range(first[open_[k]], first[open_[k] + 1]):
                    found += fits[other[e]]
                if found > partners:
                    best, partners = open_[k], found
            members[begin + size] = best
            size += 1
            for e in range(first[best], first[best + 1]):
                shared[other[e]] = 1
            left = 0
            for k in range(count):
                u = open_[k]
                fits[u] = shared[u] == 1
                if fits[u]:
                    open_[left] = u
                    left += 1
            count = left
            for e in range(first[best], first[best + 1]):
                shared[other[e]] = 0
        ends[c + 1] = begin + size
        members[begin : begin + size] = np.sort(members[begin : begin + size])
    return ends, members[: ends[-1]].copy()
