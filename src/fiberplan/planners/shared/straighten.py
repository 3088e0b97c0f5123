"""Fewer knots: replace stretches of a positioner's motion by one even move, wherever that provably stays clear.

An even move between two knots takes the time the winding way took, so it is never faster, and it stays within joint
ranges, which are intervals. Only clearance has to be shown, against the neighbours as they move at that time: first
order, like `fiberplan.kernels.sweep`. Positioners are treated one after the other, so each sees its neighbours' final
or original motion, and the result is safe whenever the input was.
"""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.kernels.arms import frame, motion
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import inlined, kernel, leaf, record
from fiberplan.motion import Trajectory
from fiberplan.tolerances import SLACK

KNOT = record([("time", "f8"), ("alpha", "f8"), ("beta", "f8")])
_TOUCH = 1e-5  # [mm] a sample closer than this to the limit refuses the move
_MOST_SAMPLES = 60  # a neighbour that takes more refuses the move


@inlined
def pose(knots, k, last, t):
    """Angles of an arm at time t between its knots k and k + 1; held before the first and after the last."""
    here = knots[k]
    if k + 1 >= last or t <= here.time:
        return here.alpha, here.beta
    after = knots[k + 1]
    part = (t - here.time) / (after.time - here.time)
    return here.alpha + part * (after.alpha - here.alpha), here.beta + part * (after.beta - here.beta)


@inlined
def _speed(arms, knots, j, k, last):
    """Bound on the speed of any body point of arm j between its knots k and k + 1 [mm/s], and when that ends [s]."""
    if k + 1 >= last:
        return 0.0, np.inf
    here, after = knots[k], knots[k + 1]
    step = motion(arms, j, after.alpha - here.alpha, after.beta - here.beta)
    return step / (after.time - here.time), after.time


@leaf
def clear_of(arms, knots, i, a, b, j, first, last, limit, most):
    """Whether arm i, moving evenly from knot a to knot b, keeps `limit` [mm] from arm j, of knots [first, last).

    A sample vouches for as long before and after it as the two could not have used up its clearance. What takes more
    than `most` samples counts as not clear.
    """
    t0, t1 = knots[a].time, knots[b].time
    span = t1 - t0
    da, db = knots[b].alpha - knots[a].alpha, knots[b].beta - knots[a].beta
    mine = motion(arms, i, da, db) / span
    shown, ahead = t0, 0.2 * span
    k = first  # arm j is between its knots k and k + 1 at time `shown`
    for _ in range(most):
        t = min(shown + ahead, t1)
        used = mine * (t - shown)  # by both, from `shown` to t
        at, m = shown, k
        theirs, ends = _speed(arms, knots, j, m, last)
        while ends < t:
            used += theirs * (ends - at)
            at, m = ends, m + 1
            theirs, ends = _speed(arms, knots, j, m, last)
        used += theirs * (t - at)
        s = (t - t0) / span
        alpha_j = beta_j = 0.0
        if first < last:
            alpha_j, beta_j = pose(knots, m, last, t)
        frame_i = frame(arms, i, knots[a].alpha + s * da, knots[a].beta + s * db)
        slack = frames_clearance(arms, i, frame_i, j, frame(arms, j, alpha_j, beta_j)) - limit
        if not (slack >= _TOUCH):
            return False
        if used > slack:
            ahead *= max(0.1, 0.9 * slack / used)
            continue
        shown, k = t, m
        while shown < t1:
            theirs, ends = _speed(arms, knots, j, k, last)
            ends = min(ends, t1)
            if (mine + theirs) * (ends - shown) > slack:
                shown += slack / (mine + theirs)
                break
            slack -= (mine + theirs) * (ends - shown)
            shown = ends
            if k + 1 < last and knots[k + 1].time <= shown:
                k += 1
        if shown >= t1:
            return True
        ahead = shown - t
    return False


@leaf
def first_at(knots, first, last, t):
    """Last of the knots [first, last) that is not after t, or the first."""
    lo, hi = first, last
    while hi - lo > 1:
        mid = (lo + hi) // 2
        if knots[mid].time <= t:
            lo = mid
        else:
            hi = mid
    return lo


@leaf
def _refused_by(arms, knots, offsets, counts, near, i, a, b, place, limit):
    """Place in `near` of the first neighbour that keeps arm i from moving evenly from its knot a to its knot b, or -1.

    The one at `place` is asked first: who refused one move will likely refuse the next.
    """
    first_near, last_near = near.offsets[i], near.offsets[i + 1]
    for n in range(-1, last_near - first_near):
        if n < 0:
            if place < 0:
                continue
            k = place
        else:
            k = first_near + n
            if k == place:
                continue
        j = near.near[k].arm
        first = last = 0
        if j < len(counts):
            last = offsets[j] + counts[j]
            first = first_at(knots, offsets[j], last, knots[a].time)
        if not clear_of(arms, knots, i, a, b, j, first, last, limit, _MOST_SAMPLES):
            return k
    return -1


@kernel
def _straighten(arms, knots, offsets, near, limit, who):
    """Thin out the knots of each of the positioners `who` in place; returns how many are left to every one."""
    counts = offsets[1:] - offsets[:-1]
    for i in who:
        kept = a = offsets[i]
        end = offsets[i] + counts[i] - 1
        refusal = -1
        while a < end:
            b = end
            while b > a + 1:
                refusal = _refused_by(arms, knots, offsets, counts, near, i, a, b, refusal, limit)
                if refusal < 0:
                    break
                b = a + (b - a) // 2
            # the knots between a and b are dropped; those from b on are still where they were
            kept += 1
            knots[kept] = knots[b]
            a = b
        counts[i] = kept - offsets[i] + 1
    return counts


def as_knots(trajectory: Trajectory) -> np.ndarray:
    """All knots as records, to be changed."""
    knots = np.empty(len(trajectory.times), KNOT)
    knots["time"], knots["alpha"], knots["beta"] = trajectory.times, *trajectory.angles.T
    return knots


def straighten(
    plane: FocalPlane,
    trajectory: Trajectory,
    margin: float,
    near: Neighbourhood | None = None,
    who: np.ndarray | None = None,
) -> Trajectory:
    """The same start, end and duration with fewer knots, as safe at `margin` [mm] as the input.

    Only those of the positioners `who` (k,), if given, are thinned out.
    """
    near = near or Neighbourhood.of(plane, margin)
    knots = as_knots(trajectory)
    who = np.arange(trajectory.n) if who is None else who
    counts = _straighten(plane.arms, knots, trajectory.offsets, near, margin + SLACK, who)
    keep = np.arange(len(knots)) - trajectory.offsets[trajectory.owner] < counts[trajectory.owner]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return Trajectory(offsets, knots["time"][keep], np.stack([knots["alpha"], knots["beta"]], axis=1)[keep])
