"""Boxes of joint space as a plan file states them, and which share a side; a part of the replay of infeasibility."""

from collections.abc import Iterator

_DIGITS = "012345"


class Box:
    """A box of joint space: its ends (d,) [rad], what it is, and its halves."""

    def __init__(self, low: list[float], high: list[float]):
        self.low, self.high, self.mark, self.halves, self.joint = low, high, "", list[Box](), -1
        self.within = False  # whether an ``i`` is among its parts
        self.beside = False  # whether an ``i`` shares a side with it

    def holds(self, q: list[float]) -> bool:
        """Whether it holds q, or may: joints that are not numbers may be anywhere."""
        return all(not (x < a or x > b) for x, a, b in zip(q, self.low, self.high, strict=True))


def grown(low: list[float], high: list[float], tree: str) -> tuple[Box, list[Box]] | None:
    """The boxes of a tree: the whole, and all that are not halved; None if it says anything else."""
    whole, leaves = Box(low, high), list[Box]()
    waiting, order = [whole], []
    for mark in tree:
        if not waiting:
            return None
        box = waiting.pop()
        box.mark = mark
        order.append(box)
        if mark in "ibo":
            box.within = mark == "i"
            leaves.append(box)
            continue
        if mark not in _DIGITS[: len(low)]:
            return None
        box.joint = d = int(mark)
        middle = 0.5 * (box.low[d] + box.high[d])
        if not box.low[d] < middle < box.high[d]:
            return None
        ends = [*box.low[:d], middle, *box.low[d + 1 :]], [*box.high[:d], middle, *box.high[d + 1 :]]
        box.halves = [Box(box.low, ends[1]), Box(ends[0], box.high)]
        waiting += box.halves[::-1]
    for box in reversed(order):
        box.within = box.within or any(half.within for half in box.halves)
    return None if waiting else (whole, leaves)


def sides(whole: Box) -> Iterator[tuple[Box, Box]]:
    """Boxes that are not halved and share a side, of which one is an ``i``."""
    inside, between = [whole], list[tuple[Box, Box, int]]()
    while inside:
        box = inside.pop()
        if box.halves:
            inside += box.halves
            between.append((box.halves[0], box.halves[1], box.joint))
    while between:
        a, b, d = between.pop()  # the upper end of a in joint d is the lower one of b
        if not (a.within or b.within):
            continue
        if a.halves:
            for half in a.halves[1:] if a.joint == d else a.halves:
                if a.joint == d or _overlap(half, b, a.joint):
                    between.append((half, b, d))
        elif b.halves:
            for half in b.halves[:1] if b.joint == d else b.halves:
                if b.joint == d or _overlap(a, half, b.joint):
                    between.append((a, half, d))
        else:
            yield a, b


def _overlap(a: Box, b: Box, d: int) -> bool:
    return a.low[d] < b.high[d] and b.low[d] < a.high[d]
