"""Values of each positioner: what the file says for all, and what tables say of one, the later table winning."""

from collections.abc import Sequence
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
    """Values of positioners by column, (n,) each, in mm, rad, s and what is made of them; complaints are collected."""

    def __init__(self, ids: Sequence[str], tables: Sequence[InputTable]):
        self.ids = tuple(ids)
        self.index = {id_: i for i, id_ in enumerate(self.ids)}
        self.complaints: list[Complaint] = []
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
    ) -> np.ndarray:
        """A column of all tables (n,).

        Args:
            name: of the column.
            field: what the instrument file calls the same value for all.
            unit: "mm", "rad", "rad/s" or "rad/s2".
            common: the value for all, as people write it (degrees); None: none is given.
            optional: where nothing is given the value is NaN, which is a complaint otherwise.
        """
        self.used.add(name)
        values = np.full(len(self.ids), np.nan)
        if common is not None:
            values[:] = np.radians(common) if unit in ("rad", "rad/s", "rad/s2") else common
        for table, rows in zip(self._tables, self._rows, strict=True):
            if name in table:
                cells = table.numbers(name, unit, unit and _TYPED[unit], blank=np.nan)
                given = (rows >= 0) & np.isfinite(cells[rows])
                values[given] = cells[rows[given]]
        missing = np.isnan(values)
        if missing.any() and not optional:
            self._missing(name, field, self.ids[int(np.argmax(missing))], bool(missing.all()))
        return values

    def _missing(self, name: str, field: Path, id_: str, everywhere: bool) -> None:
        sources = [f"column '{name}' in {table.source}" for table in self._tables]
        if not sources:
            self.complaints.append(Complaint(field, "is missing"))
        elif everywhere:
            self.complaints.append(Complaint(field, f"is missing, and there is no {' or '.join(sources)}"))
        else:
            self.complaints.append(
                Complaint(field, f"is missing, and {' and '.join(sources)} says none for positioner '{id_}'")
            )

    def flags(self, name: str) -> np.ndarray:
        """A column of true and false (n,); true where nothing is given."""
        self.used.add(name)
        values = np.ones(len(self.ids), bool)
        for table, rows in zip(self._tables, self._rows, strict=True):
            if name in table:
                values = np.where(rows >= 0, table.flags(name, blank=True)[rows], values)
        return values

    def check(self, bad: np.ndarray, names: Sequence[str], field: Path, text: str, *shown: np.ndarray) -> None:
        """Refuse the first positioner that is `bad` (n,).

        Args:
            bad: (n,)
            names: columns whose values do not go together; the table that gives one of them is blamed.
            field: what the instrument file calls the first of them, blamed if no table does.
            text: what is wrong, with a place for each value `shown`.
            shown: (n,) each.

        Raises:
            InstrumentError: of a value in a table; one in the instrument file is a complaint.
        """
        if not bad.any():
            return
        i = int(np.argmax(bad))
        said = text.format(*(f"{values[i]:.6g}" for values in shown))
        for name in names:
            for table, rows in zip(reversed(self._tables), reversed(self._rows), strict=True):
                row = int(rows[i])
                if row >= 0 and name in table and table.texts(name, "")[row] not in ("", "nan"):
                    column = "" if name == "positioner" else f"{name}: "
                    raise table.fail(row, f"positioner '{self.ids[i]}': {column}{said}")
        self.complaints.append(Complaint(field, said))

    def unused(self) -> list[str]:
        """Notes on columns that nothing asked for.

        Raises:
            InstrumentError: one that is nearly called as a column that something did ask for.
        """
        notes = []
        for table in self._tables:
            extra = [name for name in table.columns if name not in self.used]
            for name in extra:
                halves = [known for known in sorted(self.used) if known.startswith(f"{name}_")]
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
