"""Boxes of the joint space of a few positioners: what is known of each, and what of its halves.

A box is *clear* if all that may touch are proven to keep the margin all over it, *blocked* if two are proven to be
nearer all over it, and open else. Boxes join if they share a side. A box is halved in the joint that moves most whoever
is nearest there. So joints are halved where they matter only: two arms that cannot touch in a box need no boxes of the
two.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.arms import Arms, frame
from fiberplan.kernels.box_bounds import box_bounds
from fiberplan.kernels.compile import leaf, record

OPEN, CLEAR, BLOCKED, HALVED = 0, 1, 2, 3
_NARROW = 1e-6  # nothing that moves less than this is halved [mm]
_SOON = 4.0  # a way of arms so many times as long as it would have to be: such a box is soon found to be blocked

BOX = record(
    [
        ("state", "i8"),
        ("child", "i8"),  # the first of two, if halved
        ("joint", "i8"),  # that is halved, or would be; -1: none
        ("ends", "i8"),  # whether a goal lies in it: 0 none, 1 perhaps, 2 certainly, in part of it
        ("centre", "i8"),  # whether it is clear in its middle
        ("edge", "i8"),  # first of its edges, -1: none
        ("from_start", "i8"),  # open boxes on the best chain from the start to here, this one included
        ("from_goal", "i8"),
        ("before", "i8"),  # on the chain from the start
        ("link", "i8"),  # of lists during a search
    ]
)


class Query(NamedTuple):
    """What is asked, as the kernels take it. Slots are the positioners of which joint space is, then all that stand."""

    arms: Arms
    slot: np.ndarray  # (s,) arms
    pose: np.ndarray  # (s, 2) where they stand [rad]; of the first what is looked at
    half: np.ndarray  # (s, 2) half-widths of what is looked at [rad]; 0 of all that stand
    contact: np.ndarray  # (c, 2) slots that may touch
    at_end: np.ndarray  # (c,) whether that matters at the goal only
    start: np.ndarray  # (d,) [rad]
    goal: np.ndarray  # (d,) [rad]; NaN: anywhere
    margin: float  # [mm]
    shut: float  # what is nearer than this is blocked [mm]


class Boxes(NamedTuple):
    """All boxes, halved ones included; the first is the whole joint space."""

    box: np.ndarray  # (m,) BOX
    low: np.ndarray  # (m, d) [rad]
    high: np.ndarray  # (m, d)
    unsure: np.ndarray  # (m, c) contacts that may be, or not
    edge: np.ndarray  # (e, 2) box, next of the list; the other direction is the edge's number ^ 1
    used: np.ndarray  # (2,) boxes, edges


@leaf
def _look(query, unsure, at_goal):
    """State of what is in `query.pose` and `query.half`, the joint to halve, and whether its middle is clear.

    The joint is that which moves most whoever comes nearest of two that may touch: of two that block the box soon, if
    there are such, else of two of which least is known. Contacts that cannot be are struck from `unsure` (c,).
    """
    state, centre = CLEAR, True
    soonest, lowest, joint = _SOON, np.inf, -1
    for c in range(len(query.contact)):
        if not unsure[c] or (query.at_end[c] and not at_goal):
            continue
        a, b = query.contact[c, 0], query.contact[c, 1]
        i, j = query.slot[a], query.slot[b]
        hai, hbi, haj, hbj = query.half[a, 0], query.half[a, 1], query.half[b, 0], query.half[b, 1]
        frame_i = frame(query.arms, i, query.pose[a, 0], query.pose[a, 1])
        frame_j = frame(query.arms, j, query.pose[b, 0], query.pose[b, 1])
        now, low, high, w0, w1, w2, w3 = box_bounds(
            query.arms, i, frame_i, hai, hbi, j, frame_j, haj, hbj, query.margin, query.shut
        )
        if high < query.shut:
            return BLOCKED, -1, False
        if low >= query.margin:
            if not at_goal:
                unsure[c] = False
            continue
        state = OPEN
        soon = np.inf
        if not now >= query.margin:
            centre = False
            soon = (w0 + w1 + w2 + w3) / (query.margin - now)
        if soon < soonest or (soonest == _SOON and low < lowest):
            soonest, lowest = min(soon, soonest), low
            joint, most = -1, _NARROW
            if w0 > most:
                joint, most = 2 * a, w0
            if w1 > most:
                joint, most = 2 * a + 1, w1
            if w2 > most:
                joint, most = 2 * b, w2
            if w3 > most:
                joint, most = 2 * b + 1, w3
    return state, joint, centre


@leaf
def judge(query, boxes, k):
    """What is known of box k, from what was of the box that it is half of."""
    box, low, high = boxes.box[k], boxes.low[k], boxes.high[k]
    for d in range(len(low)):
        query.pose[d // 2, d % 2] = 0.5 * (low[d] + high[d])
        query.half[d // 2, d % 2] = max(query.pose[d // 2, d % 2] - low[d], high[d] - query.pose[d // 2, d % 2])
    box.state, box.joint, box.centre = _look(query, boxes.unsure[k], False)
    box.ends = 0
    if box.state == BLOCKED:
        return
    for d in range(len(low)):
        goal = query.goal[d]
        if goal == goal:
            if not (low[d] <= goal <= high[d]):
                return
            query.pose[d // 2, d % 2], query.half[d // 2, d % 2] = goal, 0.0
    state, joint, _ = _look(query, boxes.unsure[k], True)
    if state != BLOCKED:
        box.ends = 2 if state == CLEAR else 1
        if state == OPEN and box.state == CLEAR:
            box.joint = joint


@leaf
def starts_clear(query, unsure):
    """Whether the start keeps the margin; `unsure` (c,) is work space."""
    for d in range(len(query.start)):
        query.pose[d // 2, d % 2], query.half[d // 2, d % 2] = query.start[d], 0.0
    state, _, _ = _look(query, unsure, False)
    return state == CLEAR


@leaf
def _add_edge(boxes, a, b):
    """Boxes a and b share a side."""
    e = boxes.used[1]
    boxes.edge[e, 0], boxes.edge[e, 1] = b, boxes.box[a].edge
    boxes.edge[e + 1, 0], boxes.edge[e + 1, 1] = a, boxes.box[b].edge
    boxes.box[a].edge, boxes.box[b].edge = e, e + 1
    boxes.used[1] += 2


@leaf
def halve(query, boxes, k):
    """Halve box k; its neighbours become those of the halves that they touch. Whether there was room for that."""
    box, first, d = boxes.box[k], boxes.used[0], boxes.box[k].joint
    edges, e = 2, box.edge
    while e >= 0:
        edges, e = edges + 2, boxes.edge[e, 1]
    if first + 2 > len(boxes.box) or boxes.used[1] + edges > len(boxes.edge):
        return False
    middle = 0.5 * (boxes.low[k, d] + boxes.high[k, d])
    boxes.used[0] += 2
    for half in range(2):
        child = first + half
        for m in range(boxes.low.shape[1]):
            boxes.low[child, m], boxes.high[child, m] = boxes.low[k, m], boxes.high[k, m]
        for c in range(boxes.unsure.shape[1]):
            boxes.unsure[child, c] = boxes.unsure[k, c]
        boxes.box[child].edge = -1
    boxes.high[first, d] = boxes.low[first + 1, d] = middle
    e = box.edge
    while e >= 0:
        other, after = boxes.edge[e, 0], boxes.edge[e, 1]
        low, high = boxes.low[other, d], boxes.high[other, d]
        if low < boxes.high[k, d] and boxes.low[k, d] < high:
            lower, upper = low < middle, middle < high
        else:  # beside each other in this very joint
            lower = high == boxes.low[k, d]
            upper = not lower
        if lower and upper:
            _add_edge(boxes, first + 1, other)
        here = first if lower else first + 1
        boxes.edge[e ^ 1, 0] = here
        boxes.edge[e, 1] = boxes.box[here].edge
        boxes.box[here].edge = e
        e = after
    _add_edge(boxes, first, first + 1)
    box.state, box.child = HALVED, first
    judge(query, boxes, first)
    judge(query, boxes, first + 1)
    return True
