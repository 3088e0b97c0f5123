"""From the ends of a plan to targets of PFS' cobras, iteration by iteration, safe whatever the speeds of their motors.

A piezo motor's speed is known within a factor of some, so nothing can be timed. All cobras first turn phi in, until
nobody can reach anybody, then theta, then phi out; who may not do so beside a neighbour waits for another iteration.
The path of the plan itself is not used.
"""

from collections.abc import Sequence

import numpy as np

from fiberplan.certificates.any_speed import clear_at_any_speed
from fiberplan.errors import PlanError
from fiberplan.focal_plane import FocalPlane
from fiberplan.plan import Plan

MOST_ITERATIONS = 12
INSIDE = np.radians(60.0)  #: phi, from folded, within which theta turns [rad]


def iterations(plan: Plan, margin: float, error: np.ndarray) -> list[np.ndarray]:
    """(n, 2) where everyone is to be at the end of each iteration [rad].

    Raises:
        PlanError: two that cannot pass each other in this way, or more iterations than there are.
    """
    plane, start, end = plan.problem.plane, plan.trajectory.start, plan.trajectory.end
    moving = plane.online & (start != end).any(axis=1)
    folded = np.maximum(plane.lower[:, 1], INSIDE - (plane.zero[:, 1] + np.pi))
    inside = np.minimum(np.minimum(start[:, 1], end[:, 1]), folded)
    before, after = start.copy(), end.copy()
    before[moving, 1] = after[moving, 1] = inside[moving]
    inward = _order(plane, before, start, margin, error)[::-1]
    outward = _order(plane, after, end, margin, error)
    at, found = start.copy(), []
    for layer in inward:
        at[layer] = before[layer]
        found.append(at.copy())
    if (at[moving] != after[moving]).any():
        at[moving] = after[moving]
        found.append(at.copy())
    for layer in outward:
        at[layer] = end[layer]
        found.append(at.copy())
    if len(found) > MOST_ITERATIONS:
        raise PlanError(f"takes {len(found)} iterations, {MOST_ITERATIONS} are made")
    return found


def _order(
    plane: FocalPlane, inside: np.ndarray, outside: np.ndarray, margin: float, error: np.ndarray
) -> list[np.ndarray]:
    """Sets that may turn phi out jointly, one after the other: who has to wait for whom waits."""
    moves = (inside != outside).any(axis=1)
    pairs = plane.pairs_within(margin + 2.0 * float(error.max(initial=0.0)) + 1e-6)
    pairs = pairs[moves[pairs].all(axis=1)]
    inside, outside = inside[pairs], outside[pairs]
    low, high = np.minimum(inside, outside), np.maximum(inside, outside)

    def clear(*turned: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        (first_low, first_high), (second_low, second_high) = turned
        lows, highs = np.stack([first_low, second_low], axis=1), np.stack([first_high, second_high], axis=1)
        return clear_at_any_speed(plane, pairs, lows, highs, margin, error)[0]

    def sweeps(k: int) -> tuple[np.ndarray, np.ndarray]:
        return low[:, k], high[:, k]

    def rests(places: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
        return places[:, k], places[:, k]

    jointly = clear(sweeps(0), sweeps(1))
    first = clear(sweeps(0), rests(inside, 1)) & clear(rests(outside, 0), sweeps(1))
    second = clear(rests(inside, 0), sweeps(1)) & clear(sweeps(0), rests(outside, 1))
    for k in np.flatnonzero(~(jointly | first | second)).tolist():
        names = " and ".join(f"'{plane.ids[i]}'" for i in pairs[k])
        raise PlanError(f"positioners {names} cannot turn phi out one after the other, in either order")
    apart: dict[int, set[int]] = {}
    waits: dict[int, set[int]] = {}
    for k in np.flatnonzero(~jointly).tolist():
        i, j = (int(arm) for arm in pairs[k])
        apart.setdefault(i, set()).add(j)
        apart.setdefault(j, set()).add(i)
        if not (first[k] and second[k]):
            waits.setdefault(j if first[k] else i, set()).add(i if first[k] else j)
    return _layers(plane, np.flatnonzero(moves).tolist(), apart, waits)


def _layers(
    plane: FocalPlane, todo: Sequence[int], apart: dict[int, set[int]], waits: dict[int, set[int]]
) -> list[np.ndarray]:
    """`todo` in as few sets as come easily: none with two that are to be apart, each after those that it waits for."""
    left, layers = list(todo), []
    while left:
        open_, layer = set(left), set[int]()
        for i in left:
            if not (waits.get(i, set()) & open_ or apart.get(i, set()) & layer):
                layer.add(i)
        if not layer:
            names = ", ".join(plane.ids[i] for i in left[:4])
            raise PlanError(f"positioners {names} wait for each other to turn phi out")
        layers.append(np.array(sorted(layer)))
        left = [i for i in left if i not in layer]
    return layers


def as_csv(plan: Plan, made: Sequence[np.ndarray], visit: int, config: int) -> bytes:
    """Rows of `cobra_target`, with the angles of each iteration beside: a row for each cobra that turns at all."""
    plane = plan.problem.plane
    moving = np.flatnonzero(plane.online & (plan.trajectory.start != plan.trajectory.end).any(axis=1))
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
