"""Proof that a positioner cannot get from start to goal past what never moves, whatever all others do.

The joint ranges are tiled with boxes. A box is blocked if at its middle the arm is closer to something fixed than the
margin by more than any body point can move within the box: then it is in contact everywhere in the box. Where it
overlaps something its depth counts, so that also outlines without a radius are in contact, at any margin. A motion that
stays clear passes only through boxes that are not blocked, each next to the one before; where those that can be come to
from the start do not include the goal's, there is no such motion. Leaving everyone else out only makes room, so the
proof stands for the whole field. That a proof is not found says nothing.

Boxes that are neither blocked nor clear everywhere are halved in both joints, level by level, so that passages too
narrow by a few micrometres are found closed. Of the undecided those alone are kept that could join what is apart: a
cluster of them that touches a single region of clear boxes leads from it to nowhere else.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fiberplan.arrays import number, read_only
from fiberplan.certificates.tiling import Layer, Tiling
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import motion
from fiberplan.kernels.compile import kernel
from fiberplan.kernels.depth import signed_clearance
from fiberplan.tolerances import ROUNDING

_WIDEST = np.radians(6.0)  # of the boxes of the first level
_LEVELS = 11  # the narrowest boxes are 0.006 deg wide: an arm of 22 mm moves by 2 um in half of one
_MOST = 400_000  # boxes of one level


@kernel
def _least_clearance(arms, i, fixed, pose, at):
    """(m,) clearance of arm i from the nearest of `fixed`, at each of some joint angles (m, 2); negative: its depth."""
    least = np.full(len(at), np.inf)
    for m in range(len(at)):
        for k in range(len(fixed)):
            clear = signed_clearance(arms, i, at[m, 0], at[m, 1], fixed[k], pose[k, 0], pose[k, 1])
            if not clear >= least[m]:
                least[m] = clear
    return least


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
    return closed_region(plane, i, start, goal, margin) is not None


def closed_region(plane: FocalPlane, i: int, start: np.ndarray, goal: np.ndarray, margin: float) -> np.ndarray | None:
    """The boxes of joint space that positioner `i` cannot leave, if its goal is proven not to be among them.

    All around them the arm is nearer than the margin to what never moves, or at the end of a joint's range, which
    `fiberplan.certificates.replay_infeasible` checks. Arguments as of `proven_unreachable`.

    Returns:
        (m, 2, 2) low and high of each joint [rad]; None where there is a way or nothing was proven.
    """
    goal = read_only(goal, unit="rad", name="goal", error=ProblemError)

    def ends(tiling: Tiling, layer: Layer, within: float) -> tuple[np.ndarray, np.ndarray]:
        held = tiling.holds(layer, goal)
        return held, held

    return _without_ends(plane, i, start, margin, ends)


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
    goal = read_only(goal, unit="rad", name="goal", error=ProblemError)[None]
    other, margin = np.array([i]), number(margin, "mm", "margin", ProblemError)

    def ends(tiling: Tiling, layer: Layer, within: float) -> tuple[np.ndarray, np.ndarray]:
        room = _least_clearance(plane.arms, j, other, goal, tiling.middles(layer))
        return ~(room + within < margin), room >= margin

    return _without_ends(plane, j, start, margin, ends) is not None


def _without_ends(
    plane: FocalPlane,
    i: int,
    start: np.ndarray,
    margin: float,
    ends: Callable[[Tiling, Layer, float], tuple[np.ndarray, np.ndarray]],
) -> np.ndarray | None:
    """Boxes (m, 2, 2) that positioner `i` cannot leave past what never moves, if none of its `ends` is among them.

    `ends` tells of boxes, in which a point of its bodies moves so far from where it is at their middles [mm], whether
    one may lie in them (m,), and whether one does. Nothing is proven of who begins nearer than the margin, and opens.
    """
    margin = number(margin, "mm", "margin", ProblemError)
    start = read_only(start, unit="rad", name="start", error=ProblemError)
    low, high = plane.lower[i], plane.upper[i]
    if plane.kinematics.has_avoidance or not np.all(np.isfinite([low, high])):
        return None
    pairs = plane.arm_pairs_within(margin)
    beside = np.concatenate([pairs[pairs[:, 0] == i, 1], pairs[pairs[:, 1] == i, 0]])
    never_moves = np.concatenate([~plane.online, np.ones(len(plane.obstacles), bool)])
    fixed = read_only(np.sort(beside[never_moves[beside]]), np.int64)
    pose = read_only(plane.with_obstacles(start)[fixed])
    count = np.maximum(1.0, np.ceil((high - low) / _WIDEST))
    opens = not _least_clearance(plane.arms, i, fixed, pose, start[i, None])[0] >= margin
    if opens or count.prod() > _MOST:
        return None
    tiling = Tiling(low, high, count.astype(np.int64))
    layer, dead_ends = tiling.whole(), list[Layer]()
    for _ in range(_LEVELS):
        width = tiling.width(layer.level)
        room = _least_clearance(plane.arms, i, fixed, pose, tiling.middles(layer))
        within = motion(plane.arms, i, 0.5 * width[0], 0.5 * width[1]) + ROUNDING
        possible, certain = ends(tiling, layer, within)
        clear = (room - within >= margin) & (certain | ~possible)
        tiling.add_clear(replace(layer, goal=certain)[clear])
        undecided = replace(layer, goal=possible)[~clear & ~(room + within < margin)]
        if not tiling.joined(start[i], undecided):
            every = Tiling(low, high, tiling.count)
            for part in sorted([*tiling.clear, undecided, *dead_ends], key=lambda part: part.level):
                every.add_clear(part)
            return every.region(start[i])
        joins = tiling.joins(undecided, start[i])
        dead_ends.append(undecided[~joins])
        undecided = undecided[joins]
        if tiling.joined(start[i]) or 4 * len(undecided) > _MOST:
            return None
        layer = undecided.halved()
    return None
