"""Where SDSS-V's record of a configuration (``confSummary``) says that robots stand, and which are disabled."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from fiberplan.errors import ProblemError
from fiberplan.tables.yanny import read_yanny

_ABSENT = -900.0  # confSummary writes -999 for what it does not know


class Standing(NamedTuple):
    """Where robots stand."""

    ids: tuple[str, ...]  #: holes
    rows: tuple[str, ...]  #: where the file says so
    angles: np.ndarray  #: (n, 2) commanded [rad]; NaN where the record has none that is valid
    disabled: np.ndarray  #: (n,) False in records without such a column
    numbers: tuple[str, ...] | None  #: (n,) of the robots; None in records without such a column
    points: np.ndarray | None  #: (n, 2) of those fibers [mm]; NaN where the record has none
    fibers: tuple[str, ...]  #: (n,) which those are; "": metrology


def standing(path: Path, content: bytes) -> Standing:
    """One row a hole; that of its metrology fiber, if it has one.

    Raises:
        ProblemError: no FIBERMAP, or a value that cannot be used (line, column and value are named).
    """
    table = read_yanny(path, "FIBERMAP", ProblemError, content)
    table.require("holeId", "fiberType", "valid", "alpha", "beta")
    holes, kinds = table.texts("holeId"), [kind.upper() for kind in table.texts("fiberType")]
    numbers = table.texts("positionerId", blank="") if "positionerId" in table else None
    chosen: dict[str, int] = {}
    for row, hole in enumerate(holes):
        if hole not in chosen or kinds[row] == "METROLOGY":
            chosen[hole] = row
    rows = list(chosen.values())
    angles = np.stack([table.numbers(name, blank=np.nan)[rows] for name in ("alpha", "beta")], axis=1)
    known = (table.numbers("valid")[rows] != 0) & (angles > _ABSENT).all(axis=1)
    points = None
    if "xwok" in table and "ywok" in table:
        points = np.stack([table.numbers(name, blank=np.nan)[rows] for name in ("xwok", "ywok")], axis=1)
        points[(points <= _ABSENT).any(axis=1)] = np.nan
    disabled = np.zeros(len(holes), bool)
    if "disabled" in table:
        stopped = {holes[row] for row in np.flatnonzero(table.flags("disabled", blank=False)).tolist()}
        disabled = np.array([hole in stopped for hole in holes], bool)
    return Standing(
        tuple(chosen),
        tuple(table.rows[row] for row in rows),
        np.radians(np.where(known[:, None], angles, np.nan)),
        disabled[rows],
        None if numbers is None else tuple(numbers[row] for row in rows),
        points,
        tuple("" if kinds[row] == "METROLOGY" else kinds[row].lower() for row in rows),
    )
