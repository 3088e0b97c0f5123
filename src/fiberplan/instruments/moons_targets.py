"""Fields of the MOONS prototype (``targets_K.txt``): a row of seven numbers per positioner, without headings.

Base r [mm] and theta [deg], target r and theta (theta from +y towards +x), flags for the right and the left elbow, and
priority. Positioners are named by where they stand. A target at a huge r is none.
"""

from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.errors import TargetError
from fiberplan.instruments.formats import target_format
from fiberplan.tables.table_reader import InputTable, read_text

COLUMNS = ("base r", "base theta", "target r", "target theta", "right", "left", "priority")
NOWHERE = 1e5  #: a target this far out is none [mm]; the files say 1e6


def is_moons(path: Path, content: bytes) -> bool:
    """Whether a text file begins with a row of numbers, where any other table has headings."""
    if path.suffix.lower() != ".txt":
        return False
    first = next((line.split() for line in read_text(path, TargetError, content) if line.strip()), [])
    return bool(first) and all(_is_number(word) for word in first)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


@target_format("moons", "a targets_K.txt of MOONS: rows of seven numbers", is_moons)
def read_moons_targets(path: Path, content: bytes) -> dict[str, Any]:
    """The fields of `fiberplan.problem.Targets`.

    Raises:
        TargetError: a row with too few or too many values, or a value that cannot be used; its line is named.
    """
    numbered = [(k, line.split()) for k, line in enumerate(read_text(path, TargetError, content), 1) if line.strip()]
    for k, row in numbered:
        if len(row) != len(COLUMNS):
            raise TargetError(
                f"{path}: line {k}: {len(row)} values, expected {len(COLUMNS)} ({', '.join(COLUMNS)}): truncated?"
            )
    cells = {name: [row[k] for _, row in numbered] for k, name in enumerate(COLUMNS)}
    table = InputTable(str(path), cells, {}, tuple(f"line {k}" for k, _ in numbered), TargetError)
    base_r, base_theta, r, theta, right, left, priority = (table.numbers(name) for name in COLUMNS)
    for name, values in (("base r", base_r), ("target r", r)):
        for bad in np.flatnonzero(values < 0):
            raise table.fail(int(bad), f"{name} is {values[bad]:g}, expected 0 mm or more")
    for name, values in (("right", right), ("left", left)):
        for bad in np.flatnonzero((values != 0) & (values != 1)):
            raise table.fail(int(bad), f"{name} is {values[bad]:g}, expected 0 or 1")
    wanted = r < NOWHERE
    for bad in np.flatnonzero(wanted & (right + left == 0)):
        raise table.fail(int(bad), "a target with neither elbow allowed")
    base = _places(base_r, base_theta)
    return {
        "x": _places(r, theta)[wanted, 0],
        "y": _places(r, theta)[wanted, 1],
        "base": base[wanted],
        "idle": base[~wanted],
        "parity": (right - left)[wanted],
        "priority": priority[wanted],
        "source": str(path),
        "rows": tuple(table.rows[k] for k in np.flatnonzero(wanted)),
    }


def _places(r: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Polar coordinates, theta [deg] from +y towards +x, as (m, 2) [mm]."""
    return np.stack([r * np.sin(np.radians(theta)), r * np.cos(np.radians(theta))], axis=1)
