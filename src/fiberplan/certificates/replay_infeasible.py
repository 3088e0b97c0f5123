"""Is who is said to be unable to reach its goal proven to be? The third part of a replay: read it with the first.

A proof is a region of the two joint angles of one positioner, made of boxes. It holds if the start lies in the region,
no configuration that counts as the goal does, and there is no way out: wherever the region ends, which is on the sides
of boxes that no other box continues, a joint is at the end of its range, or the arm is nearer than the margin to what
never moves. That is shown of a
side by one point of the arm and one of what is in its way, nearer to each other than radii and margin along the whole
of it, less 1e-6 mm, for which ends of ranges and rounding of the two points have room (in balls of python-flint), or by
halves. Whatever all others do makes no difference. It says nothing of who begins nearer than the margin. Of a goal too
far for the time there is, the joints' speeds are the proof.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from flint import acb, arb

from fiberplan.certificates.replay import Claims

EPSILON = 1e-6  #: nearer than the margin by this [mm]
_MOST = 4_000  # halvings of one side
SPEED = 1e-9  # part of a limit or time that is not told apart


def unfounded(claims: Claims, label: str, i: int) -> Iterator[str]:
    """What does not hold of the proofs that positioner i cannot reach its goal; none if there are no proofs."""
    ends = _ends(claims, i)
    if any(i in pair for pair in claims.opening):
        yield f"{label} begins nearer than the margin, of which no proof that it cannot reach its goal is known"
        return
    shut_off = [False] * len(ends)
    for number, region in enumerate(_regions(claims, i)):
        start = claims.knots[i][0, 1:]
        if not _inside(region, start):
            yield f"{label}: the start is not in region {number} that it is said not to leave"
            continue
        out = _way_out(claims, i, region)
        if out is not None:
            yield f"{label}: region {number} is not shown to be closed at {out}"
            continue
        shut_off = [known or not _inside(region, end) for known, end in zip(shut_off, ends, strict=True)]
    late = _too_late(claims, i, ends)
    if not all(known or too_far for known, too_far in zip(shut_off, late, strict=True)):
        yield f"{label} is said to be unable to reach its goal, and is not shown to be"


def has_proof(claims: Claims, i: int) -> bool:
    """Whether the file holds anything that could prove that positioner i cannot reach its goal."""
    return bool(_regions(claims, i)) or all(_too_late(claims, i, _ends(claims, i)))


def _regions(claims: Claims, i: int) -> list[np.ndarray]:
    """Boxes (m, 2, 2) of each region of positioner i: low and high of each joint [rad]."""
    table = claims.tables.get("CERTIFICATE_REGIONS")
    if table is None:
        return []
    own = table[table["positioner"] == i]
    sides = [own[f"{end}_{joint}"].astype(float) for joint in ("alpha", "beta") for end in ("low", "high")]
    boxes = np.stack(sides, axis=1).reshape(-1, 2, 2)
    return [boxes[own["region"] == number] for number in np.unique(own["region"])]


def _ends(claims: Claims, i: int) -> np.ndarray:
    """(k, 2) configurations that count as positioner i's goal [rad]."""
    names, problem = ("alpha", "beta"), claims.problem
    ends = [np.array([float(problem[f"goal_{joint}"][i]) for joint in names])[None]]
    if "alternatives_alpha" in (problem.dtype.names or ()):
        ends.append(np.stack([np.ravel(problem[f"alternatives_{joint}"][i]).astype(float) for joint in names], axis=1))
    every = np.concatenate(ends)
    return every[~np.isnan(every).all(axis=1)]


def _too_late(claims: Claims, i: int, ends: np.ndarray) -> list[bool]:
    """Of each configuration, whether a joint's speed does not let it be reached in the time that was allowed."""
    most = claims.said["parameters"].get("max_time")
    speed = np.array([float(claims.table[f"max_speed_{joint}"][i]) for joint in ("alpha", "beta")])
    needed = np.abs(ends - claims.knots[i][0, 1:]) / speed
    return [most is not None and bool((own > float(most) * (1.0 + SPEED)).any()) for own in needed]


def _inside(region: np.ndarray, q: np.ndarray) -> bool:
    """Whether a configuration may lie in a region, or on its edge."""
    return bool((~(q < region[:, :, 0]) & ~(q > region[:, :, 1])).all(axis=1).any())


def _way_out(claims: Claims, i: int, region: np.ndarray) -> str | None:
    """Where a region is not shown to be closed; None if it is."""
    ranges = [[float(claims.table[f"{end}_{joint}"][i]) for end in ("lower", "upper")] for joint in ("alpha", "beta")]
    if not (region[:, :, 0] < region[:, :, 1]).all():
        return "a box that ends before it begins"
    for d in (0, 1):
        for end in (0, 1):
            beyond: dict[float, list[tuple[float, float]]] = {}
            for box in region.tolist():
                beyond.setdefault(box[d][1 - end], []).append(tuple(box[1 - d]))  # boxes that go on from this side
            for box in region.tolist():
                at = box[d][end]
                if (at <= ranges[d][0]) if end == 0 else (at >= ranges[d][1]):
                    continue
                for begin, until in _uncovered(box[1 - d][0], box[1 - d][1], beyond.get(at, [])):
                    if not _is_blocked(claims, i, d, at, begin, until):
                        return f"joint {d + 1} of {at:.6g} rad, the other from {begin:.6g} to {until:.6g} rad"
    return None


def _uncovered(begin: float, end: float, others: list[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """Parts of [begin, end] that no other interval covers."""
    cuts = sorted({begin, end, *(t for pair in others for t in pair if begin < t < end)})
    for a, b in pairwise(cuts):
        if not any(low <= a and b <= high for low, high in others):
            yield a, b


def _is_blocked(claims: Claims, i: int, d: int, at: float, begin: float, end: float) -> bool:
    """Whether arm i is nearer than the margin to what never moves, joint d being `at`, all over the other's turn."""
    waiting = [(begin, end)]
    for _ in range(_MOST):
        if not waiting:
            return True
        a, b = waiting.pop()
        m = 0.5 * (a + b)
        other = arb(m, max(m - a, b - m) * (1.0 + 1e-15))
        joints = (arb(at), other) if d == 0 else (other, arb(at))
        if _touches(claims, i, (at, m) if d == 0 else (m, at), *joints):
            continue
        if not a < m < b:
            return False
        waiting += [(m, b), (a, m)]
    return False


def _touches(claims: Claims, i: int, middle: tuple[float, float], alpha: arb, beta: arb) -> bool:
    """Whether a point of arm i, the nearest at the middle, stays nearer than the margin to what never moves."""
    now = claims.links(i, arb(middle[0]), arb(middle[1]), arb(0), arb(0))
    over = claims.links(i, alpha, beta, arb(0), arb(0))
    for j in range(len(claims.arms)):
        if j == i or (j < claims.n and claims.online[j]):
            continue
        if j < claims.n and abs(claims.base[i] - claims.base[j]) > 4.0 * claims.reach[i]:
            continue  # too far for a proof, which is then not found
        turned, bent = map(arb, claims.knots[j][0, 1:].tolist()) if j < claims.n else (arb(0), arb(0))
        fixed = claims.links(j, turned, bent, arb(0), arb(0))
        for _, one, _, other in claims.meeting(i, j):
            here = np.array([complex(now[one.link][0] + now[one.link][2] * z) for z in one.exact])
            there = np.array([complex(fixed[other.link][0] + fixed[other.link][2] * z) for z in other.exact])
            for a in one.parts:
                for b in other.parts:
                    s, place = _nearest(here[[*a]], there[[*b]])
                    weights = [one.exact[k] * arb(w) for k, w in zip(a, s, strict=True)]
                    own = over[one.link][0] + over[one.link][2] * sum(weights, acb(0))
                    room = arb(one.radius) + arb(other.radius) + arb(claims.margin) - EPSILON
                    if abs(own - acb(place.real, place.imag)) < room:
                        return True
    return False


def _nearest(part: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, complex]:
    """A point of a convex part, as weights of its vertices (k,), and one of another: the nearest, or a common one."""
    best = (np.inf, np.eye(len(part))[0], complex(other[0]))
    for k in range(len(part)):
        a, b = part[k], part[(k + 1) % len(part)]
        for m in range(len(other)):
            c, d = other[m], other[(m + 1) % len(other)]
            for s, t in _candidates(a, b, c, d):
                p, q = a + s * (b - a), c + t * (d - c)
                if abs(p - q) < best[0]:
                    weights = np.zeros(len(part))
                    weights[k] += 1.0 - s
                    weights[(k + 1) % len(part)] += s
                    best = (abs(p - q), weights, complex(q))
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
