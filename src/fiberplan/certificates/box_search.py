"""Is there a path through joint space? Boxes are halved where that decides it, and nowhere else.

If no chain of boxes that are not blocked leads from the start to the goal, there is no path; a chain of clear ones is
one. Else the chains with the fewest open boxes are where either is decided soonest, and these boxes are halved.

The frame is that of Zhu and Latombe's cell decomposition (IEEE Trans. Robotics and Automation 7, 1991) and of the soft
subdivision search of Wang, Chiang and Yap (SoCG 2013).
"""

import numpy as np

from fiberplan.certificates.subdivision import BLOCKED, CLEAR, HALVED, halve, judge, starts_clear
from fiberplan.kernels.compile import kernel, leaf

UNDECIDED, CLOSED, PATH = 0, 1, 2  # what a search ends with, or
FULL = 3  # that it needs more room
FAR = np.int32(2**30)
_AHEAD = 1.2  # chains of so many times as many open boxes as the fewest are halved, too


@leaf
def _price(box):
    """What a chain pays for a box: nothing if it is clear, more if it is not clear in its middle."""
    return 0 if box.state == CLEAR else 1 if box.centre else 2


@leaf
def _spread(boxes, sources, backward):
    """Fill in the fewest open boxes on chains from some boxes.

    `sources` (4,) begins lists of boxes (the others by `link`) by what the chains to them cost, modulo 4.
    """
    current, cost, idle = 0, 0, 0
    while idle < 4:
        k = sources[current]
        if k < 0:
            current, cost, idle = (current + 1) % 4, cost + 1, idle + 1
            continue
        idle = 0
        box = boxes.box[k]
        sources[current] = box.link
        e = box.edge
        while e >= 0:
            other = boxes.edge[e, 0]
            e = boxes.edge[e, 1]
            there = boxes.box[other]
            if there.state == BLOCKED:
                continue
            paid = cost + _price(there)
            if backward:
                if there.from_goal < FAR:
                    continue
                there.from_goal = paid
            else:
                if there.from_start < FAR:
                    continue
                there.from_start, there.before = paid, k
            there.link = sources[paid % 4]
            sources[paid % 4] = other


@leaf
def leaf_of(boxes, q):
    """The narrowest box that holds q (d,), the lower of two that do."""
    k = 0
    while boxes.box[k].state == HALVED:
        child, d = boxes.box[k].child, boxes.box[k].joint
        k = child if q[d] <= boxes.high[child, d] else child + 1
    return k


@kernel
def search(query, boxes, most):
    """Halve boxes until the question is decided, or there are `most` (or as many as there is room for).

    Returns:
        UNDECIDED, CLOSED, PATH or FULL, and the box in which the path ends.
    """
    sources = np.empty(4, np.int64)
    if boxes.used[0] == 0:
        boxes.used[0] = 1
        boxes.box[0].edge = -1
        if not starts_clear(query, boxes.unsure[1]):
            return UNDECIDED, -1
        judge(query, boxes, 0)
    while True:
        for k in range(boxes.used[0]):
            boxes.box[k].from_start = boxes.box[k].from_goal = FAR
        sources[:] = -1
        begin = boxes.box[leaf_of(boxes, query.start)]
        begin.from_start, begin.before, begin.link = _price(begin), -1, -1
        sources[_price(begin)] = leaf_of(boxes, query.start)
        _spread(boxes, sources, False)
        sources[:] = -1
        best, end = FAR, -1
        for k in range(boxes.used[0]):
            box = boxes.box[k]
            if box.state <= CLEAR and box.ends > 0:
                box.from_goal = _price(box) + 2 - box.ends
                if box.from_start < FAR and box.from_start + 2 - box.ends < best:
                    best, end = box.from_start + 2 - box.ends, k
        if end < 0:
            return CLOSED, -1
        if best == 0:
            return PATH, end
        for k in range(boxes.used[0]):
            if boxes.box[k].from_goal < FAR:
                boxes.box[k].link = sources[boxes.box[k].from_goal]
                sources[boxes.box[k].from_goal] = k
        _spread(boxes, sources, True)
        if boxes.used[0] >= most:
            return UNDECIDED, -1
        halved = 0
        for k in range(boxes.used[0]):
            box = boxes.box[k]
            if box.state > CLEAR or box.joint < 0 or box.from_start == FAR or box.from_goal == FAR:
                continue
            if box.from_start + box.from_goal - _price(box) <= _AHEAD * best:
                if box.state == CLEAR and not (box.ends == 1 and box.from_start + 1 <= _AHEAD * best):
                    continue
                if not halve(query, boxes, k):
                    return FULL, -1
                halved += 1
        k = end
        while halved == 0 and k >= 0:  # a goal beside an open box may be nearer than one that it may hold itself
            if boxes.box[k].state != CLEAR and boxes.box[k].joint >= 0:
                if not halve(query, boxes, k):
                    return FULL, -1
                halved += 1
            k = boxes.box[k].before
        if halved == 0:
            return UNDECIDED, -1
