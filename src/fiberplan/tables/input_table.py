"""A table as people write it: cells by column, with errors that name file, row, column and value.

Values are converted to the unit asked for at this door. Columns are found whatever the case of their names.
"""

import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from astropy import units as u

from fiberplan.arrays import read_only
from fiberplan.errors import FiberplanError
from fiberplan.tables.wording import is_number

_KINDS = {"mm": "a length", "rad": "an angle", "rad/s": "a speed of rotation", "rad/s2": "an angular acceleration"}
_KINDS |= {"rad/yr": "a proper motion", "yr": "a time"}
_FLAGS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
_EMPTY = {"", "--", "null", "none", "n/a", "na", "masked"}  # what stands in a cell for no number
_WHOLE = re.compile(r"^(\d+)\.0+$")


@dataclass(frozen=True, eq=False)
class InputTable:
    """A table as read: cells by column, units where the file gives them, and where each row stands in the file."""

    source: str  #: the file, as errors name it
    columns: Mapping[str, Sequence | np.ndarray]  #: name -> cells: text, or an astropy column
    units: Mapping[str, str] = field(default_factory=dict)
    rows: tuple[str, ...] = ()  #: "line 7" or "row 3", one per row
    error: type[FiberplanError] = FiberplanError  #: what to raise
    meta: Mapping[str, Any] = field(default_factory=dict)  #: what a file says besides its columns

    def __len__(self) -> int:
        return len(self.rows)

    def __contains__(self, name: str) -> bool:
        return self._known(name) is not None

    def _known(self, name: str) -> str | None:
        """A column's name as the file writes it; None if there is none."""
        if name in self.columns:
            return name
        return next((known for known in self.columns if known.lower() == name.lower()), None)

    def cells(self, name: str) -> Sequence | np.ndarray:
        """The cells of a column that exists, as they are."""
        return self.columns[self._known(name) or name]

    def refuse_twins(self, *names: str) -> None:
        """Refuse a table in which two columns could be one of these: they may contradict each other."""
        for name in names:
            same = [known for known in self.columns if known.lower() == name.lower()]
            if len(same) > 1:
                raise self.error(f"{self.source}: columns {' and '.join(map(repr, same))} differ only in their case")

    def require(self, *names: str) -> None:
        """Refuse a table that lacks one of these columns."""
        for name in names:
            if name not in self:
                raise self.error(f"{self.source}: no column '{name}'; {_list(self.columns, 'it has')}")

    def fail(self, row: int, complaint: str) -> FiberplanError:
        """The error to raise about a row."""
        return self.error(f"{self.source}: {self.rows[row]}: {complaint}")

    def texts(self, name: str, blank: str | None = None) -> tuple[str, ...]:
        """Cells as text, spaces at both ends removed.

        Args:
            name: of a column that exists.
            blank: what an empty cell means; None refuses it.
        """
        cells = [_label(cell) for cell in self.cells(name)]
        for row, cell in enumerate(cells):
            if not cell and blank is None:
                raise self.fail(row, f"{name} is empty")
        return tuple(cell or (blank or "") for cell in cells)

    def names(self, name: str, blank: str | None = None) -> tuple[str, ...]:
        """As `texts`, of a column of names: a number that a program wrote as 7.0 is 7."""
        return tuple(_WHOLE.sub(r"\1", text) for text in self.texts(name, blank))

    def numbers(
        self,
        name: str,
        unit: str | None = None,
        default: str | None = None,
        blank: float | None = None,
        faults: dict[int, str] | None = None,
    ) -> np.ndarray:
        """Cells as finite numbers (m,), in `unit`.

        Args:
            name: of a column that exists.
            unit: to convert to ("mm", "rad"); None for plain numbers.
            default: unit of a column that gives none; `unit` if omitted.
            blank: what an empty or NaN cell means; None refuses it.
            faults: where given, nothing is refused: rows with such a cell are put in here, with what is wrong (of
                several things the first), and their value is NaN.
        """
        wrong: dict[int, str] = {}
        values = self._parse(name, wrong)
        bad = ~np.isfinite(values) if blank is None else np.isinf(values)
        for row in map(int, np.flatnonzero(bad)):
            wrong.setdefault(row, f"{name} is {self.said(name, row)}")
        if wrong and faults is None:
            raise self.fail(min(wrong), wrong[min(wrong)])
        for row, complaint in wrong.items():
            values[row] = np.nan
            if faults is not None:
                faults.setdefault(row, complaint)
        factor = self._factor(name, unit, default or unit)
        return read_only(np.where(np.isnan(values), np.nan if blank is None else blank, values * factor))

    def flags(self, name: str, blank: bool | None = None, faults: dict[int, str] | None = None) -> np.ndarray:
        """Cells that say true or false (also yes, no, 1, 0) as booleans (m,).

        Args:
            name: of a column that exists.
            blank: what an empty cell means; None refuses it.
            faults: as in `numbers`; the value of such a cell is true.
        """
        values = np.empty(len(self), bool)
        for row, cell in enumerate(self.texts(name, None if blank is None else str(blank))):
            if cell.lower() not in _FLAGS:
                complaint = f"{name} is '{cell}', neither true nor false"
                if faults is None:
                    raise self.fail(row, complaint)
                faults.setdefault(row, complaint)
            values[row] = _FLAGS.get(cell.lower(), True)
        return read_only(values, bool)

    def said(self, name: str, row: int) -> str:
        """What a cell that holds no number says: nan, inf or empty."""
        cell = _text(self.cells(name)[row])
        return "empty" if cell.lower() in _EMPTY else cell.lower() if is_number(cell) else f"'{cell}'"

    def _parse(self, name: str, wrong: dict[int, str]) -> np.ndarray:
        """Cells as numbers, NaN where they are empty; rows that are neither, and why, are put into `wrong`."""
        cells = self.cells(name)
        if isinstance(cells, np.ndarray) and cells.dtype.kind in "fiub":
            if cells.ndim != 1:
                raise self.error(f"{self.source}: column '{name}' has {cells.shape[1:]} values a row, expected 1")
            return np.array(np.ma.filled(np.ma.asarray(cells).astype(np.float64), np.nan))
        values = np.empty(len(self))
        for row, cell in enumerate(cells):
            text = _text(cell)
            try:
                values[row] = np.nan if text.lower() in _EMPTY else float(text)
            except ValueError:
                values[row], wrong[row] = np.nan, f"{name} is '{text}', not a number"
        return values

    def _factor(self, name: str, unit: str | None, default: str | None) -> float:
        if unit is None:
            return 1.0
        given = self.units.get(self._known(name) or name) or default
        try:
            parsed = _unit(str(given))
        except (ValueError, TypeError):
            raise self.error(f"{self.source}: column '{name}': unknown unit '{given}'") from None
        try:
            return float(parsed.to(u.Unit(unit)))
        except u.UnitConversionError:
            raise self.error(f"{self.source}: column '{name}': unit '{given}' is not {_KINDS[unit]}") from None


def _unit(given: str) -> u.UnitBase:
    """A unit by its name, also in the plural and as the British spell it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return u.Unit(given, parse_strict="raise")
        except ValueError:
            word = given.strip().lower().removesuffix("s").replace("metre", "meter")
            return u.Unit(word, parse_strict="raise")


def _text(cell: object) -> str:
    if cell is None or cell is np.ma.masked:
        return ""
    return (cell.decode("utf-8", "replace") if isinstance(cell, bytes) else str(cell)).strip()


def _label(cell: object) -> str:
    """A cell as a name: whole numbers without a point, NaN as empty."""
    if isinstance(cell, float | np.floating):
        return "" if np.isnan(cell) else str(int(cell)) if float(cell).is_integer() else str(cell)
    return _text(cell)


def _list(names: Iterable[str], before: str) -> str:
    quoted = [f"'{name}'" for name in names]
    return f"{before} {', '.join(quoted[:12])}{', ...' if len(quoted) > 12 else ''}"
