"""Readers and a writer of targets: any table, and every format that is registered (`fiberplan.instruments.formats`).

A table has ``x`` and ``y`` [mm] or commanded ``alpha`` and ``beta`` [deg] or both (angles win), and optionally
``positioner``, ``priority``, ``fiber`` and ``parity``. Units in brackets are assumed where a column gives none.
"""

import os
import tempfile
from pathlib import Path
from typing import Any, Literal

import numpy as np
from astropy import units
from astropy.table import QTable, Table

from fiberplan.errors import TargetError
from fiberplan.instruments.formats import TARGET_FILES
from fiberplan.problem import Targets
from fiberplan.tables.atomic import write_whole
from fiberplan.tables.contents import read_whole
from fiberplan.tables.formats import content_format
from fiberplan.tables.table_reader import InputTable, input_table, one_line, read_table

META = "fiberplan"  #: key of a table's meta data under which there is more about its targets
_WITH_META = (".ecsv", ".txt", ".dat")  # written as ECSV, which keeps them
_PLACES = (("x", "y"), ("alpha", "beta"))
_PARITIES = {"right": 1.0, "left": -1.0, "any": 0.0, "": 0.0}


def read_columns(path: str | os.PathLike) -> dict[str, Any]:
    """The fields of `Targets` from a file.

    Raises:
        TargetError: a file, column, unit or value that cannot be used; one line that names it.
    """
    path = Path(path)
    content = read_whole(path, TargetError)
    known = content_format(TARGET_FILES, path, content)
    return _columns(read_table(path, TargetError, content)) if known is None else known.read(path, content)


def _columns(table: InputTable) -> dict[str, Any]:
    has_angles = "alpha" in table or "beta" in table
    if "x" in table or "y" in table or not has_angles:
        table.require("x", "y")
    if has_angles:
        table.require("alpha", "beta")
    unknown = np.full(len(table), np.nan)
    blank = np.nan if has_angles else None  # where there are angles, there need be no place
    x, y = (table.numbers(name, "mm", blank=blank) if name in table else unknown for name in ("x", "y"))
    angles = [table.numbers(name, "rad", "deg", blank=np.nan) if has_angles else unknown for name in ("alpha", "beta")]
    for name, values in (("x", x), ("y", y)) if has_angles else ():
        for row in np.flatnonzero(np.isnan(values) & np.isnan(angles[0])):
            raise table.fail(int(row), f"{name} is empty, and so are its angles")
    fields: dict[str, Any] = {"x": x, "y": y, "angles": np.stack(angles, axis=1)}
    if "positioner" in table:
        fields["positioner"] = table.texts("positioner")
    if "priority" in table:
        fields["priority"] = table.numbers("priority")
    if "fiber" in table:
        fields["fiber"] = table.texts("fiber", blank="")
    if "parity" in table:
        fields["parity"] = _parity(table)
    if "base_x" in table and "base_y" in table:
        fields["base"] = np.stack([table.numbers("base_x", "mm"), table.numbers("base_y", "mm")], axis=1)
    return fields | _remarks(table) | {"source": table.source, "rows": table.rows}


def _remarks(table: InputTable) -> dict[str, Any]:
    """What `write_targets` says of positioners without a target."""
    said = table.meta.get(META, {})
    try:
        found: dict[str, Any] = {name: tuple(map(str, said.get(name, ()))) for name in ("offline", "notes")}
        if said.get("idle"):
            found["idle"] = np.array(said["idle"], float).reshape(-1, 2)
    except (AttributeError, TypeError, ValueError):
        raise TargetError(f"{table.source}: what its meta data say under '{META}' cannot be read") from None
    return found


def columns_of(table: Table, masked: Literal["raise", "drop"]) -> dict[str, Any]:
    """The fields of `Targets` from a table of astropy.

    Raises:
        TargetError: as `read_columns`; with "raise", also a masked cell that is needed.
    """
    if masked not in ("raise", "drop"):
        raise TargetError(f"masked must be 'raise' or 'drop', got '{masked}'")
    if not isinstance(table, Table):
        raise TargetError(f"expected a table of astropy, got {type(table).__name__}")
    whole = input_table(table, "table", TargetError)
    lacking = _lacking(whole) if masked == "drop" else {}
    kept = [row for row in range(len(whole)) if row not in lacking]
    fields = _columns(input_table(table[kept], "table", TargetError, [whole.rows[row] for row in kept]))
    left_out = [f"{whole.rows[row]} of the table was left out: {what} is masked" for row, what in lacking.items()]
    return fields | {"notes": (*fields["notes"], *left_out)}


def _lacking(table: InputTable) -> dict[int, str]:
    """Rows that cannot be used, as a cell that they need is masked -> what it is called."""
    masked = {name: np.ma.getmaskarray(np.ma.asarray(cells)) for name, cells in table.columns.items()}
    found: dict[int, str] = {}
    for row, id_ in enumerate(table.columns.get("positioner", [""] * len(table))):
        hidden = {name for name, mask in masked.items() if mask[row].any()}
        lacking: list[str] = [name for name in ("positioner", "priority", "base_x", "base_y") if name in hidden]
        if not any(all(name in table and name not in hidden for name in place) for place in _PLACES):
            lacking += [name for name in ("x", "y", "alpha", "beta") if name in hidden]
        if lacking:
            found[row] = f"{lacking[0]} of positioner '{id_}'" if id_ and "positioner" not in hidden else lacking[0]
    return found


def table_of(targets: Targets) -> QTable:
    """Targets as `read_columns` reads them; see `Targets.to_table`."""
    columns: dict[str, Any] = {} if targets.positioner is None else {"positioner": np.array(targets.positioner, str)}
    columns |= {"x": targets.x * units.mm, "y": targets.y * units.mm}
    if targets.commanded.any():
        columns |= {"alpha": targets.angles[:, 0] * units.rad, "beta": targets.angles[:, 1] * units.rad}
    columns["priority"] = targets.priority
    if targets.fiber is not None:
        columns["fiber"] = np.array(targets.fiber, str)
    columns["parity"] = targets.parity.astype(np.int64)
    if targets.base is not None:
        columns |= {"base_x": targets.base[:, 0] * units.mm, "base_y": targets.base[:, 1] * units.mm}
    idle = [] if targets.idle is None else targets.idle.tolist()
    said = {"offline": list(targets.offline), "idle": idle, "notes": list(targets.notes)}
    said = {name: value for name, value in said.items() if value}
    return QTable(columns, meta={META: said} if said else {})


def write_targets(targets: Targets, path: str | os.PathLike) -> None:
    """Write targets in the format that the file's name says; the file appears whole or not at all.

    Raises:
        TargetError: no such format, one that cannot hold what these targets say, or a file that cannot be written.
    """
    path, table = Path(path), table_of(targets)
    suffix = path.suffix.lower()
    if suffix == ".csv":
        table.rename_columns(*zip(*((name, f"{name} [{table[name].unit}]") for name in _with_unit(table)), strict=True))
    if suffix not in _WITH_META:
        if len(targets.offline) or targets.idle is not None:
            raise TargetError(f"{path}: only {', '.join(_WITH_META)} can say which positioners have no target")
        table.meta.clear()
    options = {"format": "ascii.ecsv"} if suffix in _WITH_META else {}
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / path.name
        try:
            table.write(draft, **options)
            content = draft.read_bytes()
        except Exception as problem:  # each of astropy's writers raises what it likes
            raise TargetError(f"{path}: cannot be written as a table ({one_line(problem)})") from None
    write_whole(path, content, TargetError)


def _with_unit(table: QTable) -> list[str]:
    return [name for name in table.colnames if getattr(table[name], "unit", None) is not None]


def _parity(table: InputTable) -> np.ndarray:
    """+1, -1 or 0, also as right, left or any."""
    words = [word.lower() for word in table.texts("parity", blank="any")]
    if all(word in _PARITIES for word in words):
        return np.array([_PARITIES[word] for word in words])
    return table.numbers("parity", blank=0.0)
