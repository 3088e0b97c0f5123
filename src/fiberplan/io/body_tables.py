"""Bodies and obstacles as table rows, one a vertex, and back.

The columns say whose a row is: their order in the file decides nothing, and none may be missing, double, or of a
positioner that is not there.
"""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.tables.fits_tables import numbers, texts

_WORDS = ("name", "category", "meets")
_SHARED = -1  #: the positioner of rows that stand for all


def body_rows(bodies: tuple[Body, ...], n: int) -> dict[str, Any]:
    """Columns of BODIES."""
    rows = []
    for number, body in enumerate(bodies):
        shared = body.points.ndim == 2 and np.ndim(body.radius) == 0
        shapes = np.broadcast_to(body.points, (1 if shared else n, *body.points.shape[-2:]))
        radii = np.broadcast_to(body.radius, len(shapes))
        for i, (points, radius) in enumerate(zip(shapes, radii, strict=True)):
            about = _about(body) | {"link": body.link, "body": number, "positioner": _SHARED if shared else i}
            rows += [about | {"radius": radius, "vertex": k, "x": x, "y": y} for k, (x, y) in enumerate(points)]
    return _columns(rows, ("body", "positioner", "vertex"), (*_WORDS, "link"))


def obstacle_rows(obstacles: tuple[Obstacle, ...]) -> dict[str, Any]:
    """Columns of OBSTACLES."""
    rows = []
    for number, obstacle in enumerate(obstacles):
        about = _about(obstacle) | {"obstacle": number, "radius": obstacle.radius}
        rows += [about | {"vertex": k, "x": x, "y": y} for k, (x, y) in enumerate(obstacle.points)]
    return _columns(rows, ("obstacle", "vertex"), _WORDS)


def bodies_from_rows(table: Any, ids: Sequence[str]) -> tuple[Body, ...]:
    """The bodies in BODIES, of positioners with these ids.

    Raises:
        InstrumentError: rows that are missing, double, contradict each other, or name a positioner that is not there.
    """
    owner, columns, bodies = numbers(table, "positioner", int), _read(table, (*_WORDS, "link")), []
    for number, rows in enumerate(_numbered(table, "BODIES", "body")):
        about = _said(columns, rows, f"BODIES: body {number}", (*_WORDS, "link"))
        where = f"BODIES: body {number} '{about['name']}'"
        owners = np.unique(owner[rows])
        expected = np.array([_SHARED]) if owners[-1] == _SHARED else np.arange(len(ids))
        for i in np.setdiff1d(owners, expected)[:1]:
            mixed = "rows of positioner -1, which stands for all, beside others"
            raise InstrumentError(f"{where}: {mixed if i == _SHARED else f'there is no positioner {i}'}")
        for i in np.setdiff1d(expected, owners)[:1]:
            raise InstrumentError(f"{where}: no row of positioner '{ids[i]}'")
        names = [where] if owners[-1] == _SHARED else [f"{where}, positioner '{id_}'" for id_ in ids]
        points, radius = _outlines(columns, rows, owner[rows] - owners[0], names)
        shape = points[0] if np.all(points == points[0]) else points
        bodies.append(Body(points=shape, radius=float(radius[0]) if np.all(radius == radius[0]) else radius, **about))
    return tuple(bodies)


def obstacles_from_rows(table: Any) -> tuple[Obstacle, ...]:
    """The obstacles in OBSTACLES.

    Raises:
        InstrumentError: rows that are missing, double or contradict each other.
    """
    columns, obstacles = _read(table, _WORDS), []
    for number, rows in enumerate(_numbered(table, "OBSTACLES", "obstacle")):
        about = _said(columns, rows, f"OBSTACLES: obstacle {number}", _WORDS)
        where = f"OBSTACLES: obstacle {number} '{about['name']}'"
        points, radius = _outlines(columns, rows, np.zeros(len(rows), int), [where])
        obstacles.append(Obstacle(points=points[0], radius=float(radius[0]), **about))
    return tuple(obstacles)


def _about(shape: Body | Obstacle) -> dict[str, Any]:
    return {"name": shape.name, "category": shape.category, "meets": json.dumps(shape.meets), "closed": shape.closed}


def _columns(rows: list[dict[str, Any]], integers: tuple[str, ...], words: tuple[str, ...]) -> dict[str, Any]:
    """Rows as typed columns, which an empty table has too."""
    columns: dict[str, Any] = {key: np.array([row[key] for row in rows], np.int64) for key in integers}
    columns |= {key: [row[key] for row in rows] for key in words}
    columns["closed"] = np.array([row["closed"] for row in rows], bool)
    return columns | {key: np.array([row[key] for row in rows], float) for key in ("radius", "x", "y")}


def _numbered(table: Any, name: str, key: str) -> list[np.ndarray]:
    """The rows of each body or obstacle, by its number."""
    number = numbers(table, key, int)
    found = np.unique(number)
    if not np.array_equal(found, np.arange(len(found))):
        odd = int(found[found != np.arange(len(found))][0])
        raise InstrumentError(f"{name}: {key} {odd} is there, but they are counted from 0 and none may be missing")
    order = np.argsort(number, kind="stable")
    return np.split(order, np.searchsorted(number[order], found)[1:]) if len(found) else []


def _read(table: Any, words: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Columns as arrays: rows of a FITS table are slow to take one by one."""
    columns = {key: np.array(texts(table, key), str) for key in words}
    columns |= {key: numbers(table, key) for key in ("radius", "x", "y")}
    return columns | {"vertex": numbers(table, "vertex", int), "closed": numbers(table, "closed", bool)}


def _said(columns: dict[str, np.ndarray], rows: np.ndarray, where: str, words: tuple[str, ...]) -> dict[str, Any]:
    """What all rows of one body or obstacle have to say alike."""
    said: dict[str, Any] = {}
    for key in (*words, "closed"):
        values = columns[key][rows].tolist()
        if len(set(values)) > 1:
            raise InstrumentError(f"{where}: its rows have more than one {key}")
        said[key] = values[0]
    meets = json.loads(said["meets"])
    return said | {"meets": None if meets is None else tuple(meets)}


def _outlines(
    columns: dict[str, np.ndarray], rows: np.ndarray, owner: np.ndarray, names: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (m, k, 2) and radii (m,) [mm] of one body's or obstacle's rows.

    Args:
        columns: of BODIES or OBSTACLES.
        rows: of them.
        owner: whose each row is, from 0 to m - 1, each of which has at least one.
        names: of the m owners, for errors.
    """
    vertex, radius = columns["vertex"][rows], columns["radius"][rows]
    order = np.lexsort((vertex, owner))
    rows, owner, vertex, radius = rows[order], owner[order], vertex[order], radius[order]
    _, first, count = np.unique(owner, return_index=True, return_counts=True)
    place = np.arange(len(rows)) - first[owner]
    for k in np.flatnonzero(vertex != place)[:1]:
        twice = place[k] and vertex[k] == vertex[k - 1]
        complaint = f"vertex {vertex[k]} is double" if twice else f"vertex {place[k]} is missing"
        raise InstrumentError(f"{names[owner[k]]}: {complaint}")
    for i in np.flatnonzero(count != count[0])[:1]:
        raise InstrumentError(f"{names[i]}: {count[i]} vertices, where the first positioner has {count[0]}")
    for k in np.flatnonzero(radius != radius[first[owner]])[:1]:
        raise InstrumentError(f"{names[owner[k]]}: its rows have more than one radius")
    points = np.stack([columns["x"][rows], columns["y"][rows]], axis=1)
    return points.reshape(len(names), -1, 2), radius[first]
