"""Audits: what is proven of motions that others made, file by file, and what time they lost.

The kind of a file is found from its name and content: each controller knows its own, and what is none of theirs is read
as a table of (positioner, time, alpha, beta).
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fiberplan.arrays import Frozen
from fiberplan.certificates import Certificate, verify
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.hardware.controller import CONTROLLERS, known_to
from fiberplan.hardware.motion_tables import read_motion_table
from fiberplan.io.plan_file import is_plan
from fiberplan.motion import Executed
from fiberplan.problem import State
from fiberplan.tables.contents import read_whole


@dataclass(frozen=True, eq=False)
class Audit(Frozen):
    """What is proven of one file."""

    path: Path
    kind: str  #: the controller whose file it is, or "table"
    executed: Executed
    certificate: Certificate
    bound: float  #: no motion between the same ends is faster: the largest joint travel over its speed [s]

    @property
    def duration(self) -> float:
        """Time of the last knot [s]."""
        return self.executed.trajectory.duration

    @property
    def closest(self) -> tuple[tuple[int, int] | None, float]:
        """The pair that comes nearest, and its proven clearance [mm]; obstacle k is -1 - k; None if nobody does."""
        proof = self.certificate
        fixed = proof.obstacle_pairs * np.array([1, -1]) - np.array([0, 1])
        pairs = np.concatenate([proof.pairs, fixed])
        clearance = np.concatenate([proof.clearance, proof.obstacle_clearance])
        for contact in proof.contacts:  # what was seen is known better than the bound, which was given up early
            clearance[(pairs == contact.pair).all(axis=1)] = contact.clearance
        if not len(pairs):
            return None, float("inf")
        k = int(np.argmin(clearance))
        return (int(pairs[k, 0]), int(pairs[k, 1])), float(clearance[k])


def controller_of(path: Path, content: bytes) -> str | None:
    """Whose file it is, by its name and content; None if it is no controller's."""
    for name in CONTROLLERS:
        accepts = getattr(CONTROLLERS[name], "accepts", None)  # another package's may only write
        if accepts is not None and accepts(path, content):
            return name
    return None


def read_motion(path: str | os.PathLike, plane: FocalPlane, state: State | None = None) -> tuple[str, Executed]:
    """What a file makes `plane` do, and whose file it is.

    Args:
        path: of a controller's file, or of a table with columns positioner, time, alpha, beta.
        plane: whose positioners it moves.
        state: where they stand before; folded unless given.

    Raises:
        TrajectoryError: a file that cannot be used; one line that says where.
    """
    path = Path(path)
    content = read_whole(path, TrajectoryError)
    name = controller_of(path, content)
    if name is not None:
        return name, CONTROLLERS[name].read(path, plane, state)
    if is_plan(content):
        raise TrajectoryError(f"{path}: is a plan, which `fiberplan verify` proves")
    return "table", read_motion_table(path, content, plane, known_to(plane, state))


def audit(plane: FocalPlane, path: str | os.PathLike, state: State | None = None, margin: float | None = None) -> Audit:
    """Certify the motion that a file causes.

    Args:
        plane: whose positioners it moves.
        path: as `read_motion` takes it.
        state: where they stand before; folded unless given.
        margin: clearance to prove [mm]; the recommended one unless given, or 0.

    Raises:
        TrajectoryError: a file that cannot be used; one line that says where.
    """
    kind, executed = read_motion(path, plane, state)
    wanted = (plane.recommended_margin or 0.0) if margin is None else margin
    error = 0.0 if state is None else state.position_error
    prove = getattr(CONTROLLERS.get(kind), "prove", verify)
    certificate = prove(plane, executed, wanted, position_error=error)
    motion = executed.trajectory
    travel = np.abs(motion.end - motion.start) / plane.max_speed
    return Audit(Path(path), kind, executed, certificate, float(travel.max(initial=0.0)))
