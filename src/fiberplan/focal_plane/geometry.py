"""Which geometry a proof is about: its name for people, and a digest of all that a proof looks at.

Two focal planes with the same digest have the same arms, ranges, speeds, bodies and obstacles, to the last bit. Who is
online, where arms are folded, fibers, notes and names of bodies are no part of it.
"""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.focal_plane import FocalPlane
from fiberplan.focal_plane.kinds import stored

_ARRAYS = ("base", "length", "zero", "lower", "upper", "max_speed")
_SHOWN = 12  # digits of the digest that people compare


@dataclass(frozen=True)
class Geometry:
    """What a proof is about."""

    name: str  #: of the focal plane
    digest: str  #: SHA-256, hexadecimal
    positioners: int
    obstacles: int
    radii: tuple[tuple[str, float, float], ...]  #: name of each body, its smallest and its largest radius [mm]

    def __str__(self) -> str:
        bodies = [f"{name} of radius {_between(low, high)} mm" for name, low, high in self.radii]
        count = f"{self.obstacles} obstacle{'' if self.obstacles == 1 else 's'}"
        parts = (f"{self.positioners} positioners", *(bodies or ["no bodies"]), count)
        return f"{self.name}: {', '.join(parts)}; digest {self.digest[:_SHOWN]}"


def geometry_of(plane: FocalPlane) -> Geometry:
    """The geometry of a focal plane, in O(n)."""
    hashed = hashlib.sha256(b"fiberplan geometry 1\n")
    for part in _parts(plane):
        hashed.update(part)
    radii = tuple((b.name, float(np.min(b.radius)), float(np.max(b.radius))) for b in plane.bodies)
    return Geometry(plane.name, hashed.hexdigest(), plane.n, len(plane.obstacles), radii)


def _parts(plane: FocalPlane) -> Iterator[bytes]:
    yield _words(plane.ids)
    for name in _ARRAYS:
        yield from _array(name, getattr(plane, name))
    for name, (values, _) in stored(plane.kinematics).items():
        yield from _array(name, values)
    shapes: tuple[Body | Obstacle, ...] = (*plane.bodies, *plane.obstacles)
    for shape in shapes:
        meets = None if shape.meets is None else sorted(shape.meets)
        yield _words((getattr(shape, "link", "fixed"), shape.closed, shape.category, meets))
        yield from _array("points", shape.points)
        yield from _array("radius", shape.radius)


def _words(words: Any) -> bytes:
    return json.dumps(words).encode() + b"\n"


def _array(name: str, values: Any) -> Iterator[bytes]:
    array = np.ascontiguousarray(values, "<f8") + 0.0  # no -0.0, which is equal and has other bytes
    yield _words((name, np.shape(values)))
    yield array.tobytes()


def _between(low: float, high: float) -> str:
    return f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"
