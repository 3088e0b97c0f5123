"""The best path of one positioner through everyone else's motion, conflicts being allowed at a price.

Dynamic programming over (alpha, beta, step): after each step a positioner pays for every neighbour that it touches, a
little for every joint that turned, and a little for standing extended, so that paths retract early and extend late.
"""

import numpy as np

from fiberplan.kernels.compile import inlined, leaf
from fiberplan.planners.direct.blocked_nodes import beta_motion, holds, link_directions
from fiberplan.planners.direct.lattice import put, window
from fiberplan.planners.direct.remembered import blocked_cells

_NOWHERE = np.float32(np.inf)


@inlined
def _alphas(near, lattice, i):
    """First and last alpha node that the cheapest path may have: where nobody is near, it does not turn back."""
    first, last = lattice.first[i, 0], lattice.last[i, 0]
    if near.offsets[i] < near.offsets[i + 1]:
        return 0, lattice.size[i, 0] - 1
    return (min(first, last), max(first, last)) if last >= 0 else (first, first)


@inlined
def _within(lattice, i, k, steps, alphas):
    """As `window`, of the first and last of `alphas`."""
    low, high = window(lattice, i, k, steps)
    return max(low, alphas[0]), min(high, alphas[1])


@leaf
def _charge(arms, near, lattice, i, weight, limits, scratch, alphas, steps):
    """Fill the price of every node after every step: the weights of the neighbours that are touched there."""
    price, row, trig, known = scratch.price, scratch.row, scratch.trig, scratch.known
    count = lattice.size[i, 1]
    for k in range(steps + 1):
        low, high = _within(lattice, i, k, steps, alphas)
        for a in range(low, high + 1):
            for b in range(count):
                price[k, a, b] = np.float32(0.0)
    if near.offsets[i] == near.offsets[i + 1]:
        return
    link_directions(arms, lattice, i, trig)
    motion = beta_motion(arms, lattice, i)
    for q in range(near.offsets[i], near.offsets[i + 1]):
        pair = near.near[q].pair
        begin, end = blocked_cells(arms, near, lattice, i, q, trig, motion, limits[pair], steps, row, known)
        for c in range(begin, end):
            k, a, bits = known.cells[c].step, known.cells[c].alpha, known.cells[c].betas
            for b in range(count):
                if holds(bits, b):
                    price[k, a, b] += weight[pair]


@inlined
def _cheaper(value, best):
    return value if value < best else best


@leaf
def _turn_betas(cost, turned, betas, pace, turn):
    """Fill a row `turned` (B,): the least cost of being at each beta node after one of at most `pace` nodes before."""
    for b in range(betas):
        turned[b] = cost[b]
    for d in range(1, pace + 1):
        price = np.float32(d) * turn
        for b in range(d, betas):
            turned[b] = _cheaper(cost[b - d] + price, turned[b])
        for b in range(betas - d):
            turned[b] = _cheaper(cost[b + d] + price, turned[b])


@leaf
def _accumulate(lattice, i, scratch, bias, turn, alphas, steps):
    """Fill the least cost of being at each node after each step; `turn` is the price of a whole step's, per joint."""
    price, cost, turned = scratch.price, scratch.cost, scratch.turned_alone
    betas = lattice.size[i, 1]
    pace_a, pace_b = lattice.pace[i, 0], lattice.pace[i, 1]
    turn_a, turn_b = turn / np.float32(pace_a), turn / np.float32(pace_b)
    low, high = _within(lattice, i, 0, steps, alphas)
    for a in range(low, high + 1):
        for b in range(betas):
            cost[0, a, b] = _NOWHERE
    cost[0, lattice.first[i, 0], lattice.first[i, 1]] = np.float32(0.0)
    for k in range(steps):
        for a in range(low, high + 1):
            _turn_betas(cost[k, a], turned[a], betas, pace_b, turn_b)
        low_next, high_next = _within(lattice, i, k + 1, steps, alphas)
        for a in range(low_next, high_next + 1):
            after = cost[k + 1, a]
            for b in range(betas):
                after[b] = _NOWHERE
            for x in range(max(a - pace_a, low), min(a + pace_a, high) + 1):
                turning = np.float32(abs(x - a)) * turn_a
                for b in range(betas):
                    after[b] = _cheaper(turned[x, b] + turning, after[b])
            for b in range(betas):
                after[b] += price[k + 1, a, b] + bias[b]
        low, high = low_next, high_next


@leaf
def _best_end(lattice, i, cost, alphas, steps):
    """The goal, or the cheapest node to end at where there is none."""
    if lattice.last[i, 0] >= 0:
        return lattice.last[i, 0], lattice.last[i, 1]
    a, b = lattice.first[i, 0], lattice.first[i, 1]
    best = cost[steps, a, b]
    low, high = _within(lattice, i, steps, steps, alphas)
    for x in range(low, high + 1):
        for y in range(lattice.size[i, 1]):
            if cost[steps, x, y] < best:
                best, a, b = cost[steps, x, y], x, y
    return a, b


@leaf
def _trace_back(lattice, i, cost, turn, alphas, steps):
    """Put positioner i on its cheapest path."""
    a, b = _best_end(lattice, i, cost, alphas, steps)
    pace_a, pace_b = lattice.pace[i, 0], lattice.pace[i, 1]
    turn_a, turn_b = turn / np.float32(pace_a), turn / np.float32(pace_b)
    put(lattice, i, steps, a, b)
    for k in range(steps - 1, -1, -1):
        low, high = _within(lattice, i, k, steps, alphas)
        best, best_a, best_b = _NOWHERE, a, b
        for x in range(max(a - pace_a, low), min(a + pace_a, high) + 1):
            for y in range(max(b - pace_b, 0), min(b + pace_b, lattice.size[i, 1] - 1) + 1):
                value = cost[k, x, y] + turn_a * np.float32(abs(x - a)) + turn_b * np.float32(abs(y - b))
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
        turn: price of a joint's turn in one step at full speed.
        steps: of all paths.
    """
    bias = scratch.bias
    rate = extended if lattice.last[i, 0] >= 0 else 0.0
    for b in range(lattice.size[i, 1]):
        bias[b] = np.float32(rate * (0.5 + 0.5 * np.cos(lattice.beta[i, b] + arms.arm[i].beta_zero)))
    alphas = _alphas(near, lattice, i)
    _charge(arms, near, lattice, i, weight, limits, scratch, alphas, steps)
    price_of_turn = np.float32(turn)
    _accumulate(lattice, i, scratch, bias, price_of_turn, alphas, steps)
    _trace_back(lattice, i, scratch.cost, price_of_turn, alphas, steps)
