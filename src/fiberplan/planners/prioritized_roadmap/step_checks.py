"""Is an arm clear of those already planned while it takes one step? The second of the two questions an arm is asked.

All motions share one clock of steps; within a step every joint turns evenly. A step is looked at every `collision_dt`,
as in Sabater2018, or as rarely as the motion bound allows. Either way each look covers the time around it
(`fiberplan.kernels.even_motion`), so that nothing can happen between looks.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.arms import frame
from fiberplan.kernels.compile import leaf
from fiberplan.kernels.even_motion import constant_speed_bound

_SHORTEST = 1.0 / 1024.0  # a part of a step as short as this that is not shown clear counts as contact


class Timetable(NamedTuple):
    """Where the arms that are planned are at each step, and who of them can meet the one being planned."""

    poses: np.ndarray  # (arms, steps + 1, 2) [rad]
    until: np.ndarray  # (arms,) first step from which an arm is not there any more: it will yield
    others: np.ndarray  # (m,) arms to keep clear of
    limit: float  # clearance to keep [mm]
    looks: int  # per step and pair; 0: as few as the motion bound allows
    quiet: int  # step from which none of the others moves
    tally: np.ndarray  # (arms + 2,) contacts found with each arm, then pair checks under way and at rest


@leaf
def _pair_clear(arms, i, a0, b0, da, db, j, c0, d0, dc, dd, limit, looks):
    """Whether two arms keep `limit` over a step, and how many pair checks that took (in the paper's unit)."""
    moving = da != 0.0 or db != 0.0 or dc != 0.0 or dd != 0.0
    h = 0.5 / looks if looks > 0 and moving else 0.5
    done, checks = 0.0, 0
    while done < 1.0:
        at = min(done + h, 1.0)
        frame_i = frame(arms, i, a0 + at * da, b0 + at * db)
        frame_j = frame(arms, j, c0 + at * dc, d0 + at * dd)
        now, bound = constant_speed_bound(arms, i, frame_i, da, db, j, frame_j, dc, dd, h)
        checks += 1
        if bound >= limit:
            done = done + 2.0 * h if done + 2.0 * h < 1.0 - 1e-12 else 1.0
            if looks == 0:
                h = min(2.0 * h, max(0.5 * (1.0 - done), _SHORTEST))
        elif looks > 0 or not (now >= limit) or h < _SHORTEST:
            return False, checks
        else:
            h *= 0.5
    return True, max(checks, looks)


@leaf
def step_clear(arms, table, i, a0, b0, a1, b1, t, resting):
    """Whether arm i keeps clear while it turns from (a0, b0) to (a1, b1) in step t."""
    for k in range(len(table.others)):
        j = table.others[k]
        if t >= table.until[j]:
            continue
        c0, d0 = table.poses[j, t, 0], table.poses[j, t, 1]
        dc, dd = table.poses[j, t + 1, 0] - c0, table.poses[j, t + 1, 1] - d0
        clear, checks = _pair_clear(arms, i, a0, b0, a1 - a0, b1 - b0, j, c0, d0, dc, dd, table.limit, table.looks)
        table.tally[len(table.tally) - (1 if resting else 2)] += checks
        if not clear:
            table.tally[j] += 1
            return False
    return True


@leaf
def first_rest(arms, table, i, alpha, beta, begin):
    """First step from `begin` on, from which arm i can stand at (alpha, beta) for good; the number of steps if none."""
    last = table.poses.shape[1] - 1
    t = min(last, max(table.quiet, begin) + 1)  # one step of rest stands for all that follow
    while t > begin:
        if not step_clear(arms, table, i, alpha, beta, alpha, beta, t - 1, True):
            return t if t <= table.quiet else last  # in contact with someone at rest: never
        t -= 1
    return begin
