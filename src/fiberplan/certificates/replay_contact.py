"""Are two nearer than the margin all over a box of joint space? A part of the replay of infeasibility, with balls.

Of two convex parts, with all joints within +-d of the middle m of a box:

1. a point x of a part is x(m) + x'(m) d + e, `|e| <= (l d_alpha^2 + r (d_alpha + d_beta)^2) / 2`, by Taylor's theorem,
   with l from base to elbow and r from elbow to x; so two points that are near in the middle stay as near as their
   difference lets them;
2. nothing moves farther than the arcs about the elbow and then about the base. Parts that overlap by a depth come
   apart by no more than their vertices move: the depth is how far their difference reaches beyond 0 in every
   direction, and that gets less by no more.

What is shown by neither is halved.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from flint import acb, arb

from fiberplan.certificates.replay import QUARTER, Claims

EPSILON = 1e-6  #: nearer than the margin by this [mm]
_MOST = 4_000  # halvings of one box


class Barrier(NamedTuple):
    """A proof as the file states it."""

    turns: list[int]  # positioners whose joints the boxes are of
    goals: dict[int, tuple[float, float]]  # positioners that cannot all be there [rad]
    tree: str


def is_blocked(claims: Claims, barrier: Barrier, low: list[float], high: list[float], at_end: bool) -> bool:
    """Whether somebody is nearer than the margin to another, or to what never moves, wherever in a box joints are."""
    waiting = [(low, high)]
    for _ in range(_MOST):
        if not waiting:
            return True
        low, high = waiting.pop()
        middle = [0.5 * (a + b) for a, b in zip(low, high, strict=True)]
        if _touches(claims, barrier, low, middle, high, at_end):
            continue
        d = max(range(len(low)), key=lambda k: high[k] - low[k])
        if not low[d] < middle[d] < high[d]:
            return False
        waiting.append((low, [*high[:d], middle[d], *high[d + 1 :]]))
        waiting.append(([*low[:d], middle[d], *low[d + 1 :]], high))
    return False


def _touches(claims: Claims, barrier: Barrier, low: list, middle: list, high: list, at_end: bool) -> bool:
    """Whether two are shown to be nearer than the margin all over a box, by one look in its middle."""
    arms = {}
    for k, i in enumerate(barrier.turns):
        own = slice(2 * k, 2 * k + 2)
        half = [max(m - a, b - m) * (1.0 + 1e-15) for a, m, b in zip(low[own], middle[own], high[own], strict=True)]
        arms[i] = _Arm(claims, i, middle[own], half)
    there = {i: at for i, at in barrier.goals.items() if i not in arms and at_end}
    for i in barrier.turns:
        for j in range(len(claims.arms)):
            if j == i or (j in arms and j < i) or (j < claims.n and claims.online[j] and j not in arms | there):
                continue
            if j < claims.n and abs(claims.base[i] - claims.base[j]) > claims.reach[i] + claims.reach[j]:
                continue
            still = [*there.get(j, claims.knots[j][0, 1:].tolist() if j < claims.n else (0.0, 0.0))]
            if _meets(claims, arms[i], arms.get(j) or _Arm(claims, j, still, [0.0, 0.0])):
                return True
    return False


class _Arm:
    """An arm in the middle of its joints' turns, and how far its points may come."""

    def __init__(self, claims: Claims, arm: int, middle: list[float], half: list[float]):
        self.arm, (self.alpha, self.beta) = arm, map(arb, half)
        self.links = claims.links(arm, arb(middle[0]), arb(middle[1]), arb(0), arb(0))
        self.length = arb(float(claims.place[arm, 2])) if arm < claims.n else arb(0)
        self.places = [[self.at(s.link, z) for z in s.exact] for s in claims.arms[arm]]
        self.floats = [np.array([complex(z) for z in own]) for own in self.places]

    def at(self, link: int, z: acb) -> acb:
        """Where a point of a link is."""
        return self.links[link][0] + self.links[link][2] * z

    def moved(self, link: int, x: acb) -> tuple[acb, acb, arb, arb]:
        """Of a point at x: x' by alpha and by beta, how far they miss its motion, and how far it moves at most."""
        if link == 0:
            return acb(0), acb(0), arb(0), arb(0)
        base, elbow = self.links[1][0], self.links[-1][0]
        out = abs(x - base)
        if link == 1:
            return QUARTER * (x - base) * self.alpha, acb(0), out * self.alpha**2 / 2, out * self.alpha
        near = abs(x - elbow)
        bent = (self.length * self.alpha**2 + near * (self.alpha + self.beta) ** 2) / 2
        far = near * self.beta + (out + near * self.beta) * self.alpha
        return QUARTER * (x - base) * self.alpha, QUARTER * (x - elbow) * self.beta, bent, far

    def farthest(self, shape: int, link: int, part: tuple) -> arb:
        """How far the vertices of a part move at most."""
        ways = [self.moved(link, self.places[shape][k])[3] for k in part]
        return max(ways, key=lambda way: float(way.upper()))


def _meets(claims: Claims, one: _Arm, other: _Arm) -> bool:
    """Whether two arms are shown to be nearer than the margin wherever their joints are."""
    for p, first, q, second in claims.meeting(one.arm, other.arm):
        room = arb(first.radius) + arb(second.radius) + arb(claims.margin) - EPSILON
        for a in first.parts:
            for b in second.parts:
                here, there = one.floats[p][[*a]], other.floats[q][[*b]]
                weights, other_weights = _nearest(here, there)
                x = sum((one.places[p][k] * arb(w) for k, w in zip(a, weights, strict=True)), acb(0))
                y = sum((other.places[q][k] * arb(w) for k, w in zip(b, other_weights, strict=True)), acb(0))
                filled = len(a) > 2 or len(b) > 2
                if not (filled or abs(y - x) < room + 1):
                    continue
                if _stay_near(one.moved(first.link, x), other.moved(second.link, y), y - x, room):
                    return True
                depth = _depth(here, there) if filled or abs(y - x) < 1e-9 else 0.0
                if depth and one.farthest(p, first.link, a) + other.farthest(q, second.link, b) < room + depth:
                    return True
    return False


def _stay_near(one: tuple, other: tuple, apart: acb, room: arb) -> bool:
    """Whether two points, `apart` from each other, stay nearer than `room` as they move."""
    mid = complex(apart)
    turn = acb(mid.real, -mid.imag) / abs(acb(mid.real, mid.imag)) if mid else acb(1)
    ways = [turn * way for way in (*one[:2], *other[:2])]
    along = abs((turn * apart).real) + sum((abs(way.real) for way in ways), arb(0))
    across = abs((turn * apart).imag) + sum((abs(way.imag) for way in ways), arb(0))
    return bool((along**2 + across**2).sqrt() + one[2] + other[2] < room or abs(apart) + one[3] + other[3] < room)


def _depth(part: np.ndarray, other: np.ndarray) -> float:
    """How deep two convex parts overlap, to rounding: the least along the normal of an edge [mm]; 0 if they do not."""
    edges = np.concatenate([1j * (np.roll(own, -1) - own) for own in (part, other)])
    ways = np.concatenate([edges, -edges])
    ways = (ways[ways != 0] / np.abs(ways[ways != 0])).conj()[:, None]
    gaps = (ways * other).real.min(axis=1) - (ways * part).real.max(axis=1)
    return max(0.0, -float(gaps.max(initial=-np.inf)) - 1e-9) if len(ways) else 0.0


def _nearest(part: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points of two convex parts, as weights of their vertices: the nearest, or a common one."""
    best = (np.inf, np.eye(len(part))[0], np.eye(len(other))[0])
    for k in range(len(part)):
        a, b = part[k], part[(k + 1) % len(part)]
        for m in range(len(other)):
            c, d = other[m], other[(m + 1) % len(other)]
            for s, t in _candidates(a, b, c, d):
                p, q = a + s * (b - a), c + t * (d - c)
                if abs(p - q) < best[0]:
                    weights = np.zeros(len(part)), np.zeros(len(other))
                    for own, at, share in zip(weights, (k, m), (s, t), strict=True):
                        own[at] += 1.0 - share
                        own[(at + 1) % len(own)] += share
                    best = (abs(p - q), *weights)
    return best[1], best[2]


def _candidates(a: complex, b: complex, c: complex, d: complex) -> Iterator[tuple[float, float]]:
    """Parts (s, t) of two segments at which they may be nearest: where they cross, and each end with its foot."""

    def foot(x: complex, y: complex, z: complex) -> float:
        along = abs(z - y) ** 2
        return float(np.clip(((x - y) * (z - y).conjugate()).real / along, 0.0, 1.0)) if along > 0 else 0.0

    yield from ((0.0, foot(a, c, d)), (1.0, foot(b, c, d)), (foot(c, a, b), 0.0), (foot(d, a, b), 1.0))
    turn = ((b - a).conjugate() * (d - c)).imag
    if turn:
        s, t = ((c - a).conjugate() * (d - c)).imag / turn, ((c - a).conjugate() * (b - a)).imag / turn
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            yield s, t
