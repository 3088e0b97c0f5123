"""From the ends of a plan to targets of PFS' cobras, iteration by iteration, safe whatever the speeds of their motors.

A piezo motor's speed is known within a factor of some, so nothing can be timed. All cobras first turn phi in, until
nobody can reach anybody, then theta, then phi out; who may not do so beside a neighbour waits for another iteration, or
turns theta, too, while phi is out (`withdrawing`). The path of the plan itself is not used.
"""

from collections.abc import Sequence

import numpy as np

from fiberplan.errors import PlanError
from fiberplan.hardware.pfs.waiting import without_waiting
from fiberplan.hardware.pfs.withdrawing import withdrawn
from fiberplan.plan import Plan

MOST_ITERATIONS = 12  #: that are made
INSIDE = np.radians(60.0)  #: phi, from folded, within which theta turns [rad]


def turning(plan: Plan) -> np.ndarray:
    """(n,) whether a cobra ends elsewhere than it begins."""
    return plan.problem.plane.online & (plan.trajectory.start != plan.trajectory.end).any(axis=1)


def iterations(plan: Plan, margin: float, error: np.ndarray) -> list[np.ndarray]:
    """(n, 2) where everyone is to be at the end of each iteration [rad].

    Raises:
        PlanError: some that cannot get past each other in this way, or more iterations than there are.
    """
    plane, start, end = plan.problem.plane, plan.trajectory.start, plan.trajectory.end
    moving = turning(plan)
    folded = np.maximum(plane.lower[:, 1], INSIDE - (plane.zero[:, 1] + np.pi))
    phi = np.minimum(np.minimum(start[:, 1], end[:, 1]), folded)
    inward, outward = (
        withdrawn(plane, at, np.where(moving, phi, at[:, 1]), moving, margin, error) for at in (start, end)
    )
    found = without_waiting(plane, [start, *inward, *outward[::-1], end], margin, error)
    if len(found) > MOST_ITERATIONS:
        raise PlanError(f"takes {len(found)} iterations, {MOST_ITERATIONS} are made")
    return found


def as_csv(plan: Plan, made: Sequence[np.ndarray], visit: int, config: int) -> bytes:
    """Rows of `cobra_target`, with the angles of each iteration beside: a row for each cobra that turns at all."""
    plane = plan.problem.plane
    moving = np.flatnonzero(turning(plan))
    nominal = plane.fibers(plan.trajectory.end)
    lines = [
        "pfs_visit_id,iteration,cobra_id,pfs_config_id,pfi_nominal_x_mm,pfi_nominal_y_mm,pfi_target_x_mm,"
        "pfi_target_y_mm,flags,theta [deg],phi [deg]"
    ]
    for number, angles in enumerate(made, 1):
        target, degrees = plane.fibers(angles), np.degrees(angles)
        for i in moving.tolist():
            places = ",".join(f"{value:.6f}" for value in (*nominal[i], *target[i]))
            theta, phi = (repr(float(value)) for value in degrees[i])
            lines.append(f"{visit},{number},{plane.ids[i]},{config},{places},0,{theta},{phi}")
    return ("\n".join(lines) + "\n").encode()
