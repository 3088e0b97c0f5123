"""What one stroke of a motor can be: a row of segments of time in which it turns one way, in whole steps.

In a segment a motor makes no step, or between `least` and `most`, and in the next no more than `change` more or fewer.
The first and the last segment of a stroke have `first` steps at most. So T segments can make any number of steps from
T `least` to the sum of an envelope, which rises by `change` from either end.
"""

from typing import NamedTuple

from fiberplan.kernels.compile import inlined, leaf


class StepRules(NamedTuple):
    """What a motor can do in a segment."""

    least: int  #: steps, unless none; 0: any number
    most: int  #: steps
    change: int  #: of steps from one segment to the next
    first: int  #: steps in the first and last segment of a stroke, at most


@inlined
def _most_at(rules, k, length):
    """Most steps in segment k of a stroke."""
    return min(rules.most, rules.first + rules.change * min(k, length - 1 - k))


@leaf
def capacity(rules, length):
    """Most steps in a stroke of so many segments."""
    total = 0
    for k in range(length):
        total += _most_at(rules, k, length)
    return total


@leaf
def fewest(rules, total):
    """The fewest segments of a stroke of so many steps; 0: no stroke has that many."""
    length = 1
    while length * max(1, rules.least) <= total:
        if total <= capacity(rules, length):
            return length
        length += 1
    return 0


@leaf
def fill(rules, steps, total):
    """Turn the wanted `steps` of a stroke into ones that the motor can make, `total` in all; whether there are such."""
    t = len(steps)
    if not t * rules.least <= total <= capacity(rules, t):
        return False
    for k in range(t):
        steps[k] = min(max(steps[k], rules.least), _most_at(rules, k, t))
        if k > 0:
            steps[k] = min(steps[k], steps[k - 1] + rules.change - 1)
    for k in range(t - 2, -1, -1):
        steps[k] = min(steps[k], steps[k + 1] + rules.change - 1)
    low, high = -rules.most, rules.most  # the least that all are raised by, so that they are enough
    while high - low > 1:
        middle = (low + high) // 2
        there = 0
        for k in range(t):
            there += min(max(steps[k] + middle, rules.least), _most_at(rules, k, t))
        if there >= total:
            high = middle
        else:
            low = middle
    over = -total
    for k in range(t):
        over += min(max(steps[k] + high, rules.least), _most_at(rules, k, t))
    for k in range(t):
        raised = min(max(steps[k] + high, rules.least), _most_at(rules, k, t))
        lower = min(max(steps[k] + high - 1, rules.least), _most_at(rules, k, t))
        if over > 0 and lower < raised:
            raised, over = lower, over - 1
        steps[k] = raised
    return True
