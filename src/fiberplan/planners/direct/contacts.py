"""Which pairs touch on the paths that the lattice holds, in continuous time."""

from fiberplan.kernels.arms import frame, motion
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.kernels.sweep import swept_clear


@leaf
def steps_in_contact(arms, path, i, j, limit, steps):
    """Number of steps in which arms i and j are not shown to keep `limit` [mm], and how many of those end in contact.

    A clearance vouches for as many steps as the two need to use it up; a step next to contact is swept.
    """
    touching, ending = 0, 0
    k = 0
    while k < steps:
        frame_i = frame(arms, i, path[i, k, 0], path[i, k, 1])
        slack = frames_clearance(arms, i, frame_i, j, frame(arms, j, path[j, k, 0], path[j, k, 1])) - limit
        m = k
        while m < steps:
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
                touching += 1
                frame_i = frame(arms, i, path[i, k + 1, 0], path[i, k + 1, 1])
                frame_j = frame(arms, j, path[j, k + 1, 0], path[j, k + 1, 1])
                if not (frames_clearance(arms, i, frame_i, j, frame_j) >= limit):
                    ending += 1
            m = k + 1
        k = m
    return touching, ending


@kernel
def contacts_of_all(arms, lattice, pairs, limit, steps, contacts):
    """Fill `contacts` (pairs,): in how many steps each pair touches; pairs of which none moves are left alone."""
    for p in range(len(pairs)):
        i, j = pairs[p, 0], pairs[p, 1]
        contacts[p] = 0
        if not (lattice.fixed[i] and lattice.fixed[j]):
            contacts[p], _ = steps_in_contact(arms, lattice.path, i, j, limit, steps)
