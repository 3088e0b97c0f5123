"""SDSS-V (jaeger): trajectories in which each axis of each robot has points of its own.

A file is YAML or JSON: for each robot, by number, ``alpha`` and ``beta`` as lists of [deg, s]. The first point is at a
delay, in which the paths are sent, and where the robot stands. Facts from the public code of the operating team; not
verified on hardware.

- `encode`: from a plan to as few points as tell its motion
- `decode`: from a file, or the dump of a move, to the motion it causes
"""

import json
import os
import sys
from pathlib import Path

import numpy as np

from fiberplan.arrays import not_negative
from fiberplan.errors import PlanError, TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.hardware.certified import ALLOWANCE, hand_over, proven_bytes
from fiberplan.hardware.controller import CONTROLLERS, HandedOver, known_to
from fiberplan.hardware.sdss.decode import decode, document
from fiberplan.hardware.sdss.encode import FASTEST, RANGE, as_json, as_yaml, paths
from fiberplan.motion import Executed
from fiberplan.plan import Plan
from fiberplan.problem import State
from fiberplan.tables.contents import plain_name, read_whole

__all__ = ["DELAY", "accepts", "read", "trajectory", "with_limits", "write"]

DELAY = 1.0  #: time in which the paths are sent [s]
A_MESSAGE = {"APO": 3, "LCO": 10}  #: points of an axis that one message holds, by observatory
_ENDINGS = (".json", ".yaml", ".yml")


def write(plan: Plan, path: str | os.PathLike, *, delay: float = DELAY, allowance: float = ALLOWANCE) -> HandedOver:
    """Write a plan's motion for the controllers of SDSS-V, proven as it is read back.

    Args:
        plan: to be executed; robots that cannot move are not in the file.
        path: of the file; one that ends in .yaml or .yml is YAML, any other JSON.
        delay: time of the first point [s].
        allowance: the executed motion may keep this much less than the plan's margin [mm].

    Returns:
        the proof, and points and messages as facts.

    Raises:
        PlanError: what the controllers cannot do, a motion that is not proven, a file that cannot be written.
    """
    delay = not_negative(delay, "s", "delay", PlanError)
    file, sent = Path(path), paths(plan, delay)
    content = as_yaml(sent) if file.suffix.lower() in _ENDINGS[1:] else as_json(sent)
    counts = [len(axis) for robot in sent for axis in (robot.alpha, robot.beta)]
    messages = {site: sum(-(-count // size) for count in counts) for site, size in A_MESSAGE.items()}
    facts = {"robots": len(sent), "points": sum(counts), "messages": messages, "delay": delay}
    plane = plan.problem.plane
    return hand_over(plan, path, content, lambda written, state: decode(file, written, plane, state), allowance, facts)


def trajectory(
    plan: Plan, *, delay: float = DELAY, allowance: float = ALLOWANCE
) -> dict[str, dict[str, list[list[float]]]]:
    """A plan's motion as a control program has it, for each robot ``alpha`` and ``beta`` as lists of [deg, s].

    It is what `write` writes, and proven in the same way, as it is read back.

    Args:
        plan: to be executed; robots that cannot move are left out.
        delay: time of the first point [s].
        allowance: the executed motion may keep this much less than the plan's margin [mm].

    Raises:
        PlanError: what the controllers cannot do, or a motion that is not proven.
    """
    content, plane = as_json(paths(plan, not_negative(delay, "s", "delay", PlanError))), plan.problem.plane
    name = Path("trajectory.json")
    proven_bytes(plan, name.stem, content, lambda sent, state: decode(name, sent, plane, state), allowance, {})
    return json.loads(content)["trajectory"]


def read(path: str | os.PathLike, plane: FocalPlane, state: State | None = None) -> Executed:
    """The motion that a trajectory file, or the dump of a move, causes.

    Args:
        path: of the file.
        plane: whose robots it moves, by number or hole.
        state: where they stand before; folded unless given. Robots that the file leaves out stay there.

    Raises:
        TrajectoryError: a file, robot, axis or point that cannot be used; one line that names it.
    """
    path = Path(path)
    return decode(path, read_whole(path, TrajectoryError), plane, known_to(plane, state))


def with_limits(plane: FocalPlane) -> FocalPlane:
    """The same with the joint ranges and speeds that commands may have where they are narrower: plan with these."""
    lower, upper = (np.radians(edge) for edge in RANGE)
    lower, upper = np.maximum(plane.lower, lower), np.minimum(plane.upper, upper)
    fastest = np.minimum(plane.max_speed, np.radians(FASTEST))
    return plane.replace(lower=lower, upper=upper, folded=np.clip(plane.folded, lower, upper), max_speed=fastest)


def accepts(path: Path, content: bytes) -> bool:
    """Whether a file is a trajectory, or the dump of one; what is wrong in it is for `read` to say."""
    if plain_name(path).suffix.lower() not in _ENDINGS:
        return False
    try:
        held = document(path, content)
    except TrajectoryError:
        return False
    sent = held.get("trajectory", held)
    paths = sent.values() if isinstance(sent, dict) else ()
    return "trajectory" in held or any(isinstance(axes, dict) and {"alpha", "beta"} & set(axes) for axes in paths)


CONTROLLERS.register("sdss")(sys.modules[__name__])
