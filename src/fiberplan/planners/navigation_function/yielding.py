"""Who gives way when two are in each other's way: the one of lower rank makes room until the other has arrived.

A positioner that asks for a turn and hardly gets it for a few steps looks at who is ahead. Those that have arrived,
or rank lower, go towards their bases and come back when it has arrived; to one that ranks higher and comes its way it
gives way itself. One that had to ask someone who had arrived ranks above all from then on, so that the two do not
push each other out in turn. Where that does not help it goes home itself and comes out anew, on the other elbow side
where its goal has one.
"""

import numpy as np

from fiberplan.kernels.compile import inlined, leaf
from fiberplan.planners.navigation_function.descent import wake
from fiberplan.planners.navigation_function.fiber_ends import through_joints
from fiberplan.planners.navigation_function.retract_profile import home_of, postponed

PATIENCE = 4  # steps without progress before anyone is asked
YIELD = 150  # steps after which room is no longer made
AHEAD = 1.0  # [mm] beyond d, within which a neighbour can be in the way
_PROGRESS = 0.4  # a step that turns less than this part of what was asked is none
_AGAIN = 4  # stalls after which it starts anew in any case
_THERE = 1e-9  # [rad]


@inlined
def at_goal(end, pose):
    """Whether a positioner is where it should end, or may end anywhere."""
    return np.isnan(end.goal_alpha) or (
        abs(end.goal_alpha - pose.alpha) < _THERE and abs(end.goal_beta - pose.beta) < _THERE
    )


@leaf
def _ask_for_room(ends, now, ways, crowd, reach, i, step, top):
    """Ask those ahead of arm i to make room, or give way to one of them; True if all that were asked do already."""
    me, mine = ends.end[i], ways[i]
    already = asked = 0
    for k in range(ends.offsets[i], ends.offsets[i + 1]):
        j = ends.near[k].arm
        other, theirs = ends.end[j], ways[j]
        sx, sy = me.x - other.x, me.y - other.y
        x = np.hypot(sx, sy)
        refused = now.pose[i].blocker == j
        ga, gb = through_joints(me, sx / x, sy / x)
        if not refused and (x > reach or mine.turn_alpha * ga + mine.turn_beta * gb >= 0.0):
            continue
        if theirs.yields_to == i:
            theirs.until = step + YIELD
            already += 1
        elif theirs.arrived or theirs.rank < mine.rank:
            if mine.yields_to == j:
                continue
            if theirs.arrived and theirs.own_rank > mine.own_rank:
                top[0] += 1.0
                mine.own_rank = mine.rank = top[0]
            theirs.yields_to, theirs.until = i, step + YIELD
            theirs.rank = mine.rank - 1e-6
            theirs.arrived = False
            crowd.restless[j] = True
            wake(crowd, j)
            asked += 1
        elif mine.yields_to < 0:
            ha, hb = through_joints(other, -sx / x, -sy / x)
            if theirs.turn_alpha * ha + theirs.turn_beta * hb < 0.0:  # it comes this way
                mine.yields_to, mine.until = j, step + YIELD
    return asked == 0 and already > 0


@leaf
def keep_order(ends, now, ways, crowd, reach, i, step, top):
    """What arm i makes of the step that it got: arrived, no longer yielding, or stalled."""
    end, pose, way = ends.end[i], now.pose[i], ways[i]
    if way.yields_to >= 0 and (step >= way.until or ways[way.yields_to].arrived):
        way.yields_to, way.stalled = -1, 0
        way.rank = way.own_rank
        if not np.isnan(end.goal_alpha):
            longest = max(
                abs(end.goal_alpha - pose.alpha) / end.most_alpha, abs(end.goal_beta - pose.beta) / end.most_beta
            )
            way.due = max(way.due, step + longest)
    if way.yields_to < 0:
        way.arrived = at_goal(end, pose)
        crowd.restless[i] = not way.arrived
        if way.arrived:
            way.stalled = 0
            way.rank = way.own_rank
            return
    asked_alpha, asked_beta = way.turn_alpha / end.most_alpha, way.turn_beta / end.most_beta
    got_alpha, got_beta = (pose.alpha - way.was_alpha) / end.most_alpha, (pose.beta - way.was_beta) / end.most_beta
    asked2 = asked_alpha * asked_alpha + asked_beta * asked_beta
    if asked2 > 1e-6:
        stalls = asked_alpha * got_alpha + asked_beta * got_beta < _PROGRESS * asked2
        way.stalled = way.stalled + 1 if stalls else max(0, way.stalled - 1)
    if way.stalled < PATIENCE:
        return
    in_vain = _ask_for_room(ends, now, ways, crowd, reach, i, step, top)
    way.stalled = 0
    way.stalls += 1
    if way.yields_to < 0 and not np.isnan(end.goal_alpha) and (in_vain or way.stalls % _AGAIN == 0):
        if not np.isnan(way.other_alpha) and home_of(end, end.goal_beta) != home_of(end, pose.beta):
            end.goal_alpha, way.other_alpha = way.other_alpha, end.goal_alpha
            end.goal_beta, way.other_beta = way.other_beta, end.goal_beta
        way.due = postponed(end, way, pose.alpha, pose.beta, step)
