"""From a plan to a trajectory file of SDSS-V: points of each axis, as few as tell the motion.

An axis keeps those knots of the plan without which it would be off by more than `TOLERANCE` somewhere. Straight lines
between knots of the plan are never faster than the plan.
"""

import itertools
import json
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fiberplan.errors import PlanError
from fiberplan.plan import Plan

TOLERANCE = 1e-3  #: a joint is this close to the plan's at all times [deg]
RANGE = (-10.0, 370.0)  #: that commands may have [deg]
FASTEST = 29.3  #: [deg/s]: 5,000 rpm at the motor, reduction 1024
TICK = 0.0005  #: two points of an axis are at least this far apart [s]
LEAST = 0.1  #: time that the points of an axis take at least [s]

Points = list[list[float]]  # [deg, s] each


class Path(NamedTuple):
    """What one robot is sent."""

    robot: str
    alpha: Points
    beta: Points


def paths(plan: Plan, delay: float) -> list[Path]:
    """What every robot that can move is sent, those that rest included; nothing for the others.

    Raises:
        PlanError: what the controllers cannot do, by robot, axis and moment.
    """
    plane, motion = plan.problem.plane, plan.trajectory
    known = plane.aliases or plane.ids
    end = max(motion.duration, LEAST)
    found = []
    for i in np.flatnonzero(plane.online).tolist():
        times, angles = motion.knots(i)
        sent = [_points(times, np.degrees(angles[:, joint]), delay, end) for joint in (0, 1)]
        for axis, points in zip(("alpha", "beta"), sent, strict=True):
            for complaint in _refused(points):
                raise PlanError(f"positioner '{plane.ids[i]}': {axis} {complaint}")
        found.append(Path(known[i] or plane.ids[i], *sent))
    return found


def as_json(sent: list[Path]) -> bytes:
    """A JSON file, in which the trajectory is one of several things that may be said."""
    return json.dumps({"trajectory": {path.robot: {"alpha": path.alpha, "beta": path.beta} for path in sent}}).encode()


def as_yaml(sent: list[Path]) -> bytes:
    """A YAML file of the same; a robot whose name is a number has that number."""
    lines = []
    for path in sent:
        name = path.robot if path.robot.isdecimal() else json.dumps(path.robot)
        lines += [f"{name}:", f"  alpha: {json.dumps(path.alpha)}", f"  beta: {json.dumps(path.beta)}"]
    return ("\n".join(lines) + "\n").encode()


def _points(times: np.ndarray, values: np.ndarray, delay: float, end: float) -> Points:
    """The points of one axis, from the delay on: two at least."""
    kept = thinned(times, values, TOLERANCE)
    if len(kept) == 1 or not np.ptp(values):
        return [[float(values[0]), delay], [float(values[-1]), delay + end]]
    points = [[float(values[k]), delay + float(times[k])] for k in kept]
    if times[0] > 0:
        points.insert(0, [float(values[0]), delay])
    return points


def thinned(times: np.ndarray, values: np.ndarray, tolerance: float) -> list[int]:
    """The knots to keep, first and last among them, so that lines between them pass all others within `tolerance`.

    From each knot the farthest is taken to which a line may be drawn.
    """
    kept, last = [0], len(times) - 1
    while kept[-1] < last:
        here = kept[-1]
        for there in range(last, here, -1):
            between = slice(here + 1, there)
            line = np.interp(times[between], times[[here, there]], values[[here, there]])
            if there == here + 1 or np.abs(values[between] - line).max() <= tolerance:
                kept.append(there)
                break
    return kept


def _refused(points: Points) -> Iterator[str]:
    """What of the points of one axis the controllers cannot do."""
    for value, time in points:
        if not RANGE[0] <= value <= RANGE[1]:
            yield f"is {value:.6g} deg at {time:.3f} s, controllers take {RANGE[0]:g} to {RANGE[1]:g} deg"
    for (value, time), (after, later) in itertools.pairwise(points):
        if later - time < TICK:
            yield f"turns twice within {later - time:.3g} s at {time:.3f} s, controllers count {TICK:g} s"
        elif abs(after - value) > FASTEST * (later - time):
            speed = abs(after - value) / (later - time)
            yield f"turns at {speed:.4g} deg/s at {time:.3f} s, motors do {FASTEST:g} deg/s"
