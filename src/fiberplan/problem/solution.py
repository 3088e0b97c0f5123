"""The joint angles that put fibers on targets, and why some targets have none."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fiberplan.arrays import read_only, told_apart
from fiberplan.errors import TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.inverse_kinematics import solutions
from fiberplan.focal_plane.two_link import reach
from fiberplan.problem.agreement import NAMED, Agreement, agreement, distances, second_names_agree
from fiberplan.tolerances import ARRIVAL

if TYPE_CHECKING:
    from fiberplan.problem.targets import Targets

_SHOWN = 4  # how many unreachable targets an error message lists


class Solution(NamedTuple):
    """What targets ask of each positioner of a focal plane."""

    goal: np.ndarray  #: (n, 2) commanded angles [rad]; NaN rows have no target that can be reached
    alternatives: np.ndarray  #: (n, k, 2) other angles that reach the same target, NaN-padded [rad]
    unreachable: dict[int, str]  #: positioner -> why its target is out of reach
    lacking: dict[int, str]  #: positioner -> which fiber its target names that it does not carry
    priority: np.ndarray  #: (n,) 1 without a target
    apart: dict[int, str]  #: positioner -> how far its target's angles and position disagree
    notes: tuple[str, ...]  #: how well angles and positions agree
    named: tuple[str, ...]  #: of the notes, what a proof rests on
    wished: np.ndarray  #: (n,) goals of idle positioners, which give way to targets


def _offsets(targets: "Targets", plane: FocalPlane, who: np.ndarray) -> np.ndarray:
    """(m, 2) of each target's fiber in its beta link's frame [mm]; NaN where the positioner lacks that fiber."""
    offset = plane.fiber[who]
    known = {name.lower(): name for name in plane.fiber_offsets}
    for row, name in enumerate(targets.fiber or ()):
        if name and name.lower() not in known:
            raise targets.fail(row, f"{plane.name} has no fiber '{name}'; it has {', '.join(plane.fiber_offsets)}")
        if name:
            offset[row] = plane.fiber_offsets[known[name.lower()]][who[row]]
    return offset


def solved(targets: "Targets", plane: FocalPlane) -> Solution:
    """Joint angles for every target: of several, those reached soonest from folded (ties: right elbow).

    Targets given as angles are taken as they are, and have no alternatives. Where a row gives a position beside
    them, the two are compared.

    Raises:
        TargetError: targets without positioners, a positioner or fiber that `plane` does not have, targets of
            another observatory, or a field of which most rows disagree by more than 0.2 mm and `prefer` is not set.
    """
    if targets.site and plane.site and targets.site.lower() != plane.site.lower():
        raise TargetError(f"{targets.source}: is of {targets.site}, but {plane.name} is of {plane.site}")
    who = targets.indices(plane)
    offset = _offsets(targets, plane, who)
    points = np.stack([targets.x, targets.y], axis=1)
    renamed = second_names_agree(plane, who, targets.second_names, targets.source, bool(targets.prefer))
    agreed, commanded = _agreement(targets, plane, who, points)
    if not plane.kinematics.has_parities and np.any(targets.parity):
        row = int(np.argmax(targets.parity != 0))
        raise targets.fail(row, f"parity is given, but {plane.kinematics.name} arms have none")
    found = solutions(plane, who, points, offset, targets.parity)
    found[np.hypot(targets.x, targets.y) > plane.field_radius] = np.nan
    found[commanded] = np.nan
    found[commanded, 0] = within_range(plane, who, targets.angles, offset)[commanded]
    found[list(agreed.apart)] = np.nan
    most = int(np.isfinite(found[:, :, 0]).sum(axis=1).max(initial=1))

    goal = np.full((plane.n, 2), np.nan)
    alternatives = np.full((plane.n, most - 1, 2), np.nan)
    priority = np.ones(plane.n)
    goal[who], alternatives[who], priority[who] = found[:, 0], found[:, 1:most], targets.priority
    lost = np.flatnonzero(np.isnan(found[:, 0, 0]))
    lacks = np.isnan(offset).any(axis=1)
    why = {int(r): r not in agreed.apart and not lacks[r] for r in lost}
    unreachable = {int(who[r]): _why_unreachable(targets, plane, r, who, offset) for r, is_far in why.items() if is_far}
    lacking = {int(who[r]): _which_fiber(targets, plane, int(r), int(who[r])) for r in np.flatnonzero(lacks)}
    wished = np.zeros(plane.n, bool)
    wished[who] = ~targets.assigned
    return Solution(
        goal=read_only(goal),
        alternatives=read_only(alternatives),
        unreachable=unreachable,
        lacking=lacking,
        priority=read_only(priority),
        apart={int(who[r]): text for r, text in agreed.apart.items()},
        notes=(*renamed, *agreed.notes),
        named=agreed.named,
        wished=read_only(wished, bool),
    )


def within_range(plane: FocalPlane, who: np.ndarray, angles: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """`angles` (m, 2) [rad], at the end of a joint's range where the fiber counts as arrived there.

    Args:
        plane: the array.
        who: (m,) whose angles they are.
        angles: (m, 2) commanded [rad].
        offset: (m, 2) of the fiber in the beta link's frame [mm].
    """
    far = np.hypot(*plane.fiber[who].T) > np.hypot(*offset.T)
    lever = plane.kinematics.levers(plane, who, np.where(far[:, None], plane.fiber[who], offset))
    clipped = np.clip(angles, plane.lower[who], plane.upper[who])
    near = (np.abs(clipped - angles) * lever).sum(axis=1) <= ARRIVAL
    return np.where(near[:, None], clipped, angles)


def _agreement(
    targets: "Targets", plane: FocalPlane, who: np.ndarray, points: np.ndarray
) -> tuple[Agreement, np.ndarray]:
    """How well angles and positions of the same rows agree, and (m,) which rows are taken as angles.

    A disabled positioner stands at its angles: if its position is elsewhere, that is a target which it loses.
    """
    known = {name.lower(): name for name in plane.fiber_offsets}
    fibers = [known[name.lower()] if name else "" for name in targets.fiber or [""] * len(targets)]
    away = distances(plane, who, fibers, targets.angles, points)
    names = [f"{plane.ids[i]} in {row}" for i, row in zip(who, targets.rows, strict=True)]
    elsewhere = targets.disabled & (away > NAMED)
    commanded = (targets.commanded | (targets.disabled & ~np.isnan(targets.angles[:, 0]))) & ~elsewhere
    agreed = agreement(np.where(elsewhere, np.nan, away), names, targets.source, plane.name, targets.prefer)
    return agreed, commanded


def _which_fiber(targets: "Targets", plane: FocalPlane, row: int, i: int) -> str:
    """Which fiber the target in `row` names that positioner `i` does not carry."""
    assert targets.fiber is not None  # all carry the default fiber
    carried = ", ".join(name for name in plane.fiber_offsets if plane.carries(name)[i])
    return f"its target in {targets.rows[row]} needs the fiber '{targets.fiber[row]}', and it has {carried}"


def _why_unreachable(targets: "Targets", plane: FocalPlane, row: int, who: np.ndarray, offset: np.ndarray) -> str:
    i = who[row]
    from_middle = float(np.hypot(targets.x[row], targets.y[row]))
    if from_middle > plane.field_radius:
        far, edge = told_apart(from_middle, plane.field_radius)
        return f"its target in {targets.rows[row]} is {far} mm from the middle, outside the field of radius {edge} mm"
    distance = float(np.hypot(*(np.array([targets.x[row], targets.y[row]]) - plane.base[i])))
    inner, outer = (float(edge[0]) for edge in reach(plane, who[[row]], offset[[row]]))
    far, low, high = told_apart(distance, inner, outer)
    text = f"its target in {targets.rows[row]} is {far} mm from its base, reach {low} to {high} mm"
    if plane.kinematics.has_avoidance:
        return text + ", and no configuration brings it there within joint ranges and outside the zone of avoidance"
    if inner <= distance <= outer:
        text += ", but no elbow solution that is allowed lies within its joint ranges"
    return text


def refuse_unreachable(plane: FocalPlane, source: str, solution: Solution) -> None:
    """Raise a `TargetError` that names the targets out of reach, if there are any; idle positioners have none."""
    for what, found in (
        ("no such fiber", solution.lacking),
        ("angles and position disagree", solution.apart),
        ("out of reach", solution.unreachable),
    ):
        texts = [f"positioner '{plane.ids[i]}': {why}" for i, why in found.items() if not solution.wished[i]]
        if texts:
            more = f"; and {len(texts) - _SHOWN} more" if len(texts) > _SHOWN else ""
            raise TargetError(f"{source}: {what}: {'; '.join(texts[:_SHOWN])}{more}")
