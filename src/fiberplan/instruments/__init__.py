"""Named instruments, and one module for each real instrument: its focal plane and its target files.

- ``builtin/*.toml``: the instruments that are built in, a source beside every number
- `toml_file`: reads such a file, or a user's own; `definition` makes a focal plane of what it says: its fields are in
  `definition_model`, regular arrays in `grids`, tables beside it in `positioner_table` and `shape_tables`; `complaints`
  and `locate` say what is wrong and in which line
- `formats`: where readers of files register; importing this package registers ours
- `sdss`, `sdss_targets`, `sdss_states`: calibration folders of SDSS-V, and its record of a configuration: what was
  asked for, and where robots stand
- `moons`, `moons_zones`, `moons_targets`: configuration files of the MOONS prototype, its zones and its fields
- `desi`, `desi_outlines`, `desi_mending`: focal-plane files of DESI, what can touch there, rows with bad cells
- `pfs`: fiber map, fiducials, black dots and measured cobras of PFS
- `robot_table`: a table with a row for each robot

`names` and `named` know the built-in instruments and those of other packages.
"""

from pathlib import Path

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.instruments import (  # noqa: F401 - they register themselves
    desi,
    moons,
    moons_targets,
    pfs,
    robot_table,
    sdss,
    sdss_targets,
)
from fiberplan.instruments.formats import INSTRUMENTS
from fiberplan.instruments.toml_file import read_definition
from fiberplan.tables.formats import FileFormat
from fiberplan.tables.wording import nearest

__all__ = ["BUILTIN", "named", "names"]

BUILTIN = Path(__file__).parent / "builtin"  #: the folder of built-in instruments, a file each


def names() -> tuple[str, ...]:
    """Names of instruments: ours in alphabetical order, then those of other packages."""
    ours = sorted(path.stem for path in BUILTIN.glob("*.toml"))
    others = [name for name in INSTRUMENTS if not isinstance(INSTRUMENTS[name], FileFormat) and name not in ours]
    return (*ours, *others)


def named(name: str) -> FocalPlane:
    """A named instrument.

    Raises:
        InstrumentError: there is none of this name.
    """
    path = BUILTIN / f"{name}.toml"
    if name in names() and path.is_file():
        return read_definition(path)
    make = INSTRUMENTS.get(name)
    if make is None or isinstance(make, FileFormat):
        known = ", ".join(names())
        raise InstrumentError(f"no instrument '{name}'{nearest(name, names())} (built in: {known})")
    return make()
