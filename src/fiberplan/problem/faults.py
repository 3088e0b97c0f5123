"""What is wrong with a configuration: angles out of range, a fiber where none may end, arms nearer than the margin.

Arms without angles (NaN rows) are nowhere: nothing is wrong with them, and they touch nothing.
"""

from collections.abc import Sequence

import numpy as np

from fiberplan.arrays import read_only, told_apart
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.clearance import clearances
from fiberplan.kernels.depth import signed_clearances
from fiberplan.tolerances import EQUALITY, RANGE

Touch = tuple[int, int, float]  #: two arms, obstacle k being arm n + k, and their clearance [mm]
_SHOWN = 4  # how many contacts an error message lists


def named(plane: FocalPlane, arm: int) -> str:
    """Positioner or obstacle (arm n + k) as people know it."""
    if arm < plane.n:
        return f"positioner '{plane.ids[arm]}'"
    return f"obstacle '{plane.obstacles[arm - plane.n].name}'"


def out_of_range(plane: FocalPlane, angles: np.ndarray, allowed: float = RANGE) -> dict[int, str]:
    """Positioner -> complaint, for angles outside the joint ranges or in a zone of avoidance."""
    zones = {
        i: f"{named(plane, i)}: {plane.avoidance(i, angles)}"
        for i in map(int, np.flatnonzero(plane.in_avoidance(angles)))
    }
    outside = np.argwhere((angles < plane.lower - allowed) | (angles > plane.upper + allowed))
    ends = np.degrees(np.stack([angles, plane.lower, plane.upper]))
    shown = [(i, k, told_apart(*ends[:, i, k].tolist(), digits=6, kind="g")) for i, k in outside[::-1]]
    return zones | {
        int(i): f"{named(plane, i)}: {('alpha', 'beta')[k]} {given} deg is outside {low} to {high} deg"
        for i, k, (given, low, high) in shown
    }


def in_forbidden_place(plane: FocalPlane, goal: np.ndarray) -> dict[int, str]:
    """Positioner -> complaint, for goals at which its default fiber ends where no fiber may."""
    if not len(plane.forbidden):
        return {}
    ends = plane.fibers(goal)
    found = {}
    for i, disc in enumerate(plane.forbidden_at(ends).tolist()):
        if disc >= 0:
            x, y, radius = plane.forbidden[disc]
            away = float(np.hypot(ends[i, 0] - x, ends[i, 1] - y))
            off, size = told_apart(away, float(radius))
            found[i] = (
                f"{named(plane, i)}: its fiber would end {off} mm from ({x:.3f}, {y:.3f}) mm, the middle of a "
                f"forbidden place of radius {size} mm"
            )
    return found


def touches(plane: FocalPlane, angles: np.ndarray, margin: float) -> list[Touch]:
    """Pairs of arms closer than `margin` [mm] at `angles` (n, 2) [rad], at least one of them online.

    Bodies are those of `plane`: thicker where arms are not known to stand where they should.
    """
    needed = margin + EQUALITY
    pairs = plane.arm_pairs_within(needed)
    there = np.concatenate([~np.isnan(angles[:, 0]), np.ones(len(plane.obstacles), bool)])
    moves = np.concatenate([plane.online, np.zeros(len(plane.obstacles), bool)])
    i, j = pairs.T
    pairs = read_only(pairs[there[i] & there[j] & (moves[i] | moves[j])], np.int64)
    gaps = clearances(plane.arms, plane.with_obstacles(angles), pairs)
    near = read_only(pairs[~(gaps >= needed)], np.int64)
    depths = signed_clearances(plane.arms, plane.with_obstacles(angles), near)  # 0 would hide that outlines overlap
    return [(int(a), int(b), float(gap)) for (a, b), gap in zip(near, depths, strict=True)]


def touch_text(plane: FocalPlane, margin: float, touch: Touch) -> str:
    """Two that are too near; "overlap" only where surfaces do."""
    a, b, gap = touch
    names = f"{named(plane, a)} and {named(plane, b)}"
    if gap < 0:
        return f"{names} overlap (clearance {gap:.3f} mm, margin {margin:g} mm)"
    digits = 3 if abs(gap - margin) >= 5e-4 else 6  # enough for the two numbers to differ
    return f"{names} are {gap:.{digits}f} mm apart, nearer than the margin of {margin:g} mm"


def refuse_touching(plane: FocalPlane, margin: float, what: str, found: Sequence[Touch]) -> None:
    """Raise for arms that are too near, if there are any.

    Raises:
        ProblemError: naming the first few of them, after `what` they are about.
    """
    if not found:
        return
    text = "; ".join(touch_text(plane, margin, touch) for touch in found[:_SHOWN])
    if len(found) > _SHOWN:
        text += f"; and {len(found) - _SHOWN} more"
    who = sorted({arm for a, b, _ in found for arm in (a, b) if arm < plane.n})
    raise ProblemError(f"{what}: {text}", tuple(who))
