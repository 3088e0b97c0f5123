"""SDSS-V's record of a configuration (``confSummary``): who was sent where, and whose position is not known."""

from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.errors import TargetError
from fiberplan.instruments.formats import target_format
from fiberplan.tables.yanny import read_yanny

_ABSENT = -900.0  # confSummary writes -999 for what it does not know


@target_format("sdss", "a confSummary*.par of SDSS-V", lambda path, content: path.suffix.lower() == ".par")
def read_conf_summary(path: Path, content: bytes) -> dict[str, Any]:
    """One target per hole: where its metrology fiber was commanded to be; holes without valid angles are offline."""
    table = read_yanny(path, "FIBERMAP", TargetError, content)
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
