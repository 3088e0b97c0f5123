"""Instruments written by hand: a TOML file of nominal values, each with its source beside it.

Lengths are in mm, angles in degrees, speeds in deg/s. The file describes a hexagonal grid of equal positioners, or
four-bar arms on a ring, the holes that hold something else, and what stands fixed; anything it does not know is refused
by name.
"""

import os
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError, model_validator

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import ARM, Body, Obstacle
from fiberplan.focal_plane.four_bar import FourBar
from fiberplan.focal_plane.kinematics import Kinematics
from fiberplan.focal_plane.layouts import hexagonal_grid
from fiberplan.focal_plane.two_link import TWO_LINK
from fiberplan.instruments.formats import focal_plane_format
from fiberplan.tables.table_reader import nearest, one_line, read_text

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Length = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Point = Annotated[tuple[Finite, Finite], Strict(False)]  # TOML has arrays only
Points = Annotated[list[Point], Field(min_length=1)]


class _Part(BaseModel):
    """Unknown fields are refused; numbers must be numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Grid(_Part):
    """Where positioners stand: a filled hexagon, less some holes."""

    kind: Literal["hexagonal"]
    rings: Annotated[int, Field(ge=0, le=1000)]
    pitch: Positive  #: [mm]
    empty: list[str] = []  #: holes with nothing in them

    def places(self) -> tuple[tuple[str, ...], np.ndarray]:
        """Ids and positions (n, 2) [mm]."""
        return hexagonal_grid(self.rings, self.pitch)


class Ring(_Part):
    """Where four-bar arms stand: evenly on a circle, each with its x axis towards the middle."""

    kind: Literal["ring"]
    count: Annotated[int, Field(ge=1, le=1000)]
    radius: Positive  #: of the circle of J1 [mm]
    empty: list[str] = []

    def places(self) -> tuple[tuple[str, ...], np.ndarray]:
        """Ids A1, A2, ... counter-clockwise from the x axis, and positions (n, 2) [mm]."""
        turn = 2 * np.pi * np.arange(self.count) / self.count
        return tuple(f"A{k + 1}" for k in range(self.count)), self.radius * np.stack([np.cos(turn), np.sin(turn)], 1)


class Arm(_Part):
    """The first link."""

    length: Length  #: base to elbow, d13 of a four-bar arm [mm]


class Slider(_Part):
    """How long the slider of a four-bar arm may be: outside is the zone of avoidance."""

    shortest: Positive  #: [mm]
    longest: Positive  #: [mm]


class FourBarPart(_Part):
    """What a four-bar arm has beyond its first link and its fiber, the tip."""

    spacing: Positive  #: J1 to J2, d12 [mm]
    rocker: Positive  #: J2 to J4, d24 [mm]
    slider: Slider


class Joint(_Part):
    """One joint's range, park angle and speed."""

    lower: Finite  #: [deg]
    upper: Finite  #: [deg]
    folded: Finite  #: [deg]
    zero: Finite = 0.0  #: added to commanded angles by geometry, which measures beta from the alpha link [deg]
    speed: Positive  #: [deg/s]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.lower > self.upper:
            raise ValueError(f"lower {self.lower:g} deg is above upper {self.upper:g} deg")
        if not self.lower <= self.folded <= self.upper:
            raise ValueError(f"folded {self.folded:g} deg is outside {self.lower:g} to {self.upper:g} deg")
        return self


class Joints(_Part):
    """Both joints."""

    alpha: Joint
    beta: Joint


class BodyPart(_Part):
    """What can touch, on a link of every positioner."""

    name: str = ARM
    link: Literal["base", "alpha", "beta", "rocker"] = "beta"
    points: Points  #: in the link's frame [mm]
    radius: Length  #: [mm]
    closed: bool = False
    category: str = ARM
    meets: list[str] = [ARM]  #: ["*"] meets everything


class Square(_Part):
    """A square about a point given in polar coordinates, one pair of sides across the radius."""

    distance: Length  #: of its centre from the middle [mm]
    angle: Finite  #: [deg]
    side: Positive  #: [mm]

    def corners(self) -> np.ndarray:
        """(4, 2), counter-clockwise [mm]."""
        c, s = np.cos(np.radians(self.angle)), np.sin(np.radians(self.angle))
        half = self.side / 2
        across = np.array([-half, half, half, -half]) + self.distance
        local = np.stack([across, [-half, -half, half, half]], axis=1)
        return local @ np.array([[c, s], [-s, c]])


class ObstaclePart(_Part):
    """What stands fixed: an outline of points, or a square."""

    name: str
    points: Points | None = None  #: [mm]
    square: Square | None = None
    radius: Length = 0.0  #: [mm]
    closed: bool = True
    category: str = "obstacle"
    meets: list[str] = ["*"]

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        if (self.points is None) == (self.square is None):
            raise ValueError("needs either points or square")
        return self


class Fiducials(_Part):
    """Discs in holes of the grid and elsewhere."""

    radius: Length  #: [mm]
    holes: list[str] = []  #: of the grid
    at: dict[str, Point] = {}  #: name -> centre [mm]


class Definition(_Part):
    """A whole instrument file."""

    format: Literal[1]
    name: str
    title: str = ""
    sources: list[str] = []  #: where the numbers come from; printed beside plans
    grid: Annotated[Grid | Ring, Field(discriminator="kind")]
    arm: Arm
    four_bar: FourBarPart | None = None
    field_radius: Positive | None = None  #: targets lie this close to the middle [mm]
    fibers: Annotated[dict[str, Point], Field(min_length=1)]  #: in the beta link's frame [mm]; the first is the default
    joints: Joints
    bodies: list[BodyPart] = []
    fiducials: Fiducials | None = None
    obstacles: list[ObstaclePart] = []

    @model_validator(mode="after")
    def _ring_of_bars(self) -> Self:
        if (self.four_bar is None) != isinstance(self.grid, Grid):
            raise ValueError("four_bar arms stand on a grid of kind 'ring', and only they do")
        return self

    def plane(self) -> FocalPlane:
        """The focal plane this describes.

        Raises:
            InstrumentError: a hole that the grid does not have or that is used twice, or values that make no focal
                plane.
        """
        ids, base = self.grid.places()
        where = dict(zip(ids, base, strict=True))
        fiducials = self.fiducials or Fiducials(radius=0.0)
        taken: set[str] = set()
        for field, holes in (("grid.empty", self.grid.empty), ("fiducials.holes", fiducials.holes)):
            for hole in holes:
                if hole not in where:
                    raise InstrumentError(f"{field}: the grid has no hole '{hole}'{nearest(hole, ids)}")
                if hole in taken:
                    raise InstrumentError(f"{field}: hole '{hole}' is already used")
                taken.add(hole)
        kept = tuple(id_ for id_ in ids if id_ not in taken)
        discs = {hole: where[hole] for hole in fiducials.holes} | {k: np.array(v) for k, v in fiducials.at.items()}
        obstacles = [Obstacle(f"fiducial {k}", [centre], fiducials.radius) for k, centre in discs.items()]  # type: ignore[arg-type]
        joints, n = (self.joints.alpha, self.joints.beta), len(kept)

        def both(name: str) -> np.ndarray:
            return np.tile(np.radians([getattr(joint, name) for joint in joints]), (n, 1))

        return FocalPlane(
            ids=kept,
            base=np.array([where[id_] for id_ in kept]).reshape(-1, 2),
            length=np.full(n, self.arm.length),
            fiber_offsets={name: np.array(offset) for name, offset in self.fibers.items()},
            folded=both("folded"),
            lower=both("lower"),
            upper=both("upper"),
            max_speed=both("speed"),
            zero=both("zero"),
            bodies=tuple(
                Body(np.array(b.points), b.radius, b.link, b.closed, b.category, _meets(b.meets), b.name)
                for b in self.bodies
            ),
            obstacles=tuple(obstacles)
            + tuple(
                Obstacle(
                    name=o.name,
                    points=o.square.corners() if o.square else np.array(o.points),
                    radius=o.radius,
                    closed=o.closed,
                    category=o.category,
                    meets=_meets(o.meets),
                )
                for o in self.obstacles
            ),
            name=self.name,
            kinematics=self._kinematics(np.array([where[id_] for id_ in kept]).reshape(-1, 2)),
            field_radius=self.field_radius or np.inf,
            notes=(*([self.title] if self.title else []), *self.sources),
        )

    def _kinematics(self, base: np.ndarray) -> Kinematics:
        """The kind of arms that stand at `base` (n, 2) [mm]."""
        part = self.four_bar
        if part is None:
            return TWO_LINK
        lengths = (part.spacing, part.rocker, part.slider.shortest, part.slider.longest)
        inward = np.arctan2(-base[:, 1], -base[:, 0])
        spacing, rocker, shortest, longest = (np.full(len(base), x) for x in lengths)
        return FourBar(spacing, rocker, shortest, longest, inward)


def _meets(names: list[str]) -> tuple[str, ...] | None:
    return None if "*" in names else tuple(names)


@focal_plane_format("toml", "a .toml file written by hand", lambda path: path.suffix.lower() == ".toml")
def read_definition(path: str | os.PathLike) -> FocalPlane:
    """The focal plane that a TOML file describes.

    Raises:
        InstrumentError: no such file, not TOML (line and column are named), or a field that cannot be used (it is
            named).
    """
    path = Path(path)
    text = "\n".join(read_text(path, InstrumentError))
    try:
        return Definition.model_validate(tomllib.loads(text)).plane()
    except tomllib.TOMLDecodeError as error:
        raise InstrumentError(f"{path}: is not valid TOML: {one_line(error)}") from None
    except ValidationError as error:
        raise InstrumentError(f"{path}: {_complaint(error)}") from None
    except InstrumentError as error:
        raise InstrumentError(f"{path}: {error}") from None


def _complaint(error: ValidationError) -> str:
    """The first complaint, with the field's name and value as the file has them."""
    first, *others = error.errors()
    where = [str(part) for part in first["loc"] if part not in ("hexagonal", "ring")]  # the kind is no part of the name
    field = ".".join(where) or "the file"
    message = first["msg"].removeprefix("Value error, ")
    value: Any = first["input"]
    if first["type"] == "missing":
        text = f"{field}: is missing"
    elif first["type"] == "extra_forbidden":
        text = f"{field}: no such field"
    elif isinstance(value, (int, float, str)):
        text = f"{field} = {value!r}: {message[0].lower()}{message[1:]}"
    else:
        text = f"{field}: {message[0].lower()}{message[1:]}"
    return text + (f" (and {len(others)} more)" if others else "")
