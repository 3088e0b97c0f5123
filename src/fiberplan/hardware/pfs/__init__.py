"""PFS: targets of cobras, iteration by iteration, in phases that are safe whatever the speeds of their motors.

A file is a CSV table with the columns of ``cobra_target``, and theta and phi [deg] of each iteration beside. Facts from
public code and documents of the instrument's team; not verified on hardware.

- `encode`: from the ends of a plan to iterations: phi in, theta, phi out
- `withdrawing`: who turns in after whom; `waiting`: nobody waits for those far off
- `decode`: from a table to the motion it causes, and the proof that leaves speeds open
"""

import os
import sys
from pathlib import Path

import numpy as np

from fiberplan.errors import PlanError, TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.hardware.certified import ALLOWANCE, hand_over, refuse_empty
from fiberplan.hardware.controller import CONTROLLERS, HandedOver, known_to
from fiberplan.hardware.pfs.decode import COLUMNS, decode, prove
from fiberplan.hardware.pfs.encode import as_csv, iterations, turning
from fiberplan.motion import Executed
from fiberplan.plan import Plan
from fiberplan.problem import State
from fiberplan.tables.contents import read_whole

__all__ = ["accepts", "prove", "read", "write"]


def write(
    plan: Plan, path: str | os.PathLike, *, visit: int = 0, config: int = 0, allowance: float = ALLOWANCE
) -> HandedOver:
    """Write where cobras are to be at the end of each iteration, proven as it is read back, whatever their speeds.

    Args:
        plan: whose ends count; its path does not.
        path: of the file.
        visit: pfs_visit_id.
        config: pfs_config_id.
        allowance: the executed motion may keep this much less than the plan's margin [mm].

    Returns:
        the proof; cobras and iterations as facts.

    Raises:
        PlanError: arms of another kind, some that cannot get past each other so, more than 12 iterations, a motion that
            is not proven, or a file that cannot be written.
    """
    plane, file, problem = plan.problem.plane, Path(path), plan.problem
    if plane.kinematics.has_avoidance:
        raise PlanError(f"{plane.name}: {plane.kinematics.name} arms are no cobras")
    assert problem.position_error is not None  # set on construction
    cobras = np.flatnonzero(turning(plan))
    refuse_empty(cobras, path, "a table of targets names a cobra at least")
    made = iterations(plan, max(0.0, problem.margin - allowance), np.asarray(problem.position_error))

    def decoded(written: bytes, state: State) -> Executed:
        return decode(file, written, plane, state)

    facts = {"cobras": len(cobras), "iterations": len(made)}
    return hand_over(plan, path, as_csv(plan, made, visit, config), decoded, allowance, facts, prove=prove)


def read(path: str | os.PathLike, plane: FocalPlane, state: State | None = None) -> Executed:
    """The motion that a table of targets causes, at nominal speeds; `prove` leaves them open.

    Args:
        path: of the file.
        plane: whose cobras it moves.
        state: where they stand before; folded unless given. Cobras that the file leaves out stay there.

    Raises:
        TrajectoryError: a file, cobra, iteration or angle that cannot be used; one line that names it.
    """
    path = Path(path)
    return decode(path, read_whole(path, TrajectoryError), plane, known_to(plane, state))


def accepts(path: Path, content: bytes) -> bool:
    """Whether a file is a table of targets of cobras, with angles."""
    heading = content[:4096].split(b"\n", 1)[0].decode("utf-8", "replace")
    return set(COLUMNS) <= {name.partition("[")[0].strip() for name in heading.split(",")}


CONTROLLERS.register("pfs")(sys.modules[__name__])
