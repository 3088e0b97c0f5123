"""A focal plane as FITS tables, exact to the last bit; the same tables describe it in plan files.

POSITIONERS has a row per positioner, BODIES and OBSTACLES a row per vertex (in BODIES, positioner -1 stands for all),
and FOCALPLANE one row with what is said once. Columns carry their units; lists of names are JSON.
"""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from astropy.io import fits

from fiberplan.errors import FiberplanError, InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.kinds import kinematics_of, stored
from fiberplan.instruments.formats import focal_plane_format
from fiberplan.io.body_tables import bodies_from_rows, body_rows, obstacle_rows, obstacles_from_rows
from fiberplan.io.sealed_tables import FOCAL_PLANE, MISFITS, PLAN, seal, unseal
from fiberplan.tables.atomic import write_whole
from fiberplan.tables.contents import read_whole
from fiberplan.tables.fits_tables import numbers, pick, table_hdu, texts
from fiberplan.tables.wording import one_line

_JOINTS = {"folded": "rad", "lower": "rad", "upper": "rad", "max_speed": "rad/s", "zero": "rad"}
_LIMITS = {"max_acceleration": "rad/s2", "min_speed": "rad/s"}  # columns that are there where a joint has such a limit
_UNITS = {"x": "mm", "y": "mm", "radius": "mm"}


def write_focal_plane(plane: FocalPlane, path: str | os.PathLike) -> None:
    """Write a focal plane; `read_focal_plane` gives it back exactly.

    Raises:
        InstrumentError: the file cannot be written; what was there before is kept.
    """
    write_whole(path, seal(FOCAL_PLANE, plane_hdus(plane)), InstrumentError)


@focal_plane_format(
    "fits", "a .fits file of a focal plane or a plan", lambda path: path.name.lower().endswith((".fits", ".fits.gz"))
)
def read_focal_plane(path: str | os.PathLike) -> FocalPlane:
    """Read a focal plane from its own file, or from a plan; files of before they had a digest are read too.

    Raises:
        InstrumentError: no such file, not these tables, truncated, damaged or of a newer format.
    """
    path = Path(path)
    tables = unseal(read_whole(path, InstrumentError), path, [PLAN, FOCAL_PLANE], InstrumentError, bare=True)
    try:
        return plane_from_tables(tables)
    except FiberplanError as error:
        raise InstrumentError(f"{path}: {error}") from None


def plane_hdus(plane: FocalPlane) -> list[fits.BinTableHDU]:
    """The tables FOCALPLANE, POSITIONERS, BODIES and OBSTACLES, and FORBIDDEN where there are such places."""
    about: dict[str, Any] = {"name": [plane.name], "pair_margin": np.array([plane.pair_margin])}
    about |= {"fibers": [json.dumps(list(plane.fiber_offsets))], "notes": [json.dumps(plane.notes)]}
    rows: dict[str, Any] = {"positioner": plane.ids, "online": plane.online}
    rows |= {"base_x": plane.base[:, 0], "base_y": plane.base[:, 1], "length": plane.length}
    units = dict.fromkeys(("base_x", "base_y", "length"), "mm")
    about["field_radius"] = np.array([plane.field_radius])
    about["assumptions"] = [json.dumps(plane.assumptions)]
    about["margin"] = np.array([np.nan if plane.recommended_margin is None else plane.recommended_margin])
    if plane.site:
        about["site"] = [plane.site]
    if plane.aliases:
        rows["alias"] = plane.aliases
    for name, (values, unit) in stored(plane.kinematics).items():
        rows[name], units[name] = values, unit
    for name, unit in (_JOINTS | _LIMITS).items():
        if getattr(plane, name) is None:
            continue
        for k, joint in enumerate(("alpha", "beta")):
            rows[f"{name}_{joint}"], units[f"{name}_{joint}"] = getattr(plane, name)[:, k], unit
    for k, offset in enumerate(plane.fiber_offsets.values()):
        for axis, values in zip("xy", offset.T, strict=True):
            rows[f"fiber{k}_{axis}"], units[f"fiber{k}_{axis}"] = values, "mm"
    forbidden = dict(zip(("x", "y", "radius"), plane.forbidden.T, strict=True))
    return [
        table_hdu("FOCALPLANE", about, {"pair_margin": "mm", "field_radius": "mm", "margin": "mm"}),
        table_hdu("POSITIONERS", rows, units),
        table_hdu("BODIES", body_rows(plane.bodies, plane.n), _UNITS),
        table_hdu("OBSTACLES", obstacle_rows(plane.obstacles), _UNITS),
        *([table_hdu("FORBIDDEN", forbidden, _UNITS)] if len(plane.forbidden) else []),
    ]


def plane_from_tables(tables: Mapping[str, Any]) -> FocalPlane:
    """The focal plane in these tables, by name.

    Raises:
        InstrumentError: a table or column is missing, or the values make no focal plane.
    """
    about, rows = pick(tables, "FOCALPLANE", InstrumentError), pick(tables, "POSITIONERS", InstrumentError)
    try:
        joints: dict[str, Any] = {
            name: np.stack([numbers(rows, f"{name}_{joint}") for joint in ("alpha", "beta")], axis=1)
            for name in (*_JOINTS, *(name for name in _LIMITS if f"{name}_alpha" in rows.columns.names))
        }
        fibers = {
            name: np.stack([numbers(rows, f"fiber{k}_{axis}") for axis in "xy"], axis=1)
            for k, name in enumerate(json.loads(texts(about, "fibers")[0]))
        }
        return FocalPlane(
            ids=tuple(texts(rows, "positioner")),
            base=np.stack([numbers(rows, "base_x"), numbers(rows, "base_y")], axis=1),
            length=numbers(rows, "length"),
            fiber_offsets=fibers,
            bodies=bodies_from_rows(pick(tables, "BODIES", InstrumentError), tuple(texts(rows, "positioner"))),
            obstacles=obstacles_from_rows(pick(tables, "OBSTACLES", InstrumentError)),
            online=numbers(rows, "online", bool),
            name=texts(about, "name")[0],
            pair_margin=float(numbers(about, "pair_margin")[0]),
            notes=tuple(json.loads(texts(about, "notes")[0])),
            kinematics=kinematics_of({name: numbers(rows, name) for name in rows.columns.names if "four_bar" in name}),
            field_radius=_field_radius(about),
            aliases=tuple(texts(rows, "alias")) if "alias" in rows.columns.names else (),
            forbidden=_forbidden(tables.get("FORBIDDEN")),
            site=texts(about, "site")[0] if "site" in about.columns.names else "",
            **_stated(about),
            **joints,
        )
    except MISFITS as error:
        raise InstrumentError(f"the tables of the focal plane cannot be used ({one_line(error)})") from None


def _stated(about: Any) -> dict[str, Any]:
    """Assumptions and recommended margin; tables of earlier versions have none."""
    if "assumptions" not in about.columns.names:
        return {}
    margin = float(numbers(about, "margin")[0])
    return {
        "assumptions": tuple(json.loads(texts(about, "assumptions")[0])),
        "recommended_margin": None if np.isnan(margin) else margin,
    }


def _forbidden(table: Any) -> np.ndarray:
    """Forbidden places (m, 3) [mm]; focal planes without such have no table."""
    if table is None:
        return np.empty((0, 3))
    return np.stack([numbers(table, name) for name in ("x", "y", "radius")], axis=1)


def _field_radius(about: Any) -> float:
    """Radius of the field [mm]; tables of format 1 have none."""
    return float(numbers(about, "field_radius")[0]) if "field_radius" in about.columns.names else float(np.inf)
