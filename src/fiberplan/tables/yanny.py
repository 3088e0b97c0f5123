"""Yanny parameter files (``.par``), the text tables of SDSS: keywords, C-like struct definitions, and rows.

A row begins with the name of its struct; values are words, "quoted words" or {arrays}. Only what the tables of
positioners need is read: one struct's rows, as text, with the line each stands on.
Source: the format description in SDSS' ``yanny`` documentation.
"""

import re
from pathlib import Path

from fiberplan.errors import FiberplanError
from fiberplan.tables.table_reader import InputTable, read_text

_TYPEDEF = re.compile(r"typedef\s+struct\s*\{(.*?)\}\s*(\w+)\s*;", re.DOTALL | re.IGNORECASE)
_FIELD = re.compile(r"\w+\s+(\w+)\s*(?:\[[^\]]*\]\s*)*;")
_TOKEN = re.compile(r'"((?:[^"\\]|\\.)*)"|\{([^}]*)\}|(\S+)')


def read_yanny(path: Path, struct: str, error: type[FiberplanError], content: bytes | None = None) -> InputTable:
    """The rows of one struct of a file, of which `content` may have been read already.

    Raises:
        error: no such file or struct, or a row with too few or too many values (its line is named).
    """
    lines = read_text(path, error, content)
    bare = "\n".join("" if line.lstrip().startswith("#") else line for line in lines)
    fields = next(
        (_FIELD.findall(body) for body, name in _TYPEDEF.findall(bare) if name.upper() == struct.upper()), None
    )
    if not fields:
        raise error(f"{path}: no struct {struct} is defined: truncated, or not the Yanny file expected here")
    rows, where = [], []
    for number, line in enumerate(lines, 1):
        word, *rest = line.split(maxsplit=1)[:2] or [""]
        if word.upper() != struct.upper():
            continue
        values = [quoted or array or plain for quoted, array, plain in _TOKEN.findall("".join(rest))]
        if len(values) != len(fields):
            raise error(f"{path}: line {number}: {len(values)} values for the {len(fields)} columns of {struct}")
        rows.append(values)
        where.append(f"line {number}")
    columns = {name: [row[k] for row in rows] for k, name in enumerate(fields)}
    return InputTable(str(path), columns, {}, tuple(where), error)
