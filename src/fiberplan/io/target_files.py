"""Readers and a writer of targets: any table, and every format that is registered (`fiberplan.instruments.formats`).

A table has ``x`` and ``y`` [mm] or commanded ``alpha`` and ``beta`` [deg] or both, and optionally ``positioner``,
``priority``, ``fiber``, ``parity``, ``assigned``, ``on_target``, ``disabled``, ``site``. Units in brackets are assumed
where a column gives none.
"""

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fiberplan.errors import TargetError
from fiberplan.instruments.formats import TARGET_FILES
from fiberplan.io.plan_file import is_plan
from fiberplan.io.target_columns import META, PLACES, lacking_cells, target_fields
from fiberplan.problem import Targets
from fiberplan.tables.atomic import is_special, write_whole
from fiberplan.tables.contents import read_whole
from fiberplan.tables.formats import content_format
from fiberplan.tables.table_reader import input_table, read_table
from fiberplan.tables.wording import one_line

if TYPE_CHECKING:
    from astropy.table import QTable, Table

_WITH_META = (".ecsv", ".txt", ".dat")  # written as ECSV, which keeps them


def read_columns(path: str | os.PathLike, drop: bool = False) -> dict[str, Any]:
    """The fields of `Targets` from a file.

    Args:
        path: of the file.
        drop: leave out rows that cannot be used, each with a note, instead of refusing the file.

    Raises:
        TargetError: a file, column, unit or value that cannot be used; one line that names it.
    """
    path = Path(path)
    content = read_whole(path, TargetError)
    refuse_plan(path, content)
    known = content_format(TARGET_FILES, path, content)
    if known is not None:
        return known.read(path, content)
    return target_fields(read_table(path, TargetError, content, wanted=PLACES), drop)


def refuse_plan(path: str | os.PathLike, content: bytes) -> None:
    """Raise `TargetError` if a file of this content is a plan: it has tables with x and y, and none of targets."""
    if is_plan(content):
        raise TargetError(f"{path}: is a plan, not a table of targets")


def columns_of(table: "Table", masked: Literal["raise", "drop"]) -> dict[str, Any]:
    """The fields of `Targets` from a table of astropy.

    Raises:
        TargetError: as `read_columns`; with "raise", also a masked cell that is needed.
    """
    from astropy.table import Table

    if masked not in ("raise", "drop"):
        raise TargetError(f"masked must be 'raise' or 'drop', got '{masked}'")
    if not isinstance(table, Table):
        raise TargetError(f"expected a table of astropy, got {type(table).__name__}")
    whole = input_table(table, "table", TargetError)
    lacking = lacking_cells(whole) if masked == "drop" else {}
    kept = [row for row in range(len(whole)) if row not in lacking]
    if len(table) and not kept:
        raise TargetError(f"table: none of {len(table)} rows can be used: {next(iter(lacking.values()))} is masked")
    rows = [whole.rows[row] for row in kept]
    fields = target_fields(input_table(table[kept], "table", TargetError, rows), drop=masked == "drop")
    left_out = [f"{whole.rows[row]} of the table was left out: {what} is masked" for row, what in lacking.items()]
    return fields | {"notes": (*fields["notes"], *left_out)}


def table_of(targets: Targets) -> "QTable":
    """Targets as `read_columns` reads them; see `Targets.to_table`."""
    from astropy import units
    from astropy.table import QTable

    columns: dict[str, Any] = {} if targets.positioner is None else {"positioner": np.array(targets.positioner, str)}
    columns |= {"x": targets.x * units.mm, "y": targets.y * units.mm}
    if np.isfinite(targets.angles).any():
        columns |= {"alpha": targets.angles[:, 0] * units.rad, "beta": targets.angles[:, 1] * units.rad}
    columns["priority"] = targets.priority
    if targets.fiber is not None:
        columns["fiber"] = np.array(targets.fiber, str)
    if targets.second_names is not None:
        columns["second_name"] = np.array(targets.second_names, str)
    columns["parity"] = targets.parity.astype(np.int64)
    if not targets.assigned.all():
        columns["assigned"] = targets.assigned.astype(np.int64)
    if targets.disabled.any():
        columns["disabled"] = targets.disabled.astype(np.int64)
    if targets.base is not None:
        columns |= {"base_x": targets.base[:, 0] * units.mm, "base_y": targets.base[:, 1] * units.mm}
    idle = [] if targets.idle is None else targets.idle.tolist()
    said = {"offline": list(targets.offline), "idle": idle, "notes": list(targets.notes)}
    said |= {"left_out": list(targets.left_out), "prefer": targets.prefer, "site": targets.site}
    said = {name: value for name, value in said.items() if value}
    return QTable(columns, meta={META: said} if said else {})


def write_targets(targets: Targets, path: str | os.PathLike) -> None:
    """Write targets in the format that the file's name says; the file appears whole or not at all.

    Raises:
        TargetError: no such format, one that cannot hold what these targets say, or a file that cannot be written.
    """
    path, table = Path(path), table_of(targets)
    if path.suffix.lower() not in _WITH_META and (len(targets.offline) or targets.idle is not None):
        raise TargetError(f"{path}: only {', '.join(_WITH_META)} can say which positioners have no target")
    write_table(table, path)


def write_table(table: "QTable", path: str | os.PathLike) -> None:
    """Write a table in the format that the file's name says; the file appears whole or not at all.

    Raises:
        TargetError: no such format, or a file that cannot be written.
    """
    path, table = Path(path), table.copy()
    suffix = path.suffix.lower()
    if suffix == ".csv":
        table.rename_columns(*zip(*((name, f"{name} [{table[name].unit}]") for name in _with_unit(table)), strict=True))
    if suffix not in _WITH_META:
        table.meta.clear()
    options = {"format": "ascii.ecsv"} if suffix in _WITH_META or is_special(path) else {}  # a pipe has no ending
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / path.name
        try:
            table.write(draft, **options)
            content = draft.read_bytes()
        except Exception as problem:  # each of astropy's writers raises what it likes
            raise TargetError(f"{path}: cannot be written as a table ({one_line(problem)})") from None
    write_whole(path, content, TargetError)


def _with_unit(table: "QTable") -> list[str]:
    return [name for name in table.colnames if getattr(table[name], "unit", None) is not None]
