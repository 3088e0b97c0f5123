"""Values of each positioner: what the file says for all, and what tables say of one, the later table winning."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.instruments.complaints import Complaint
from fiberplan.instruments.definition_model import Definition, Positioner
from fiberplan.instruments.locate import Lines, Path
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_table
from fiberplan.tables.wording import nearest

_TYPED = {"mm": "mm", "rad": "deg", "rad/s": "deg/s", "rad/s2": "deg/s2"}  # unit of a column -> of what people write
_CLOSE = 0.8  # of 1: a column spelt like this one is a mistake, and not one for somebody else


class PositionerValues:
    """Values of positioners by column, (n,) each, in mm, rad, s and what is made of them; complaints are collected.

    Where cells that cannot be used are to be dropped, `faults` gets the positioners that have one, and the usual value
    (unless it is said otherwise the median of all others) stands in for it.
    """

    def __init__(self, ids: Sequence[str], tables: Sequence[InputTable], drop: bool = False):
        self.ids = tuple(ids)
        self.index = {id_: i for i, id_ in enumerate(self.ids)}
        self.complaints: list[Complaint] = []
        self.faults: dict[int, str] = {}  # positioner -> what is wrong, and where
        self.drop = drop
        self.used = {"positioner"}
        self._tables = tables
        rows = [row_of(table) for table in tables]
        self._rows = [np.array([of.get(id_, -1) for id_ in self.ids], np.int64) for of in rows]  # -1: not in the table

    def column(
        self,
        name: str,
        field: Path,
        unit: str | None = None,
        common: float | np.ndarray | None = None,
        optional: bool = False,
        usual: Callable[[np.ndarray], float] = np.median,
    ) -> np.ndarray:
        """A column of all tables (n,).

        Args:
            name: of the column.
            field: what the instrument file calls the same value for all.
            unit: "mm", "rad", "rad/s" or "rad/s2".
            common: the value for all, as people write it (degrees); None: none is given.
            optional: where nothing is given the value is NaN, which is a complaint otherwise.
            usual: of the cells that can be used, what stands in for one that cannot.
        """
        self.used.add(name)
        values = np.full(len(self.ids), np.nan)
        if common is not None:
            values[:] = np.radians(common) if unit in ("rad", "rad/s", "rad/s2") else common
        for table, rows in zip(self._tables, self._rows, strict=True):
            if name in table:
                wrong: dict[int, str] | None = {} if self.drop else None
                cells = table.numbers(name, unit, unit and _TYPED[unit], blank=np.nan, faults=wrong)
                given = (rows >= 0) & np.isfinite(cells[rows])
                values[given] = cells[rows[given]]
                self._found_wrong(table, rows, wrong)
        missing = np.isnan(values)
        if missing.any() and not optional:
            if self.drop and not missing.all():
                for i in map(int, np.flatnonzero(missing)):
                    row = self._row(i)
                    self.faults.setdefault(i, f"{row}: {name} is empty" if row else f"no table says its {name}")
                values[missing] = usual(values[~missing])
            else:
                self._missing(name, field, int(np.argmax(missing)), bool(missing.all()))
        return values

    def given(self, name: str) -> bool:
        """Whether a table has such a column."""
        return any(name in table for table in self._tables)

    def _found_wrong(self, table: InputTable, rows: np.ndarray, wrong: Mapping[int, str] | None) -> None:
        """Note whose rows (n,) of a table have something wrong."""
        for row, text in (wrong or {}).items():
            for i in map(int, np.flatnonzero(rows == row)):
                self.faults.setdefault(i, f"{table.rows[row]}: {text}")

    def _row(self, i: int) -> str:
        """The row of a positioner in the last table that has one; "" if none has."""
        found = [table.rows[rows[i]] for table, rows in zip(self._tables, self._rows, strict=True) if rows[i] >= 0]
        return found[-1] if found else ""

    def _missing(self, name: str, field: Path, i: int, everywhere: bool) -> None:
        sources = [f"column '{name}' in {table.source}" for table in self._tables]
        if not sources:
            self.complaints.append(Complaint(field, "is missing"))
        elif everywhere:
            self.complaints.append(Complaint(field, f"is missing, and there is no {' or '.join(sources)}"))
        else:
            who = f"positioner '{self.ids[i]}'" + (f" in {row}" if (row := self._row(i)) else "")
            self.complaints.append(Complaint(field, f"is missing, and {' and '.join(sources)} says none for {who}"))

    def flags(self, name: str) -> np.ndarray:
        """A column of true and false (n,); true where nothing is given."""
        self.used.add(name)
        values = np.ones(len(self.ids), bool)
        for table, rows in zip(self._tables, self._rows, strict=True):
            if name in table:
                wrong: dict[int, str] | None = {} if self.drop else None
                values = np.where(rows >= 0, table.flags(name, blank=True, faults=wrong)[rows], values)
                self._found_wrong(table, rows, wrong)
        return values

    def check(self, bad: np.ndarray, names: Sequence[str], field: Path, text: str, *shown: np.ndarray) -> np.ndarray:
        """Refuse the first positioner that is `bad` (n,), or note all of them, and tell which of them (n,) are noted.

        Args:
            bad: (n,)
            names: columns whose values do not go together; the table that gives one of them is blamed.
            field: what the instrument file calls the first of them, blamed if no table does.
            text: what is wrong, with a place for each value `shown`.
            shown: (n,) each.

        Raises:
            InstrumentError: of a value in a table; one in the instrument file is a complaint.
        """
        noted = np.zeros(len(self.ids), bool)
        for i in map(int, np.flatnonzero(bad)):
            said = text.format(*(f"{values[i]:.6g}" for values in shown))
            blamed = self._blamed(names, i)
            if blamed is None:
                self.complaints.append(Complaint(field, said))
                break
            (table, row, name), noted[i] = blamed, True
            column = "" if name == "positioner" else f"{name}: "
            if not self.drop:
                raise table.fail(row, f"positioner '{self.ids[i]}': {column}{said}")
            self.faults.setdefault(i, f"{table.rows[row]}: {column}{said}")
        return noted

    def _blamed(self, names: Sequence[str], i: int) -> tuple[InputTable, int, str] | None:
        """The table, its row and the column that says one of these values of positioner i; None if no table does."""
        for name in names:
            for table, rows in zip(reversed(self._tables), reversed(self._rows), strict=True):
                row = int(rows[i])
                if row >= 0 and name in table and table.texts(name, "")[row] not in ("", "nan"):
                    return table, row, name
        return None

    def unused(self) -> list[str]:
        """Notes on columns that nothing asked for.

        Raises:
            InstrumentError: one that is nearly called as a column that something did ask for.
        """
        notes = []
        for table in self._tables:
            known = {used.lower() for used in self.used}
            extra = [name for name in table.columns if name.lower() not in known]
            for name in extra:
                halves = [used for used in sorted(self.used) if used.startswith(f"{name}_")]
                if meant := nearest(name, halves, 0.0) or nearest(name, self.used, _CLOSE):
                    raise InstrumentError(f"{table.source}: column '{name}' is not known{meant}")
            if extra:
                notes.append(f"not used of {FilePath(table.source).name}: column {', '.join(extra)}")
        return notes


def row_of(table: InputTable) -> dict[str, int]:
    """Positioner id -> row.

    Raises:
        InstrumentError: no such column, or a positioner that has two rows.
    """
    table.require("positioner")
    rows: dict[str, int] = {}
    for row, id_ in enumerate(table.texts("positioner")):
        if (first := rows.setdefault(id_, row)) != row:
            raise table.fail(row, f"positioner '{id_}' was already given in {table.rows[first]}")
    return rows


def positioner_tables(definition: Definition, path: FilePath, text: str) -> list[InputTable]:
    """The tables of an instrument file at `path`, and of that text: the one it names, and then the one it contains."""
    tables = []
    if definition.positioners is not None:
        tables.append(read_table(path.parent / definition.positioners, InstrumentError))
    if definition.positioner:
        tables.append(_inline(definition.positioner, path, Lines(text)))
    return tables


def _inline(positioners: Sequence[Positioner], path: FilePath, lines: Lines) -> InputTable:
    """Positioners listed in the instrument file, as a table."""
    cells: list[dict[str, Any]] = [positioner.cells() for positioner in positioners]
    columns = {name: [row.get(name) for row in cells] for name in dict.fromkeys(k for row in cells for k in row)}
    rows = tuple(f"line {lines.of(('positioner', k))}" for k in range(len(cells)))
    return InputTable(str(path), columns, {}, rows, InstrumentError)
