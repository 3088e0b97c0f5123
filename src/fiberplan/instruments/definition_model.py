"""What an instrument file may say: its fields, with the units and the meaning that the JSON Schema prints.

Lengths are in mm, angles in degrees, speeds in deg/s, accelerations in deg/s^2. Unknown fields are refused, and numbers
must be numbers. What a table of positioners may give in place of a field can be left out here;
`fiberplan.instruments.definition` says what is still missing once everything is read.
"""

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, Strict, Tag, model_validator

from fiberplan.focal_plane.bodies import ARM
from fiberplan.instruments.grids import Finite, Grid, Part, Positive

Length = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Point = Annotated[tuple[Finite, Finite], Strict(False)]  # TOML has arrays only
Points = Annotated[list[Point], Field(min_length=1)]
Text = Annotated[str, Field(min_length=1)]


class Positioner(Part):
    """One positioner; what it does not say is as for all. A table of positioners has columns of the same names."""

    id: Text = Field(description="its name; on a grid the hole's (in a table: column `positioner`)")
    x: Finite | None = Field(default=None, description="alpha axis [mm]")
    y: Finite | None = Field(default=None, description="alpha axis [mm]")
    distance: Length | None = Field(
        default=None, description="alpha axis from the origin, with `angle`, in place of x, y [mm]"
    )
    angle: Finite | None = Field(
        default=None, description="of the alpha axis about the origin, from +x towards +y [deg]"
    )
    length: Length | None = Field(default=None, description="base to elbow [mm]")
    arm: Finite | None = Field(default=None, description="elbow to the first fiber, straight along the beta link [mm]")
    fibers: dict[str, Point] = Field(
        default={}, description="in the beta link's frame [mm] (in a table: <fiber>_x, <fiber>_y)"
    )
    radius: dict[str, Length] = Field(default={}, description="of bodies by name [mm] (in a table: radius_<body>)")
    lower_alpha: Finite | None = Field(default=None, description="lower end of alpha's range [deg]")
    lower_beta: Finite | None = Field(default=None, description="lower end of beta's range [deg]")
    upper_alpha: Finite | None = Field(default=None, description="upper end of alpha's range [deg]")
    upper_beta: Finite | None = Field(default=None, description="upper end of beta's range [deg]")
    folded_alpha: Finite | None = Field(default=None, description="alpha of the park state [deg]")
    folded_beta: Finite | None = Field(default=None, description="beta of the park state [deg]")
    zero_alpha: Finite | None = Field(default=None, description="added to commanded alpha by geometry [deg]")
    zero_beta: Finite | None = Field(default=None, description="added to commanded beta by geometry [deg]")
    speed_alpha: Positive | None = Field(default=None, description="fastest turn of alpha [deg/s]")
    speed_beta: Positive | None = Field(default=None, description="fastest turn of beta [deg/s]")
    acceleration_alpha: Positive | None = Field(default=None, description="fastest change of alpha's speed [deg/s^2]")
    acceleration_beta: Positive | None = Field(default=None, description="fastest change of beta's speed [deg/s^2]")
    min_speed_alpha: Length | None = Field(default=None, description="slowest turn of alpha, unless it rests [deg/s]")
    min_speed_beta: Length | None = Field(default=None, description="slowest turn of beta, unless it rests [deg/s]")
    orientation: Finite | None = Field(default=None, description="x axis of a four-bar arm; inward if not given [deg]")
    spacing: Positive | None = Field(default=None, description="J1 to J2 of a four-bar arm, d12 [mm]")
    rocker: Positive | None = Field(default=None, description="J2 to J4 of a four-bar arm, d24 [mm]")
    shortest: Positive | None = Field(default=None, description="slider of a four-bar arm [mm]")
    longest: Positive | None = Field(default=None, description="slider of a four-bar arm [mm]")
    online: bool = Field(default=True, description="false: it cannot move and stays folded")

    def cells(self) -> dict[str, Any]:
        """What it says, by the names of a table's columns."""
        said = self.model_dump(exclude={"id", "fibers", "radius"}, exclude_none=True, exclude_unset=True)
        said |= {
            f"{name}_{axis}": v for name, point in self.fibers.items() for axis, v in zip("xy", point, strict=True)
        }
        return {"positioner": self.id} | said | {f"radius_{name}": value for name, value in self.radius.items()}


class Arm(Part):
    """The first link."""

    length: Length = Field(description="base to elbow; d13 of a four-bar arm [mm]")


class Slider(Part):
    """How long the slider of a four-bar arm may be: outside is the zone of avoidance."""

    shortest: Positive = Field(description="J3 to J4 [mm]")
    longest: Positive = Field(description="J3 to J4 [mm]")


class FourBarPart(Part):
    """What a four-bar arm has beyond its first link and its fiber, the tip."""

    spacing: Positive = Field(description="J1 to J2, d12 [mm]")
    rocker: Positive = Field(description="J2 to J4, d24 [mm]")
    slider: Slider = Field(description="how long it may be")


class Joint(Part):
    """One joint's range, park angle and motor, for all positioners."""

    lower: Finite | None = Field(default=None, description="lower end of the range [deg]")
    upper: Finite | None = Field(default=None, description="upper end of the range [deg]")
    folded: Finite | None = Field(default=None, description="angle of the park state [deg]")
    zero: Finite = Field(
        default=0.0, description="added to commanded angles by geometry, which measures beta from the alpha link [deg]"
    )
    speed: Positive | None = Field(default=None, description="fastest turn [deg/s]")
    acceleration: Positive | None = Field(
        default=None, description="fastest change of speed [deg/s^2]; without, motors jump to any speed"
    )
    min_speed: Length = Field(default=0.0, description="slowest turn, unless the joint rests [deg/s]")


class Joints(Part):
    """Both joints; commanded beta is measured from the alpha link unless `zero` says otherwise."""

    alpha: Joint = Field(default=Joint(), description="about the base")
    beta: Joint = Field(default=Joint(), description="about the elbow")


class BodyPart(Part):
    """What can touch, on a link of every positioner."""

    name: Text = Field(default=ARM, description="as errors, pages and tables of outlines name it")
    link: Literal["base", "alpha", "beta", "rocker"] = Field(default="beta", description="the link it rides on")
    points: Points | None = Field(
        default=None, description="for every positioner, in the link's frame: 1 a disc, 2 a capsule [mm]"
    )
    outlines: Text | None = Field(
        default=None, description="file of outlines: columns positioner, x, y and, if wanted, body, vertex, radius"
    )
    radius: Length | None = Field(default=None, description="by which the points are rounded [mm]")
    closed: bool = Field(default=False, description="a filled outline rather than a line")
    category: str = Field(default=ARM, description="what it is, usually its height")
    meets: list[str] = Field(default=[ARM], description='categories it can touch; ["*"] meets everything')

    @model_validator(mode="after")
    def _some_shape(self) -> Self:
        if self.points is None and self.outlines is None:
            raise ValueError("needs points, or outlines from a file")
        return self


class Square(Part):
    """A square about a point given in polar coordinates, one pair of sides across the radius."""

    distance: Length = Field(description="of its centre from the middle [mm]")
    angle: Finite = Field(description="of its centre, from +x towards +y [deg]")
    side: Positive = Field(description="[mm]")

    def corners(self) -> np.ndarray:
        """(4, 2), counter-clockwise [mm]."""
        c, s = np.cos(np.radians(self.angle)), np.sin(np.radians(self.angle))
        half = self.side / 2
        across = np.array([-half, half, half, -half]) + self.distance
        local = np.stack([across, [-half, -half, half, half]], axis=1)
        return local @ np.array([[c, s], [-s, c]])


class ObstaclePart(Part):
    """What stands fixed: an outline of points, a square, or every row of a table."""

    name: Text | None = Field(
        default=None, description="as errors and pages name it; in a table each row gives its own"
    )
    points: Points | None = Field(default=None, description="in focal-plane coordinates: 1 a disc, 2 a capsule [mm]")
    square: Square | None = Field(default=None, description="in place of points")
    table: Text | None = Field(
        default=None, description="file of obstacles: columns name, x, y and, if wanted, vertex, radius"
    )
    radius: Length = Field(default=0.0, description="by which the points are rounded [mm]")
    closed: bool = Field(default=True, description="a filled outline rather than a line")
    category: str = Field(default="obstacle", description="what it is, usually its height")
    meets: list[str] = Field(default=["*"], description='categories it can touch; ["*"] meets everything')

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        if sum(shape is not None for shape in (self.points, self.square, self.table)) != 1:
            raise ValueError("needs either points, square or table")
        if (self.name is None) == (self.table is None):
            raise ValueError(
                "needs a name" if self.table is None else "has a name, but those in its table have their own"
            )
        return self


class Fiducials(Part):
    """Discs in holes of the grid and elsewhere."""

    radius: Length = Field(description="[mm]")
    holes: list[str] = Field(default=[], description="ids of holes of the grid, which then have no positioner")
    at: dict[str, Point] = Field(default={}, description="name -> centre [mm]")


Fibers = Annotated[
    Annotated[dict[str, Point], Field(min_length=1), Tag("offsets")]
    | Annotated[list[Text], Field(min_length=1), Tag("names")],
    Discriminator(lambda value: "names" if isinstance(value, list) else "offsets"),
]


class Definition(Part):
    """An instrument: where its positioners stand, what each is like, what can touch, and what stands fixed."""

    format: Literal[1] = Field(description="of this file")
    name: Text = Field(description="as plans name the instrument")
    title: str = Field(default="", description="one line about it; printed beside plans")
    sources: list[str] = Field(default=[], description="where the numbers come from; printed beside plans")
    assumptions: list[str] = Field(default=[], description="what has no source; said with every proof")
    margin: Length | None = Field(default=None, description="recommended clearance, taken where none is asked for [mm]")
    grid: Grid | None = Field(default=None, description="where positioners stand regularly")
    positioners: Text | None = Field(
        default=None,
        description="file with a row for each positioner, beside this one; its values win over those given for all",
    )
    positioner: list[Positioner] = Field(
        default=[], description="positioners one by one; what they say wins over all else"
    )
    arm: Arm | None = Field(default=None, description="the first link of all")
    four_bar: FourBarPart | None = Field(default=None, description="makes them four-bar arms, as in MIRADAS")
    field_radius: Positive | None = Field(default=None, description="targets lie this close to the middle [mm]")
    fibers: Fibers = Field(
        default=["fiber"],
        description="name -> place in the beta link's frame [mm], or only names where a table gives the places; "
        "the first is the default",
        examples=[{"fiber": [15.0, 0.0]}, ["metrology", "science"]],
    )
    joints: Joints = Field(default=Joints(), description="ranges, park angles and speeds of all")
    bodies: list[BodyPart] = Field(default=[], description="what can touch; without bodies nothing can")
    fiducials: Fiducials | None = Field(default=None, description="discs that stand fixed")
    obstacles: list[ObstaclePart] = Field(default=[], description="what stands fixed")
    forbidden: Text | None = Field(
        default=None, description="file of places where no fiber may end: columns x, y, radius; nothing touches them"
    )

    @model_validator(mode="after")
    def _somewhere(self) -> Self:
        if self.grid is None and self.positioners is None and not self.positioner:
            raise ValueError(
                "grid: is missing, and neither positioners nor [[positioner]] says where positioners stand"
            )
        if self.grid is not None and (self.four_bar is None) != (self.grid.kind != "ring"):
            raise ValueError("four_bar arms stand on a grid of kind 'ring' or in a table, and only they on a ring")
        return self


def schema() -> dict[str, Any]:
    """The JSON Schema of an instrument file."""
    title = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "fiberplan instrument, format 1"}
    return title | {key: value for key, value in _sayable(Definition.model_json_schema()).items() if key != "title"}


def _sayable(node: Any) -> Any:
    """A schema without null, which TOML cannot say: a field that may be left out is not required, that is all."""
    if isinstance(node, list):
        return [_sayable(item) for item in node if item != {"type": "null"}]
    if not isinstance(node, dict):
        return node
    kept = {key: _sayable(value) for key, value in node.items() if key != "default" or value is not None}
    only = kept.get("anyOf", ())
    return {key: value for key, value in kept.items() if key != "anyOf"} | only[0] if len(only) == 1 else kept
