"""PFS: 2394 cobras, from the instrument's own files.

- ``grandfibermap.txt`` (or its folder): where cobras stand, nominally; ids are cobra numbers, from 1;
- ``fiducials.txt`` and ``black_dots*.csv`` beside it: discs that stand fixed, and spots where no fiber may end;
- ``*.xml`` (``ARM_DATA_CONTAINER``): the geometry of each cobra as it was measured, in mm.

Commanded angles are the motors': theta from its counter-clockwise hard stop, phi from its own, where the arm is folded.
Where a file gives no links, ranges, sizes or speeds they are nominal and assumptions; see `nominal`.
"""

import os
import tomllib
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.instruments.formats import focal_plane_format
from fiberplan.tables.contents import beginning, plain_name, read_whole
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_table, read_text

MAP, FIDUCIALS, DOTS = "grandfibermap.txt", "fiducials.txt", "black_dots*.csv"
_LINKS = ("Link1_Link_Length", "Link2_Link_Length")
_RANGES = ("CCW_Global_base_ori_z", "CW_Global_base_ori_z", "Joint2_CCW_limit_angle", "Joint2_CW_limit_angle")
_BASE = ("Global_base_pos_x", "Global_base_pos_y")
_LENGTHS = (1.0, 5.0)  # links of cobras are nominally 2.375 mm; files of the laboratory are in pixels of a camera
_STATUS = {2: "invisible", 4: "its theta is broken", 8: "its phi is broken"}


@cache
def nominal() -> dict[str, Any]:
    """What the files leave out, with sources and assumptions."""
    return tomllib.loads((Path(__file__).parent / "pfs_constants.toml").read_text(encoding="utf-8"))


def _map_of(path: Path) -> Path | None:
    if path.is_dir():
        return path / MAP if (path / MAP).is_file() else None
    return path if plain_name(path).name.lower() == MAP else None


@focal_plane_format("pfs", f"a {MAP} of PFS, or its folder", lambda path: _map_of(path) is not None)
def read_pfs(path: str | os.PathLike) -> FocalPlane:
    """Nominal cobras where the fiber map has them, with the fiducials and black dots of the same folder.

    Raises:
        InstrumentError: no such file, or a value that cannot be used (file, line and value are named).
    """
    file = _map_of(Path(path)) or Path(path)
    cobras = _columns(file, "cob", ("x", "y"))
    numbers = cobras.texts("cob")
    order = np.argsort([int(k) for k in numbers], kind="stable")
    for a, b in pairwise(order):
        if numbers[a] == numbers[b]:
            raise cobras.fail(int(b), f"cobra {numbers[b]} was already given in {cobras.rows[a]}")
    base = np.stack([cobras.numbers(axis, "mm") for axis in "xy"], axis=1)[order]
    n = len(base)
    theta, phi = nominal()["theta"], nominal()["phi"]
    fixed, notes = _fiducials(file.parent)
    dots, more = _black_dots(file.parent)
    return FocalPlane(
        ids=tuple(numbers[k] for k in order),
        base=base,
        length=np.full(n, nominal()["link"]),
        fiber_offsets={"fiber": np.array([nominal()["link"], 0.0])},
        folded=np.zeros((n, 2)),
        lower=np.zeros((n, 2)),
        upper=np.tile(np.radians([theta, phi]), (n, 1)),
        max_speed=np.tile(np.radians(nominal()["speed"]), (n, 1)),
        bodies=_bodies(np.full(n, nominal()["link"])),
        obstacles=fixed,
        zero=np.tile([0.0, -np.pi], (n, 1)),
        name="pfs",
        notes=(f"from {file.name}: nominal centres of {n} cobras", *nominal()["sources"], *notes, *more),
        assumptions=(*nominal()["assumptions"], *nominal()["assumed"], *notes, *more),
        forbidden=dots,
    )


def _is_geometry(path: Path) -> bool:
    try:
        return plain_name(path).suffix.lower() == ".xml" and b"ARM_DATA" in beginning(path, 4096)
    except OSError:
        return False


@focal_plane_format("pfs-xml", "an .xml of PFS with ARM_DATA_CONTAINER", _is_geometry)
def read_pfs_geometry(path: str | os.PathLike) -> FocalPlane:
    """Cobras as they were measured: places, links, hard stops; the broken ones are offline.

    Ids count the containers of the file from 1, which in a file of the whole instrument are cobra numbers; that has the
    fiducials and black dots of its folder too.

    Raises:
        InstrumentError: no such file, not such XML, lengths that are not in mm, or a value that cannot be used; the
            cobra is named.
    """
    path = Path(path)
    try:
        root = ElementTree.fromstring(read_whole(path, InstrumentError))
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InstrumentError(f"{path}: is not an XML file ({error})") from None
    arms = list(root.iter("ARM_DATA_CONTAINER"))
    if not arms:
        raise InstrumentError(f"{path}: no ARM_DATA_CONTAINER")
    rows = [{element.tag: (element.text or "").strip() for element in arm.iter()} for arm in arms]
    columns = {name: [row.get(name, "") for row in rows] for name in (*_BASE, *_LINKS, *_RANGES, "Status")}
    table = InputTable(str(path), columns, {}, tuple(f"cobra {k + 1}" for k in range(len(rows))), InstrumentError)
    first, second = (table.numbers(name) for name in _LINKS)
    status = table.numbers("Status", blank=1.0).astype(int)
    works = (status & (4 | 8)) == 0
    typical = float(np.median(first[works])) if works.any() else float(np.median(first))
    if not _LENGTHS[0] <= typical <= _LENGTHS[1]:
        raise InstrumentError(
            f"{path}: the median {_LINKS[0]} is {typical:.6g}, but links of cobras are 2.375 mm: lengths are not in mm "
            "(files of the laboratory are in pixels of its camera)"
        )
    begin, end, phi_low, phi_high = (table.numbers(name, "rad", "deg") for name in _RANGES)
    turn = (end - begin) % (2 * np.pi)
    turn = np.where(turn < np.pi, turn + 2 * np.pi, turn)  # theta turns by a little more than once, stop to stop
    notes = []
    for k in np.flatnonzero(status > 1):
        said = [text for bit, text in _STATUS.items() if status[k] & bit]
        notes.append(f"cobra {k + 1}: {', '.join(said) or f'status {status[k]}'}{'' if works[k] else ', so offline'}")
    n = len(rows)
    fixed, dots, lacks = _beside(path.parent, n)
    phi = np.maximum(phi_high - phi_low, 0.0)
    for k in np.flatnonzero((phi_high < phi_low) & works):
        raise table.fail(int(k), f"{_RANGES[3]} is below {_RANGES[2]}")
    return FocalPlane(
        ids=tuple(str(k + 1) for k in range(n)),
        base=np.stack([table.numbers(name, "mm") for name in _BASE], axis=1),
        length=first,
        fiber_offsets={"fiber": np.stack([second, np.zeros(n)], axis=1)},
        folded=np.zeros((n, 2)),
        lower=np.zeros((n, 2)),
        upper=np.stack([turn, phi], axis=1),
        max_speed=np.tile(np.radians(nominal()["speed"]), (n, 1)),
        bodies=_bodies(second),
        zero=np.stack([begin, phi_low - np.pi], axis=1),
        online=works,
        name=f"pfs-{plain_name(path).stem}",
        notes=(f"from {path.name}: places, links and hard stops of {n} cobras", *nominal()["sources"], *notes),
        obstacles=fixed,
        forbidden=dots,
        assumptions=(*nominal()["assumptions"], *lacks),
    )


def _beside(folder: Path, count: int) -> tuple[tuple[Obstacle, ...], np.ndarray, tuple[str, ...]]:
    """Fiducials and black dots beside a file of `count` cobras, if it is of the whole instrument; and what lacks."""
    if count != nominal()["cobras"]:
        return (), np.empty((0, 3)), (f"no fiducials and no black dots: a file of {count} cobras is a part of PFS",)
    (fixed, notes), (dots, more) = _fiducials(folder), _black_dots(folder)
    return fixed, dots, (*notes, *more)


def _bodies(link: np.ndarray) -> tuple[Body, ...]:
    """A capsule from elbow to fiber, for each cobra's second link (n,) [mm]."""
    ends = np.zeros((len(link), 2, 2))
    ends[:, 1, 0] = link
    return (Body(ends[0] if np.all(link == link[0]) else ends, nominal()["radius"]),)


def _columns(file: Path, number: str, names: tuple[str, ...]) -> InputTable:
    r"""Rows of a PFS text table that begin with a number; headings (``\cob``, ``fid``) may be repeated among them."""
    heading: list[str] = []
    cells: list[list[str]] = []
    rows: list[str] = []
    for k, line in enumerate(read_text(file, InstrumentError), 1):
        words = line.split()
        if words and words[0].lstrip("\\") == number:
            heading = [words[0].lstrip("\\"), *words[1:]]
        elif words and words[0].isdigit():
            if not heading:
                raise InstrumentError(f"{file}: line {k}: no heading '{number} ...' above it")
            if len(words) != len(heading):
                raise InstrumentError(f"{file}: line {k}: {len(words)} values for {len(heading)} columns")
            cells.append(words)
            rows.append(f"line {k}")
    if not cells:
        raise InstrumentError(f"{file}: no rows of numbers under a heading '{number} ...'")
    columns = {name: [row[j] for row in cells] for j, name in enumerate(heading)}
    table = InputTable(str(file), columns, {}, tuple(rows), InstrumentError)
    table.require(number, *names)
    return table


def _fiducials(folder: Path) -> tuple[tuple[Obstacle, ...], tuple[str, ...]]:
    """A disc for each fiducial of the folder; and what to say if there is none."""
    if not (folder / FIDUCIALS).exists():
        return (), (f"no fiducials: the folder has no {FIDUCIALS}",)
    table = _columns(folder / FIDUCIALS, "fid", ("x", "y"))
    places = np.stack([table.numbers(axis, "mm") for axis in "xy"], axis=1)
    radius = nominal()["fiducial_radius"]
    return tuple(
        Obstacle(f"fiducial {k}", place[None], radius) for k, place in zip(table.texts("fid"), places, strict=True)
    ), ()


def _black_dots(folder: Path) -> tuple[np.ndarray, tuple[str, ...]]:
    """Discs (m, 3) x, y, radius [mm] of the last such file by name; and what to say if there is none."""
    file = max(folder.glob(DOTS), default=None)
    if file is None:
        return np.empty((0, 3)), (f"no black dots: the folder has no {DOTS}",)
    table = read_table(file, InstrumentError)
    table.require("x", "y", "r")
    return np.stack([table.numbers(name, "mm") for name in "xyr"], axis=1), ()
