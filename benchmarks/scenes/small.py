"""The smallest decisive scenes: a planner that cannot do these does not do what its table says."""

from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.scenes.uniform import uniform_field
from scenes.scene import Scene, margin_of

PITCH = 22.4


def few(base: np.ndarray, zero: np.ndarray | None = None) -> fp.FocalPlane:
    """Positioners of Sayres2021 at `base` (n, 2) [mm], their angles counted from `zero` (n, 2) [rad]."""
    one, n = fp.FocalPlane.hexagonal(0, PITCH), len(base)
    fields = ("length", "folded", "lower", "upper", "max_speed", "zero", "online")
    repeated = {name: np.repeat(getattr(one, name), n, axis=0) for name in fields}
    if zero is not None:
        repeated["zero"] = zero
    ids = tuple(f"P{k}" for k in range(n))
    return one.replace(ids=ids, base=base, fiber_offsets={"fiber": one.fiber[0]}, **repeated)


def exchange(seed: int, data: Path) -> fp.Problem:
    """Two arms exchange sides: one has to make room for the other."""
    plane = few(np.array([[0.0, 0.0], [PITCH, 0.0]]))
    return fp.Problem(plane, np.radians([[281.0, 115.0], [218.0, 35.0]]), np.radians([[135.0, 169.0], [29.0, 39.0]]))


def pinwheel(seed: int, data: Path) -> fp.Problem:
    """Three arms lean one way round their middle and have to lean the other way: each goal is across a start."""
    around = np.radians([90.0, 210.0, 330.0])
    base = PITCH / np.sqrt(3.0) * np.stack([np.cos(around), np.sin(around)], axis=1)
    plane = few(base, zero=np.stack([around, np.zeros(3)], axis=1))  # alpha 0 points outward
    return fp.Problem(plane, np.tile(np.radians([118.0, 11.0]), (3, 1)), np.tile(np.radians([188.0, 54.0]), (3, 1)))


def aside(seed: int, data: Path) -> fp.Problem:
    """An arm that stands at its target must leave it and come back: the other cannot pass while it is there."""
    plane = few(np.array([[0.0, 0.0], [PITCH, 0.0]]))
    return fp.Problem(plane, np.radians([[300.0, 56.0], [64.0, 0.0]]), np.radians([[300.0, 56.0], [154.0, 180.0]]))


def offline_across(seed: int, data: Path) -> fp.Problem:
    """Nineteen arms from folded, among two that cannot move: one extended across the others' ways, one folded."""
    plane = fp.FocalPlane.hexagonal(2, PITCH)
    online = np.ones(plane.n, bool)
    online[[9, 3]] = False
    plane = plane.replace(online=online)
    start = plane.folded.copy()
    start[9] = np.radians([30.0, 10.0])
    return fp.Problem(plane, start, uniform_field(plane, seed, start=start))


def hexagon_61(seed: int, data: Path) -> fp.Problem:
    """61 arms from field to field at a buffer of 2.0 mm: field 2 seed to field 2 seed + 1."""
    plane, margin = fp.FocalPlane.hexagonal(4, PITCH), margin_of(2.0)
    start, goal = (uniform_field(plane, number, margin) for number in (2 * seed, 2 * seed + 1))
    return fp.Problem(plane, start, goal, margin)


SCENES = (
    Scene("exchange", exchange, fields=1, finite=True, quick=True),
    Scene("pinwheel", pinwheel, fields=1, finite=True, quick=True),
    Scene("aside", aside, fields=1, finite=True, quick=True),
    Scene("offline-across", offline_across, quick=True),
    Scene("hexagon-61", hexagon_61, quick=True),
)
