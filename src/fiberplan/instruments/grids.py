"""Where positioners stand in regular arrays, as an instrument file says it."""

from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from fiberplan.focal_plane.layouts import hexagonal_grid

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Part(BaseModel):
    """Unknown fields are refused; numbers must be numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Hexagonal(Part):
    """A filled hexagon, row by row from the lowest y; holes are R<row>C<column> (R-1C2), row 0 in the middle.

    With `count` its holes farthest from the middle are left out, of equally far ones those of higher rows and columns.
    """

    kind: Literal["hexagonal"] = Field(description="rows along x, neighbours at equal distances")
    rings: Annotated[int, Field(ge=0, le=1000)] = Field(description="around the middle hole; 10 rings have 331 holes")
    pitch: Positive = Field(description="from hole to hole [mm]")
    empty: list[str] = Field(default=[], description="ids of holes with nothing in them", examples=[["R0C1"]])
    count: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="keep so many holes, those nearest to the middle; all unless given"
    )

    def places(self) -> tuple[tuple[str, ...], np.ndarray]:
        """Ids and positions (n, 2) [mm]."""
        ids, base = hexagonal_grid(self.rings, self.pitch)
        if self.count is None or self.count >= len(ids):
            return ids, base
        away = np.round(np.hypot(*base.T) / self.pitch, 9)  # as far is as far, whatever the rounding
        kept = np.sort(np.argsort(away, kind="stable")[: self.count])
        return tuple(ids[k] for k in kept), base[kept]


class Rectangular(Part):
    """Rows and columns about the middle, row by row from the lowest y; holes are R1C1, R1C2, ..."""

    kind: Literal["rectangular"] = Field(description="rows along x, columns along y")
    rows: Annotated[int, Field(ge=1, le=1000)] = Field(description="how many rows")
    columns: Annotated[int, Field(ge=1, le=1000)] = Field(description="how many holes in a row")
    pitch: Positive = Field(description="from hole to hole, along x and along y [mm]")
    empty: list[str] = Field(default=[], description="ids of holes with nothing in them", examples=[["R1C1"]])

    def places(self) -> tuple[tuple[str, ...], np.ndarray]:
        """Ids and positions (n, 2) [mm]."""
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        ids = tuple(f"R{r + 1}C{c + 1}" for r, c in zip(row, column, strict=True))
        return ids, self.pitch * np.stack([column - (self.columns - 1) / 2, row - (self.rows - 1) / 2], axis=1)


class Ring(Part):
    """Evenly on a circle, for four-bar arms; A1, A2, ... counter-clockwise from the x axis."""

    kind: Literal["ring"] = Field(description="arms look towards the middle")
    count: Annotated[int, Field(ge=1, le=1000)] = Field(description="how many arms")
    radius: Positive = Field(description="of the circle of J1 [mm]")
    empty: list[str] = Field(default=[], description="ids of places with nothing in them", examples=[["A1"]])

    def places(self) -> tuple[tuple[str, ...], np.ndarray]:
        """Ids and positions (n, 2) [mm]."""
        turn = 2 * np.pi * np.arange(self.count) / self.count
        return tuple(f"A{k + 1}" for k in range(self.count)), self.radius * np.stack([np.cos(turn), np.sin(turn)], 1)


class Modules(Part):
    """Rhombic fields around the middle, of modules of two staggered columns; numbered from 1, field by field.

    The first module's first hole is at (-h, pitch / 2), h = pitch sqrt(3) / 2; its holes alternate between two columns
    and go down; each next module stands two columns farther to -x and one pitch higher. Fields follow clockwise.
    """

    kind: Literal["modules"] = Field(description="fields of modules, as the cobras of PFS")
    fields: Annotated[int, Field(ge=1, le=3)] = Field(description="each turned by 120 deg")
    modules: Annotated[int, Field(ge=1, le=1000)] = Field(description="in each field")
    holes: Annotated[int, Field(ge=1, le=1000)] = Field(description="in each module")
    pitch: Positive = Field(description="from hole to hole [mm]")
    empty: list[str] = Field(default=[], description="ids of holes with nothing in them", examples=[["1"]])

    def places(self) -> tuple[tuple[str, ...], np.ndarray]:
        """Ids and positions (n, 2) [mm]."""
        n = self.fields * self.modules * self.holes
        field, rest = np.divmod(np.arange(n), self.modules * self.holes)
        module, hole = np.divmod(rest, self.holes)
        x = -self.pitch * np.sqrt(0.75) * (1 + 2 * module + hole % 2)
        y = self.pitch * (0.5 + module - 0.5 * hole)
        turn = -2 * np.pi / 3 * field
        c, s = np.cos(turn), np.sin(turn)
        return tuple(map(str, range(1, n + 1))), np.stack([c * x - s * y, s * x + c * y], axis=1)


Grid = Annotated[Hexagonal | Rectangular | Ring | Modules, Field(discriminator="kind")]
