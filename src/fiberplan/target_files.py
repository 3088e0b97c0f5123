"""Readers of targets: any table, SDSS-V's record of a configuration (``confSummary``), or a field of MOONS.

A table has ``x`` and ``y`` [mm] or commanded ``alpha`` and ``beta`` [deg] or both (angles win), and optionally
``positioner``, ``priority``, ``fiber`` and ``parity``. Units in brackets are assumed where a column gives none.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.errors import TargetError
from fiberplan.instruments.moons_targets import is_moons, read_moons_targets
from fiberplan.instruments.yanny import read_yanny
from fiberplan.table_reader import InputTable, read_table

_PARITIES = {"right": 1.0, "left": -1.0, "any": 0.0, "": 0.0}
_ABSENT = -900.0  # confSummary writes -999 for what it does not know


def read_columns(path: str | os.PathLike) -> dict[str, Any]:
    """The fields of `Targets` from a file.

    Raises:
        TargetError: a file, column, unit or value that cannot be used; one line that names it.
    """
    path = Path(path)
    if path.suffix.lower() == ".par":
        return _conf_summary(path)
    return read_moons_targets(path) if is_moons(path) else _table(path)


def _table(path: Path) -> dict[str, Any]:
    table = read_table(path, TargetError)
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


def _conf_summary(path: Path) -> dict[str, Any]:
    """One target per hole: where its metrology fiber was commanded to be; holes without valid angles are offline."""
    table = read_yanny(path, "FIBERMAP", TargetError)
    table.require("holeId", "fiberType", "valid", "xwok", "ywok", "alpha", "beta")
    if not len(table):
        raise TargetError(f"{path}: the table FIBERMAP has no rows")
    holes, kinds = table.texts("holeId"), table.texts("fiberType")
    chosen: dict[str, int] = {}
    seen: dict[tuple[str, str], int] = {}
    for row, hole in enumerate(holes):
        if (before := seen.setdefault((hole, kinds[row]), row)) != row:
            raise table.fail(row, f"{kinds[row]} fiber of hole '{hole}' was already given in {table.rows[before]}")
        if hole not in chosen or kinds[row] == "METROLOGY":
            chosen[hole] = row
    rows = np.array(list(chosen.values()), np.int64)
    valid = table.numbers("valid")[rows]
    alpha, beta, x, y = (table.numbers(name, blank=np.nan)[rows] for name in ("alpha", "beta", "xwok", "ywok"))
    known = (valid != 0) & (alpha > _ABSENT) & (beta > _ABSENT)
    kept = rows[known]
    return {
        "x": x[known],
        "y": y[known],
        "positioner": tuple(holes[row] for row in kept),
        "angles": np.radians(np.stack([alpha, beta], axis=1)[known]),
        "offline": tuple(holes[row] for row in rows[~known]),
        "source": str(path),
        "rows": tuple(table.rows[row] for row in kept),
    }
