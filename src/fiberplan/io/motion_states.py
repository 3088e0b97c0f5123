"""Where an executed motion, or a controller's file of one, leaves everyone, at its end or at a moment of it.

Some files say where robots go, others only how far from where they stand. Which robots' places follow from a file alone
is found by reading it twice, as if everyone stood in two places.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from fiberplan.errors import ProblemError, TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.drift import drift, motion_bounds
from fiberplan.motion import Executed
from fiberplan.problem import State
from fiberplan.registry import hardware_function

_AWAY = 0.1  # [rad] between the two places


class Standing(NamedTuple):
    """Where a motion leaves each positioner."""

    angles: np.ndarray  #: (n, 2) [rad]
    online: np.ndarray  #: (n,)
    position_error: np.ndarray  #: (n,) of joints that are off, and amid the motion of clocks [mm]
    guessed: np.ndarray  #: (n,) whose place the file does not tell


def standing_after(executed: Executed, plane: FocalPlane, at: float | None) -> Standing:
    """Where everyone is at `at` [s], or at the end.

    Raises:
        ProblemError: another number of positioners than `plane` has.
    """
    motion = executed.trajectory
    if motion.n != plane.n:
        raise ProblemError(f"the motion has {motion.n} positioners, {plane.name} has {plane.n}")
    angles = motion.end if at is None else motion.at(at)
    error = motion_bounds(plane, executed.joint_error)
    if at is not None and executed.clock_error:
        error = error + drift(plane, executed.clock_error)
    return Standing(angles, executed.online, error, ~executed.placed)


def standing_in_file(path: Path, content: bytes, plane: FocalPlane, at: float | None) -> Standing | None:
    """Where everyone is after the motion of a controller's file; None if it is no controller's.

    Raises:
        ProblemError: a file that cannot be used, or one that does not tell where anyone stands.
    """
    name = hardware_function("controller_of")(path, content)
    if name is None:
        return None
    nowhere = np.ones(plane.n, bool)
    read = hardware_function("read_motion")
    try:
        found = [
            standing_after(read(path, plane, State(plane.folded + away, plane.online, unknown=nowhere))[1], plane, at)
            for away in (0.0, _AWAY)
        ]
    except TrajectoryError as error:
        raise ProblemError(str(error)) from None
    guessed = (np.abs(found[0].angles - found[1].angles) > 0.5 * _AWAY).any(axis=1)
    if guessed.all():
        raise ProblemError(
            f"{path}: says how far robots go, not from where (a file of {name}); "
            "`fiberplan simulate INSTRUMENT FILE --state BEFORE -o AFTER` tells where they stand then"
        )
    return found[0]._replace(guessed=guessed, online=found[0].online & ~guessed)
