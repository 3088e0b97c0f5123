"""Bodies and obstacles of an instrument file: from its own points, or from a table with a row for every vertex.

A crossed outline is refused here, where the place that says it is still known.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import NamedTuple

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.outlines import simple_outline
from fiberplan.instruments.complaints import Complaint, DefinitionError
from fiberplan.instruments.definition_model import BodyPart, ObstaclePart
from fiberplan.instruments.locate import Path
from fiberplan.instruments.positioner_table import PositionerValues
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_table
from fiberplan.tables.wording import nearest


class _Shape(NamedTuple):
    """What the rows of one positioner or obstacle say."""

    row: int  # the first
    points: np.ndarray  # (k, 2) [mm]
    radius: float  # NaN where not given [mm]


def bodies(parts: Sequence[BodyPart], values: PositionerValues, folder: FilePath) -> tuple[Body, ...]:
    """Bodies of the positioners of `values`, with outlines from files in `folder`.

    Raises:
        InstrumentError: a table or outline that cannot be used.
    """
    made = []
    files = {part.outlines for part in parts if part.outlines is not None}  # one file may serve several bodies
    tables = {name: read_table(folder / name, InstrumentError) for name in sorted(files)}
    for k, part in enumerate(parts):
        points, common = _outlines(k, part, values, tables)
        field, column = ("bodies", k, "radius"), f"radius_{part.name}"
        radius = values.column(column, field, "mm", common, usual=np.max)
        wrong = values.check(radius < 0, [column], field, "{} mm is negative", radius)
        radius[wrong] = radius.max(initial=-np.inf, where=~wrong)
        if not np.all(radius >= 0):
            continue  # a complaint by now
        made.append(
            Body(
                points=points,
                radius=radius[0] if np.all(radius == radius[0]) else radius,
                link=part.link,
                closed=part.closed,
                category=part.category,
                meets=meets_of(part.meets),
                name=part.name,
            )
        )
    return tuple(made)


def _outlines(
    k: int, part: BodyPart, values: PositionerValues, tables: Mapping[str, InputTable]
) -> tuple[np.ndarray, np.ndarray]:
    """Points (k, 2) that all share or (n, k, 2), and radii (n,), NaN where none is given [mm]."""
    shared = _Shape(-1, np.zeros((1, 2)) if part.points is None else np.array(part.points), np.nan)
    radii = np.full(len(values.ids), np.nan if part.radius is None else part.radius)
    if part.points is not None:
        _refuse_crossed(shared, part.closed, f"body '{part.name}'", ("bodies", k, "points"))
    if part.outlines is None:
        return shared.points, radii
    table = tables[part.outlines]
    table.require("positioner")
    names = table.texts("body") if "body" in table else (part.name,) * len(table)
    found = _shapes(table, table.texts("positioner"), np.array([name == part.name for name in names]))
    if not found:
        raise InstrumentError(f"{table.source}: no rows of body '{part.name}'{nearest(part.name, names)}")
    for id_, shape in found.items():
        if id_ not in values.index:
            raise table.fail(shape.row, f"there is no positioner '{id_}'{nearest(id_, values.ids)}")
        _refuse_crossed(shape, part.closed, f"body '{part.name}' of positioner '{id_}'", table)
        if not np.isnan(shape.radius):
            radii[values.index[id_]] = shape.radius
    for id_ in values.ids:
        if id_ not in found and part.points is None:
            raise InstrumentError(f"{table.source}: no rows of body '{part.name}' for positioner '{id_}'")
    outlines = [found.get(id_, shared).points for id_ in values.ids]
    most = max(map(len, outlines))  # a last point repeated changes no shape
    return np.array([np.pad(points, ((0, most - len(points)), (0, 0)), mode="edge") for points in outlines]), radii


def obstacles(parts: Sequence[ObstaclePart], folder: FilePath) -> tuple[Obstacle, ...]:
    """Obstacles, those of a table in the order of their first rows.

    Raises:
        InstrumentError: a table or outline that cannot be used.
    """
    made: list[Obstacle] = []
    for k, part in enumerate(parts):
        meets = meets_of(part.meets)
        shapes: dict[str, _Shape] = {}
        blame: InputTable | Path = ("obstacles", k, "points")
        if part.table is not None:
            blame = read_table(folder / part.table, InstrumentError)
            blame.require("name")
            shapes = _shapes(blame, blame.texts("name"), np.ones(len(blame), bool))
        else:
            points = part.square.corners() if part.square else np.array(part.points)
            shapes[str(part.name)] = _Shape(-1, points, np.nan)
        for name, shape in shapes.items():
            _refuse_crossed(shape, part.closed, f"obstacle '{name}'", blame)
            radius = part.radius if np.isnan(shape.radius) else shape.radius
            made.append(Obstacle(name, shape.points, radius, part.closed, part.category, meets))
    return tuple(made)


def forbidden(name: str | None, folder: FilePath) -> np.ndarray:
    """Places where no fiber may end (m, 3): x, y, radius [mm] of the rows of a table; none without one.

    Raises:
        InstrumentError: a table that cannot be used.
    """
    if name is None:
        return np.empty((0, 3))
    table = read_table(folder / name, InstrumentError)
    table.require("x", "y", "radius")
    discs = np.stack([table.numbers(column, "mm") for column in ("x", "y", "radius")], axis=1)
    for row in np.flatnonzero(discs[:, 2] < 0):
        raise table.fail(int(row), f"radius {discs[row, 2]:.6g} mm is negative")
    return discs


def _shapes(table: InputTable, owners: Sequence[str], wanted: np.ndarray) -> dict[str, _Shape]:
    """The shape that the wanted rows (m,) of each owner make, by vertex if there is such a column."""
    table.require("x", "y")
    points = np.stack([table.numbers(axis, "mm") for axis in "xy"], axis=1)
    radius = table.numbers("radius", "mm", blank=np.nan) if "radius" in table else np.full(len(table), np.nan)
    vertex = table.numbers("vertex") if "vertex" in table else np.arange(len(table))
    rows: dict[str, list[int]] = {owner: [] for owner, mine in zip(owners, wanted, strict=True) if mine}
    for row in map(int, np.argsort(vertex, kind="stable")):
        if wanted[row]:
            rows[owners[row]].append(row)
    for of in rows.values():
        for row in of:
            if radius[row] < 0:
                raise table.fail(row, f"radius {radius[row]:.6g} mm is negative")
            if radius[row] != radius[of[0]] and not np.isnan(radius[[row, of[0]]]).all():
                raise table.fail(
                    row, f"radius {radius[row]:.6g} mm differs from {table.rows[of[0]]}, of the same shape"
                )
    return {owner: _Shape(min(of), points[of], float(radius[of[0]])) for owner, of in rows.items()}


def _refuse_crossed(shape: _Shape, closed: bool, what: str, blame: InputTable | Path) -> None:
    """Refuse an outline without an inside, naming the row of a table or the field of the instrument file."""
    if not closed:
        return
    try:
        simple_outline(shape.points)
    except InstrumentError as error:
        if isinstance(blame, InputTable):
            raise blame.fail(shape.row, f"{what}: {error}") from None
        raise DefinitionError(Complaint(blame, f"{what}: {error}")) from None


def meets_of(names: Sequence[str]) -> tuple[str, ...] | None:
    """Categories as bodies have them: None meets everything."""
    return None if "*" in names else tuple(names)
