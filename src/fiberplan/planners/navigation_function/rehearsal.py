"""Taking turns: before anything moves, all motions are rehearsed as if no one were in the way.

Where two fiber ends would come too near, one of them changes what costs nothing or little: when it leaves, when it
arrives, on which side of its base it passes. Only neighbours need to know each other's intentions, so this is as
decentralized as the field. What is left to the field is what no change could mend.
"""

import numpy as np

from fiberplan.kernels.arms import frame
from fiberplan.kernels.compile import inlined, kernel, leaf
from fiberplan.kernels.segments import point_to_segment
from fiberplan.planners.navigation_function.retract_profile import MIDDLE, heading
from fiberplan.planners.shared.step_limits import limited

EVERY = 3  # steps between samples
SPARE = 0.15  # [mm] two should pass this much farther apart than they must
_SHIFT = 4  # steps by which a departure or arrival is moved
_SHIFTS = 20  # how often at most
_LEANS = 5
_ROUNDS = 2
_LATE = 4  # every so manieth arrival that is tried is late rather than early


@inlined
def _lean(k):
    """The leans that are tried, the middle way first."""
    return MIDDLE if k == 0 else 0.0 if k == 1 else 1.0 if k == 2 else -0.5 if k == 3 else 1.5


@leaf
def rehearse(arms, ends, way, i, alpha, beta, path):
    """Fill `path` (samples, 2) [mm] with where fiber end i would be from (alpha, beta) on; returns its last step."""
    end = ends.end[i]
    moved = 0
    for s in range(len(path)):
        links = frame(arms, i, alpha, beta)
        path[s, 0] = links[2] + links[6] * end.offset_u - links[7] * end.offset_v
        path[s, 1] = links[3] + links[7] * end.offset_u + links[6] * end.offset_v
        for k in range(EVERY):
            da, db = heading(end, way, alpha, beta, s * EVERY + k)
            if da != 0.0 or db != 0.0:
                da, db = limited(da, db, end.most_alpha, end.most_beta)
                alpha = min(max(alpha + da, end.lower_alpha), end.upper_alpha)
                beta = min(max(beta + db, end.lower_beta), end.upper_beta)
                moved = s * EVERY + k + 1
    return moved


@inlined
def _meeting(a, b, apart):
    """First sample after which two paths come nearer than `apart` [mm], or -1.

    Two that begin or end nearer than that only have to come no nearer still.
    """
    last = len(a) - 1
    first2 = (a[0, 0] - b[0, 0]) ** 2 + (a[0, 1] - b[0, 1]) ** 2
    last2 = (a[last, 0] - b[last, 0]) ** 2 + (a[last, 1] - b[last, 1]) ** 2
    least = min(apart * apart, 0.99 * min(first2, last2))
    x, y = a[0, 0] - b[0, 0], a[0, 1] - b[0, 1]
    for s in range(last):
        u, v = a[s + 1, 0] - b[s + 1, 0], a[s + 1, 1] - b[s + 1, 1]
        if (u != x or v != y) and point_to_segment(0.0, 0.0, x, y, u, v)[0] < least:
            return s
        x, y = u, v
    return -1


@leaf
def _meetings(ends, paths, i, path, apart):
    """How many neighbours fiber end i would meet on `path`."""
    count = 0
    for k in range(ends.offsets[i], ends.offsets[i + 1]):
        if _meeting(path, paths[ends.near[k].arm], apart) >= 0:
            count += 1
    return count


@inlined
def _vary(way, early, trial, go, due):
    """Set departure or arrival, and the lean with it, to variant number `trial` of what it was, cheapest first."""
    shift, lean = trial // _LEANS, _lean(trial % _LEANS)
    if early:
        way.go, way.lean_in = go + shift * _SHIFT, lean
    elif shift % _LATE == _LATE - 1:
        way.due, way.lean_out = due + (shift // _LATE + 1) * _SHIFT, lean
    else:
        way.due, way.lean_out = due - (shift - shift // _LATE) * _SHIFT, lean


@leaf
def _mend(arms, ends, ways, angles, paths, spare, i, j, early, apart, late):
    """Let one of two that would meet change its way so that it meets no one, or else fewer; in time, if possible."""
    fewest, chosen, variant = 0, -1, 0
    for strict in range(2):
        for trial in range(1, _SHIFTS * _LEANS):
            for side in range(2):
                who = i if side == 0 else j
                end, way = ends.end[who], ways[who]
                if np.isnan(end.goal_alpha):
                    continue
                go, due, lean_in, lean_out = way.go, way.due, way.lean_in, way.lean_out
                _vary(way, early, trial, go, due)
                arrives = rehearse(arms, ends, way, who, angles[who, 0], angles[who, 1], spare)
                way.go, way.due, way.lean_in, way.lean_out = go, due, lean_in, lean_out
                if strict == 0 and arrives > late:
                    continue
                meets = _meetings(ends, paths, who, spare, apart)
                fewer = _meetings(ends, paths, who, paths[who], apart) - meets
                if fewer > fewest:
                    fewest, chosen, variant = fewer, who, trial
                    if meets == 0:
                        _vary(way, early, trial, go, due)
                        rehearse(arms, ends, way, who, angles[who, 0], angles[who, 1], paths[who])
                        return
    if chosen >= 0:
        way = ways[chosen]
        _vary(way, early, variant, way.go, way.due)
        rehearse(arms, ends, way, chosen, angles[chosen, 0], angles[chosen, 1], paths[chosen])


@kernel
def take_turns(arms, ends, ways, angles, paths, spare, apart, late):
    """Rehearse all from `angles` (n, 2) [rad] and change ways until no two come nearer than `apart` [mm], if possible.

    Args:
        arms: the array.
        ends: its fiber ends.
        ways: (n,) WAY, changed here.
        angles: (n, 2) the start [rad].
        paths: (n, samples, 2) room for the rehearsed fibers.
        spare: (samples, 2) room for one more.
        apart: how far two should stay apart [mm].
        late: step by which all should have arrived.

    Returns:
        how many pairs would still meet.
    """
    for i in range(len(ways)):
        rehearse(arms, ends, ways[i], i, angles[i, 0], angles[i, 1], paths[i])
    left = 0
    for _ in range(_ROUNDS):
        left = 0
        for i in range(len(ways)):
            for k in range(ends.offsets[i], ends.offsets[i + 1]):
                j = ends.near[k].arm
                if j < i:
                    continue
                when = _meeting(paths[i], paths[j], apart)
                if when < 0:
                    continue
                left += 1
                _mend(arms, ends, ways, angles, paths, spare, i, j, 2 * when < len(spare), apart, late)
        if left == 0:
            break
    return left
