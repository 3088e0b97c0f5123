"""The compiled loop of the greedy fold: every arm in turn takes the first move of its ranking that touches nothing.

Two things make it fast. An arm that has moved m since it was c away from a neighbour is still c - m away at least, so
each arm carries an allowance up to which it need not look at all (`wake`), and each pair the sum at which it was last
measured (`known`). And a loop costs nothing for arms that are already folded.

Arms move in turn but the recorded motion is simultaneous. So the arm that moves later tests its move against the
motions that arms before it make in the same loop, and against the standing poses of those after it; standing still is
then always safe, and the simultaneous motion is what was tested.
"""

import numpy as np

from fiberplan.kernels.arms import frame, motion
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import inlined, kernel, leaf
from fiberplan.kernels.sweep import swept_clear
from fiberplan.planners.greedy_fold.walk_state import code, landed, turns

FOLDED, STUCK, STALLED, FULL, EXHAUSTED = 0, 1, 2, 3, 4
"""Why the loop ended: all folded; nothing can move any more; no progress; no room for knots; no loops left."""

_LANDING = 1e-4  # [mm] without it, arms end up so close that no bound can show the next small move clear

# Sayres2021's ranking for (alpha, beta): 1 towards folded, -1 away, 0 hold
RANKING = np.array([[1, 1], [0, 1], [-1, 1], [1, 0], [-1, 0], [1, -1], [0, -1], [-1, -1]])
RANKING.setflags(write=False)


@inlined
def _frame(arms, walk, i):
    """Frames of arm i now, computed when first asked for after it moved."""
    me = walk.state[i]
    row = walk.frames[i]
    if not me.fresh:
        bx, by, ex, ey, c1, s1, c2, s2, _, _, _, _ = frame(arms, i, me.alpha, me.beta)
        row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7] = bx, by, ex, ey, c1, s1, c2, s2
        me.fresh = True
    return row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], 0.0, 0.0, 0.0, 0.0  # two links only


@leaf
def _look_around(arms, walk, rules, i, loop, room, measured):
    """Fill `room` with how far arm i stands from each neighbour during this loop, at least [mm].

    Neighbours are measured nearest first, by what is known from the last look, and only until the nearest of all is a
    measured one: what is farther may stay a lower bound.
    """
    me = walk.state[i]
    count = me.last - me.first
    for k in range(count):
        near = walk.near[me.first + k]
        room[k] = walk.known[near.pair] - me.travel - walk.state[near.arm].travel - rules.limit
        measured[k] = False
    while count > 0:
        nearest = 0
        for k in range(1, count):
            if room[k] < room[nearest]:
                nearest = k
        if measured[nearest]:
            return
        j, p = walk.near[me.first + nearest].arm, walk.near[me.first + nearest].pair
        far = frames_clearance(arms, i, _frame(arms, walk, i), j, _frame(arms, walk, j))
        if walk.state[j].turn == loop:
            far -= walk.state[j].moved  # j moves in this same loop: earlier in it, it was this much elsewhere
        walk.known[p] = far + me.travel + walk.state[j].travel
        room[nearest], measured[nearest] = far - rules.limit, True


@leaf
def _share_room(walk, i, bound, room):
    """Set how far arm i may travel before it looks again, and see that its neighbours do not count on that room.

    It takes half of the room left to a neighbour that may move too, all of it where the neighbour is done.
    """
    me = walk.state[i]
    share = np.inf
    for k in range(me.last - me.first):
        left = max(0.0, room[k] - bound)
        share = min(share, left if walk.state[walk.near[me.first + k].arm].still else 0.5 * left)
    for k in range(me.last - me.first):
        other = walk.state[walk.near[me.first + k].arm]
        other.wake = min(other.wake, other.travel + max(0.0, room[k] - bound) - share)
    me.wake = me.travel + bound + share


@leaf
def _quiet(walk, i, loop):
    """A sum that changes when any neighbour of arm i moves, or -1 if one has moved in this loop already."""
    me = walk.state[i]
    total = 0.0
    for k in range(me.first, me.last):
        other = walk.state[walk.near[k].arm]
        if other.turn == loop and other.moved > 0.0:
            return -1.0
        total += other.travel
    return total


@leaf
def _refused_by(arms, walk, rules, i, loop, da, db, bound, room):
    """The first neighbour that a move of arm i would come too close to, or -1."""
    me = walk.state[i]
    for k in range(me.last - me.first):
        if room[k] >= bound:
            continue
        j = walk.near[me.first + k].arm
        other = walk.state[j]
        if rules.swept:
            c, d, dc, dd = other.alpha, other.beta, 0.0, 0.0
            if other.turn == loop:
                dc, dd = c - other.alpha_before, d - other.beta_before
                c, d = other.alpha_before, other.beta_before
            shown = max(0.0, room[k] / bound)  # room is of all of this loop: only the arm's own motion uses it up
            landing = _LANDING + me.bend + other.bend  # far enough away that both can slide along each other next
            if not swept_clear(arms, i, me.alpha, me.beta, da, db, j, c, d, dc, dd, rules.limit, shown, landing):
                return j
        else:
            gap = frames_clearance(arms, i, frame(arms, i, me.alpha + da, me.beta + db), j, _frame(arms, walk, j))
            if not (gap >= rules.limit):
                return j
    return -1


@leaf
def _choose(arms, walk, rules, i, loop, room, measured):
    """The move of arm i in this loop: (d_alpha, d_beta) [rad] and its motion bound [mm]; zeros to stand still."""
    me = walk.state[i]
    contrary = loop < me.contrary
    if me.refused >= 0.0 and not contrary and _quiet(walk, i, loop) == me.refused:
        return 0.0, 0.0, 0.0  # refused before, and nothing around it has moved since
    me.refused = -1.0
    looked = False
    first_refusal = -1
    for rank in range(len(RANKING)):
        place = len(RANKING) - 1 - rank if contrary else rank
        da, db = turns(me, RANKING[place, 0], RANKING[place, 1])
        if da == 0.0 and db == 0.0:
            if rules.skip_noops:
                continue
            break
        bound = motion(arms, i, da, db)
        if not looked:
            if me.travel + bound <= me.wake:
                return da, db, bound
            _look_around(arms, walk, rules, i, loop, room, measured)
            looked = True
        refusal = _refused_by(arms, walk, rules, i, loop, da, db, bound, room)
        if refusal < 0:
            _share_room(walk, i, bound, room)
            return da, db, bound
        if first_refusal < 0:
            first_refusal = me.blocker = refusal
    if looked:
        _share_room(walk, i, 0.0, room)
        me.refused = _quiet(walk, i, loop)
    return 0.0, 0.0, 0.0


@inlined
def _record(walk, i, loop):
    """A knot where arm i stands now."""
    knot = walk.knots[walk.counters[2]]
    knot.owner, knot.loop = i, loop
    knot.alpha, knot.beta = walk.state[i].alpha, walk.state[i].beta
    walk.counters[2] += 1


@inlined
def _best_move(arms, i, me):
    """The first move of the ranking, both joints towards folded: (d_alpha, d_beta) [rad] and its motion bound [mm]."""
    da, db = turns(me, 1, 1)
    if abs(me.alpha - me.folded_alpha) > me.step_alpha and abs(me.beta - me.folded_beta) > me.step_beta:
        return da, db, me.stride_same if (da > 0.0) == (db > 0.0) else me.stride_opposite
    return da, db, motion(arms, i, da, db)


@inlined
def _advance(arms, walk, rules, i, loop, room, measured):
    """Arm i takes its turn; returns the travel that is left to it [rad] and whether it moved."""
    me = walk.state[i]
    da, db, bound = _best_move(arms, i, me)
    if loop < me.contrary or me.travel + bound > me.wake:
        da, db, bound = _choose(arms, walk, rules, i, loop, room, measured)
    direction = code(da, db, me.step_alpha, me.step_beta)
    if direction != me.direction or direction < 0:
        _record(walk, i, loop)
        me.direction = direction
    me.alpha_before, me.beta_before = me.alpha, me.beta
    me.turn, me.moved = loop, bound
    moved = da != 0.0 or db != 0.0
    if moved:
        me.alpha = landed(me.alpha + da, me.folded_alpha, me.lower_alpha, me.upper_alpha)
        me.beta = landed(me.beta + db, me.folded_beta, me.lower_beta, me.upper_beta)
        me.travel += bound
        me.fresh = False
    return abs(me.alpha - me.folded_alpha) + abs(me.beta - me.folded_beta), moved


@leaf
def begin(walk):
    """Take the arms that are folded to begin with off the active list."""
    kept = 0
    for k in range(walk.counters[1]):
        me = walk.state[walk.active[k]]
        if me.alpha == me.folded_alpha and me.beta == me.folded_beta:
            me.still = True
        else:
            walk.active[kept] = walk.active[k]
            kept += 1
    walk.counters[1] = kept


@kernel
def run(arms, walk, rules, last_loop):
    """Walk until folded, stuck, stalled, out of room for knots or at `last_loop`; returns which."""
    widest = 0
    for me in walk.state:
        widest = max(widest, me.last - me.first)
    room, measured = np.empty(widest), np.empty(widest, np.bool_)
    begin(walk)
    while walk.counters[1] > 0:
        loop = walk.counters[0]
        if walk.counters[2] + 2 * walk.counters[1] > len(walk.knots):
            return FULL
        if loop >= last_loop:
            return EXHAUSTED
        anyone = False
        left = 0.0
        kept = 0
        for k in range(walk.counters[1]):
            i = walk.active[k]
            away, moved = _advance(arms, walk, rules, i, loop, room, measured)
            anyone = anyone or moved
            if away == 0.0:
                _record(walk, i, loop + 1)
                walk.state[i].still = True
            else:
                walk.active[kept] = i
                kept += 1
                left += away
        walk.counters[0], walk.counters[1] = loop + 1, kept
        if kept > 0 and not anyone:
            return STUCK
        if left < walk.best[0] - 1e-9:
            walk.best[0], walk.counters[3] = left, loop
        elif kept > 0 and loop - walk.counters[3] >= rules.patience:
            return STALLED
    return FOLDED
