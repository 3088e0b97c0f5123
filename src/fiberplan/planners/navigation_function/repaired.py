"""The repaired mode: attraction by way of home (`retract_profile`), turns (`rehearsal`), repulsion that spares goals.

Printed, repulsion is weighed against attraction, so two goals nearer than its range are never quite reached. Here it
does not pull: it takes from what attraction asks for what would bring two ends nearer than half of what is left between
them, which slides them along each other, and near its goal a positioner lands at once. One that ranks lower also makes
some room while a higher one is close.
"""

import numpy as np

from fiberplan.kernels.compile import kernel, leaf
from fiberplan.planners.navigation_function.descent import CONVERGED, EXHAUSTED, FULL, advance
from fiberplan.planners.navigation_function.fiber_ends import through_joints
from fiberplan.planners.navigation_function.retract_profile import heading
from fiberplan.planners.navigation_function.yielding import AHEAD, keep_order
from fiberplan.planners.shared.step_limits import limited, within

_CLOSE = 0.3  # [mm] beyond d, within which one of lower rank makes room ...
_ROOM = 0.02  # [mm] ... by this much a step
_SPARE = 1e-3  # [mm] two ends slow down towards this much beyond d
_PASSES = 2  # over the neighbours: giving way to one may go towards another


@leaf
def _ask(ends, now, ways, weights, i, step):
    """What arm i asks for in this step: its attraction less what comes too near to others."""
    me, pose, way = ends.end[i], now.pose[i], ways[i]
    da, db = heading(me, way, pose.alpha, pose.beta, step)
    way.turn_alpha, way.turn_beta = da, db
    way.was_alpha, way.was_beta = pose.alpha, pose.beta
    lands = (
        way.yields_to < 0
        and abs(me.goal_alpha - pose.alpha - da) < 1e-12
        and abs(me.goal_beta - pose.beta - db) < 1e-12
    )
    for _ in range(0 if lands else _PASSES):
        for k in range(ends.offsets[i], ends.offsets[i + 1]):
            j = ends.near[k].arm
            sx, sy = me.x - ends.end[j].x, me.y - ends.end[j].y
            x2 = sx * sx + sy * sy
            if not (x2 < weights.D * weights.D):
                continue
            x = np.sqrt(x2)
            ga, gb = through_joints(me, sx / x, sy / x)
            least = -0.5 * max(0.0, x - weights.d - _SPARE)
            if ways[j].rank > way.rank and x < weights.d + _CLOSE and not ways[j].arrived:
                least = _ROOM
            along = da * ga + db * gb
            if along < least:
                part = (least - along) / max(ga * ga + gb * gb, 1e-3)
                da += ga * part
                db += gb * part
    da, db = limited(da, db, me.most_alpha, me.most_beta)
    pose.wanted_alpha = within(pose.alpha, da, me.lower_alpha, me.upper_alpha)
    pose.wanted_beta = within(pose.beta, db, me.lower_beta, me.upper_beta)
    pose.lands = lands


@kernel
def descend_repaired(arms, near, now, record, ends, crowd, ways, weights, top, last_step):
    """Move until all have arrived; returns why it ended."""
    reach = weights.d + AHEAD
    while True:
        missing = 0
        for k in range(crowd.counters[1]):
            missing += crowd.restless[crowd.active[k]]
        if missing == 0:
            return CONVERGED
        if crowd.counters[0] >= last_step:
            return EXHAUSTED
        if record.used[0] + 2 * crowd.counters[1] > len(record.knots):
            return FULL
        for k in range(crowd.counters[1]):
            _ask(ends, now, ways, weights, crowd.active[k], crowd.counters[0])
        advance(arms, near, now, record, ends, crowd, weights.D)
        for k in range(crowd.counters[1]):  # may wake others, who come last
            keep_order(ends, now, ways, crowd, reach, crowd.active[k], crowd.counters[0], top)
