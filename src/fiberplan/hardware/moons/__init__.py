"""MOONS: waveforms, whole steps of both motors in each segment of 125 ms.

A file is JSON with ``configPaths`` (for each unit alpha and beta [rad] at the ends of segments) and ``configMotion``
(pairs of steps a segment). Facts of the driver's public documents, rule set 5; not verified on hardware.

- `encode`: from a plan to steps, or a refusal by unit, motor and moment
- `decode`: from a file to the motion it causes
"""

import dataclasses
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.arrays import not_negative
from fiberplan.errors import PlanError, TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.hardware.certified import ALLOWANCE, hand_over, refuse_empty
from fiberplan.hardware.controller import CONTROLLERS, HandedOver, known_to
from fiberplan.hardware.moons.decode import decode
from fiberplan.hardware.moons.encode import CHANGE, LEAST, MOST, RANGES, SEGMENT, STEPS, as_json, waveforms
from fiberplan.motion import Executed
from fiberplan.plan import Plan
from fiberplan.problem import Problem, State
from fiberplan.shaping import shape
from fiberplan.tables.contents import plain_name, read_whole
from fiberplan.tables.uncollected import uncollected

__all__ = ["LATENCY", "SEGMENT", "STEP", "accepts", "fit", "read", "with_goals", "with_limits", "write"]

STEP = np.radians(1.0 / np.array(STEPS))  #: turn of alpha and beta in one step [rad]
LATENCY = 0.02  #: between the starts of units [s]


@uncollected()
def write(plan: Plan, path: str | os.PathLike, *, allowance: float = ALLOWANCE, latency: float = LATENCY) -> HandedOver:
    """Write a plan's motion as a waveform, proven as it is read back; what the driver refuses is shaped to its steps.

    Args:
        plan: to be executed, best planned `with_limits`; units that do not turn are not named.
        path: of the file.
        allowance: the executed motion may keep this much less than the plan's margin [mm].
        latency: clocks of units may be off by this [s].

    Returns:
        the proof; units and segments as facts.

    Raises:
        PlanError: what the driver refuses, a motion that is not proven, a file that cannot be written.
    """
    latency = not_negative(latency, "s", "latency", PlanError)
    shaped = fit(plan)
    made, file, plane = waveforms(shaped), Path(path), plan.problem.plane
    refuse_empty(made, file, "a waveform names a unit at least")
    facts = {"units": len(made), "segments": len(made[0].steps), "segment": SEGMENT}
    facts["seconds longer than the plan"] = round(shaped.makespan - plan.makespan, 3)

    def decoded(written: bytes, state: State) -> Executed:
        return decode(file, written, plane, state, latency)

    return hand_over(plan, path, as_json(made), decoded, allowance, facts)


@uncollected()
def read(
    path: str | os.PathLike, plane: FocalPlane, state: State | None = None, *, latency: float = LATENCY
) -> Executed:
    """The motion that a waveform causes.

    Args:
        path: of the file.
        plane: whose units it moves.
        state: where they stand before; where their paths begin, or folded, unless given.
        latency: clocks of units may be off by this [s].

    Raises:
        TrajectoryError: a file, unit or value that cannot be used; one line that names it.
    """
    path, latency = Path(path), not_negative(latency, "s", "latency", TrajectoryError)
    return decode(path, read_whole(path, TrajectoryError), plane, known_to(plane, state), latency)


def accepts(path: Path, content: bytes) -> bool:
    """Whether a file is a waveform."""
    return plain_name(path).suffix.lower() == ".json" and (b'"configPaths"' in content or b'"configMotion"' in content)


def with_limits(plane: FocalPlane) -> FocalPlane:
    """The same with the driver's joint ranges, speeds and accelerations where they are narrower: plan with these."""
    steps = np.radians(1.0 / np.array(STEPS))
    low, high = np.radians(RANGES).T
    lower, upper = np.maximum(plane.lower, low), np.minimum(plane.upper, high)
    fastest = np.minimum(plane.max_speed, MOST * steps / SEGMENT)
    return plane.replace(
        lower=lower,
        upper=upper,
        folded=np.clip(plane.folded, lower, upper),
        max_speed=fastest,
        min_speed=np.minimum(fastest, LEAST * steps / SEGMENT),
        max_acceleration=np.tile(CHANGE * steps / SEGMENT**2, (plane.n, 1)),
    )


def with_goals(problem: Problem, **_: Any) -> Problem:
    """The problem with goals at the nearest whole steps from where units stand, where motors can stop."""
    plane, start = problem.plane, problem.start

    def nearest(goal: np.ndarray, start: np.ndarray) -> np.ndarray:
        steps = np.rint((goal - start) / STEP)
        at = start + steps * STEP
        low, high = (np.broadcast_to(edge.reshape(start.shape), at.shape) for edge in (plane.lower, plane.upper))
        return at + STEP * ((at < low).astype(int) - (at > high).astype(int))

    others = problem.alternatives
    alternatives = None if others is None else nearest(others, start[:, None])
    return dataclasses.replace(problem, goal=nearest(problem.requested, start), alternatives=alternatives)


def fit(plan: Plan) -> Plan:
    """The plan's motion in whole steps a segment, as near to it as that keeps clear; as it is if it is so already.

    Raises:
        PlanError: steps in which a motor cannot get where it should.
    """
    try:
        waveforms(plan)
    except PlanError:
        problem = plan.problem
        assert problem.position_error is not None  # set on construction
        try:
            shaped = shape(
                plan.trajectory,
                with_limits(problem.plane),
                problem.margin,
                problem.position_error,
                problem.near_start == "open" or problem.needs_opening,
                segment=SEGMENT,
                step=STEP,
                jitter=LATENCY,
            )
        except TrajectoryError as error:
            raise PlanError(str(error)) from None
        return dataclasses.replace(plan, trajectory=shaped.trajectory)
    return plan


CONTROLLERS.register("moons")(sys.modules[__name__])
