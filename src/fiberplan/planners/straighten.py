"""Fewer knots: replace stretches of a positioner's motion by one even move, wherever that provably stays clear.

An even move between two knots takes the time the winding way took, so it is never faster, and it stays within joint
ranges, which are intervals. Only clearance has to be shown, against the neighbours as they move at that time: first
order, like `fiberplan.kernels.sweep`. Positioners are treated one after the other, so each sees its neighbours' final
or original motion, and the result is safe whenever the input was.
"""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import frame, motion
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.kernels.sweep import SLACK
from fiberplan.neighbourhood import Neighbourhood
from fiberplan.trajectory import Trajectory

KNOT = np.dtype([("time", "f8"), ("alpha", "f8"), ("beta", "f8")], align=True)
_TOUCH = 1e-5  # [mm] a sample closer than this to the limit refuses the move
_MOST_SAMPLES = 60  # a neighbour that takes more refuses the move


@leaf
def _clear_of(arms, knots, i, a, b, j, first, last, limit):
    """Whether arm i, moving evenly from knot a to knot b, keeps `limit` [mm] from arm j and its knots [first, last)."""
    t0, t1 = knots[a].time, knots[b].time
    span = t1 - t0
    da, db = knots[b].alpha - knots[a].alpha, knots[b].beta - knots[a].beta
    mine = motion(arms, i, da, db) / span
    t = t0
    k = first  # j moves from knot k to knot k + 1
    for _ in range(_MOST_SAMPLES):
        s = (t - t0) / span
        frame_i = frame(arms, i, knots[a].alpha + s * da, knots[a].beta + s * db)
        alpha_j = beta_j = 0.0
        if first < last:
            while k + 1 < last and knots[k + 1].time <= t:
                k += 1
            alpha_j, beta_j = knots[k].alpha, knots[k].beta
            if k + 1 < last and t > knots[k].time:
                part = (t - knots[k].time) / (knots[k + 1].time - knots[k].time)
                alpha_j += part * (knots[k + 1].alpha - alpha_j)
                beta_j += part * (knots[k + 1].beta - beta_j)
        slack = frames_clearance(arms, i, frame_i, j, frame(arms, j, alpha_j, beta_j)) - limit
        if not (slack >= _TOUCH):
            return False
        # use the slack up, interval by interval of j's motion
        while t < t1:
            until, theirs = t1, 0.0
            if k + 1 < last:
                until = min(t1, knots[k + 1].time)
                step = motion(arms, j, knots[k + 1].alpha - knots[k].alpha, knots[k + 1].beta - knots[k].beta)
                theirs = step / (knots[k + 1].time - knots[k].time)
            used = (mine + theirs) * (until - t)
            if used > slack:
                t += slack / (mine + theirs)
                break
            slack -= used
            t = until
            if k + 1 < last and knots[k + 1].time <= t:
                k += 1
        if t >= t1:
            return True
    return False


@leaf
def _first_at(knots, first, last, t):
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
            first = _first_at(knots, offsets[j], last, knots[a].time)
        if not _clear_of(arms, knots, i, a, b, j, first, last, limit):
            return k
    return -1


@kernel
def _straighten(arms, knots, offsets, near, limit):
    """Thin out the knots of each positioner in place; returns how many are left to each."""
    counts = offsets[1:] - offsets[:-1]
    for i in range(len(counts)):
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


def straighten(
    plane: FocalPlane, trajectory: Trajectory, margin: float, near: Neighbourhood | None = None
) -> Trajectory:
    """The same start, end and duration with fewer knots, as safe at `margin` [mm] as the input."""
    near = near or Neighbourhood.of(plane, margin)
    knots = np.empty(len(trajectory.times), KNOT)
    knots["time"], knots["alpha"], knots["beta"] = trajectory.times, *trajectory.angles.T
    counts = _straighten(plane.arms, knots, trajectory.offsets, near, margin + SLACK)
    keep = np.arange(len(knots)) - np.repeat(trajectory.offsets[:-1], np.diff(trajectory.offsets))
    keep = keep < np.repeat(counts, np.diff(trajectory.offsets))
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return Trajectory(offsets, knots["time"][keep], np.stack([knots["alpha"], knots["beta"]], axis=1)[keep])
