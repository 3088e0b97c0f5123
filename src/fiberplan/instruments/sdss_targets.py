"""SDSS-V's record of a configuration (``confSummary``): who was sent where, who is out of order or without a position.

Columns that say what a robot is worth, where a record has them: ``disabled`` (1: it will not move from its angles),
``assigned`` and ``on_target`` (of fibers; a robot none of whose fibers is on a target was only put somewhere).
"""

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.errors import TargetError
from fiberplan.instruments.formats import target_format
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.yanny import read_yanny

_ABSENT = -900.0  # confSummary writes -999 for what it does not know
_METROLOGY = "METROLOGY"


@target_format(
    "sdss", "a confSummary*.par of SDSS-V", lambda path, content: path.name.lower().endswith((".par", ".par.gz"))
)
def read_conf_summary(path: Path, content: bytes) -> dict[str, Any]:
    """One target per hole: where its metrology fiber was commanded to be; holes without valid angles are offline."""
    table = read_yanny(path, "FIBERMAP", TargetError, content)
    table.require("holeId", "fiberType", "valid", "xwok", "ywok", "alpha", "beta")
    if not len(table):
        raise TargetError(f"{path}: the table FIBERMAP has no rows")
    holes, kinds = table.texts("holeId"), tuple(kind.upper() for kind in table.texts("fiberType"))
    chosen: dict[str, int] = {}
    fibers: dict[str, list[int]] = defaultdict(list)
    seen: dict[tuple[str, str], int] = {}
    for row, hole in enumerate(holes):
        if (before := seen.setdefault((hole, kinds[row]), row)) != row:
            raise table.fail(row, f"{kinds[row]} fiber of hole '{hole}' was already given in {table.rows[before]}")
        if hole not in chosen or kinds[row] == _METROLOGY:
            chosen[hole] = row
        fibers[hole].append(row)
    rows = np.array(list(chosen.values()), np.int64)
    valid = table.numbers("valid")[rows]
    alpha, beta, x, y = (table.numbers(name, blank=np.nan)[rows] for name in ("alpha", "beta", "xwok", "ywok"))
    known = (valid != 0) & (alpha > _ABSENT) & (beta > _ABSENT)
    placed = (x > _ABSENT) & (y > _ABSENT)
    kept = rows[known]
    numbers = table.texts("positionerId", blank="") if "positionerId" in table else ()
    assigned, notes = _assigned(table, fibers)
    disabled = _any_fiber(table, "disabled", fibers)
    return {
        "x": np.where(placed, x, np.nan)[known],
        "y": np.where(placed, y, np.nan)[known],
        "positioner": tuple(holes[row] for row in kept),
        "fiber": tuple("" if kinds[row] == _METROLOGY else kinds[row].lower() for row in kept),
        "angles": np.radians(np.stack([alpha, beta], axis=1)[known]),
        "assigned": np.array([assigned.get(holes[row], True) for row in kept], bool),
        "disabled": np.array([disabled.get(holes[row], False) for row in kept], bool),
        "offline": tuple(holes[row] for row in rows[~known]),
        "source": str(path),
        "rows": tuple(table.rows[row] for row in kept),
        "notes": notes,
        "site": str(table.meta.get("observatory", "")),
        "second_names": tuple(numbers[row] for row in kept) if numbers else None,
    }


def _any_fiber(table: InputTable, name: str, fibers: dict[str, list[int]]) -> dict[str, bool]:
    """Hole -> whether a column of flags says yes of one of its fibers; nothing of a table without that column."""
    if name not in table:
        return {}
    flags = table.flags(name, blank=False)
    return {hole: bool(flags[rows].any()) for hole, rows in fibers.items()}


def _assigned(table: InputTable, fibers: dict[str, list[int]]) -> tuple[dict[str, bool], tuple[str, ...]]:
    """Hole -> whether one of its fibers is on a target, and what to note of it; nothing where no column says it.

    A fiber that is assigned and not on its target was moved away from it (or never got there): its angles are worth no
    more than those of an idle robot.
    """
    if "assigned" not in table:
        return {}, ()
    assigned = table.flags("assigned", blank=False)
    there = assigned & table.flags("on_target", blank=True) if "on_target" in table else assigned
    if not there.any():
        return {}, (f"{table.source} has no fiber on a target: the angles of all robots are taken as targets",)
    found = {hole: bool(there[rows].any()) for hole, rows in fibers.items()}
    valid = table.numbers("valid", blank=0.0) != 0
    away = [hole for hole, rows in fibers.items() if not found[hole] and (assigned & valid)[rows].any()]
    text = f"assigned, but not on target in {table.source}, so they count as idle: {', '.join(away)}"
    return found, (text,) if away else ()
