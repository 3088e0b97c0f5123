"""What the greedy walk keeps for each arm, and how one step changes a joint."""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.compile import inlined, record

# What one arm is doing, and what it obeys. Obstacles follow the positioners.
STATE = record(
    [
        ("alpha", "f8"),  # now [rad]; what every turn needs comes first, to share cache lines
        ("beta", "f8"),
        ("folded_alpha", "f8"),  # [rad]
        ("folded_beta", "f8"),
        ("step_alpha", "f8"),  # largest turn of each joint in one loop [rad]
        ("step_beta", "f8"),
        ("travel", "f8"),  # motion bound so far [mm]
        ("wake", "f8"),  # travel up to which the arm need not look at its neighbours [mm]
        ("alpha_before", "f8"),  # at the beginning of the arm's last turn [rad]
        ("beta_before", "f8"),
        ("turn", "i4"),  # loop of the arm's last turn
        ("moved", "f8"),  # motion bound of the arm's last turn [mm]
        ("contrary", "i4"),  # loop until which the arm's ranking is reversed
        ("direction", "i4"),  # code of the last move, to record a knot only where it changes
        ("fresh", "?"),  # its row of `Walk.frames` is that of now
        ("still", "?"),  # does not move any more: folded, held, an obstacle
        ("stride_same", "f8"),  # motion bound of a whole step of both joints, turning the same way [mm]
        ("stride_opposite", "f8"),  # and opposite ways
        ("refused", "f8"),  # sum of the neighbours' travel when the arm last found no move, or -1
        ("blocker", "i4"),  # who last refused the arm its best move, or -1
        ("first", "i4"),  # neighbours in `Walk.near`
        ("last", "i4"),  # one past
        ("bend", "f8"),  # how far a body point's way in one loop can differ from a straight one [mm]
        ("lower_alpha", "f8"),
        ("lower_beta", "f8"),
        ("upper_alpha", "f8"),
        ("upper_beta", "f8"),
    ]
)
KNOT = record([("owner", "i8"), ("loop", "i8"), ("alpha", "f8"), ("beta", "f8")])


class Walk(NamedTuple):
    """Where everything stands; mutable, so that the loop can stop and go on."""

    state: np.ndarray  # (n,) STATE
    frames: np.ndarray  # (n, 8) link frames
    near: np.ndarray  # (2 m,) NEAR
    known: np.ndarray  # (m,) clearance + both travels when the pair was last measured [mm]
    active: np.ndarray  # (n,) positioners not yet folded come first, in order
    knots: np.ndarray  # (k,) KNOT
    counters: np.ndarray  # (4,) loop, active arms, knots, loop of the last progress
    best: np.ndarray  # (1,) least total travel left so far [rad]


class Rules(NamedTuple):
    """What all arms obey."""

    limit: float  # clearance to keep [mm]
    swept: bool  # test moves over the whole step rather than at its end
    skip_noops: bool  # a move that changes nothing is no move
    patience: int  # loops without progress before STALLED


@inlined
def stepped(q, folded, lower, upper, step, sense):
    """Joint angle after one step towards folded (1), away from it (-1) or none (0), clamped [rad]."""
    if sense == 0:
        return q
    if sense > 0:
        return max(q - step, folded) if q > folded else min(q + step, folded)
    up = q > folded or (q == folded and upper - folded >= folded - lower)
    return min(q + step, upper) if up else max(q - step, lower)


@inlined
def turns(me, sense_alpha, sense_beta):
    """How far both joints turn by a move of the ranking (d_alpha, d_beta) [rad]."""
    alpha = stepped(me.alpha, me.folded_alpha, me.lower_alpha, me.upper_alpha, me.step_alpha, sense_alpha)
    beta = stepped(me.beta, me.folded_beta, me.lower_beta, me.upper_beta, me.step_beta, sense_beta)
    return alpha - me.alpha, beta - me.beta


@inlined
def code(da, db, step_a, step_b):
    """Direction of a move as a number that is equal for equal velocities; -1 for a clamped, shorter one."""
    whole_a = da == 0.0 or abs(abs(da) - step_a) <= 1e-9 * step_a
    whole_b = db == 0.0 or abs(abs(db) - step_b) <= 1e-9 * step_b
    if not (whole_a and whole_b):
        return -1
    return 3 * (0 if da == 0.0 else (1 if da > 0.0 else 2)) + (0 if db == 0.0 else (1 if db > 0.0 else 2))


@inlined
def landed(q, folded, lower, upper):
    """A joint angle with rounding at its stops removed, so that arrival is exact [rad]."""
    if abs(q - folded) < 1e-12:
        return folded
    if abs(q - lower) < 1e-12:
        return lower
    if abs(q - upper) < 1e-12:
        return upper
    return q
