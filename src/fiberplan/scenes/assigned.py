"""Seeded assignment plans for probe arms: targets in the field, an arm for each, and no two arms touching there.

Targets fall uniformly in the field, no two closer than a separation. Arms are assigned so that the sum of squared
travel times from park is least. Of the configurations that reach a target the quickest are taken that touch no other
arm; where a pair has none, one of its targets is drawn again. Source: the assignment plans of Sabater2018, made anew.
"""

import numpy as np
from scipy.optimize import linear_sum_assignment

from fiberplan.arrays import number
from fiberplan.arrays.seeds import generator
from fiberplan.errors import InstrumentError, TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.inverse_kinematics import solutions
from fiberplan.problem import Targets
from fiberplan.problem.configuration_choice import clear_choice
from fiberplan.tolerances import SCENE

SEPARATION = 25.0  #: of targets, unless another is asked for [mm]
_UNREACHABLE = 1e9  # [s^2]
_ROUNDS = 2000


def assignment_plan(
    plane: FocalPlane, seed: int, count: int | None = None, separation: float = SEPARATION, margin: float = 0.0
) -> Targets:
    """Up to one target for each online arm, reachable together and without contacts.

    Args:
        plane: arms around a field of finite radius.
        seed: the same seed gives the same plan.
        count: targets; as many as there are online arms unless given.
        separation: least distance of two targets [mm].
        margin: clearance to keep at the goals [mm].

    Raises:
        InstrumentError: a focal plane without a field radius.
        TargetError: a count that is not from 1 to the number of online arms, a separation that is not a length, or no
            such plan found.
        ProblemError: a seed that is none.
    """
    separation = number(separation, "mm", "separation", TargetError)
    margin = number(margin, "mm", "margin", TargetError)
    online = np.flatnonzero(plane.online)
    count = len(online) if count is None else count
    if not np.isfinite(plane.field_radius):
        raise InstrumentError(f"{plane.name}: has no field radius to draw targets in")
    if not 1 <= count <= len(online):
        raise TargetError(f"{count} targets for {len(online)} online arms: expected 1 to {len(online)}")
    if not (np.isfinite(separation) and separation >= 0):
        raise TargetError(f"separation must be a length of 0 mm or more, got {separation}")
    rng = generator(seed)
    points = np.empty((0, 2))
    for _ in range(_ROUNDS):
        points = _filled(plane, rng, points, count, separation)
        options = _options(plane, online, points)
        who = _assigned(plane, online, options)
        unreached = [k for k in range(count) if np.isnan(options[who[k], k, 0, 0])]
        if unreached:
            points = np.delete(points, unreached[0], axis=0)
            continue
        arms = online[who]
        choice, pair = clear_choice(plane, arms, [options[who[k], k] for k in range(count)], margin + SCENE)
        if choice is not None:
            order = np.argsort(arms, kind="stable")
            return Targets(
                x=points[order, 0],
                y=points[order, 1],
                positioner=tuple(plane.ids[i] for i in arms[order]),
                angles=choice[order],
                source=f"assignment plan {seed}",
                notes=(f"targets: {count} drawn with seed {seed}, at least {separation:g} mm apart",),
            )
        points = np.delete(points, rng.choice(pair), axis=0)
    raise TargetError(f"no plan of {count} targets {separation:g} mm apart within {_ROUNDS} rounds")


def _filled(
    plane: FocalPlane, rng: np.random.Generator, points: np.ndarray, count: int, separation: float
) -> np.ndarray:
    """`points` (k, 2) and as many more as make `count`."""
    for _ in range(_ROUNDS * count):
        if len(points) == count:
            return points
        new = rng.uniform(-plane.field_radius, plane.field_radius, 2)
        apart = np.hypot(*(points - new).T)
        if np.hypot(*new) <= plane.field_radius and np.all(apart >= separation):
            points = np.append(points, new[None], axis=0)
    raise TargetError(f"{count} targets {separation:g} mm apart do not fit into the field")


def _options(plane: FocalPlane, online: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(arms, targets, k, 2) configurations of each online arm on each target, quickest first, NaN-padded [rad]."""
    who = np.repeat(online, len(points))
    every = np.tile(points, (len(online), 1))
    found = solutions(plane, who, every, plane.fiber[who], np.zeros(len(who)))
    return found.reshape(len(online), len(points), -1, 2)


def _assigned(plane: FocalPlane, online: np.ndarray, options: np.ndarray) -> np.ndarray:
    """(targets,) which online arm takes each."""
    travel = np.abs(options[:, :, 0] - plane.folded[online, None]) / plane.max_speed[online, None]
    cost = np.where(np.isnan(travel[..., 0]), _UNREACHABLE, travel.max(axis=2) ** 2)
    arm, target = linear_sum_assignment(cost)
    return arm[np.argsort(target)]
