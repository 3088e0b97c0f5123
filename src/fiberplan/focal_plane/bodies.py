"""What can touch: bodies that ride on a link of every positioner, and obstacles fixed to the focal plane.

A body is a rounded shape: one point is a disc, two or more an open line of capsules, and a closed outline is filled. A
category says what it is (usually its height) and `meets` what it can touch; two bodies can touch if either meets the
other. Closed outlines are cut into convex pieces once, here.
"""

import dataclasses
from collections.abc import Collection
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from fiberplan.arrays import Frozen, number, read_only, shortened
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.outlines import convex_pieces

ARM = "arm"
LINKS = {"base": 0, "alpha": 1, "beta": 2, "rocker": 3}


@dataclass(frozen=True, eq=False)
class Body(Frozen):
    """A rounded shape on one link of every positioner.

    Raises:
        InstrumentError: a shape with no points, a negative radius, or values that are not finite.
    """

    points: np.ndarray  #: (k, 2) shared by all positioners or (n, k, 2), in the frame of the link [mm]
    radius: float | np.ndarray  #: rounding, shared or (n,) [mm]
    link: str = "beta"  #: "base", "alpha" (origin at the base), "beta" (at the elbow) or a four-bar arm's "rocker"
    closed: bool = False  #: a filled outline rather than a line
    category: str = ARM
    meets: tuple[str, ...] | None = (ARM,)  #: None meets everything
    name: str = ARM

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _points(self.points, self.name, (2, 3)))
        radius = read_only(self.radius, float, "mm", f"body '{self.name}': radius", InstrumentError)
        if radius.ndim > 1 or not np.all(np.isfinite(radius) & (radius >= 0)):
            raise InstrumentError(f"body '{self.name}': radius {self.radius} is not a length of 0 mm or more")
        object.__setattr__(self, "radius", radius)
        _check_meets(self.meets, self.name)
        if self.link not in LINKS:
            raise InstrumentError(f"body '{self.name}': link '{self.link}' is none of {', '.join(LINKS)}")

    def __repr__(self) -> str:
        radius = "own radii" if np.ndim(self.radius) else f"radius {float(self.radius):g} mm"
        return f"<Body '{shortened(self.name)}' on {self.link}: {self.points.shape[-2]} points, {radius}>"

    def subset(self, who: np.ndarray) -> "Body":
        """The same body as the positioners `who` (k,) have it."""
        own_points, own_radius = self.points.ndim == 3, np.ndim(self.radius) == 1
        if not (own_points or own_radius):
            return self
        return dataclasses.replace(
            self,
            points=self.points[who] if own_points else self.points,
            radius=np.asarray(self.radius)[who] if own_radius else self.radius,
        )

    def meeting(self, there: Collection[str]) -> "Body":
        """The same body, meeting only categories that are `there`: a focal plane refuses to name others."""
        return _meeting(self, there)

    def pieces(self, i: int) -> list[np.ndarray]:
        """Convex pieces of positioner `i`'s body, each (k, 2) [mm]."""
        return convex_pieces(self.points[i] if self.points.ndim == 3 else self.points, self.closed)


@dataclass(frozen=True, eq=False)
class Obstacle(Frozen):
    """A rounded shape fixed to the focal plane: a fiducial, a guide camera, a petal edge.

    Raises:
        InstrumentError: as for `Body`.
    """

    name: str
    points: np.ndarray  #: (k, 2) in focal-plane coordinates [mm]
    radius: float = 0.0  #: [mm]
    closed: bool = False
    category: str = "obstacle"
    meets: tuple[str, ...] | None = None  #: None meets everything

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _points(self.points, self.name, (2,)))
        radius = number(self.radius, "mm", f"obstacle '{self.name}': radius", InstrumentError)
        object.__setattr__(self, "radius", radius)
        if not (np.isfinite(self.radius) and self.radius >= 0):
            raise InstrumentError(f"obstacle '{self.name}': radius {self.radius} is not a length of 0 mm or more")
        _check_meets(self.meets, self.name)

    def __repr__(self) -> str:
        return f"<Obstacle '{shortened(self.name)}': {len(self.points)} points, radius {self.radius:g} mm>"

    def meeting(self, there: Collection[str]) -> "Obstacle":
        """The same obstacle, meeting only categories that are `there`: a focal plane refuses to name others."""
        return _meeting(self, there)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Distance of `points` (m, 2) from it (m,) [mm]; 0 within."""
        begin, end = self.points, np.roll(self.points, -1, axis=0)
        if not self.closed and len(begin) > 1:
            begin, end = begin[:-1], end[:-1]
        along, beside = end - begin, points[:, None] - begin
        length2 = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
        part = np.clip((beside * along).sum(axis=2) / length2, 0.0, 1.0)
        away = np.hypot(*np.moveaxis(beside - part[..., None] * along, 2, 0)).min(axis=1)
        if self.closed:
            up = (begin[:, 1] <= points[:, None, 1]) != (end[:, 1] <= points[:, None, 1])
            left = along[:, 0] * beside[..., 1] - along[:, 1] * beside[..., 0]
            away[np.count_nonzero(up & ((left > 0) == (along[:, 1] > 0)), axis=1) % 2 == 1] = 0.0
        return np.maximum(away - self.radius, 0.0)

    def pieces(self) -> list[np.ndarray]:
        """Convex pieces, each (k, 2) [mm]."""
        return convex_pieces(self.points, self.closed)


_Shape = TypeVar("_Shape", Body, Obstacle)


def _meeting(shape: _Shape, there: Collection[str]) -> _Shape:
    if shape.meets is None or set(there).issuperset(shape.meets):
        return shape
    return dataclasses.replace(shape, meets=tuple(name for name in shape.meets if name in there))


def _check_meets(meets: tuple[str, ...] | None, name: str) -> None:
    """Refuse a bare string, which would be read letter by letter and meet nothing."""
    if isinstance(meets, str):
        raise InstrumentError(f"'{name}': meets must be a list of categories, got the string '{meets}'")


def _points(points: np.ndarray, name: str, dimensions: tuple[int, ...]) -> np.ndarray:
    """`points` as a read-only float array of one of the given dimensions, the last of size 2."""
    array = read_only(points, unit="mm", name=f"'{name}': points", error=InstrumentError)
    if array.ndim not in dimensions or array.shape[-1] != 2 or array.shape[-2] == 0 or not np.all(np.isfinite(array)):
        raise InstrumentError(f"'{name}': points must be finite and of shape (k, 2), got shape {array.shape}")
    return array
