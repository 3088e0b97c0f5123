"""ECSV tables by their text alone: columns and units, without the rest of a header that may be far larger.

astropy parses the whole YAML header; a DESI focal-plane file keeps a thousand outlines in it, which takes seconds.
"""

import csv
import re
from pathlib import Path

from fiberplan.errors import FiberplanError
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_text

_DATATYPE = re.compile(r"#\s*-\s*\{name:\s*([^,}]+),(?:\s*unit:\s*([^,}]+),)?")
_DELIMITER = re.compile(r"#\s*delimiter:\s*['\"]?([, ])['\"]?\s*$")


def read_ecsv(path: Path, error: type[FiberplanError], content: bytes | None = None) -> InputTable:
    """An ECSV table as text.

    Raises:
        error: no such file, or rows that do not fit the headings; the line is named.
    """
    lines = read_text(path, error, content)
    units: dict[str, str] = {}
    delimiter = " "
    for line in lines:
        if not line.startswith("#"):
            break
        if match := _DATATYPE.match(line):
            if match[2]:
                units[match[1].strip()] = match[2].strip()
        elif match := _DELIMITER.match(line):
            delimiter = match[1]
    numbered = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if len(numbered) < 2:
        raise error(f"{path}: the table has no rows")
    try:
        names, *cells = list(csv.reader((line for _, line in numbered), delimiter=delimiter, strict=True))
    except csv.Error as problem:
        raise error(f"{path}: is not an ECSV table ({problem})") from None
    if len(cells) != len(numbered) - 1:
        raise error(f"{path}: a quoted cell runs over more than one line")
    for (number, _), row in zip(numbered[1:], cells, strict=True):
        if len(row) != len(names):
            raise error(f"{path}: line {number}: {len(row)} values for {len(names)} columns: is the file truncated?")
    columns = dict(zip(names, map(list, zip(*cells, strict=True)), strict=True))
    return InputTable(str(path), columns, units, tuple(f"line {number}" for number, _ in numbered[1:]), error)
