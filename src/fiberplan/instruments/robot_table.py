"""A table with a row for each robot as an instrument by itself.

Columns are those of a table beside an instrument file (``docs/instrument-format.md``): `positioner`, a place (`x`, `y`
or `distance`, `angle`), `length`, one fiber or more (`arm`, or `<fiber>_x` and `<fiber>_y`), joint ranges
(`lower_alpha`, ...), and what there is of `folded_alpha`, `zero_alpha`, `speed_alpha`, `acceleration_alpha`,
`min_speed_alpha`, `online`. Names may also be said the other way round (`alpha_lower`), and `base_x`, `base_y` for the
place. `radius` makes each arm a capsule from the elbow to its first fiber. What the table leaves out is assumed, and
said so.
"""

from pathlib import Path
from typing import Literal

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body
from fiberplan.instruments.formats import focal_plane_format
from fiberplan.tables.contents import beginning, plain_name
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_table

USUAL_SPEED = 30.0  #: where a table gives none [deg/s]
_JOINT_VALUES = ("lower", "upper", "folded", "zero", "speed", "acceleration", "min_speed")
_NAMES = {"base_x": "x", "base_y": "y"} | {
    f"{joint}_{value}": f"{value}_{joint}" for joint in ("alpha", "beta") for value in _JOINT_VALUES
}
_HEAD = 65536  # bytes that are looked at to tell a table of robots from others
_OURS = (b"FPPLANE", b"FPFORMAT", b"FOCALPLANE", b"POSITIONERS")


def _accepts(path: Path) -> bool:
    """Whether a table has columns `positioner` and `length`, which no table of targets has."""
    suffix = plain_name(path).suffix.lower()
    if suffix not in (".csv", ".ecsv", ".fits"):
        return False
    try:
        head = beginning(path, _HEAD)
    except OSError:
        return False
    if suffix == ".fits":
        there = {card.lower() for card in (b"'positioner", b"'length") if card in head.lower()}
        return len(there) == 2 and not any(word in head for word in _OURS)
    lines = head.decode("utf-8", "replace").lstrip("\ufeff").lower().splitlines()
    heading = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    words = {word.split("[")[0].strip(' "') for word in heading.replace(" ", ",").split(",")}
    return {"positioner", "length"} <= words


def _usable(path: Path) -> FocalPlane:
    return read_robots(path, "drop")


@focal_plane_format(
    "robots", "a table with a row for each robot (columns positioner, x, y, length, ...)", _accepts, _usable
)
def read_robots(path: Path, conflicts: Literal["raise", "drop"] = "raise") -> FocalPlane:
    """The focal plane of a table of robots.

    With "drop", a robot with a cell that cannot be used is offline, and named; one of which nothing says where it is,
    is left out.

    Raises:
        InstrumentError: a column that is missing, or a value that cannot be used; file, row and value are named.
    """
    from fiberplan.instruments.complaints import DefinitionError  # slow to import, as is all that checks a definition
    from fiberplan.instruments.definition import plane_of
    from fiberplan.instruments.definition_model import Definition
    from fiberplan.instruments.positioner_table import row_of

    read = read_table(path, InstrumentError)
    drop = conflicts == "drop"
    if not drop:
        _refuse_blanks(read)
    table = _renamed(read)
    fibers = [name[:-2] for name in table.columns if name.endswith("_x") and name[:-2]] or ["fiber"]
    table = _with_sides(table, fibers)
    assumptions = []
    joints: dict[str, dict[str, float]] = {}
    for joint in ("alpha", "beta"):
        said = joints[joint] = {}
        table.require(f"lower_{joint}", f"upper_{joint}")
        if f"speed_{joint}" not in table:
            said["speed"] = USUAL_SPEED
            assumptions.append(f"speed of {joint} {USUAL_SPEED:g} deg/s: the table of robots gives none")
    table, parked = _parked(table, drop)
    assumptions += parked
    definition = Definition.model_validate(
        {"format": 1, "name": plain_name(path).stem, "positioners": path.name, "fibers": fibers, "joints": joints}
    )
    radius, faults = _radius(table, drop)
    bare = {name: cells for name, cells in table.columns.items() if name != "radius"}
    try:
        rest = InputTable(table.source, bare, table.units, table.rows, InstrumentError)
        plane = plane_of(definition, path, [rest], drop)
    except DefinitionError as error:
        raise InstrumentError(f"{path}: {error}") from None
    assumptions += plane.assumptions
    if radius is None:
        return plane.replace(assumptions=tuple(assumptions))
    row = np.array([row_of(table)[id_] for id_ in plane.ids])
    thin = [f"positioner {plane.ids[i]} is offline: {faults[k]}" for i, k in enumerate(row) if k in faults]
    ends = np.stack([np.zeros((plane.n, 2)), plane.fiber], axis=1)
    assumptions += ["arms are capsules from the elbow to the fiber, of the table's radius", *thin]
    notes = (*(note for note in plane.notes if "no bodies" not in note), *thin)
    online = plane.online & ~np.isin(row, list(faults))
    bodies = (Body(ends, radius[row]),)
    return plane.replace(bodies=bodies, online=online, assumptions=tuple(assumptions), notes=notes)


def _refuse_blanks(table: InputTable) -> None:
    """Refuse a cell that is empty, or is no number, where every robot needs one: by its line and its heading."""
    ends = [f"{value}_{joint}" for value in ("lower", "upper", "folded", "speed") for joint in ("alpha", "beta")]
    needed = {"length", "radius", *ends}
    if "distance" not in table:
        needed |= {"x", "y"}
    for heading in table.columns:
        if _name(heading) in needed:
            table.numbers(heading)


def _radius(table: InputTable, drop: bool) -> tuple[np.ndarray | None, dict[int, str]]:
    """Of each row's arm [mm], None if the table gives none; and the rows that have none, which take the largest."""
    if "radius" not in table:
        return None, {}
    faults: dict[int, str] = {}
    radius = np.array(table.numbers("radius", "mm", faults=faults if drop else None))
    for row in map(int, np.flatnonzero(radius < 0)):
        said = f"radius {radius[row]:g} mm is negative"
        if not drop:
            raise table.fail(row, said)
        faults.setdefault(row, said)
    good = ~np.isin(np.arange(len(radius)), list(faults))
    if not good.any():
        raise table.fail(min(faults), faults[min(faults)])
    radius[~good] = radius[good].max()
    return radius, {row: f"{table.rows[row]}: {text}; its arm is taken as thick as any" for row, text in faults.items()}


def _name(heading: str) -> str:
    """What `docs/instrument-format.md` calls a column."""
    return _NAMES.get(heading.lower(), heading)


def _renamed(table: InputTable) -> InputTable:
    """The same by the names of `docs/instrument-format.md`."""
    columns, units = {}, {}
    for name, cells in table.columns.items():
        known = _name(name)
        if known in columns or (known != name and known in table.columns):
            raise InstrumentError(f"{table.source}: columns '{known}' and '{name}' are the same value")
        columns[known] = cells
        if name in table.units:
            units[known] = table.units[name]
    return InputTable(table.source, columns, units, table.rows, InstrumentError)


def _with_sides(table: InputTable, fibers: list[str]) -> InputTable:
    """The same with a zero for the y of fibers that lie straight along the beta link."""
    from fiberplan.instruments.definition_model import Positioner

    known = set(Positioner.model_fields)
    added = {}
    for name in fibers:
        if f"{name}_x" in table and f"{name}_y" not in table:
            along = table.numbers(f"{name}_x", blank=np.nan, faults={})
            added[f"{name}_y"] = ["" if np.isnan(x) else "0" for x in along]
    added = {name: cells for name, cells in added.items() if name not in known}
    return InputTable(table.source, {**table.columns, **added}, table.units, table.rows, InstrumentError)


def _parked(table: InputTable, drop: bool) -> tuple[InputTable, list[str]]:
    """The same with a park state where it gives none: alpha as near to 0, beta as near to folded as ranges allow.

    With `drop`, cells that cannot be used do not count here.
    """
    faults: dict[int, str] | None = {} if drop else None
    columns, units, assumptions = dict(table.columns), dict(table.units), []
    for joint, wanted in (("alpha", 0.0), ("beta", 180.0)):
        if f"folded_{joint}" in table:
            continue
        zero = table.numbers(f"zero_{joint}", "rad", "deg", 0.0, faults) if f"zero_{joint}" in table else 0.0
        low, high = (table.numbers(f"{end}_{joint}", "rad", "deg", np.nan, faults) for end in ("lower", "upper"))
        best = np.radians(wanted) - (zero if joint == "beta" else 0.0)
        columns[f"folded_{joint}"] = np.fmin(np.fmax(np.broadcast_to(best, low.shape), low), high)
        units[f"folded_{joint}"] = "rad"
        where = "folded back" if joint == "beta" else "at 0 deg"
        assumptions.append(f"{joint} is parked {where}, or as near as its range allows: the table of robots says none")
    return InputTable(table.source, columns, units, table.rows, InstrumentError), assumptions
