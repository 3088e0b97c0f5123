"""A focal plane by name, or from a file or folder of any kind that is known here.

That is a built-in name, a TOML file written by hand, a FITS file that `FocalPlane.write` made (a plan file will do), a
``positioners.cfg`` of the MOONS prototype, or a folder of SDSS-V calibrations.
"""

import os
from pathlib import Path

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.instruments import builtin, names
from fiberplan.instruments.definition import read_definition
from fiberplan.instruments.moons import read_moons
from fiberplan.instruments.sdss import HOLE_MAP, read_calibration
from fiberplan.io.focal_plane_tables import read_focal_plane
from fiberplan.tables.table_reader import nearest, one_line


def load_focal_plane(name_or_path: str | os.PathLike) -> FocalPlane:
    """A built-in instrument by name, or one from a file or folder.

    Raises:
        InstrumentError: no such instrument or file, or one that cannot be used; one line that names it.
    """
    if name_or_path in names():
        return read_definition(builtin(str(name_or_path)))
    path = Path(name_or_path)
    try:
        return _from_path(path, str(name_or_path))
    except OSError as error:  # a name that no file can have, a folder that may not be looked into
        raise InstrumentError(f"{path}: cannot be read ({(error.strerror or str(error)).lower()})") from None


def _from_path(path: Path, name: str) -> FocalPlane:
    """One from a file or folder, by its ending; `name` is what was asked for."""
    if path.is_dir():
        if not (path / HOLE_MAP).is_file():
            raise InstrumentError(f"{path}: the folder has no {HOLE_MAP}, so it is not a SDSS calibration folder")
        return read_calibration(path)
    suffix = path.suffix.lower()
    if suffix == ".toml":
        try:
            return read_definition(path)
        except (ValueError, RecursionError) as error:  # numbers or nesting that Python cannot hold
            raise InstrumentError(f"{path}: cannot be used ({one_line(error)})") from None
    if suffix == ".fits":
        return read_focal_plane(path)
    if suffix == ".cfg":
        return read_moons(path)
    if path.exists():
        raise InstrumentError(f"{path}: is neither a .toml, a .fits nor a .cfg file, nor a calibration folder")
    if path.suffix or len(path.parts) > 1:
        raise InstrumentError(f"{path}: no such file")
    known = ", ".join(names())
    raise InstrumentError(f"no instrument '{name}'{nearest(name, names())} (built in: {known})")
