"""The smallest decisive problems: a planner that cannot do these does not do what its table says.

Arms are those of Sayres2021: 7.4 and 15 mm long, with a radius of 1.5 mm, 22.4 mm apart.
"""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.problem import Problem
from fiberplan.scenes.uniform import uniform_field

PITCH = 22.4  #: distance of neighbouring bases [mm]


def few(base: np.ndarray, zero: np.ndarray | None = None) -> FocalPlane:
    """Arms at `base` (n, 2) [mm], their angles counted from `zero` (n, 2) [rad]."""
    one, n = FocalPlane.hexagonal(0, PITCH), len(base)
    fields = ("length", "folded", "lower", "upper", "max_speed", "zero", "online")
    repeated = {name: np.repeat(getattr(one, name), n, axis=0) for name in fields}
    if zero is not None:
        repeated["zero"] = zero
    ids = tuple(f"P{k}" for k in range(n))
    return one.replace(ids=ids, base=base, fiber_offsets={"fiber": one.fiber[0]}, **repeated)


def row(n: int, pitch: float = PITCH) -> FocalPlane:
    """`n` arms in a row along x, from the origin, `pitch` [mm] apart."""
    return few(pitch * np.stack([np.arange(n), np.zeros(n)], axis=1))


def exchange() -> Problem:
    """Two arms exchange sides: one has to make room for the other."""
    return Problem(row(2), np.radians([[281.0, 115.0], [218.0, 35.0]]), np.radians([[135.0, 169.0], [29.0, 39.0]]))


def pinwheel() -> Problem:
    """Three arms lean one way round their middle and have to lean the other way: each goal is across a start."""
    around = np.radians([90.0, 210.0, 330.0])
    base = PITCH / np.sqrt(3.0) * np.stack([np.cos(around), np.sin(around)], axis=1)
    plane = few(base, zero=np.stack([around, np.zeros(3)], axis=1))  # alpha 0 points outward
    return Problem(plane, np.tile(np.radians([118.0, 11.0]), (3, 1)), np.tile(np.radians([188.0, 54.0]), (3, 1)))


def aside() -> Problem:
    """An arm that stands at its target must leave it and come back: the other cannot pass while it is there."""
    return Problem(row(2), np.radians([[300.0, 56.0], [64.0, 0.0]]), np.radians([[300.0, 56.0], [154.0, 180.0]]))


def offline_across(seed: int) -> Problem:
    """Nineteen arms from folded, among two that cannot move: one extended across the others' paths, one folded."""
    plane = FocalPlane.hexagonal(2, PITCH)
    plane = plane.replace(online=~np.isin(np.arange(plane.n), [9, 3]))
    start = plane.folded.copy()
    start[9] = np.radians([30.0, 10.0])
    return Problem(plane, start, uniform_field(plane, seed, start=start))
