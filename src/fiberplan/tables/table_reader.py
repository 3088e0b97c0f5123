"""Tables that people bring: whatever astropy reads, with errors that name file, row, column and value.

Values are converted to the unit asked for at this door. A CSV file says its units in its headings (``x [mm]``) or in
comment lines above them (``# x: mm``); rows are counted as lines of the file where it is text, else from 1. Columns are
found whatever the case of their names; commas, semicolons and tabs separate cells, whichever the headings have most of.
"""

import csv
import difflib
import io
import os
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from astropy import units as u
from astropy.io import fits
from astropy.table import Table
from astropy.table.column import Column

from fiberplan.arrays import read_only
from fiberplan.errors import FiberplanError
from fiberplan.tables.contents import plain_name, read_whole

_KINDS = {"mm": "a length", "rad": "an angle", "rad/s": "a speed of rotation", "rad/s2": "an angular acceleration"}
_KINDS |= {"rad/yr": "a proper motion", "yr": "a time"}
_SEPARATED = {".csv", ".tsv", ".tab"}
_FLAGS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
_HEADING = re.compile(r"(.*?)\s*\[([^\]]*)\]\s*$")  # x [mm]
_EMPTY = {"", "--", "null", "none", "n/a", "na", "masked"}  # what stands in a cell for no number
_WHOLE = re.compile(r"^(\d+)\.0+$")
_COMMENT = re.compile(r"#\s*([^:]+?)\s*:\s*(\S.*?)\s*$")  # # x: mm


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
        return "empty" if cell.lower() in _EMPTY else cell.lower() if _is_number(cell) else f"'{cell}'"

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


def read_table(
    path: str | os.PathLike,
    error: type[FiberplanError],
    content: bytes | None = None,
    allow_empty: bool = False,
    wanted: Sequence[Sequence[str]] = (),
    form: str = "",
) -> InputTable:
    """Read a table in any format that astropy knows.

    Args:
        path: of the file; its ending says the format.
        error: what to raise.
        content: of the file, where it has been read already.
        allow_empty: a table of headings only is one.
        wanted: of a FITS file with several tables, the first that has all columns of one of these.
        form: ending that says the format, whatever the file is called.

    Raises:
        error: no such file, not a table, truncated, or without rows.
    """
    path = Path(path)
    content = read_whole(path, error) if content is None else content
    suffix = form or plain_name(path).suffix.lower()
    if suffix in (".fits", ".fit") and content.startswith(b"SIMPLE  ="):
        content = _chosen_table(content, wanted)
    is_csv = suffix in _SEPARATED or (suffix in (".txt", ".dat") and _is_separated(content))
    table = _read_csv(path, content, error) if is_csv else _read_any(path, suffix, content, error)
    if not len(table) and not allow_empty:
        raise error(f"{path}: the table has no rows")
    return table


def _is_separated(content: bytes) -> bool:
    """Whether semicolons, tabs or commas separate the headings of a text table."""
    if content.lstrip(b"\xef\xbb\xbf").startswith(b"# %ECSV"):
        return False
    lines = content[:65536].decode("utf-8-sig", "replace").splitlines()
    heading = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    return any(mark in heading.strip() for mark in ",;\t")


def _chosen_table(content: bytes, wanted: Sequence[Sequence[str]]) -> bytes:
    """A FITS file with only the first table that has all columns of one of `wanted`; as it is if none has."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            with fits.open(io.BytesIO(content), memmap=False) as hdus:
                tables = [hdu for hdu in hdus if isinstance(hdu, fits.BinTableHDU | fits.TableHDU)]
                names = [{name.lower() for name in hdu.columns.names} for hdu in tables]
                found = next((k for k, has in enumerate(names) if any(has >= set(want) for want in wanted)), 0)
                if len(tables) < 2 or not found:
                    return content
                out = io.BytesIO()
                fits.HDUList([fits.PrimaryHDU(), tables[found]]).writeto(out)
                return out.getvalue()
        except Exception:  # astropy raises what it likes on a damaged file; the reader says so
            return content


def read_text(path: Path, error: type[FiberplanError], content: bytes | None = None) -> list[str]:
    """Lines of a text file, of which `content` may have been read already."""
    try:
        return (read_whole(path, error) if content is None else content).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise error(f"{path}: is not a text file") from None


def nearest(name: str, known: Iterable[str], cutoff: float = 0.5) -> str:
    """A question that suggests the closest known name, whatever its case, or nothing if none is close."""
    if _is_number(name):
        return ""  # nobody misspells one number as another
    lower = {other.lower(): other for other in known}
    close = difflib.get_close_matches(name.lower(), list(lower), n=1, cutoff=cutoff)
    return f"; did you mean '{lower[close[0]]}'?" if close else ""


def one_line(text: object) -> str:
    """The first line of a message from elsewhere, at most 200 characters of it."""
    lines = [line.strip() for line in str(text).splitlines() if line.strip()]
    return lines[0][:200] if lines else type(text).__name__


def _read_csv(path: Path, content: bytes, error: type[FiberplanError]) -> InputTable:
    """A CSV file as text, so that errors can quote it."""
    numbered = [(k, line) for k, line in enumerate(read_text(path, error, content), 1) if line.strip()]
    comments = [line.strip() for _, line in numbered if line.lstrip().startswith("#")]
    lines = [(k, line) for k, line in numbered if not line.lstrip().startswith("#")]
    if not lines:
        raise error(f"{path}: the file is empty")
    units = {match[1]: match[2] for comment in comments if (match := _COMMENT.match(comment))}
    mark = max(",;\t", key=lines[0][1].count)
    try:
        names, *cells = [next(csv.reader([line], strict=True, delimiter=mark)) for _, line in lines]
    except csv.Error as problem:
        raise error(f"{path}: is not a CSV table ({one_line(problem)})") from None
    names = [name.strip() for name in names]
    for k, name in enumerate(names):
        if match := _HEADING.match(name):
            names[k], units[match[1]] = match[1], match[2]
    twice = next((name for k, name in enumerate(names) if name and name in names[:k]), None)
    if twice is not None:
        raise error(f"{path}: line {lines[0][0]}: column '{twice}' appears twice")
    for (number, _), row in zip(lines[1:], cells, strict=True):
        if len(row) != len(names):
            raise error(f"{path}: line {number}: {len(row)} values for {len(names)} columns")
    columns = {name: [row[k] for row in cells] for k, name in enumerate(names)}
    return InputTable(str(path), columns, units, tuple(f"line {number}" for number, _ in lines[1:]), error)


def _read_any(path: Path, suffix: str, content: bytes, error: type[FiberplanError]) -> InputTable:
    """Any other table, by astropy."""
    content = content.removeprefix(b"\xef\xbb\xbf")
    options: dict[str, dict[str, Any]] = {
        ".ecsv": {"format": "ascii.ecsv"},
        ".txt": {"format": "ascii"},
        ".dat": {"format": "ascii"},
        ".fits": {"format": "fits", "memmap": False},
        ".fit": {"format": "fits", "memmap": False},
    }
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            known = options.get(suffix)
            table = Table.read(io.BytesIO(content), **known) if known else Table.read(path)
        except Exception as problem:  # each of astropy's readers raises what it likes
            why = "no format that is known" if "Format could not be identified" in str(problem) else one_line(problem)
            raise error(f"{path}: cannot be read as a table ({why})") from None
    if any("truncated" in str(warning.message) for warning in caught):
        raise error(f"{path}: the file is truncated")
    return input_table(table, str(path), error, _line_labels(suffix, content, len(table)))


def input_table(table: Table, source: str, error: type[FiberplanError], rows: Sequence[str] = ()) -> InputTable:
    """A table of astropy; its rows are counted from 1 unless `rows` names them."""
    names = [name for name in table.colnames if isinstance(table[name], Column | u.Quantity)]  # not sky coordinates
    columns = {name: _cells(table[name].value) for name in names}
    units = {name: str(table[name].unit) for name in names if table[name].unit is not None}
    rows = tuple(rows) or tuple(f"row {k + 1}" for k in range(len(table)))
    return InputTable(source, columns, units, rows, error, table.meta)


def given_table(
    given: Any, source: str, what: str, error: type[FiberplanError], wanted: Sequence[Sequence[str]] = ()
) -> InputTable:
    """A table of astropy, named `source`, or that of a file's path.

    Raises:
        error: neither of these, told as `what` it may be, or a file that cannot be read; one line.
    """
    if isinstance(given, Table):
        return input_table(given, source, error)
    if isinstance(given, str | os.PathLike):
        return read_table(given, error, wanted=wanted)
    raise error(f"{what} or the path of a file, not {type(given).__name__}")


def _cells(values: Any) -> np.ndarray:
    """Values as an array of numpy's masked kind, also of astropy's."""
    unmasked = getattr(values, "unmasked", None)
    return np.ma.asarray(values) if unmasked is None else np.ma.array(unmasked, mask=values.mask)


def _line_labels(suffix: str, content: bytes, count: int) -> tuple[str, ...]:
    """Lines of an ECSV file that hold its rows; none where that cannot be told."""
    if suffix != ".ecsv":
        return ()
    lines = content.decode("utf-8").splitlines()
    holding = [k for k, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    return tuple(f"line {k}" for k in holding[1:]) if len(holding) == count + 1 else ()


def _text(cell: object) -> str:
    if cell is None or cell is np.ma.masked:
        return ""
    return (cell.decode("utf-8", "replace") if isinstance(cell, bytes) else str(cell)).strip()


def _label(cell: object) -> str:
    """A cell as a name: whole numbers without a point, NaN as empty."""
    if isinstance(cell, float | np.floating):
        return "" if np.isnan(cell) else str(int(cell)) if float(cell).is_integer() else str(cell)
    return _text(cell)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _list(names: Iterable[str], before: str) -> str:
    quoted = [f"'{name}'" for name in names]
    return f"{before} {', '.join(quoted[:12])}{', ...' if len(quoted) > 12 else ''}"
