"""From a waveform of MOONS to the motion it causes.

Motors count steps from where they stand, so a unit ends where it stood plus its steps. `configMotion` is what motors
do; of a file that has `configPaths` alone steps are the differences of its rounded places, as the driver makes them.
"""

from codecs import BOM_UTF8
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pydantic_core import from_json

from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Executed, Trajectory
from fiberplan.problem import State
from fiberplan.tables.wording import nearest, one_line

PERIOD = 1 / 8  #: of a segment [s]
DEGREES = (1 / 113.8986, 1 / 84.3146)  #: of alpha and beta a step
SLOWEST = 62  #: steps a segment that motors can make evenly
_SHOWN = 12


def decode(path: Path, content: bytes, plane: FocalPlane, state: State, latency: float) -> Executed:
    """The motion that a file causes, from the state before.

    Raises:
        TrajectoryError: no waveform, or a unit or value that cannot be used, each named.
    """
    held = _document(path, content)
    paths, motions = held.get("configPaths") or {}, held.get("configMotion") or {}
    start, sent = np.array(state.angles), dict[int, np.ndarray]()
    moved, notes, guessed = np.zeros(plane.n, bool), [], ~state.unknown
    for unit, path_ in paths.items():
        i, places = _index(path, unit, plane), _places(path, unit, path_)
        away = np.degrees(np.abs(places[0] - start[i]))
        if state.unknown[i]:
            start[i], guessed[i] = places[0], True
        elif (away > np.array(DEGREES)).any():
            notes.append(f"unit {unit} begins {away.max():.3g} deg from where it stands: the driver refuses")
        sent[i] = np.diff(np.rint(np.degrees(places) / DEGREES), axis=0)
    for unit, steps in motions.items():
        i, made = _index(path, unit, plane), _steps(path, unit, steps)
        if i in sent and len(sent[i]) == len(made) and (sent[i] != made).any():
            notes.append(f"unit {unit}: configPaths and configMotion differ; motors do what configMotion says")
        sent[i] = made
    if not sent:
        raise TrajectoryError(f"{path}: names no unit")
    counts = {len(steps) for steps in sent.values()}
    if len(counts) > 1:
        raise TrajectoryError(f"{path}: units differ in the number of segments: {', '.join(map(str, sorted(counts)))}")
    slow = False
    knots = {i: (np.zeros(1), start[i : i + 1]) for i in range(plane.n)}
    for i, steps in sent.items():
        moved[i] = True
        slow |= bool(((np.abs(steps) > 0) & (np.abs(steps) < SLOWEST)).any())
        knots[i] = _turned(start[i], steps)
    offsets = np.cumsum([0, *(len(knots[i][0]) for i in range(plane.n))])
    times, angles = (np.concatenate([knots[i][k] for i in range(plane.n)]) for k in (0, 1))
    if slow:
        notes.append(f"some turn slower than {SLOWEST} steps a segment: pulses and pauses, up to a segment off")
    return Executed(
        Trajectory(offsets, times, angles),
        joint_error=np.zeros((plane.n, 2)),
        clock_error=latency + (PERIOD if slow else 0.0),
        notes=tuple(notes),
        assumptions=tuple(_assumed(path, plane, moved, guessed)),
        online=moved & plane.online & state.online,
    )


def _turned(start: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and angles of one unit; a knot where a motor changes its pace."""
    changes = np.concatenate([[True], (np.diff(steps, axis=0) != 0).any(axis=1), [True]])
    degrees = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]) * DEGREES
    kept = np.flatnonzero(changes)
    return kept * PERIOD, start + np.radians(degrees[kept])


def _assumed(path: Path, plane: FocalPlane, moved: np.ndarray, guessed: np.ndarray) -> Iterator[str]:
    for which, what in (
        (moved & ~guessed, "move from where they are taken to stand, folded"),
        (~moved & ~guessed, f"are not in {path.name}: taken as folded, and as never moving"),
    ):
        who = [plane.ids[i] for i in np.flatnonzero(which)]
        if who:
            more = f" and {len(who) - _SHOWN} more" if len(who) > _SHOWN else ""
            yield f"{', '.join(who[:_SHOWN])}{more} {what}"


def _document(path: Path, content: bytes) -> dict[str, Any]:
    try:
        held = from_json(content.removeprefix(BOM_UTF8))
    except ValueError as problem:
        raise TrajectoryError(f"{path}: is no JSON ({one_line(problem)})") from None
    if not isinstance(held, dict) or not {"configPaths", "configMotion"} & set(held):
        raise TrajectoryError(f"{path}: has neither 'configPaths' nor 'configMotion'")
    for name in ("configPaths", "configMotion"):
        if not isinstance(held.get(name) or {}, dict):
            raise TrajectoryError(f"{path}: '{name}' is no mapping of units")
    return held


def _index(path: Path, unit: str, plane: FocalPlane) -> int:
    if unit not in plane.names:
        raise TrajectoryError(f"{path}: {plane.name} has no positioner '{unit}'{nearest(unit, plane.names)}")
    return plane.names[unit]


def _places(path: Path, unit: str, given: Any) -> np.ndarray:
    """(segments + 1, 2) [rad] of a configPath."""
    try:
        places = np.array(given, float).T
    except (ValueError, TypeError, OverflowError):
        places = np.zeros(0)
    if places.ndim != 2 or places.shape[1] != 2 or not len(places) or not np.isfinite(places).all():
        raise TrajectoryError(f"{path}: unit {unit}: a path is two lists of finite numbers [rad], equally long")
    return places


def _steps(path: Path, unit: str, given: Any) -> np.ndarray:
    """(segments, 2) of a configMotion."""
    try:
        steps = np.array(given, float)
    except (ValueError, TypeError, OverflowError):
        steps = np.zeros(0)
    if steps.ndim != 2 or steps.shape[1] != 2 or not np.isfinite(steps).all() or (steps != np.rint(steps)).any():
        raise TrajectoryError(f"{path}: unit {unit}: a motion is a list of pairs of whole numbers of steps")
    return steps
