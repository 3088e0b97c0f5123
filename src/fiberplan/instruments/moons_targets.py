"""Fields of the MOONS prototype (``targets_K.txt``): a row of numbers per positioner, without headings.

Base r [mm] and theta [deg], target r and theta (theta from +y towards +x), flags for the right and the left elbow, and
priority. In the newer form a letter, R or L, stands for the flags, and the positioner's number may stand for its base.
Otherwise positioners are named by where they stand. A target at a huge r is none.
"""

from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.errors import TargetError
from fiberplan.instruments.formats import target_format
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_text

BY_PLACE = ("base r", "base theta")
BY_NUMBER = ("positioner",)
TARGET = ("target r", "target theta")
COLUMNS = (*BY_PLACE, *TARGET, "right", "left", "priority")
LETTERS = {"R": (1, 0), "L": (0, 1)}  #: elbows in the newer form
NOWHERE = 1e5  #: a target this far out is none [mm]; the files say 1e6


def is_moons(path: Path, content: bytes) -> bool:
    """Whether a text file begins with a row of numbers and perhaps a letter, where any other table has headings."""
    if path.suffix.lower() != ".txt":
        return False
    first = next((line.split() for line in read_text(path, TargetError, content) if line.strip()), [])
    return bool(first) and all(_is_number(word) or (k > 2 and word in LETTERS) for k, word in enumerate(first))


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _form(row: list[str]) -> tuple[str, ...]:
    """Columns of a file that begins with this row."""
    if not any(word in LETTERS for word in row):
        return COLUMNS
    return (*(BY_NUMBER if len(row) <= 5 else BY_PLACE), *TARGET, "elbow", "priority")


@target_format("moons", "a targets_K.txt of MOONS: rows of seven numbers, or of five with R or L", is_moons)
def read_moons_targets(path: Path, content: bytes) -> dict[str, Any]:
    """The fields of `fiberplan.problem.Targets`.

    Raises:
        TargetError: a row with too few or too many values, or a value that cannot be used; its line is named.
    """
    numbered = [(k, line.split()) for k, line in enumerate(read_text(path, TargetError, content), 1) if line.strip()]
    form = _form(numbered[0][1])
    for k, row in numbered:
        if len(row) != len(form):
            raise TargetError(
                f"{path}: line {k}: {len(row)} values, expected {len(form)} ({', '.join(form)}): truncated?"
            )
    cells: dict[str, list[str]] = {name: [row[k] for _, row in numbered] for k, name in enumerate(form)}
    lines = tuple(f"line {k}" for k, _ in numbered)
    if "elbow" in cells:
        for k, letter in enumerate(cells["elbow"]):
            if letter not in LETTERS:
                raise TargetError(f"{path}: {lines[k]}: elbow is '{letter}', expected R or L")
        for name, flags in zip(("right", "left"), zip(*map(LETTERS.get, cells.pop("elbow")), strict=True), strict=True):
            cells[name] = [str(flag) for flag in flags]
    table = InputTable(str(path), cells, {}, lines, TargetError)
    r, theta, right, left, priority = (table.numbers(name) for name in COLUMNS[2:])
    base_r = table.numbers("base r") if "base r" in table else np.zeros(len(table))
    for name, values in (("base r", base_r), ("target r", r)):
        for bad in np.flatnonzero(values < 0):
            raise table.fail(int(bad), f"{name} is {values[bad]:g}, expected 0 mm or more")
    for name, values in (("right", right), ("left", left)):
        for bad in np.flatnonzero((values != 0) & (values != 1)):
            raise table.fail(int(bad), f"{name} is {values[bad]:g}, expected 0 or 1")
    wanted = r < NOWHERE
    for bad in np.flatnonzero(wanted & (right + left == 0)):
        raise table.fail(int(bad), "a target with neither elbow allowed")
    if "positioner" in table:
        owner: dict[str, Any] = {"positioner": tuple(cells["positioner"][k] for k in np.flatnonzero(wanted))}
    else:
        base = _places(base_r, table.numbers("base theta"))
        owner = {"base": base[wanted], "idle": base[~wanted]}
    return owner | {
        "x": _places(r, theta)[wanted, 0],
        "y": _places(r, theta)[wanted, 1],
        "parity": (right - left)[wanted],
        "priority": priority[wanted],
        "source": str(path),
        "rows": tuple(table.rows[k] for k in np.flatnonzero(wanted)),
    }


def _places(r: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Polar coordinates, theta [deg] from +y towards +x, as (m, 2) [mm]."""
    return np.stack([r * np.sin(np.radians(theta)), r * np.cos(np.radians(theta))], axis=1)
