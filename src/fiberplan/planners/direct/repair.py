"""Contacts are repaired one positioner at a time, and what only gets stuck that way two at a time.

Local search with soft conflicts: a positioner of some pair in contact is put on the cheapest path through everyone
else's, whether or not that is free; a pair that still touches afterwards weighs more from then on (breakout). A pair
that has been tried often is moved jointly, first past everybody, then past fewer and fewer of those who could make
room, who have to find other paths while the pair is held for a while.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.compile import kernel, leaf
from fiberplan.kernels.randoms import uniform
from fiberplan.planners.direct.contacts import all_contacts, steps_in_contact
from fiberplan.planners.direct.joint_nodes import joint_words
from fiberplan.planners.direct.pairs import move_jointly, steps_alone
from fiberplan.planners.direct.past_fixed import steps_past_fixed
from fiberplan.planners.direct.scratch import table_for
from fiberplan.planners.direct.single import replan

EXTENDED = 0.02  # price of a step at full extension; touching costs 1 or more
TURN = 0.01  # price of a joint's turn by one node
_HEAVIER = 0.5  # what a pair that still touches weighs more
_INFLATION = 0.1  # [mm] by which a pair that touches only between steps is kept farther apart, every time
_JOINT_INFLATION = 0.05  # [mm] the same for a pair that was moved jointly
_MOST_INFLATION = 1.5  # [mm] of either
_PATIENCE = 8  # replans on account of one pair before it is moved jointly
_HELD = 6  # conflicts after which a positioner that was moved jointly may be replanned alone
_RESPECT = (1.5, 0.5, 0.0)  # how much neighbours' paths count, as a pair is moved jointly again and again

SOLVED, SPENT, TOO_SHORT = 0, 1, 2

WORK = np.dtype(
    (
        np.record,
        [
            ("replans", "i8"),  # of single positioners
            ("joint_moves", "i8"),  # of pairs, in vain or not
            ("joint_words", "i8"),  # that they were searched in
            ("short_pair", "i8"),  # that needs more steps than there are
        ],
    )
)


class Search(NamedTuple):
    """What the repair knows; all of it changes."""

    contacts: np.ndarray  #: (pairs,) steps in contact
    weight: np.ndarray  #: (pairs,) float32 price of a step in contact
    limits: np.ndarray  #: (pairs,) clearance that paths are searched with [mm]
    joint_limits: np.ndarray  #: (pairs,) and that joint paths are [mm]
    tries: np.ndarray  #: (pairs,) replans since the pair was last moved jointly
    joined: np.ndarray  #: (pairs,) how often it was
    needs: np.ndarray  #: (pairs,) steps that it needs alone; 0: not asked yet
    held: np.ndarray  #: (n,) conflicts until a positioner may be replanned alone
    open: np.ndarray  #: (pairs,) pairs in contact come first
    place: np.ndarray  #: (pairs,) where a pair is among them, or -1
    touching: np.ndarray  #: (1,) how many are in contact
    work: np.ndarray  #: (1,) WORK: what has been done
    state: np.ndarray  #: (1,) of the random generator


def make_search(n: int, pairs: int, limit: float, seed: int) -> Search:
    """Nothing known yet."""
    return Search(
        contacts=np.zeros(pairs, np.int64),
        weight=np.ones(pairs, np.float32),
        limits=np.full(pairs, limit),
        joint_limits=np.full(pairs, limit),
        tries=np.zeros(pairs, np.int64),
        joined=np.zeros(pairs, np.int64),
        needs=np.zeros(pairs, np.int64),
        held=np.zeros(n, np.int64),
        open=np.zeros(pairs, np.int64),
        place=np.full(pairs, -1),
        touching=np.zeros(1, np.int64),
        work=np.zeros(1, WORK),
        state=np.array([seed], np.uint64),
    )


@leaf
def _note(search, pair, contacts):
    """A pair touches in so many steps."""
    search.contacts[pair] = contacts
    where, last = search.place[pair], search.touching[0] - 1
    if contacts > 0 and where < 0:
        search.open[last + 1], search.place[pair] = pair, last + 1
        search.touching[0] += 1
    elif contacts == 0 and where >= 0:
        moved = search.open[last]
        search.open[where], search.place[moved] = moved, where
        search.place[pair] = -1
        search.touching[0] -= 1


@kernel
def note_all(search):
    """Take the contacts as they are."""
    for pair in range(len(search.contacts)):
        _note(search, pair, search.contacts[pair])


@leaf
def _update_contacts(arms, near, lattice, search, i, limit, steps):
    """Find the contacts of positioner i on its new path; pairs in contact weigh more from now on."""
    for q in range(near.offsets[i], near.offsets[i + 1]):
        j, pair = near.near[q].arm, near.near[q].pair
        touching, ending = all_contacts(arms, lattice, i, j, pair, limit, steps)
        if touching > 0:
            search.weight[pair] += np.float32(_HEAVIER)
            if ending == 0 and search.limits[pair] < limit + _MOST_INFLATION:
                search.limits[pair] += _INFLATION
        _note(search, pair, touching)


@kernel
def place_each(arms, near, lattice, search, scratch, who, steps):
    """Put all of `who` on their cheapest paths past their neighbours' paths; `near` may leave neighbours out."""
    for i in who:
        replan(arms, near, lattice, i, search.weight, search.limits, scratch, EXTENDED, TURN, steps)


@leaf
def _join(arms, near, lattice, search, scratch, pair, i, j, limit, steps):
    """Move a pair jointly; returns False if it needs more steps than there are."""
    variety = min(1.0, 0.2 * search.joined[pair])
    table = table_for(lattice, i, j, pair, search.joint_limits[pair], scratch, steps)
    known, known_for = scratch.clear[table], scratch.clear_for[table]
    for n in range(min(search.joined[pair], len(_RESPECT) - 1), len(_RESPECT)):
        search.work[0].joint_moves += 1
        search.work[0].joint_words += scratch.begins[steps + 1]
        limits, respect = search.limits, _RESPECT[n]
        if move_jointly(
            arms, near, lattice, i, j, known, known_for, limits, respect, variety, scratch, steps, search.state
        ):
            search.joined[pair] += 1
            search.held[i] = search.held[j] = _HELD
            _update_contacts(arms, near, lattice, search, i, limit, steps)
            _update_contacts(arms, near, lattice, search, j, limit, steps)
            if search.contacts[pair] > 0 and search.joint_limits[pair] < limit + _MOST_INFLATION:
                search.joint_limits[pair] += _JOINT_INFLATION
                search.needs[pair] = 0
            return True
    return False


@kernel
def repair(arms, near, lattice, pairs, search, scratch, limit, steps, most):
    """Replan until nothing touches, or `most` times; SOLVED, SPENT, or TOO_SHORT: a pair needs more steps.

    `search.work` says which pair that is.
    """
    for _ in range(most):
        if search.touching[0] == 0:
            return SOLVED
        pair = search.open[int(uniform(search.state) * search.touching[0])]
        i, j = pairs[pair, 0], pairs[pair, 1]
        if uniform(search.state) < 0.5:
            i, j = j, i
        if lattice.fixed[i] or (search.held[i] > 0 and not lattice.fixed[j]):
            if not lattice.fixed[i]:
                search.held[i] -= 1
            i, j = j, i
        search.tries[pair] += 1
        if search.tries[pair] > _PATIENCE and not lattice.fixed[j]:
            search.tries[pair] = 0
            first, second = pairs[pair, 0], pairs[pair, 1]
            late = lattice.delay > 0 and steps_in_contact(arms, lattice.path, first, second, limit, steps)[0] == 0
            if not late and joint_words(lattice, first, second, steps, scratch.begins) <= len(scratch.reach):
                if _join(arms, near, lattice, search, scratch, pair, first, second, limit, steps):
                    continue
                if search.needs[pair] == 0 or search.needs[pair] > steps:
                    search.work[0].short_pair = pair
                    return TOO_SHORT
        search.work[0].replans += 1
        price = 0.25 + 1.5 * uniform(search.state)
        turn = TURN * (0.5 + uniform(search.state))
        replan(arms, near, lattice, i, search.weight, search.limits, scratch, EXTENDED * price, turn, steps)
        _update_contacts(arms, near, lattice, search, i, limit, steps)
    return SOLVED if search.touching[0] == 0 else SPENT


@kernel
def needed_past_fixed(arms, near, lattice, who, scratch, limit, most):
    """For each of `who`, steps needed past those that never move; `most` + 1: more; -1: never, on these lattices."""
    out = np.empty(len(who), np.int64)
    for k in range(len(who)):
        out[k] = steps_past_fixed(arms, near, lattice, who[k], limit, scratch, most)
    return out


@kernel
def needed_alone(arms, near, lattice, pairs, apart, scratch, pair, limit, most):
    """Steps that a pair needs past each other and what never moves, as `steps_alone` says."""
    return steps_alone(arms, near, lattice, pairs[pair, 0], pairs[pair, 1], apart, limit, scratch, most)
