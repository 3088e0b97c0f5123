"""From a trajectory file, or a dump of one, of SDSS-V to the motion it causes.

Robots are known by number (`positionerID`) or hole. Each axis has points of its own; both are held before their first
and after their last. On the bus angles are whole parts of a turn and times whole parts of a second, both cut off, for
each axis by itself: what that takes is the joint error.
"""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Executed, Trajectory
from fiberplan.problem import State
from fiberplan.tables.wording import nearest, one_line

ANGLE_BITS = 30  #: of a turn, on the bus
TIMES_A_SECOND = 2000  #: on the bus
START = math.radians(1.0)  #: controllers refuse a path that begins farther from where the robot is [rad]
_SHOWN = 12


def document(path: Path, content: bytes) -> Mapping[str, Any]:
    """The mapping that a JSON or YAML file holds.

    Raises:
        TrajectoryError: it holds none.
    """
    try:
        text = content.decode()
        if text.lstrip().startswith("{") and path.suffix.lower() not in (".yaml", ".yml"):
            held = json.loads(text)
        else:
            held = _yaml(text)
    except Exception as problem:  # each parser raises what it likes
        raise TrajectoryError(f"{path}: is neither JSON nor YAML ({one_line(problem)})") from None
    if not isinstance(held, dict):
        raise TrajectoryError(f"{path}: holds no mapping of robots to paths")
    return {str(key): value for key, value in held.items()}


def _yaml(text: str) -> Any:
    import yaml

    return yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))


def decode(path: Path, content: bytes, plane: FocalPlane, state: State) -> Executed:
    """The motion that a file causes, from the state before.

    Raises:
        TrajectoryError: no such file of SDSS, or a robot, axis or point that cannot be used, each named.
    """
    held = document(path, content)
    sent: Any = held
    stand: Any = {}
    if "trajectory" in held:
        sent, stand = held["trajectory"] or {}, held.get("initial_positions") or {}
    if not isinstance(sent, dict) or not isinstance(stand, dict):
        raise TrajectoryError(f"{path}: 'trajectory' holds no mapping of robots to paths")
    if not sent:
        raise TrajectoryError(f"{path}: names no robot that moves: there is nothing to judge")
    rest = np.array(state.angles)
    known = ~state.unknown
    for robot, angles in stand.items():
        i = _index(path, str(robot), plane)
        rest[i] = np.radians([_number(path, f"robot {robot}: initial position", angle) for angle in angles[:2]])
        known[i] = True
    knots: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    notes = []
    for robot, axes in sent.items():
        i = _index(path, str(robot), plane)
        if i in knots:
            raise TrajectoryError(f"{path}: robot {robot}: {plane.ids[i]} is given twice")
        knots[i] = _together(*(_axis(path, str(robot), axes, axis) for axis in ("alpha", "beta")))
        away = float(np.abs(knots[i][1][0] - rest[i]).max())
        if known[i] and away > START:
            notes.append(f"{plane.ids[i]} begins {math.degrees(away):.3g} deg from where it stands: controllers refuse")
    absent = [i for i in range(plane.n) if i not in knots]
    if held.get("failed_positioners"):
        notes.append(f"failed, the file says: {', '.join(str(robot) for robot in held['failed_positioners'])}")
    for i in absent:
        knots[i] = np.zeros(1), rest[i : i + 1]
    offsets = np.cumsum([0, *(len(knots[i][0]) for i in range(plane.n))])
    times, angles = (np.concatenate([knots[i][k] for i in range(plane.n)]) for k in (0, 1))
    motion = Trajectory(offsets, times, angles)
    moved = np.ones(plane.n, bool)
    moved[absent] = False
    guessed = [plane.ids[i] for i in absent if not known[i]]
    return Executed(
        motion,
        joint_error=_cut_off(motion, moved),
        clock_error=0.0,
        notes=tuple(notes),
        assumptions=_assumed(guessed, path),
        online=moved & plane.online & state.online,
    )


def _assumed(guessed: list[str], path: Path) -> tuple[str, ...]:
    if not guessed:
        return ()
    more = f" and {len(guessed) - _SHOWN} more" if len(guessed) > _SHOWN else ""
    return (f"{', '.join(guessed[:_SHOWN])}{more} are not in {path.name}: taken as folded, and as never moving",)


def _index(path: Path, robot: str, plane: FocalPlane) -> int:
    if robot not in plane.names:
        raise TrajectoryError(f"{path}: {plane.name} has no positioner '{robot}'{nearest(robot, plane.names)}")
    return plane.names[robot]


def _number(path: Path, where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise TrajectoryError(f"{path}: {where}: {value!r} is not a finite number")
    return float(value)


def _axis(path: Path, robot: str, axes: Any, axis: str) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and angles [rad] of one axis; several points at one time and place are one."""
    where = f"robot {robot}: {axis}"
    points = axes.get(axis) if isinstance(axes, dict) else None
    if not isinstance(points, list) or not points:
        raise TrajectoryError(f"{path}: {where}: no points [deg, s]")
    times: list[float] = []
    angles: list[float] = []
    for k, point in enumerate(points, 1):
        if not isinstance(point, list) or len(point) != 2:
            raise TrajectoryError(f"{path}: {where}: point {k} is {point!r}, expected [deg, s]")
        degrees, time = (_number(path, f"{where}: point {k}", value) for value in point)
        if time < 0 or (times and time < times[-1]):
            before = times[-1] if times else 0.0
            raise TrajectoryError(f"{path}: {where}: point {k} is at {time:g} s, before {before:g} s")
        angle = math.radians(degrees)
        if times and time == times[-1]:
            if angle != angles[-1]:
                raise TrajectoryError(f"{path}: {where}: point {k} is elsewhere at {time:g} s than the one before")
            continue
        times.append(time)
        angles.append(angle)
    return np.array(times), np.array(angles)


def _together(
    alpha: tuple[np.ndarray, np.ndarray], beta: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Both axes at the times of either."""
    times = np.union1d(alpha[0], beta[0])
    return times, np.stack([np.interp(times, *axis) for axis in (alpha, beta)], axis=1)


def _cut_off(motion: Trajectory, moved: np.ndarray) -> np.ndarray:
    """(n, 2) what cutting off angles and times on the bus takes from each joint, at most [rad]."""
    speed = np.zeros((motion.n, 2))
    inside = motion.owner[1:] == motion.owner[:-1]
    rates = np.abs(np.diff(motion.angles, axis=0)[inside]) / np.diff(motion.times)[inside, None]
    np.maximum.at(speed, motion.owner[:-1][inside], rates)
    return np.where(moved[:, None], 2.0 * math.pi / 2**ANGLE_BITS + speed / TIMES_A_SECOND, 0.0)
