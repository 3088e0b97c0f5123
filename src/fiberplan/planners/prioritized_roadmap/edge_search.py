"""Sabater2018's depth-first search in state-time, along one path, with the start-stop counter and its limit.

A state is (step on the path, start-stops so far, motion -1, 0 or +1, time). From standing still no action adds to the
count; from motion, any other action adds 1; reaching an intermediate vertex adds 1 and is a stop, so that waiting there
adds nothing. Forward is tried first, then waiting, then backing. Count and motion carry from edge to edge. Corrections
of the printed routine: integer steps kept within the path, visited states keyed by all four parts, and the forward
neighbour has motion +1. The search may go back to earlier edges' states, which the paper's calls do not.
"""

import numpy as np

from fiberplan.kernels.compile import kernel
from fiberplan.planners.prioritized_roadmap.step_checks import first_rest, step_clear

ACTIONS = np.array([1, 0, -1])
ACTIONS.setflags(write=False)


@kernel
def search(arms, table, i, path, vertex, most_stops, begin, rest_from, prune):
    """Find a motion along a path.

    Args:
        arms: `fiberplan.kernels.arms.Arms`.
        table: `Timetable` of those to keep clear of.
        i: the arm.
        path: (k + 1, 2) its configurations at each step of the path [rad].
        vertex: (k + 1,) whether a step is an intermediate vertex.
        most_stops: the limit of start-stops.
        begin: state to begin from: (step, start-stops, motion, time).
        rest_from: first time at which the end of the path may be reached and kept, if known; -1: find out when asked.
        prune: whether states that cannot arrive in time are left out before they are looked at.

    Returns:
        (steps on the path at each time from begin's on, start-stops), the first empty if there is no motion; and
        rest_from as it is known now.
    """
    last, end = len(path) - 1, table.poses.shape[1] - 1
    counts, times = most_stops + 1, end + 1
    visited = np.zeros((last + 1, counts, 3, times), np.bool_)
    known = np.zeros((last + 1, 3, times), np.int8)  # of collisions: 0 unknown, 1 clear, 2 contact
    stack = np.zeros((times + 2, 5), np.int64)  # step, start-stops, motion, time, next action
    k0, s0, m0, t0 = begin
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = k0, s0, m0, t0
    depth = 1
    visited[k0, s0, m0 + 1, t0] = True
    while depth > 0:
        k, s, m, t = stack[depth - 1, 0], stack[depth - 1, 1], stack[depth - 1, 2], stack[depth - 1, 3]
        if k == last:
            if rest_from < 0:
                rest_from = first_rest(arms, table, i, path[last, 0], path[last, 1], 0)
            if t >= rest_from:
                return stack[:depth, 0].copy(), s, rest_from
        action = stack[depth - 1, 4]
        stack[depth - 1, 4] += 1
        if action == 3 or t == end:
            depth -= 1
            continue
        a = ACTIONS[action]
        step, stops, motion = k + a, s, a
        if m != 0 and a != m:
            stops += 1
        if step < 0 or step > last or (a == -1 and (vertex[k] or k == last)):
            continue
        if a == 1 and vertex[step]:
            stops, motion = stops + 1, 0
        if step == last:
            motion = 0
        if stops > most_stops or visited[step, stops, motion + 1, t + 1]:
            continue
        if prune and t + 1 + last - step > end:
            continue
        if known[k, a + 1, t] == 0:
            clear = step_clear(arms, table, i, path[k, 0], path[k, 1], path[step, 0], path[step, 1], t, False)
            known[k, a + 1, t] = 1 if clear else 2
        if known[k, a + 1, t] == 2:
            continue
        visited[step, stops, motion + 1, t + 1] = True
        stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3] = step, stops, motion, t + 1
        stack[depth, 4] = 0
        depth += 1
    return np.zeros(0, np.int64), s0, rest_from
