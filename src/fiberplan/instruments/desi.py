"""DESI's focal-plane files (``fp-*.ecsv``, with ``collision_settings.conf`` beside it): ten petals of 502 devices each.

Ids are the file's LOCATION (1000 petal + device), device ids (M05826) second names. Commanded angles are the file's own
POS_T and POS_P: theta about the base, counted from ``OFFSET_T`` (and by 36 deg from petal to petal), phi about the
elbow, where ``POS_P + OFFSET_P`` is counted from the stretched arm. Positions are those of the flat focal plane, which
are within a millimetre of the curved one's. Outlines are described at `fiberplan.instruments.desi_outlines`.
"""

import os
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.instruments.desi_mending import mended
from fiberplan.instruments.desi_outlines import Settings, find_settings, fixed_outlines, moving_outlines
from fiberplan.instruments.formats import focal_plane_format
from fiberplan.tables.contents import beginning, plain_name
from fiberplan.tables.ecsv import read_ecsv
from fiberplan.tables.input_table import InputTable

CRUISE = 59400 / (46 / 14 + 1) ** 4
"""Cruise speed of both axes [deg/s]: 18,000 steps a second of 3.3 deg of the motor, over its gear."""
STOPS = 3.0  #: what is kept from the hard stops [deg]
PHI_MOST = 185.0  #: phi at its upper hard stop, counted from POS_P = 0 [deg]
PARKED = 150.0  #: phi of the park state, from the stretched arm [deg]
_PETAL = np.pi / 5
_SHOWN = 12  # devices that a note lists
_SOURCES = (
    "positions, lengths, offsets and ranges: the focal-plane file of the instrument's team",
    "outlines of phi arm and theta body, petal edges and guide cameras: collision_settings.conf; the phi arm's is made "
    "longer by what LENGTH_R1, and LENGTH_R2 where it is more, exceed 3 mm by, as the focal-plane file's own outlines "
    "are; each is expanded as the file says, those of linear phi motors by 5 deg at least",
    f"speed {CRUISE:.2f} deg/s: cruise, 18,000 steps/s of 3.3 motor deg over the gear (46/14 + 1)^4, from the team's "
    "move tables",
    "ranges end 3 deg before the hard stops: settings of the instrument's team",
)
_ASSUMPTIONS = (
    "positions are those of the flat focal plane, up to 0.7 mm from the curved one's",
    "phi at its upper hard stop is 185 deg: the team's code, not in the focal-plane file",
    "units with linear phi motors are no faster than the others",
    "petals meet nothing of other petals: their edges are between them",
)


class Angles(NamedTuple):
    """Where devices stand."""

    ids: tuple[str, ...]  #: as the focal plane's
    angles: np.ndarray  #: (n, 2) commanded theta, phi [rad]; NaN where the file has none
    known: np.ndarray  #: (n,) whether the file has both


def focal_plane_file(path: Path) -> Path | None:
    """The focal-plane file that `path` is, or the last (by name) of those in the folder that it is; None if none."""
    if path.is_dir():
        return max(path.glob("fp-*.ecsv"), default=None)
    if plain_name(path).suffix.lower() != ".ecsv":
        return None
    head = beginning(path, 8192)
    return path if b"PETAL_LOC" in head and b"LENGTH_R1" in head else None


def _accepts(path: Path) -> bool:
    try:
        return focal_plane_file(path) is not None
    except OSError:
        return False


def _usable(path: Path) -> FocalPlane:
    return read_desi(path, "drop")


@focal_plane_format("desi", "a fp-*.ecsv of DESI, or its folder", _accepts, _usable)
def read_desi(path: str | os.PathLike, conflicts: Literal["raise", "drop"] = "raise") -> FocalPlane:
    """All petals that a focal-plane file has; `petal` is one of them.

    A device that is classified as nonfunctional is offline and folded where the file says it stands. With "drop", so is
    one of whose cells one cannot be used (`fiberplan.instruments.desi_mending`); each is named.

    Raises:
        InstrumentError: no such file, no collision settings beside it, or a value that cannot be used (file, line,
            column and value are named).
    """
    file, table = _devices(Path(path))
    table, mendings = mended(table, 2.0 * STOPS) if conflicts == "drop" else (table, ())
    _check_locations(table)
    settings = find_settings(file.parent)
    locations = table.texts("LOCATION")
    petals = table.numbers("PETAL_LOC").astype(int)
    turn = _PETAL * (petals - 3.0)
    flat = np.stack([table.numbers(f"OFFSET_{axis}", "mm") for axis in "XY"], axis=1)
    c, s = np.cos(turn), np.sin(turn)
    base = np.stack([c * flat[:, 0] - s * flat[:, 1], s * flat[:, 0] + c * flat[:, 1]], axis=1)
    first, second = (table.numbers(f"LENGTH_R{k}", "mm") for k in (1, 2))
    offset = np.stack([table.numbers(f"OFFSET_{axis}", "rad", "deg") for axis in "TP"], axis=1)
    lower, upper = _ranges(table, offset[:, 1], settings)
    online = ~_flags(table, "DEVICE_CLASSIFIED_NONFUNCTIONAL")
    folded = np.clip(np.stack([0.0 * turn, np.radians(PARKED) - offset[:, 1]], axis=1), lower, upper)
    angles = _angles(table)
    stands = ~online & np.isfinite(angles).all(axis=1)
    folded[stands] = angles[stands]
    lower[stands], upper[stands] = np.fmin(lower, angles)[stands], np.fmax(upper, angles)[stands]
    notes = _notes(table, locations, online, stands)
    return FocalPlane(
        ids=locations,
        base=base,
        length=first,
        fiber_offsets={"fiber": np.stack([second, np.zeros(len(second))], axis=1)},
        folded=folded,
        lower=lower,
        upper=upper,
        max_speed=np.full((len(base), 2), np.radians(CRUISE)),
        bodies=moving_outlines(settings, table, first, second),
        obstacles=fixed_outlines(settings, sorted(set(petals.tolist()))),
        zero=offset + np.stack([turn, np.zeros(len(turn))], axis=1),
        online=online,
        name=f"desi-{plain_name(file).stem}",
        notes=(*_SOURCES, *notes, *mendings),
        aliases=table.texts("DEVICE_ID") if "DEVICE_ID" in table else (),
        assumptions=(*_ASSUMPTIONS, *mendings),
    )


def angles_of(path: str | os.PathLike) -> Angles:
    """Where the devices of a focal-plane file stood when it was written.

    Raises:
        InstrumentError: as `read_desi`.
    """
    _, table = _devices(Path(path))
    _check_locations(table)
    angles = _angles(table)
    return Angles(table.texts("LOCATION"), angles, np.isfinite(angles).all(axis=1))


def petal(plane: FocalPlane, number: int) -> FocalPlane:
    """One petal (0 to 9) of a focal plane of DESI, with its own edge and guide camera.

    Raises:
        InstrumentError: the focal plane has no device of that petal.
    """
    mine = np.array([int(id_) // 1000 == number for id_ in plane.ids])
    if not mine.any():
        raise InstrumentError(f"{plane.name}: no device of petal {number}")
    names = {f"{what} of petal {number}" for what in ("edge", "guide camera")}
    fixed = [k for k, obstacle in enumerate(plane.obstacles) if obstacle.name in names]
    return plane.subset(np.flatnonzero(mine), np.array(fixed, np.int64)).replace(name=f"{plane.name} petal {number}")


def _devices(path: Path) -> tuple[Path, InputTable]:
    """The file, and its rows of what moves: positioners and sky monitors."""
    file = focal_plane_file(path)
    if file is None:
        raise InstrumentError(f"{path}: is no fp-*.ecsv of DESI, nor a folder that has one")
    whole = read_ecsv(file, InstrumentError)
    whole.require("LOCATION", "PETAL_LOC", "LENGTH_R1", "LENGTH_R2", "OFFSET_T", "OFFSET_P", "OFFSET_X", "OFFSET_Y")
    whole.require("PHYSICAL_RANGE_T", "PHYSICAL_RANGE_P", "DEVICE_CLASSIFIED_NONFUNCTIONAL")
    moving = [row for row, cell in enumerate(whole.columns["LENGTH_R1"]) if cell]
    if not moving:
        raise InstrumentError(f"{file}: no device has a LENGTH_R1")
    columns = {name: [cells[row] for row in moving] for name, cells in whole.columns.items()}
    table = InputTable(whole.source, columns, whole.units, tuple(whole.rows[row] for row in moving), InstrumentError)
    return file, table


def _check_locations(table: InputTable) -> None:
    """Refuse a device that is not of the petal that it is said to be of."""
    petals = table.numbers("PETAL_LOC").tolist()
    for row, cell in enumerate(table.texts("LOCATION")):
        if not cell.isdigit() or int(cell) // 1000 != petals[row]:
            raise table.fail(row, f"LOCATION is '{cell}', expected 1000 times PETAL_LOC and DEVICE_LOC")


def _ranges(table: InputTable, phi_zero: np.ndarray, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """Commanded ranges (n, 2) [rad]; a retracted device's phi stays where the team's envelope holds it."""
    theta, phi = (table.numbers(f"PHYSICAL_RANGE_{axis}", "rad", "deg") for axis in "TP")
    lower = np.stack([-theta / 2, np.radians(PHI_MOST) - phi], axis=1) + np.radians(STOPS)
    upper = np.stack([theta / 2, np.full(len(phi), np.radians(PHI_MOST))], axis=1) - np.radians(STOPS)
    if "CLASSIFIED_AS_RETRACTED" in table:
        retracted = _flags(table, "CLASSIFIED_AS_RETRACTED")
        least = np.radians(settings.number("PHI_EO")) - phi_zero if retracted.any() else lower[:, 1]
        lower[retracted, 1] = np.minimum(np.maximum(lower[:, 1], least), upper[:, 1])[retracted]
    for row in np.flatnonzero(~(lower < upper).all(axis=1)):
        raise table.fail(int(row), "PHYSICAL_RANGE_T or PHYSICAL_RANGE_P leaves no room 3 deg from the hard stops")
    return lower, upper


def _flags(table: InputTable, name: str) -> np.ndarray:
    """True or false (n,); what is left out counts as true: not to be used."""
    return np.array(table.flags(name, blank=True))


def _angles(table: InputTable) -> np.ndarray:
    """POS_T, POS_P (n, 2) [rad]; NaN where the file has none."""
    columns = [
        table.numbers(name, "rad", "deg", blank=np.nan) if name in table else np.full(len(table), np.nan)
        for name in ("POS_T", "POS_P")
    ]
    return np.stack(columns, axis=1)


def _notes(table: InputTable, locations: tuple[str, ...], online: np.ndarray, stands: np.ndarray) -> list[str]:
    """Who cannot move or has no fiber, and who is held back."""
    notes = []
    broken = ~_flags(table, "FIBER_INTACT") if "FIBER_INTACT" in table else np.zeros(len(online), bool)
    held = _flags(table, "CLASSIFIED_AS_RETRACTED") if "CLASSIFIED_AS_RETRACTED" in table else np.zeros_like(broken)
    for which, text in (
        (~online & stands, "are classified as nonfunctional: offline, where the file says they stand"),
        (~online & ~stands, "are classified as nonfunctional and the file has no angles: offline, taken as folded"),
        (held & online, "are classified as retracted: their phi stays within the envelope of PHI_EO"),
        (broken, "have no intact fiber"),
    ):
        who = [locations[i] for i in np.flatnonzero(which)]
        if who:
            more = f" and {len(who) - _SHOWN} more" if len(who) > _SHOWN else ""
            notes.append(f"{len(who)} devices {text}: {', '.join(who[:_SHOWN])}{more}")
    return notes
