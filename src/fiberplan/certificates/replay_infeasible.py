"""Is who is said to be unable to reach its goal proven to be? The third part of a replay: read it with the first.

A proof (a *barrier*) is about the joints of one, two or three positioners, which it says turn, and about goals that it
says not all can be at, of these or of others. It holds boxes of their joint space: from the whole of it on, a digit is
the joint in which a box is halved, and its lower and upper half follow; ``i`` is a box that may be come to from the
start, ``b`` one that is blocked, ``o`` any other. It holds if

- the start is in an ``i``;
- what shares a side with an ``i`` is an ``i`` or a ``b``: there is no other way out, since joints end where the whole
  joint space does;
- in every ``b`` that does, one of the positioners is nearer than the margin, less 1e-6 mm, to another or to what never
  moves, wherever in the box their joints are;
- in every ``i`` in which the goals are, the same holds where joints that have a goal are at it.

Whatever all others do makes no difference. How a box is judged is in `replay_contact.py`. It says nothing of who begins
nearer than the margin. Of a goal too far for the time there is, to which the plan keeps, joint speeds are the proof.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

from fiberplan.certificates.replay import FLOATS, Claims, refuse
from fiberplan.certificates.replay_boxes import grown, sides
from fiberplan.certificates.replay_contact import Barrier, is_blocked

SPEED = 1e-9  # part of a limit or time that is not told apart


def unfounded(claims: Claims, label: str, i: int) -> Iterator[str]:
    """What does not hold of the proofs that positioner i cannot reach its goal; none if there are no proofs."""
    if any(i in pair for pair in claims.opening):
        yield f"{label} begins nearer than the margin, of which no proof that it cannot reach its goal is known"
        return
    ends, shown = _ends(claims, i), list[tuple[frozenset, tuple]]()
    if not ends:
        yield f"{label} is said to be unable to reach its goal, and has none"
    for number, barrier in _barriers(claims, i).items():
        gap = _gap(claims, barrier)
        if gap is not None:
            yield f"{label}: barrier {number} is not shown to be closed: {gap}"
            continue
        shown.append((frozenset(barrier.goals) - {i}, tuple(sorted(barrier.goals.items()))))
    for end, late in zip(ends, _too_late(claims, i, ends), strict=True):
        if not late and not any(_excluded(claims, i, end, others, shown) for others in {who for who, _ in shown}):
            yield f"{label} is said to be unable to reach its goal, and is not shown to be"
            return


def _excluded(claims: Claims, i: int, end: tuple, others: frozenset, shown: list) -> bool:
    """Whether i is shown not to be at `end` while `others`, who arrive, are wherever it counts as their goals."""
    if not all(claims.problem["outcome"][j] == b"ARRIVED" for j in others):
        return False
    there = [[(j, at) for at in _ends(claims, j)] for j in sorted(others)]
    known = {goals for who, goals in shown if who == others}
    return all(tuple(sorted([(i, end), *places])) in known for places in product(*there))


def has_proof(claims: Claims, i: int) -> bool:
    """Whether the file holds anything that could prove that positioner i cannot reach its goal."""
    return bool(_barriers(claims, i)) or all(_too_late(claims, i, _ends(claims, i)))


def _barriers(claims: Claims, i: int) -> dict[int, Barrier]:
    """Proofs that positioner i is lost, by their numbers."""
    members, trees = (claims.tables.get(f"CERTIFICATE_{name}") for name in ("BARRIERS", "TREES"))
    if members is None or trees is None or claims.bar.size:
        return {}
    found = {}
    for number in np.unique(members["barrier"][members["lost"] == i]).tolist():
        own = members[members["barrier"] == number]
        goals = {int(row["positioner"]): (float(row["goal_alpha"]), float(row["goal_beta"])) for row in own}
        turns = own["positioner"][own["turns"] == b"T"].tolist()
        text = b"".join(trees["boxes"][trees["barrier"] == number].tolist()).decode()
        wrong = [j for j in own["positioner"].tolist() if not (0 <= j < claims.n and claims.online[j])]
        refuse(wrong or len({*own["positioner"].tolist()}) < len(own), "CERTIFICATE_BARRIERS: no such positioners")
        found[number] = Barrier(turns, {j: at for j, at in goals.items() if not np.isnan(at).all()}, text)
    return found


def _ends(claims: Claims, i: int) -> list[tuple[float, float]]:
    """Configurations that count as positioner i's goal [rad]."""
    names, problem = ("alpha", "beta"), claims.problem
    ends = [np.array([float(problem[f"goal_{joint}"][i]) for joint in names])[None]]
    if "alternatives_alpha" in (problem.dtype.names or ()):
        ends.append(np.stack([np.ravel(problem[f"alternatives_{joint}"][i]).astype(float) for joint in names], axis=1))
    every = np.concatenate(ends)
    return [(alpha, beta) for alpha, beta in every[~np.isnan(every).all(axis=1)].tolist()]


def _too_late(claims: Claims, i: int, ends: list) -> list[bool]:
    """Of each configuration, whether a joint's speed does not let it be reached in the time that the plan keeps to."""
    most = claims.said["parameters"].get("max_time")
    lasts = max(own[-1, 0] for own in claims.knots) - min(own[0, 0] for own in claims.knots)
    if most is None or not lasts <= float(most) * (1.0 + SPEED):
        return [False] * len(ends)
    speed = np.array([float(claims.table[f"max_speed_{joint}"][i]) for joint in ("alpha", "beta")])
    needed = [np.abs(np.array(end) - claims.knots[i][0, 1:]) / speed for end in ends]
    return [bool((own > float(most) * (1.0 + SPEED)).any()) for own in needed]


def _gap(claims: Claims, barrier: Barrier) -> str | None:
    """Where a barrier is not shown to be closed; None if it is."""
    joints = [(i, joint) for i in barrier.turns for joint in ("alpha", "beta")]
    low, high = ([float(claims.table[f"{end}_{joint}"][i]) for i, joint in joints] for end in ("lower", "upper"))
    start = np.concatenate([[], *(claims.knots[i][0, 1:] for i in barrier.turns)]).tolist()
    boxes = grown(low, high, barrier.tree) if 1 <= len(barrier.turns) <= 3 else None
    if boxes is None or not np.isfinite([*low, *high]).all():
        return "its boxes are no such boxes"
    if claims.slack > 2 * FLOATS:
        return "its coordinates are larger than rounding is allowed for"
    whole, leaves = boxes
    if not any(box.mark == "i" and box.holds(start) for box in leaves):
        return "the start is outside"
    for a, b in sides(whole):
        if "o" in (a.mark, b.mark):
            return f"there is a way out at {_said(a.low, a.high)}"
        a.beside = b.beside = True
    goal = [x for i in barrier.turns for x in barrier.goals.get(i, (np.nan, np.nan))]
    for box in leaves:
        if box.mark == "b" and box.beside and not is_blocked(claims, barrier, box.low, box.high, False):
            return f"nobody touches all over {_said(box.low, box.high)}"
        if box.mark == "i" and box.holds(goal):
            ends = [[a if np.isnan(x) else x for x, a in zip(goal, side, strict=True)] for side in (box.low, box.high)]
            if not is_blocked(claims, barrier, ends[0], ends[1], True):
                return f"the goals may be in {_said(box.low, box.high)}"
    return None


def _said(low: list[float], high: list[float]) -> str:
    return ", ".join(f"{a:.6g} to {b:.6g}" for a, b in zip(low, high, strict=True)) + " rad"
