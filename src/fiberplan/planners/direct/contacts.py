"""Which pairs touch on the paths that the lattice holds, in continuous time."""

import numpy as np

from fiberplan.kernels.arms import frame, motion
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.kernels.sweep import swept_clear
from fiberplan.planners.direct.lattice import late_limit


@leaf
def first_contact(arms, path, i, j, limit, first, last):
    """The first step from `first` on in which arms i and j are not shown to keep `limit` [mm]; `last` if none before.

    A clearance vouches for as many steps as the two need to use it up; a step next to contact is swept.
    """
    k = first
    while k < last:
        frame_i = frame(arms, i, path[i, k, 0], path[i, k, 1])
        slack = frames_clearance(arms, i, frame_i, j, frame(arms, j, path[j, k, 0], path[j, k, 1])) - limit
        m = k
        while m < last:
            used = motion(arms, i, path[i, m + 1, 0] - path[i, m, 0], path[i, m + 1, 1] - path[i, m, 1])
            used += motion(arms, j, path[j, m + 1, 0] - path[j, m, 0], path[j, m + 1, 1] - path[j, m, 1])
            if not (slack >= used):
                break
            slack -= used
            m += 1
        if m == k:
            a, b, c, d = path[i, k, 0], path[i, k, 1], path[j, k, 0], path[j, k, 1]
            da, db, dc, dd = path[i, k + 1, 0] - a, path[i, k + 1, 1] - b, path[j, k + 1, 0] - c, path[j, k + 1, 1] - d
            if not swept_clear(arms, i, a, b, da, db, j, c, d, dc, dd, limit, 0.0, 0.0):
                return k
            m = k + 1
        k = m
    return last


@leaf
def steps_in_contact(arms, path, i, j, limit, steps):
    """Number of steps in which arms i and j are not shown to keep `limit` [mm]; how many of those end in contact."""
    touching, ending = 0, 0
    k = first_contact(arms, path, i, j, limit, 0, steps)
    while k < steps:
        touching += 1
        frame_i = frame(arms, i, path[i, k + 1, 0], path[i, k + 1, 1])
        frame_j = frame(arms, j, path[j, k + 1, 0], path[j, k + 1, 1])
        if not (frames_clearance(arms, i, frame_i, j, frame_j) >= limit):
            ending += 1
        k = first_contact(arms, path, i, j, limit, k + 1, steps)
    return touching, ending


@leaf
def late_contacts(arms, lattice, i, j, apart, steps):
    """Number of steps after which arm i is where arm j will be, or was, within `lattice.delay` steps: at nodes only."""
    path, delay, touching = lattice.path, lattice.delay, 0
    if delay == 0:
        return 0
    k = 0
    while k <= steps:
        frame_i = frame(arms, i, path[i, k, 0], path[i, k, 1])
        touches, room, slack = False, 0, np.inf
        for m in range(max(0, k - delay), min(steps, k + delay) + 1):
            if m > max(0, k - delay) and path[j, m, 0] == path[j, m - 1, 0] and path[j, m, 1] == path[j, m - 1, 1]:
                continue
            gap = frames_clearance(arms, i, frame_i, j, frame(arms, j, path[j, m, 0], path[j, m, 1])) - apart
            touches = touches or not gap >= 0.0
            slack = min(slack, gap)
        touching += touches
        while k + room < steps and slack > 0.0:  # what is clear now vouches for as long as the two could not use it up
            here, ahead = k + room, min(steps, k + room + delay)
            slack -= motion(arms, i, path[i, here + 1, 0] - path[i, here, 0], path[i, here + 1, 1] - path[i, here, 1])
            if ahead < steps:
                da, db = path[j, ahead + 1, 0] - path[j, ahead, 0], path[j, ahead + 1, 1] - path[j, ahead, 1]
                slack -= motion(arms, j, da, db)
            room += slack > 0.0
        k += max(room, 1)
    return touching


@leaf
def all_contacts(arms, lattice, i, j, pair, limit, steps):
    """As `steps_in_contact`, and of those that are late; a pair that is in contact for being late only ends in it."""
    touching, ending = steps_in_contact(arms, lattice.path, i, j, limit, steps)
    late = late_contacts(arms, lattice, i, j, late_limit(lattice, pair), steps)
    return touching + late, ending + late


@kernel
def find_contacts(arms, lattice, pairs, which, limit, steps, contacts):
    """Fill `contacts` (pairs,) at pairs `which` (m,): in how many steps they touch; none if neither moves."""
    for p in which:
        i, j = pairs[p, 0], pairs[p, 1]
        contacts[p] = 0
        if not (lattice.fixed[i] and lattice.fixed[j]):
            contacts[p], _ = all_contacts(arms, lattice, i, j, p, limit, steps)
