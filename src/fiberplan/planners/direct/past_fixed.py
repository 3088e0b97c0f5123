"""What never moves: the nodes of a positioner that it blocks, and the steps that a positioner needs past it."""

import numpy as np

from fiberplan.kernels.arms import frame
from fiberplan.kernels.compile import leaf
from fiberplan.planners.direct.blocked_nodes import beta_motion, bit, blocked_betas, holds, link_directions

_NONE = np.uint64(0)
_ONE = np.uint64(1)


@leaf
def is_stationary(lattice, j):
    """True if arm j is fixed and its path never leaves its start."""
    if not lattice.fixed[j]:
        return False
    for k in range(1, lattice.path.shape[1]):
        if lattice.path[j, k, 0] != lattice.path[j, 0, 0] or lattice.path[j, k, 1] != lattice.path[j, 0, 1]:
            return False
    return True


@leaf
def mark_blocked_by_stationary(arms, near, lattice, i, trig, limit, row):
    """Fill `row` (A,) with the nodes of positioner i that arms which never move block; its start and goal are not."""
    motion = beta_motion(arms, lattice, i)
    for a in range(lattice.size[i, 0]):
        row[a] = _NONE
    for q in range(near.offsets[i], near.offsets[i + 1]):
        j = near.near[q].arm
        if is_stationary(lattice, j):
            frame_j = frame(arms, j, lattice.path[j, 0, 0], lattice.path[j, 0, 1])
            for a in range(lattice.size[i, 0]):
                row[a] |= blocked_betas(arms, lattice, i, a, trig, motion, j, frame_j, limit, _NONE)
    row[lattice.first[i, 0]] &= ~bit(lattice.first[i, 1])
    if lattice.last[i, 0] >= 0:
        row[lattice.last[i, 0]] &= ~bit(lattice.last[i, 1])


@leaf
def steps_past_fixed(arms, near, lattice, i, limit, scratch, most):
    """Steps that positioner i needs past those that never move, if nobody else were there; -1 if it never gets there.

    At most `most` are tried; `most + 1` says that it takes more.
    """
    trig, reached, row = scratch.trig, scratch.blocked, scratch.row
    link_directions(arms, lattice, i, trig)
    alphas, betas = lattice.size[i, 0], lattice.size[i, 1]
    every = ~_NONE if betas == 64 else bit(betas) - _ONE
    mark_blocked_by_stationary(arms, near, lattice, i, trig, limit, row)
    for a in range(alphas):
        row[a] = every & ~row[a]
        reached[0, a] = _NONE
    goal_a, goal_b = lattice.last[i, 0], lattice.last[i, 1]
    reached[0, lattice.first[i, 0]] = bit(lattice.first[i, 1])
    pace_a, pace_b = lattice.pace[i, 0], lattice.pace[i, 1]
    pace = max(pace_a, pace_b)
    here = 0
    for k in range(most + 1):
        grown = False
        for part in range(pace):  # node by node, so that none that is blocked is passed over
            if holds(reached[here, goal_a], goal_b):
                return k + (part > 0)
            there, aside = 1 - here, part < pace_a
            for a in range(alphas):
                bits = _NONE
                for x in range(max(a - aside, 0), min(a + aside, alphas - 1) + 1):
                    bits |= reached[here, x]
                if part < pace_b:
                    bits |= (bits << _ONE) | (bits >> _ONE)
                bits = (bits & row[a]) | reached[here, a]
                grown = grown or bits != reached[here, a]
                reached[there, a] = bits
            here = there
        if not grown:
            return -1
    return most + 1
