"""Joints' motions in whole steps of their motors, so many in each segment of time: strokes, and rests between.

A joint follows given places, the rounded angles at the ends of segments. Where it should turn more slowly than it can,
it makes `least` steps in some segments and none in others, and the longest stroke makes up for what is left, or one
gets a segment less or more. What no stroke can make is made at the end, by a stroke that goes farther and one that
comes back; both on the side that the joint came from, for what lies beyond its end it has never swept.

A stroke may go beyond what it follows, and where that is near an end of the joint's range, beyond that. Then the joint
follows places that stay off that end, by as much, then by ever more until it keeps its range.
"""

import numpy as np

from fiberplan.kernels.compile import inlined, kernel, leaf
from fiberplan.shaping.strokes import StepRules, capacity, fewest, fill

TAIL = 64  #: segments that going there and back may take
_TURNS = 8  # in which places are drawn in from the ends of a joint's range


@leaf
def _stretch(rules, out, first, last, turn, after, before, longest):
    """Put a turn that is too slow for segments [first, last) into some of them; `out` is zero there."""
    way = 1 if turn > 0 else -1
    count = min(last - first, (2 * abs(turn) + rules.least) // (2 * rules.least))
    number = min(count, max((count + longest - 1) // longest, 2 if after and before else 1))
    for k in range(number):
        begin, end = first + (last - first) * k // number, first + (last - first) * (k + 1) // number
        mine = count * (k + 1) // number - count * k // number
        room = end - begin - mine
        at = begin + room // 2
        if after and (not before or k == 0):
            at = begin
        elif before and (not after or k == number - 1):
            at = begin + room
        for j in range(at, at + mine):
            out[j] = way * rules.least


@leaf
def _no_slower(rules, wanted, out, longest):
    """The wanted steps with none below the least: slow stretches as whole segments of the least, and none."""
    m = len(wanted)
    begin = 0
    while begin < m:
        if abs(wanted[begin]) >= rules.least:
            out[begin] = wanted[begin]
            begin += 1
            continue
        way, turn, end = 0, 0, begin  # as far as it is slow and does not turn back
        while end < m and abs(wanted[end]) < rules.least and wanted[end] * way >= 0:
            if wanted[end] != 0:
                way = 1 if wanted[end] > 0 else -1
            turn += wanted[end]
            out[end] = 0
            end += 1
        after = begin > 0 and wanted[begin - 1] * way >= rules.least
        before = end < m and wanted[end] * way >= rules.least
        if turn != 0:
            _stretch(rules, out, begin, end, turn, after, before, longest)
        begin = end


@inlined
def _way(steps, k):
    """Which way the joint turns in segment k."""
    return 0 if k < 0 or k >= len(steps) or steps[k] == 0 else (1 if steps[k] > 0 else -1)


@leaf
def _one_stroke(rules, steps, a, b, owed):
    """Make a stroke of segments [a, b), with what is owed besides if it can; what is owed then."""
    way, now = _way(steps, a), 0
    for k in range(a, b):
        steps[k] *= way
        now += steps[k]
    total = min(max(now + way * owed, (b - a) * rules.least), capacity(rules, b - a))
    fill(rules, steps[a:b], total)
    for k in range(a, b):
        steps[k] *= way
    return owed - way * (total - now)


@leaf
def _strokes(rules, steps, end):
    """Make strokes of all rows of `steps`, which should end at `end`; what is still owed to it."""
    for turn in range(2):  # first each for itself, then the longest make up for what is left
        owed = end
        for k in range(len(steps)):
            owed -= steps[k]
        longest = len(steps) + 1
        while longest > 0:
            length = 0
            a = 0
            while a < len(steps):
                b = a + 1
                while b < len(steps) and _way(steps, b) == _way(steps, a):
                    b += 1
                if steps[a] != 0 and (turn == 0 or b - a == longest):
                    left = _one_stroke(rules, steps, a, b, owed if turn == 1 else 0)
                    owed = left if turn == 1 else owed
                elif steps[a] != 0 and b - a < longest:
                    length = max(length, b - a)
                a = b
            longest = length if turn == 1 else 0
    return owed


@leaf
def _resized(rules, steps, owed):
    """Take a segment from a stroke, or give it one more, so that it makes what is owed; what is owed then."""
    a = 0
    while a < len(steps):
        b, way, total = a, _way(steps, a), 0
        while b < len(steps) and _way(steps, b) == way:
            total += abs(steps[b])
            b += 1
        total += way * owed
        free = b < len(steps) and steps[b] == 0 and (b + 1 == len(steps) or steps[b + 1] == 0)
        for t in (b - a - 1, b - a + 1):
            if way == 0 or t < 1 or (t > b - a and not free):
                continue
            if t * rules.least <= total <= capacity(rules, t):
                for k in range(a, b):
                    steps[k] = 0 if k >= a + t else abs(steps[k])
                fill(rules, steps[a : a + t], total)
                for k in range(a, a + t):
                    steps[k] *= way
                return 0
        a = b
    return owed


@leaf
def _finish(rules, steps, owed):
    """Make what is owed after the last stroke; whether there is room.

    Where it takes a stroke that goes farther and one that comes back, the joint stays on the side that it came from.
    """
    way, rest = (1 if owed > 0 else -1), abs(owed)
    at = last = 0
    for k in range(len(steps)):
        if steps[k] != 0:
            at, last = k + 2, _way(steps, k)  # a rest before
    back = 0
    while fewest(rules, rest + back) == 0 or (back > 0 and fewest(rules, back) == 0):
        back = max(rules.least, back + 1)
    there, again = (back, rest + back) if back > 0 and way == last else (rest + back, back)
    if there == back:
        way = -way
    going, returning = fewest(rules, there), fewest(rules, again)
    if at + going + 1 + returning > len(steps):
        return False
    fill(rules, steps[at : at + going], there)
    if returning > 0:
        fill(rules, steps[at + going + 1 : at + going + 1 + returning], again)
    for k in range(at, at + going):
        steps[k] *= way
    for k in range(at + going + 1, at + going + 1 + returning):
        steps[k] *= -way
    return True


@leaf
def _drawn_in(wanted, low, high, out):
    """The wanted steps with places no lower than `low` and no higher than `high` but for the first and the last."""
    place = before = 0
    for k in range(len(wanted)):
        place += wanted[k]
        there = place if k == len(wanted) - 1 else max(low, min(high, place))
        out[k] = there - before
        before = there


@leaf
def _beyond(steps, low, high):
    """How far places go below `low`, and above `high`."""
    place = below = above = 0
    for k in range(len(steps)):
        place += steps[k]
        below = max(below, low - place)
        above = max(above, place - high)
    return below, above


@leaf
def _one_followed(rules, wanted, longest, out):
    """`followed`, of one joint, wherever its range ends."""
    m = len(wanted)
    end = 0
    for k in range(m):
        end += wanted[k]
    out[:] = 0
    _no_slower(rules, wanted, out, longest)
    owed = _strokes(rules, out[:m], end)
    if owed != 0:
        owed = _resized(rules, out[:m], owed)
    return owed == 0 or _finish(rules, out, owed)


@kernel
def followed(least, most, change, first, wanted, longest, low, high, out):
    """Steps of joints that follow the wanted ones, in `out` (joints, m + TAIL).

    Args:
        least: (joints,) as in `StepRules`.
        most: (joints,)
        change: (joints,)
        first: (joints,)
        wanted: (joints, m) steps in each segment, of any size.
        longest: (joints,) segments that a joint may turn in one go where it should turn more slowly than it can.
        low: (joints,) lowest place of a joint, in steps from where it is.
        high: (joints,) highest place.
        out: all columns beyond m are for going there and back.

    Returns:
        (joints,) whether a joint gets where it should and keeps its range, or what it begins and ends at.
    """
    done = np.zeros(len(wanted), np.bool_)
    drawn = np.empty(wanted.shape[1], np.int64)
    for j in range(len(wanted)):
        rules = StepRules(least[j], most[j], change[j], first[j])
        end = 0
        for k in range(wanted.shape[1]):
            end += wanted[j, k]
        lowest, highest = min(low[j], 0, end), max(high[j], 0, end)
        lower, upper = lowest, highest
        for turn in range(_TURNS):
            _drawn_in(wanted[j], lower, upper, drawn)
            if not _one_followed(rules, drawn, longest[j], out[j]):
                break
            below, above = _beyond(out[j], lowest, highest)
            if below == 0 and above == 0:
                done[j] = True
                break
            lower, upper = lower + below * 2**turn, upper - above * 2**turn
    return done
