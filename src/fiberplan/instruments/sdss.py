"""The calibration folders of the SDSS-V focal plane system, as its own team publishes them.

Each hole has its own frame: x along iHat = (0, -1) and y along jHat = (1, 0). Its rotation goes into the alpha zero,
and (dx, dy), which are given in that frame, move the base. Source: fps_calibrations; the convention was checked against
an observed configuration (median residual 0.04 mm). What the folder leaves out is in ``calibration_constants.toml``.
"""

import os
import tomllib
from pathlib import Path
from typing import Literal

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.instruments.formats import focal_plane_format
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_table
from fiberplan.tables.wording import nearest

HOLE_MAP = "wokCoords.csv"
_CONSTANTS = Path(__file__).parent / "calibration_constants.toml"
_FIBERS = {"metrology": "met", "apogee": "ap", "boss": "boss"}  # name -> prefix of its columns


def _usable(folder: Path) -> FocalPlane:
    return read_calibration(folder, "drop")


@focal_plane_format(
    "sdss", f"a folder of SDSS-V calibrations (with {HOLE_MAP})", lambda path: (path / HOLE_MAP).is_file(), _usable
)
def read_calibration(folder: str | os.PathLike, conflicts: Literal["raise", "drop"] = "raise") -> FocalPlane:
    """The calibrated focal plane; positioner ids are hole ids, row by row of the grid.

    With "drop", a robot of which a number cannot be used is offline, with the median of the column in place of it.

    Raises:
        InstrumentError: a file, column or value that is missing or cannot be used; one line that names it.
    """
    folder = Path(folder)
    constants = tomllib.loads(_CONSTANTS.read_text(encoding="utf-8"))
    holes = read_table(folder / HOLE_MAP, InstrumentError)
    robots = read_table(folder / "positionerTable.csv", InstrumentError)
    hole, robot = _match(holes, robots)
    n = len(hole)

    x_axis, y_axis = _vectors(holes, "ix", "iy")[hole], _vectors(holes, "jx", "jy")[hole]
    _check_frames(holes, hole, x_axis, y_axis)
    faults: dict[int, str] | None = {} if conflicts == "drop" else None

    def vectors(x: str, y: str, unit: str, default: str | None = None) -> np.ndarray:
        return _usual_where_missing(_vectors(robots, x, y, unit, default, faults))[robot]

    local, offsets = vectors("dx", "dy", "mm"), vectors("alphaOffset", "betaOffset", "rad", "deg")
    length = _usual_where_missing(_column(robots, "alphaArmLen", "mm", faults=faults))[robot]
    fibers = {name: vectors(f"{k}X", f"{k}Y", "mm") for name, k in _FIBERS.items()}
    mendings = [
        f"positioner {robots.texts('holeID')[row]} is offline: {robots.rows[row]}: {text}, taken as the median of all"
        for row, text in sorted((faults or {}).items())
    ]
    kinds = np.array(holes.texts("holeType"))[hole]
    fibers["apogee"] = np.where((kinds == "ApogeeBoss")[:, None], fibers["apogee"], np.nan)  # the table has it for all
    radius, farthest = constants["arm_radius"], np.nanmax([np.hypot(*xy.T) for xy in fibers.values()])
    arm = np.array([[0.0, 0.0], [max(constants["arm_length"], farthest - radius), 0.0]])
    empty = sorted(set(_fillable(holes)) - set(robots.texts("holeID")))
    fiducials, cameras = _fiducials(folder, constants), _guide_cameras(folder, constants)
    absent = [note for found, note in (fiducials, cameras) if not found]

    def both(name: str) -> np.ndarray:
        return np.tile(np.radians(constants[name]), (n, 1))

    return FocalPlane(
        ids=tuple(holes.texts("holeID")[k] for k in hole),
        base=_vectors(holes, "xWok", "yWok", "mm")[hole] + local[:, :1] * x_axis + local[:, 1:] * y_axis,
        length=length,
        fiber_offsets=fibers,
        folded=both("folded"),
        lower=both("lower"),
        upper=both("upper"),
        max_speed=both("speed"),
        bodies=(Body(arm, radius),),
        obstacles=(*fiducials[0], *cameras[0]),
        zero=offsets + np.stack([np.arctan2(x_axis[:, 1], x_axis[:, 0]), np.zeros(n)], axis=1),
        online=~np.isin(robot, list(faults or ())),
        name=folder.resolve().name,
        notes=(*constants["sources"], *absent, *mendings, *(f"hole {id_} has no positioner" for id_ in empty)),
        aliases=tuple(robots.texts("positionerID")[k] for k in robot) if "positionerID" in robots else (),
        assumptions=(*constants["assumptions"], *absent, *mendings),
        recommended_margin=constants["margin"],
        site=_site(holes, robots),
    )


def _site(holes: InputTable, robots: InputTable) -> str:
    """The observatory that both tables are of, where they say it."""
    site = ""
    for table in (holes, robots):
        for row, name in enumerate(table.texts("site", blank="") if "site" in table else ()):
            if name and site and name != site:
                raise table.fail(row, f"site is {name}, and {site} before")
            site = name or site
    return site


def _column(
    table: InputTable,
    name: str,
    unit: str | None = None,
    default: str | None = None,
    faults: dict[int, str] | None = None,
) -> np.ndarray:
    table.require(name)
    return table.numbers(name, unit, default, faults=faults)


def _vectors(
    table: InputTable,
    x: str,
    y: str,
    unit: str | None = None,
    default: str | None = None,
    faults: dict[int, str] | None = None,
) -> np.ndarray:
    """Two columns as (m, 2)."""
    return np.stack([_column(table, name, unit, default, faults) for name in (x, y)], axis=1)


def _usual_where_missing(values: np.ndarray) -> np.ndarray:
    """The same with the median of its column in place of each NaN, where there is one."""
    usual = np.zeros(values.shape[1:]) if np.isnan(values).all() else np.nanmedian(values, axis=0)
    return np.where(np.isnan(values), usual, values)


def _unique(table: InputTable) -> dict[str, int]:
    """Hole id -> row."""
    table.require("holeID")
    rows: dict[str, int] = {}
    for row, id_ in enumerate(table.texts("holeID")):
        if (first := rows.setdefault(id_, row)) != row:
            raise table.fail(row, f"hole '{id_}' was already given in {table.rows[first]}")
    return rows


def _match(holes: InputTable, robots: InputTable) -> tuple[np.ndarray, np.ndarray]:
    """Rows of both tables that belong together, row by row of the grid as in the built-in array."""
    where, who = _unique(holes), _unique(robots)
    for id_, row in who.items():
        if id_ not in where:
            raise robots.fail(row, f"{HOLE_MAP} has no hole '{id_}'{nearest(id_, where)}")
    both = np.array([(where[id_], who[id_]) for id_ in where if id_ in who], np.int64).reshape(-1, 2)
    holes.require("hexRow", "hexCol")
    order = [holes.numbers(name, blank=np.nan)[both[:, 0]] for name in ("hexCol", "hexRow")]
    hole, robot = both[np.lexsort(order)].T
    return hole, robot


def _fillable(holes: InputTable) -> list[str]:
    """Holes made for positioners."""
    holes.require("holeType")
    kinds = holes.texts("holeType")
    return [id_ for id_, kind in zip(holes.texts("holeID"), kinds, strict=True) if kind != "Fiducial"]


def _check_frames(holes: InputTable, hole: np.ndarray, x_axis: np.ndarray, y_axis: np.ndarray) -> None:
    """Refuse frames that are mirrored or not of unit length: a rotation could not stand for them."""
    turned = np.stack([-x_axis[:, 1], x_axis[:, 0]], axis=1)
    bad = (np.abs(np.hypot(*x_axis.T) - 1) > 1e-3) | (np.abs(turned - y_axis).max(axis=1) > 1e-3)
    if bad.any():
        k = int(np.argmax(bad))
        axes = f"i = ({x_axis[k, 0]:g}, {x_axis[k, 1]:g}), j = ({y_axis[k, 0]:g}, {y_axis[k, 1]:g})"
        raise holes.fail(int(hole[k]), f"{axes} are not the axes of a rotated frame")


def _fiducials(folder: Path, constants: dict) -> tuple[list[Obstacle], str]:
    """A disc for each fiducial, where it was measured; and what to say if there is none."""
    table, why = _optional(folder / "fiducialCoords.csv", "holeID")
    if table is None:
        return [], f"no fiducials: {why}"
    centres = _vectors(table, "xWok", "yWok", "mm")
    radius = constants["fiducial_radius"]
    return [Obstacle(f"fiducial {id_}", centres[[row]], radius) for id_, row in _unique(table).items()], ""


def _guide_cameras(folder: Path, constants: dict) -> tuple[list[Obstacle], str]:
    """A line for each guide camera, across the radius; and what to say if there is none.

    Their team keeps arms from lines at multiples of 60 deg from +y, whatever was measured of the cameras: each camera
    of the folder has the line that is nearest to it.
    """
    table, why = _optional(folder / "gfaCoords.csv", "id")
    if table is None:
        return [], f"no guide cameras: {why}"
    table.require("id")
    centres = _vectors(table, "xWok", "yWok", "mm")
    step = np.pi / 3
    turns = step * np.round((np.arctan2(centres[:, 1], centres[:, 0]) - np.pi / 2) / step)
    half, away = constants["guide_camera_length"] / 2, constants["guide_camera_distance"]
    line = np.array([[-half, away], [half, away]])
    c, s = np.cos(turns), np.sin(turns)
    ends = np.stack([line @ np.array([[ck, sk], [-sk, ck]]) for ck, sk in zip(c, s, strict=True)])
    cameras = zip(table.texts("id"), ends, strict=True)
    return [Obstacle(f"guide camera {id_}", points, constants["guide_camera_radius"]) for id_, points in cameras], ""


def _optional(path: Path, key: str) -> tuple[InputTable | None, str]:
    """A table of places that a folder may lack or leave empty, or None and why; what is no such table is refused."""
    if not path.exists():
        return None, f"the folder has no {path.name}"
    table = read_table(path, InstrumentError, allow_empty=True)
    table.require(key, "xWok", "yWok")
    return (table, "") if len(table) else (None, f"{path.name} has no rows")
