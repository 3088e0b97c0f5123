"""Proof that positioners cannot all get from where they start to their goals, whatever everybody else does.

The joint space of one, two or three of them is cut into boxes (`fiberplan.certificates.subdivision`), past what never
moves and past each other. Where no chain of boxes that are not blocked leads from the start to the goal, there is no
motion either: leaving everyone else out only makes room, so the proof stands for the whole field. Blocked is what is
nearer than the margin less `BELOW`, all over a box. Overlapping outlines count by their depth, so that those without a
radius are blocked, too, at any margin. That a proof is not found says nothing.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fiberplan.arrays import number, read_only
from fiberplan.certificates.box_search import CLOSED, FAR, FULL, PATH, search
from fiberplan.certificates.subdivision import BLOCKED, BOX, HALVED, Boxes, Query
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane

BELOW = 2e-6  #: what is blocked is nearer than the margin by so much [mm]
MOST = {1: 200_000, 2: 60_000, 3: 60_000}  #: boxes looked at for so many positioners, unless more are allowed
_TURNS = 1e3  # joint ranges are no wider than this [rad]: boxes of many turns take too long
_FIRST = 2_000  # boxes that there is room for at first


class Barrier(NamedTuple):
    """A proof that some positioners cannot all be at their goals: boxes around the start that have no way out."""

    positioners: tuple[int, ...]  #: whose joints the boxes are of
    goals: dict[int, tuple[float, float]]  #: positioners that cannot all be where they are asked to be, and where [rad]
    #: The boxes from the whole joint space on: a digit is the joint in which a box is halved (alpha and beta of the
    #: first, then of the second), and its lower and upper half follow; ``i`` is a box that may be come to from the
    #: start, ``b`` one that is blocked, and ``o`` any other.
    tree: str


def decided(
    plane: FocalPlane,
    positioners: Sequence[int],
    goals: Mapping[int, np.ndarray],
    start: np.ndarray,
    margin: float,
    most: int | None = None,
) -> tuple[np.ndarray | None, Barrier | None]:
    """Whether positioners can move past what never moves, and each other, so that others can be at their goals, too.

    Args:
        plane: the array, of arms of two links.
        positioners: one, two or three that move; all others but those that never move are left out.
        goals: where some are to be at the end (2,) [rad]: of those that move, or others that are there by then.
        start: (n, 2) where everyone stands [rad]; offline positioners stay there.
        margin: clearance to keep [mm].
        most: boxes to look at; `MOST` unless given.

    Returns:
        A path (m, 2 k) of those that move, even between its points [rad], or a proof that there is none; neither if
        nothing was decided, as for joint ranges of many turns.
    """
    margin = number(margin, "mm", "margin", ProblemError)
    start = read_only(start, unit="rad", name="start", error=ProblemError)
    ends = {int(i): read_only(q, unit="rad", name="goal", error=ProblemError) for i, q in goals.items()}
    who = [int(i) for i in positioners]
    low, high = plane.lower[who].ravel(), plane.upper[who].ravel()
    if plane.kinematics.has_avoidance or not np.all(np.abs([low, high]) < _TURNS):
        return None, None
    query = _query(plane, who, ends, start, margin)
    if not (query.start == np.clip(query.start, low, high)).all():
        return None, None
    boxes, answer, end = _room(_FIRST, query, low, high), FULL, -1
    while answer == FULL:
        answer, end = search(query, boxes, most or MOST[len(who)])
        if answer == FULL:
            boxes = _more_room(boxes)
    if answer == PATH:
        return _path(query, boxes, end), None
    stated = {i: (float(q[0]), float(q[1])) for i, q in ends.items()}
    return None, Barrier(tuple(who), stated, _tree(boxes)) if answer == CLOSED else None


def proven_unreachable(plane: FocalPlane, i: int, start: np.ndarray, goal: np.ndarray, margin: float) -> bool:
    """Whether positioner `i` is proven unable to reach its goal past obstacles and offline positioners.

    Args:
        plane: the array, of arms of two links.
        i: the positioner.
        start: (n, 2) where everyone stands [rad]; offline positioners stay there.
        goal: (2,) where `i` should go [rad].
        margin: clearance to keep [mm].

    Returns:
        True only with proof; False if there is a way or if nothing was proven, as for joint ranges of many turns.
    """
    return decided(plane, [i], {i: goal}, start, margin)[1] is not None


def proven_excluded(plane: FocalPlane, i: int, goal: np.ndarray, j: int, start: np.ndarray, margin: float) -> bool:
    """Whether positioner `i` is proven unable to be at its goal, for want of a place where `j` could be then.

    Wherever `j` can go past obstacles and offline positioners, if there were nobody else, it touches `i` at its goal.

    Args:
        plane: the array, of arms of two links.
        i: the positioner that has a goal.
        goal: (2,) where it should go [rad].
        j: the positioner that is in its way, whatever its own goal.
        start: (n, 2) where everyone stands [rad]; offline positioners stay there.
        margin: clearance to keep [mm].

    Returns:
        True only with proof.
    """
    return decided(plane, [j], {i: goal}, start, margin)[1] is not None


def _query(
    plane: FocalPlane, who: list[int], ends: Mapping[int, np.ndarray], start: np.ndarray, margin: float
) -> Query:
    """What is asked, as the kernels take it."""
    fixed = np.concatenate([~plane.online, np.ones(len(plane.obstacles), bool)])
    others = [i for i in ends if i not in who]
    slots, contacts = [*who], []
    pairs = plane.arm_pairs_within(margin)
    for pair in pairs[np.isin(pairs, who).any(axis=1)].tolist():
        for a, b in (pair, pair[::-1]):
            if a in who and (fixed[b] or b in others or (b in who and a < b)):
                slots += [] if b in slots else [b]
                contacts.append((slots.index(a), slots.index(b), b in others))
    pose = np.array(plane.with_obstacles(start)[slots])
    for k, arm in enumerate(slots):
        if arm in others:
            pose[k] = ends[arm]
    goal = np.concatenate([ends.get(i, np.full(2, np.nan)) for i in who])
    table = np.array(contacts, np.int64).reshape(-1, 3)
    return Query(
        plane.arms,
        np.array(slots, np.int64),
        pose,
        np.zeros_like(pose),
        np.ascontiguousarray(table[:, :2]),
        table[:, 2] == 1,
        start[who].ravel(),
        goal,
        margin,
        margin - BELOW,
    )


def _room(most: int, query: Query, low: np.ndarray, high: np.ndarray) -> Boxes:
    """Room for so many boxes, in which the first is the whole joint space; `search` fills in the rest."""
    boxes = Boxes(
        np.zeros(most, BOX),
        np.zeros((most, len(low))),
        np.zeros((most, len(low))),
        np.ones((most, len(query.contact)), bool),
        np.full((24 * most, 2), -1, np.int32),
        np.zeros(2, np.int64),
    )
    boxes.low[0], boxes.high[0] = low, high
    return boxes


def _more_room(boxes: Boxes) -> Boxes:
    """Twice the room, with what is known."""
    box, low, high, unsure, edge = (np.concatenate([part, part]) for part in boxes[:-1])
    return Boxes(box, low, high, unsure, edge, boxes.used)


def _path(query: Query, boxes: Boxes, end: int) -> np.ndarray:
    """(m, d) from the start through the middles of the sides that boxes of a chain of clear ones share [rad]."""
    chain = [end]
    while boxes.box["before"][chain[-1]] >= 0:
        chain.append(int(boxes.box["before"][chain[-1]]))
    low, high = boxes.low[chain[::-1]], boxes.high[chain[::-1]]
    sides = 0.5 * (np.maximum(low[1:], low[:-1]) + np.minimum(high[1:], high[:-1]))
    points = np.concatenate([query.start[None], sides])
    last = np.where(np.isnan(query.goal), np.clip(points[-1], low[-1], high[-1]), query.goal)
    return read_only(np.concatenate([points, last[None]]))


def _tree(boxes: Boxes) -> str:
    """The boxes as a `Barrier` states them; halves that are both ``i``, or both ``o``, are told as one."""
    count = int(boxes.used[0])
    box = boxes.box[:count]
    inside = (box["state"] < BLOCKED) & (box["from_start"] < FAR)
    needed = np.zeros(count, bool)
    edges = int(boxes.used[1])
    ends = boxes.edge[:edges, 0][np.arange(edges) ^ 1], boxes.edge[:edges, 0]  # of each edge, from and to
    needed[ends[1][inside[ends[0]]]] = True
    said = np.where(inside, "i", np.where((box["state"] == BLOCKED) & needed, "b", "o")).tolist()
    for k in reversed(np.flatnonzero(box["state"] == HALVED).tolist()):  # halves come after the box that they are of
        child = int(box["child"][k])
        one, other = said[child], said[child + 1]
        said[k] = one if one == other and one in "io" else f"{box['joint'][k]}{one}{other}"
    return str(said[0])
