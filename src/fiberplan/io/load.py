"""A focal plane by name, or from a file or folder of any format that is registered."""

import os
from pathlib import Path
from typing import Literal

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.outliers import one_place_only, unusual
from fiberplan.instruments import named, names
from fiberplan.instruments.formats import focal_plane_formats
from fiberplan.tables.formats import format_of


def load_focal_plane(name_or_path: str | os.PathLike, conflicts: Literal["raise", "drop"] = "raise") -> FocalPlane:
    """A named instrument, or one from a file or folder; robots that are far from their kind are noted.

    Args:
        name_or_path: of the instrument.
        conflicts: with "drop", a robot with a cell that cannot be used is offline, and named, where its format can say
            so (DESI's).

    Raises:
        InstrumentError: no such instrument or file, or one that cannot be used; one line that names it.
    """
    path = Path(name_or_path)
    if not str(name_or_path).strip():
        raise InstrumentError(f"no instrument is called '{name_or_path}': a name or a path is wanted")
    try:
        return _noted(named(str(name_or_path)) if name_or_path in names() else _from_path(path, conflicts))
    except OSError as error:  # a name that no file can have, a folder that may not be looked into
        raise InstrumentError(f"{path}: cannot be read ({(error.strerror or str(error)).lower()})") from None


def _noted(plane: FocalPlane) -> FocalPlane:
    """The same with notes on robots that are far from their kind, less those that it has already."""
    doubtful = one_place_only(plane)
    notes = dict.fromkeys((*plane.notes, *unusual(plane)))
    assumptions = dict.fromkeys((*plane.assumptions, *doubtful))
    if len(notes) == len(plane.notes) and len(assumptions) == len(plane.assumptions):
        return plane
    return plane.replace(notes=tuple(notes), assumptions=tuple(assumptions))


def _from_path(path: Path, conflicts: str) -> FocalPlane:
    formats = focal_plane_formats()
    known = format_of(formats, path)
    if known is not None:
        return known.usable(path) if conflicts == "drop" and known.usable is not None else known.read(path)
    if path.exists():
        what = "folder" if path.is_dir() else "file"
        wanted = "; ".join(each.about for each in formats.values())
        raise InstrumentError(f"{path}: the {what} is no instrument, which is one of: {wanted}")
    if path.suffix or len(path.parts) > 1:
        raise InstrumentError(f"{path}: no such file")
    return named(str(path))
