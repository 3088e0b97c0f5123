"""Robots far from their kind: values that stand out of their column, as fits that went astray do.

A value is far when it differs from the median by more than a floor, which ordinary scatter does not reach, and by more
than `SPREADS` times the spread of its column, which is told by the median deviation so that one does not hide another;
and when a gap of half the floor lies between it and the rest, which the end of a long tail has not.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane.focal_plane import FocalPlane

SPREADS = 8.0  #: standard deviations of a normal column that its values may be off
LENGTH_FLOOR = 0.3  #: [mm]
ANGLE_FLOOR = np.radians(20.0)  #: [rad]
SPEED_FLOOR = 0.5  #: of the median speed
PLACE_FACTOR = 3.0  #: the next robot is at most so many times as far, and at least this part as far, as usual
FEWEST = 5  #: of fewer robots nobody can say what is usual
_LISTED = 20  # robots that are noted by name
_NORMAL = 1.4826  # standard deviations of a normal distribution in its median deviation


class _Column(NamedTuple):
    """One value of every robot."""

    name: str
    values: np.ndarray  # (n,), as people read them; NaN: it has none
    far: np.ndarray  # (n,) far from the others
    unit: str


def unusual(plane: FocalPlane) -> tuple[str, ...]:
    """One note for each robot that is far from its kind in lengths, fibers, zero points, ranges, speeds or place.

    Each names the robot, the value and what the others have. Takes time that grows as the number of robots.
    """
    if plane.n < FEWEST:
        return ()
    said: dict[int, list[str]] = {}
    for column in _columns(plane):
        others = column.values[~column.far & np.isfinite(column.values)]
        for i in np.flatnonzero(column.far).tolist():
            usual = f" (the others {_between(others)})" if len(others) else ""
            said.setdefault(i, []).append(f"{column.name} {column.values[i]:.6g} {column.unit}{usual}")
    notes = [f"positioner '{plane.ids[i]}' is far from its kind: {', '.join(said[i])}" for i in sorted(said)]
    if len(notes) > _LISTED:
        more = [plane.ids[i] for i in sorted(said)[_LISTED:]]
        notes[_LISTED:] = [f"{len(more)} more positioners are far from their kind: {', '.join(more[:_LISTED])}"]
        notes[_LISTED] += ", ..." if len(more) > _LISTED else ""
    return tuple(notes)


def one_place_only(plane: FocalPlane) -> tuple[str, ...]:
    """One sentence for each robot that is said to work though one of its links has no length."""
    arm = np.hypot(*plane.fiber.T)
    short = np.flatnonzero(plane.online & ((plane.length == 0) | (arm == 0)) & (np.median(plane.length) > 0))
    return tuple(
        f"positioner '{plane.ids[i]}' works though it has links of {plane.length[i]:g} and {arm[i]:g} mm: its fiber "
        f"reaches {'one point' if plane.length[i] == arm[i] else 'one circle'} only"
        for i in short.tolist()
    )


def _columns(plane: FocalPlane) -> Iterator[_Column]:
    yield _lengths("length", plane.length)
    for name, offset in plane.fiber_offsets.items():
        for axis, values in zip("xy", offset.T, strict=True):
            yield _lengths(f"fiber '{name}' {axis}", values)
    for k, joint in enumerate(("alpha", "beta")):
        yield _zero(f"zero of {joint}", plane.zero[:, k])
        for end, ranges in (("lower", plane.lower), ("upper", plane.upper)):
            degrees = np.degrees(ranges[:, k])
            yield _Column(f"{end} end of {joint}", degrees, _far(ranges[:, k], ANGLE_FLOOR), "deg")
        speed = plane.max_speed[:, k]
        yield _Column(f"speed of {joint}", np.degrees(speed), _far(speed, SPEED_FLOOR * np.median(speed)), "deg/s")
    from scipy.spatial import cKDTree  # slow to import, and a plan that is read needs none

    away = cKDTree(plane.base).query(plane.base, k=2)[0][:, 1]
    usual = float(np.median(away))
    far = (away > PLACE_FACTOR * usual) | (away < usual / PLACE_FACTOR)
    yield _Column("distance to the next positioner", away, far & (usual > 0), "mm")


def _lengths(name: str, values: np.ndarray) -> _Column:
    return _Column(name, values, _far(values, LENGTH_FLOOR), "mm")


def _zero(name: str, values: np.ndarray) -> _Column:
    """Zero points by how far they are from their mean direction: they have no first and last."""
    mean = np.angle(np.exp(1j * values).mean())
    off = (values - mean + np.pi) % (2 * np.pi) - np.pi
    return _Column(name, np.degrees(values), _far(off, ANGLE_FLOOR), "deg")


def _far(values: np.ndarray, floor: float) -> np.ndarray:
    """(n,) which values stand out; those that are not finite do not."""
    there = np.isfinite(values)
    if np.count_nonzero(there) < FEWEST:
        return np.zeros(len(values), bool)
    off = np.where(there, values - np.median(values[there]), 0.0)
    limit = max(floor, SPREADS * _NORMAL * float(np.median(np.abs(off[there]))))
    above, below = _beyond(off, limit, floor / 2), _beyond(-off, limit, floor / 2)
    return above | below


def _beyond(off: np.ndarray, limit: float, gap: float) -> np.ndarray:
    """(n,) which of `off` lie above `limit` and above the first gap of that size, counted from 0."""
    up = np.sort(np.append(off[off > 0], 0.0))
    jumps = np.flatnonzero((np.diff(up) > gap) & (up[1:] > limit))
    return off >= up[jumps[0] + 1] if len(jumps) else np.zeros(len(off), bool)


def _between(values: np.ndarray) -> str:
    low, high = f"{values.min():.6g}", f"{values.max():.6g}"
    return low if low == high else f"{low} to {high}"
