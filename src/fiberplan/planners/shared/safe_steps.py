"""One simultaneous step of all positioners of which every moment is proven to keep the margin.

A field asks each positioner for a turn; what is granted is that turn, a part of it, or none. Positioners are decided
one after the other, each against the whole motions of those decided before it and against the standing poses of the
rest, so that standing still is safe for whoever is refused, and the simultaneous motion is what was tested. Most tests
are a subtraction: a pair that was c apart is still c less what both have moved since (`travel`). Only where that does
not do is the pair measured, and only where that does not do either is the step swept (`fiberplan.kernels.sweep`).
"""

from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.kernels.arms import motion
from fiberplan.kernels.clearance import clearance
from fiberplan.kernels.compile import leaf, record
from fiberplan.kernels.sweep import swept_clear
from fiberplan.tolerances import SLACK

_LANDING = 1e-4  # [mm] without it, arms end up so close that no bound can show the next small move clear
_HALVINGS = 3  # a step that is refused is tried at half its length, and so on

POSE = record(
    [
        ("alpha", "f8"),  # at the beginning of the step [rad]
        ("beta", "f8"),
        ("wanted_alpha", "f8"),  # what the field asks for in this step [rad]
        ("wanted_beta", "f8"),
        ("granted_alpha", "f8"),  # what it gets [rad]; zero before it is decided
        ("granted_beta", "f8"),
        ("bound", "f8"),  # on the motion of any body point in the granted step [mm]
        ("travel", "f8"),  # sum of those, this step's included [mm]
        ("blocker", "i4"),  # who refused the whole wanted step, or -1
        ("lands", "?"),  # the wanted step ends at its goal, which is clear of all other goals by very little maybe
    ]
)


class Stepping(NamedTuple):
    """Where everything stands; mutable. Obstacles follow the positioners and never move."""

    pose: np.ndarray  # (arms,) POSE
    known: np.ndarray  # (pairs,) clearance + both travels when the pair was last measured [mm]
    limit: float  # clearance to keep [mm]


def stepping(plane: FocalPlane, angles: np.ndarray, margin: float, near: Neighbourhood) -> Stepping:
    """Everyone at rest at `angles` (n, 2) [rad], to be moved at `margin` [mm]."""
    pose = np.zeros(len(plane.arms.arm), POSE)
    pose["alpha"][: plane.n], pose["beta"][: plane.n] = np.asarray(angles, float).T
    pose["blocker"] = -1
    return Stepping(pose, np.full(len(near.pairs), -np.inf), float(margin) + SLACK)


@leaf
def refused_by(arms, near, now, i, da, db, bound, landing):
    """The first neighbour that keeps arm i from turning by (da, db) in this step, or -1.

    `bound` is on the motion of that turn [mm]; the step must end `landing` [mm] clearer than the limit, or no nearer
    than it began.
    """
    me = now.pose[i]
    for k in range(near.offsets[i], near.offsets[i + 1]):
        j, p = near.near[k].arm, near.near[k].pair
        other = now.pose[j]
        before = me.travel - me.bound
        if now.known[p] - (before + bound) - other.travel >= now.limit + landing:
            continue
        far = clearance(arms, i, me.alpha, me.beta, j, other.alpha, other.beta)
        now.known[p] = far + before + (other.travel - other.bound)
        used = bound + other.bound
        if far - used >= now.limit + landing:
            continue
        shown = min(max(0.0, (far - now.limit) / used), 1.0)
        c, d, dc, dd = other.alpha, other.beta, other.granted_alpha, other.granted_beta
        if not swept_clear(arms, i, me.alpha, me.beta, da, db, j, c, d, dc, dd, now.limit, shown, landing):
            return j
    return -1


@leaf
def grant(arms, near, now, i):
    """Decide the step of arm i: what it wants, or a half of that, and so on, or nothing; True if it moves."""
    me = now.pose[i]
    da, db = me.wanted_alpha, me.wanted_beta
    me.blocker = -1
    for halving in range(_HALVINGS + 1):
        bound = motion(arms, i, da, db)
        if bound == 0.0:
            return False
        landing = 0.0
        if not (me.lands and halving == 0):
            arm = arms.arm[i]
            both = da + db
            landing = _LANDING + (arm.length * da * da + arm.reach_beta * both * both) / 4.0  # room to slide along
        refusal = refused_by(arms, near, now, i, da, db, bound, landing)
        if refusal < 0:
            me.granted_alpha, me.granted_beta = da, db
            me.bound = bound
            me.travel += bound
            return True
        if halving == 0:
            me.blocker = refusal
        da *= 0.5
        db *= 0.5
    return False


@leaf
def room_of(near, now, i):
    """How much clearer than the limit arm i is known to be of everyone, all through this step as granted [mm]."""
    smallest = np.inf
    for k in range(near.offsets[i], near.offsets[i + 1]):
        smallest = min(smallest, now.known[near.near[k].pair] - now.pose[near.near[k].arm].travel)
    return smallest - now.pose[i].travel - now.limit


@leaf
def take(now, i):
    """Arm i makes its granted step: the next one begins where this one ends."""
    me = now.pose[i]
    me.alpha += me.granted_alpha
    me.beta += me.granted_beta
    me.granted_alpha = me.granted_beta = me.bound = 0.0
