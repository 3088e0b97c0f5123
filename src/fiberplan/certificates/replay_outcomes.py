"""Is what a plan file says besides the clearances so? Limits, start, goals, outcomes, and pairs that begin nearer.

The other part of a replay, made of the same `Claims` as `fiberplan.certificates.replay`, which has the proof of safety
proper. Nothing of planner or verifier is used here either.

Sums and differences of single stored numbers are taken in floating point, where they are exact to a part in 1e16 and
compared with tolerances of 1e-9; whatever needs a sine is done with balls.
"""

import math
import re
from collections.abc import Iterator
from itertools import chain, pairwise

import numpy as np
from flint import acb, arb

from fiberplan.certificates.replay import BadFileError, Claims, everywhere
from fiberplan.certificates.replay_infeasible import has_proof, unfounded

RANGE, SPEED, SAME_START = 1e-9, 1e-9, 1e-9  #: [rad], part of the limit, [rad]: so far off is not off
START_RANGE = 8.8e-3  #: a joint may begin this far out of its range, and then only comes back [rad]
ARRIVAL = 1e-3  #: a fiber this close to its goal has arrived [mm]
ZONE = 1e-6  #: a slider this far out of its range is in it [mm]
OPENING = 1e-6  #: what a pair that begins nearer may lose, or be farther apart before it has the margin [mm]
OUTCOMES = ("OFFLINE", "NO_TARGET", "DROPPED", "ARRIVED", "INFEASIBLE", "DEADLOCKED")


def faults(claims: Claims) -> Iterator[str]:
    """What does not hold, a line each.

    Raises:
        BadFileError: a column is missing, or holds what it cannot.
    """
    try:
        if claims.said["certificate"]["margin"] != claims.margin or claims.said["certificate"]["jitter"] != 0:
            yield "the certificate is about another margin, or about clocks that are off, which is not replayed"
        yield from _limits(claims)
        yield from _sliders(claims)
        yield from _outcomes(claims)
        for i in _infeasible(claims):
            yield from unfounded(claims, label(claims, i), i) if has_proof(claims, i) else ()
        yield from _openings(claims)
    except (LookupError, TypeError, AttributeError, ValueError) as error:
        raise BadFileError(f"cannot be used ({error})") from None


def not_replayed(claims: Claims) -> Iterator[str]:
    """What the file claims, or asks of motors, and a replay says nothing of."""
    count = sum(not has_proof(claims, i) for i in _infeasible(claims))
    if count:
        yield f"{count} losses are said to be proven, without a proof in the file: losses without a claimed proof"
    for name, what in (("max_acceleration", "accelerations"), ("min_speed", "least speeds")):
        if f"{name}_alpha" in (claims.table.dtype.names or ()):
            yield f"limits of {what} are not replayed; `fiberplan verify` has them"
    if claims.said.get("bounds"):
        yield "bounds of the makespan are not replayed"


def _infeasible(claims: Claims) -> list[int]:
    """Positioners that are said to be unable to reach their goals."""
    return [i for i, outcome in enumerate(_words(claims, "outcome")) if outcome == "INFEASIBLE"]


def label(claims: Claims, arm: int) -> str:
    """An arm as people know it: obstacles, which follow the positioners, by their names."""
    if arm < claims.n:
        return f"positioner '{claims.table['positioner'][arm].decode()}'"
    table = claims.tables["OBSTACLES"]
    return f"obstacle '{table['name'][np.argmax(table['obstacle'] == arm - claims.n)].decode()}'"


def _words(claims: Claims, name: str) -> list[str]:
    return [cell.decode() for cell in claims.problem[name].tolist()]


def _joints(table: np.ndarray, name: str) -> np.ndarray:
    """(n, 2) columns of both joints."""
    return np.stack([table[f"{name}_{joint}"].astype(float) for joint in ("alpha", "beta")], axis=1)


def _limits(claims: Claims) -> Iterator[str]:
    """Start, ranges and speeds; offline positioners stand. A comparison with NaN is a fault."""
    start, lower, upper = _joints(claims.problem, "start"), *(_joints(claims.table, k) for k in ("lower", "upper"))
    fastest = _joints(claims.table, "max_speed")
    for i, own in enumerate(claims.knots):
        times, angles = own[:, 0], own[:, 1:]
        who = label(claims, i)
        if not (np.abs(angles[0] - start[i]) <= SAME_START).all():
            yield f"{who} does not begin at the stated start"
        if not claims.online[i]:
            if not (angles == angles[0]).all():
                yield f"{who} is offline but moves"
            continue
        out = np.maximum(np.maximum(lower[i] - angles, angles - upper[i]), 0.0)
        nearest = np.minimum.accumulate(out, axis=0)  # a joint that begins out of range gets no farther out
        allowed = np.where((out[0] > RANGE) & (out[0] <= START_RANGE), np.roll(nearest, 1, axis=0), 0.0)
        allowed[0] = np.where(out[0] <= START_RANGE, out[0], 0.0)
        if not ((out <= allowed + RANGE).all() and (lower[i] <= upper[i]).all()):
            yield f"{who} leaves its range"
        speed = np.abs(np.diff(angles, axis=0)) / np.diff(times)[:, None]
        if not (speed <= fastest[i] * (1.0 + SPEED)).all():
            yield f"{who} is faster than it can be"


def _sliders(claims: Claims) -> Iterator[str]:
    """Four-bar arms stay out of their zones of avoidance: between any two knots the slider is in its range."""
    for i in np.flatnonzero(claims.online).tolist() if claims.bar.size else []:
        low, high = (max(arb(0), arb(x) + y) ** 2 for x, y in zip(claims.bar[i, 2:4], (-ZONE, ZONE), strict=True))
        times = claims.knots[i][:, 0].tolist()

        def look(m: float, h: float, todo: list, i: int = i, low: arb = low, high: arb = high) -> tuple[list, list]:
            now, over = (links[-1] for links in claims.seen(i, m, h))
            square = abs(now[0]) ** 2
            all_over = square + 2 * (over[0].conjugate() * over[1]).real * arb(0, h)
            return [k for k in todo if not low <= all_over <= high], [k for k in todo if not low <= square <= high]

        if not all(everywhere(a, b, [i], look) for a, b in [*pairwise(times)] or [(times[0], times[0])]):
            yield f"{label(claims, i)} is not shown to keep out of its zone of avoidance"


def _outcomes(claims: Claims) -> Iterator[str]:
    """Outcomes are such as the problem allows, and who is said to arrive ends at its goal."""
    goal, requested = (_joints(claims.problem, name) for name in ("goal", "requested"))
    dropped, near = claims.problem["dropped"] == b"T", set(chain(*claims.opening))
    for i, outcome in enumerate(_words(claims, "outcome")):
        who, asked = label(claims, i), not np.isnan(requested[i]).all()
        must = "OFFLINE" if not claims.online[i] else "DROPPED" if dropped[i] else None if asked else "NO_TARGET"
        wedged = must == "NO_TARGET" and outcome == "DEADLOCKED" and i in near
        if outcome not in OUTCOMES or (outcome != must and not wedged if must else outcome in OUTCOMES[:2]):
            yield f"{who} is said to be {outcome}, which the problem rules out"
        kept = not np.isnan(goal[i]).all()
        if kept and not (goal[i] == requested[i]).all():
            yield f"{who} has a goal that is not the one it was asked for"
        if outcome == "ARRIVED" and not (kept and _arrives(claims, i, goal[i])):
            yield f"{who} is said to arrive and is not shown to"


def _arrives(claims: Claims, i: int, goal: np.ndarray) -> bool:
    """Whether every fiber of positioner i ends where it is in one of the configurations at its goal."""
    ends = goal[None]
    if "alternatives_alpha" in (claims.problem.dtype.names or ()):
        ends = np.vstack([ends, _joints(claims.problem, "alternatives")[i].reshape(2, -1).T])
    fibers = [x for x in claims.table.dtype.names or () if re.fullmatch(r"fiber\d+_x", x)]
    offsets = [acb(float(claims.table[x][i]), float(claims.table[f"{x[:-1]}y"][i])) for x in fibers]
    carried = [offset for offset in offsets if offset.is_finite()]

    def places(angles: np.ndarray) -> list[acb]:
        alpha, beta = map(arb, angles.tolist())
        origin, _, turn, _ = claims.links(i, alpha, beta, arb(0), arb(0))[2]
        return [origin + turn * offset for offset in carried]

    end = places(claims.knots[i][-1, 1:])
    return bool(carried) and any(all(abs(z - w) < ARRIVAL for z, w in zip(end, places(at), strict=True)) for at in ends)


def _openings(claims: Claims) -> Iterator[str]:
    """Pairs that are said to begin nearer do, and stay below the margin until they are said to have it.

    That they lose nothing until then, and keep the margin from then on, is judged with all other pairs.
    """
    pairs = set(claims.pairs()) if claims.opening else set()
    for (i, j), (clearance, until) in claims.opening.items():
        what = f"{label(claims, i)} and {label(claims, j)}, said to begin nearer than the margin,"
        if (i, j) not in pairs or not clearance < claims.margin or not until > 0:
            yield f"{what} are no such pair"
            continue
        times = sorted({t for arm in (i, j) if arm < claims.n for t in claims.knots[arm][:, 0].tolist()})
        if not _upper(claims, i, j, times[0], 0.0) <= clearance + OPENING:
            yield f"{what} are not shown to begin so near"
        cuts = [t for t in times if t < until] + [min(until, times[-1])]

        def look(m: float, h: float, todo: list, i: int = i, j: int = j) -> tuple[list, list]:
            return [k for k in todo if not _upper(claims, i, j, m, h) < claims.margin + OPENING], []

        if not all(everywhere(a, b, [0], look) for a, b in pairwise(cuts) if a < b):
            yield f"{what} are not shown to be below it until {until:.6g} s"


def _upper(claims: Claims, i: int, j: int, m: float, h: float) -> float:
    """An upper bound of a pair's signed clearance, less the position errors, all over m +- h [mm].

    The depth of two convex parts that overlap is the largest gap along the normal of an edge; the distance of two that
    do not, that along such or along the connection of two vertices. A clearance changes no faster than vertices move.
    """
    arms = [claims.vertices(arm, m, h) for arm in (i, j)]
    origin = arms[0][0][0][0]  # floats are of what is near
    places = [[np.array([complex(z - origin) for z, _ in shape]) for shape in arm] for arm in arms]
    least = math.inf
    for p, a, q, b, room in claims.parts(i, j):
        one, other = places[0][p][[*a]], places[1][q][[*b]]
        edges = np.concatenate([1j * (np.roll(part, -1) - part) for part in (one, other)])
        ways = np.concatenate([edges, -edges, (other - one[:, None]).ravel()])
        ways = (ways[ways != 0] / np.abs(ways[ways != 0])).conj()[:, None]
        gaps = (ways * other).real.min(axis=1) - (ways * one).real.max(axis=1)
        least = min(least, gaps.max(initial=-math.inf if len(ways) else 0.0) - float(room))
    speed = sum(max(float(abs(v).upper()) for shape in arm for _, v in shape) for arm in arms)
    return least + speed * h + 1e-9
