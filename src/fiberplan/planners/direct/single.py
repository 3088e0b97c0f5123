"""The best path of one positioner through everyone else's motion, conflicts being allowed at a price.

Dynamic programming over (alpha, beta, step): after each step a positioner pays for every neighbour that it touches, a
little for every joint that turned, and a little for standing extended, so that paths retract early and extend late.
"""

import numpy as np

from fiberplan.kernels.compile import inlined, leaf
from fiberplan.planners.direct.blocked_nodes import beta_motion, holds, link_directions, mark_blocked
from fiberplan.planners.direct.lattice import put, window

_NOWHERE = np.float32(np.inf)


@leaf
def _charge(arms, near, lattice, i, weight, limits, scratch, steps):
    """Fill the price of every node after every step: the weights of the neighbours that are touched there."""
    price, blocked, row, trig = scratch.price, scratch.blocked, scratch.row, scratch.trig
    count = lattice.size[i, 1]
    link_directions(arms, lattice, i, trig)
    motion = beta_motion(arms, lattice, i)
    for k in range(steps + 1):
        low, high = window(lattice, i, k, steps)
        for a in range(low, high + 1):
            for b in range(count):
                price[k, a, b] = np.float32(0.0)
    for q in range(near.offsets[i], near.offsets[i + 1]):
        pair = near.near[q].pair
        for k in range(steps + 1):
            low, high = window(lattice, i, k, steps)
            for a in range(low, high + 1):
                blocked[k, a] = np.uint64(0)
        mark_blocked(arms, lattice, i, trig, motion, near.near[q].arm, limits[pair], steps, row, blocked)
        for k in range(1, steps + 1):
            low, high = window(lattice, i, k, steps)
            for a in range(low, high + 1):
                bits = blocked[k, a]
                if bits != np.uint64(0):
                    for b in range(count):
                        if holds(bits, b):
                            price[k, a, b] += weight[pair]


@inlined
def _cheaper(value, best):
    return value if value < best else best


@leaf
def _accumulate(lattice, i, scratch, bias, turn, steps):
    """Fill the least cost of being at each node after each step."""
    price, cost, turned = scratch.price, scratch.cost, scratch.turned_alone
    alphas, betas = lattice.size[i, 0], lattice.size[i, 1]
    for k in range(steps + 1):
        low, high = window(lattice, i, k, steps)
        for a in range(max(low - 1, 0), min(high + 2, alphas)):
            for b in range(betas):
                cost[k, a, b] = _NOWHERE
    cost[0, lattice.first[i, 0], lattice.first[i, 1]] = np.float32(0.0)
    for k in range(steps):
        low, high = window(lattice, i, k, steps)
        for a in range(max(low - 1, 0), min(high + 2, alphas)):
            for b in range(betas):
                turned[a, b] = cost[k, a, b]
            for b in range(1, betas):
                turned[a, b] = _cheaper(cost[k, a, b - 1] + turn, turned[a, b])
            for b in range(betas - 1):
                turned[a, b] = _cheaper(cost[k, a, b + 1] + turn, turned[a, b])
        low_next, high_next = window(lattice, i, k + 1, steps)
        for a in range(low_next, high_next + 1):
            left, right = max(a - 1, max(low - 1, 0)), min(a + 1, min(high + 1, alphas - 1))
            here = min(max(a, left), right)
            for b in range(betas):
                best = turned[here, b] if here == a else turned[here, b] + turn
                best = _cheaper(turned[left, b] + turn, best)
                best = _cheaper(turned[right, b] + turn, best)
                cost[k + 1, a, b] = best + price[k + 1, a, b] + bias[b]


@leaf
def _best_end(lattice, i, cost, steps):
    """The goal, or the cheapest node to end at where there is none."""
    if lattice.last[i, 0] >= 0:
        return lattice.last[i, 0], lattice.last[i, 1]
    a, b = lattice.first[i, 0], lattice.first[i, 1]
    best = cost[steps, a, b]
    low, high = window(lattice, i, steps, steps)
    for x in range(low, high + 1):
        for y in range(lattice.size[i, 1]):
            if cost[steps, x, y] < best:
                best, a, b = cost[steps, x, y], x, y
    return a, b


@leaf
def _trace_back(lattice, i, cost, turn, steps):
    """Put positioner i on its cheapest path."""
    a, b = _best_end(lattice, i, cost, steps)
    put(lattice, i, steps, a, b)
    for k in range(steps - 1, -1, -1):
        low, high = window(lattice, i, k, steps)
        best, best_a, best_b = _NOWHERE, a, b
        for x in range(a - 1, a + 2):
            for y in range(b - 1, b + 2):
                if low <= x <= high and 0 <= y < lattice.size[i, 1]:
                    value = cost[k, x, y] + turn * np.float32(abs(x - a) + abs(y - b))
                    # of equal paths the one that waits
                    if value < best or (value == best and x == a and y == b):
                        best, best_a, best_b = value, x, y
        a, b = best_a, best_b
        put(lattice, i, k, a, b)


@leaf
def replan(arms, near, lattice, i, weight, limits, scratch, extended, turn, steps):
    """Put positioner i on the cheapest path to its goal.

    Args:
        arms: the array.
        near: its neighbour lists.
        lattice: everybody's paths.
        i: the positioner.
        weight: (pairs,) price of touching, per step.
        limits: (pairs,) clearance below which two touch [mm].
        scratch: arrays to work in.
        extended: price of a step at full extension.
        turn: price of a joint's turn by one node.
        steps: of all paths.
    """
    bias = scratch.bias
    rate = extended if lattice.last[i, 0] >= 0 else 0.0
    for b in range(lattice.size[i, 1]):
        bias[b] = np.float32(rate * (0.5 + 0.5 * np.cos(lattice.beta[i, b] + arms.arm[i].beta_zero)))
    _charge(arms, near, lattice, i, weight, limits, scratch, steps)
    price_of_turn = np.float32(turn)
    _accumulate(lattice, i, scratch, bias, price_of_turn, steps)
    _trace_back(lattice, i, scratch.cost, price_of_turn, steps)
