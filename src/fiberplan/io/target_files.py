"""Readers of targets: any table, and every format that is registered (`fiberplan.instruments.formats`).

A table has ``x`` and ``y`` [mm] or commanded ``alpha`` and ``beta`` [deg] or both (angles win), and optionally
``positioner``, ``priority``, ``fiber`` and ``parity``. Units in brackets are assumed where a column gives none.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.errors import TargetError
from fiberplan.instruments.formats import TARGET_FILES
from fiberplan.tables.contents import read_whole
from fiberplan.tables.formats import content_format
from fiberplan.tables.table_reader import InputTable, read_table

_PARITIES = {"right": 1.0, "left": -1.0, "any": 0.0, "": 0.0}


def read_columns(path: str | os.PathLike) -> dict[str, Any]:
    """The fields of `Targets` from a file.

    Raises:
        TargetError: a file, column, unit or value that cannot be used; one line that names it.
    """
    path = Path(path)
    content = read_whole(path, TargetError)
    known = content_format(TARGET_FILES, path, content)
    return _table(path, content) if known is None else known.read(path, content)


def _table(path: Path, content: bytes) -> dict[str, Any]:
    table = read_table(path, TargetError, content)
    has_angles = "alpha" in table or "beta" in table
    if "x" in table or "y" in table or not has_angles:
        table.require("x", "y")
    if has_angles:
        table.require("alpha", "beta")
    unknown = np.full(len(table), np.nan)
    x, y = (table.numbers(name, "mm") if name in table else unknown for name in ("x", "y"))
    angles = [table.numbers(name, "rad", "deg", blank=np.nan) if has_angles else unknown for name in ("alpha", "beta")]
    fields: dict[str, Any] = {"x": x, "y": y, "angles": np.stack(angles, axis=1)}
    if "positioner" in table:
        fields["positioner"] = table.texts("positioner")
    if "priority" in table:
        fields["priority"] = table.numbers("priority")
    if "fiber" in table:
        fields["fiber"] = table.texts("fiber", blank="")
    if "parity" in table:
        fields["parity"] = _parity(table)
    return fields | {"source": str(path), "rows": table.rows}


def _parity(table: InputTable) -> np.ndarray:
    """+1, -1 or 0, also as right, left or any."""
    words = [word.lower() for word in table.texts("parity", blank="any")]
    if all(word in _PARITIES for word in words):
        return np.array([_PARITIES[word] for word in words])
    return table.numbers("parity", blank=0.0)
