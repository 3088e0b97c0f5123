"""Tables that people bring: whatever astropy reads, as an `InputTable`.

A CSV file says its units in its headings (``x [mm]``) or in comment lines above them (``# x: mm``); rows are counted as
lines of the file where it is text, else from 1. Commas, semicolons and tabs separate cells, whichever the headings have
most of. Tables of astropy are slow to import, and no plan needs one: whoever reads one does.
"""

import csv
import io
import os
import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from astropy.io import fits

from fiberplan.errors import FiberplanError
from fiberplan.tables.contents import plain_name, read_whole
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.wording import one_line

if TYPE_CHECKING:
    from astropy.table import Table

_SEPARATED = {".csv", ".tsv", ".tab"}
_HEADING = re.compile(r"(.*?)\s*\[([^\]]*)\]\s*$")  # x [mm]
_COMMENT = re.compile(r"#\s*([^:]+?)\s*:\s*(\S.*?)\s*$")  # # x: mm


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
    from astropy.table import Table

    content = content.removeprefix(b"\xef\xbb\xbf")
    options: dict[str, dict[str, Any]] = {
        ".ecsv": {"format": "ascii.ecsv", "encoding": "utf-8"},
        ".txt": {"format": "ascii", "encoding": "utf-8"},
        ".dat": {"format": "ascii", "encoding": "utf-8"},
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


def input_table(table: "Table", source: str, error: type[FiberplanError], rows: Sequence[str] = ()) -> InputTable:
    """A table of astropy; its rows are counted from 1 unless `rows` names them."""
    from astropy.table.column import Column
    from astropy.units import Quantity

    names = [name for name in table.colnames if isinstance(table[name], Column | Quantity)]  # not sky coordinates
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
    from astropy.table import Table

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
