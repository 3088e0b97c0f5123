"""From a plan to a waveform of MOONS: whole steps of both motors in each segment of 125 ms.

Steps are differences of places, rounded to whole steps from where the unit stands, so that nothing drifts. The rules
are those of the driver's default set, number 5; a motion that breaks one is refused by unit, motor and moment.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from pydantic_core import to_json

from fiberplan.errors import PlanError
from fiberplan.plan import Plan

SEGMENT = 0.125  #: [s]
MOST_SEGMENTS = 256
STEPS = (113.8986, 84.3146)  #: of alpha and beta a degree
ORIGIN = (-180.0, 0.0)  #: where steps are counted from [deg]
RANGES = ((-180.2, 159.0), (-179.3, 141.0))  #: of alpha and beta [deg]
LEAST, MOST = 62, 250  #: steps in a segment, unless none
FIRST = 69  #: steps in the first and last segment of a turn, at most
CHANGE = 50  #: of steps from one segment to the next, at most
_SAME_SEGMENT = 1e-9  # of a segment


class Waveform(NamedTuple):
    """What one unit is sent."""

    unit: str
    places: np.ndarray  #: (segments + 1, 2) since the origins [steps]

    @property
    def steps(self) -> np.ndarray:
        """(segments, 2) of alpha and beta."""
        return np.diff(self.places, axis=0)


def waveforms(plan: Plan) -> list[Waveform]:
    """The waveforms of all units that turn, equally long; others, and those that are locked, are not named.

    Raises:
        PlanError: what the driver refuses, by unit, motor and moment.
    """
    plane, motion = plan.problem.plane, plan.trajectory
    count = math.ceil(motion.duration / SEGMENT - _SAME_SEGMENT)
    if count > MOST_SEGMENTS:
        raise PlanError(
            f"the motion takes {motion.duration:.3f} s, {count} segments; the driver takes {MOST_SEGMENTS} of "
            f"{SEGMENT:g} s ({MOST_SEGMENTS * SEGMENT:g} s)"
        )
    times = np.arange(count + 1) * SEGMENT
    degrees = np.degrees(motion.sampled(times))
    places = np.rint((degrees[:, :1] - ORIGIN) * STEPS) + np.rint((degrees - degrees[:, :1]) * STEPS)
    places = places.astype(np.int64)
    turning = np.flatnonzero(plane.online & (places != places[:, :1]).any(axis=(1, 2)))
    wrong = _off_limits(places) | _broken(places)
    for i in turning[wrong[turning].any(axis=(1, 2))].tolist():
        for complaint in _refused(places[i]):
            raise PlanError(f"positioner '{plane.ids[i]}': {complaint}")
    return [Waveform(plane.ids[i], places[i]) for i in turning.tolist()]


def _off_limits(places: np.ndarray) -> np.ndarray:
    """(..., segments + 1, 2) which places (..., segments + 1, 2) are out of the driver's ranges."""
    degrees, (low, high) = places / STEPS + ORIGIN, np.array(RANGES).T
    return np.asarray((degrees < low) | (degrees > high))


def _steps_around(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(..., segments + 1, 2) steps in the segment before each place, and in that after it; none beyond the ends."""
    steps = np.diff(places, axis=-2)
    none = np.zeros_like(places[..., :1, :])
    return np.concatenate([none, steps], axis=-2), np.concatenate([steps, none], axis=-2)


def _broken(places: np.ndarray) -> np.ndarray:
    """(..., segments + 1, 2) whether the steps from a place on break a rule, after those that led there."""
    before, steps = _steps_around(places)
    many, goes_on = np.abs(steps), before * steps > 0
    pace = (many > MOST) | ((many > 0) & (many < LEAST))
    change = np.where(goes_on, np.abs(steps - before) > CHANGE, np.maximum(np.abs(before), many) > FIRST)
    return np.asarray(pace | change)


def _refused(places: np.ndarray) -> Iterator[str]:
    """What of the places of one unit (segments + 1, 2) the driver refuses."""
    before, steps = _steps_around(places)
    beyond, broken = _off_limits(places), _broken(places)
    for motor, name in enumerate(("alpha", "beta")):
        low, high = RANGES[motor]
        for k in np.flatnonzero(beyond[:, motor]).tolist():
            degrees = places[k, motor] / STEPS[motor] + ORIGIN[motor]
            yield f"{name} is {degrees:.6g} deg at {k * SEGMENT:.3f} s, the driver takes {low:g} to {high:g} deg"
        for k in np.flatnonzero(broken[:, motor]).tolist():
            fault = _rule(int(before[k, motor]), int(steps[k, motor]))
            yield f"{name} makes {steps[k, motor]} steps from {k * SEGMENT:.3f} s, {fault}"


def _rule(before: int, steps: int) -> str:
    """Which rule the steps of a segment break, after those of the segment before."""
    if abs(steps) > MOST:
        return f"at most {MOST} are allowed"
    if 0 < abs(steps) < LEAST:
        return f"at least {LEAST} or none are allowed"
    if before * steps > 0 and abs(steps - before) > CHANGE:
        return f"after {before}: {CHANGE} more or fewer are allowed"
    return f"after {before}: a turn begins and ends with {FIRST} at most"


def as_json(made: list[Waveform]) -> bytes:
    """Both forms in one file: paths in rad at the ends of segments, and steps."""
    places = np.array([wave.places for wave in made])
    paths = np.radians(places / STEPS + ORIGIN).swapaxes(1, 2).tolist()
    steps = np.diff(places, axis=1).tolist()
    forms = {"configPaths": paths, "configMotion": steps}
    units = [wave.unit for wave in made]
    return to_json({name: dict(zip(units, numbers, strict=True)) for name, numbers in forms.items()})
