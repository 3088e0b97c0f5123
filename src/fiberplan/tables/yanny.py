"""Yanny parameter files (``.par``), the text tables of SDSS: keywords, C-like struct definitions, and rows.

A row begins with the name of its struct; values are words, "quoted words" or {arrays}. A line that ends in a backslash
goes on in the next one; what follows a ``#`` outside quotes is a comment; ``{}``, ``{{}}`` and ``""`` are empty. Only
what the tables of positioners need is read: one struct's rows, as text, with the line each begins on, and keywords.
Source: the format description in SDSS' ``yanny`` documentation.
"""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from fiberplan.errors import FiberplanError
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_text

_STRUCT = re.compile(r"typedef\s+struct\s*\{(.*?)\}\s*(\w+)\s*;", re.DOTALL | re.IGNORECASE)
_TYPEDEF = re.compile(r"typedef\s+(?:struct|enum)\s*\{.*?\}\s*\w+\s*;", re.DOTALL | re.IGNORECASE)
_FIELD = re.compile(r"\w+\s+(\w+)\s*(?:\[[^\]]*\]\s*|<[^>]*>\s*)*;")
_COMMENT = re.compile(r"#[^\n]*")
_TOKEN = re.compile(r'"((?:[^"\\]|\\.)*)"|\{\s*\{\s*(\})\s*\}|\{([^}]*)\}|(#.*)|(\S+)')


def read_yanny(path: Path, struct: str, error: type[FiberplanError], content: bytes | None = None) -> InputTable:
    """The rows of one struct of a file, of which `content` may have been read already; keywords are its `meta`.

    Raises:
        error: no such file or struct, or a row with too few or too many values (its line is named).
    """
    lines = read_text(path, error, content)
    bare = _COMMENT.sub("", "\n".join(lines))
    fields = next((_FIELD.findall(body) for body, name in _STRUCT.findall(bare) if name.upper() == struct.upper()), [])
    if not fields:
        raise error(f"{path}: no struct {struct} is defined: truncated, or not the Yanny file expected here")
    defined = {name.upper() for _, name in _STRUCT.findall(bare)}
    rows, where = [], []
    keywords: dict[str, str] = {}
    for number, line in _joined(lines, bare, path, error):
        word, rest = (*line.split(maxsplit=1), "")[:2]
        if word.upper() == struct.upper():
            values = _values(rest)
            if len(values) != len(fields):
                raise error(f"{path}: line {number}: {len(values)} values for the {len(fields)} columns of {struct}")
            rows.append(values)
            where.append(f"line {number}")
        elif word.upper() not in defined:
            keywords.setdefault(word, " ".join(_values(rest)))
    columns = {name: [row[k] for row in rows] for k, name in enumerate(fields)}
    return InputTable(str(path), columns, {}, tuple(where), error, keywords)


def _joined(lines: Sequence[str], bare: str, path: Path, error: type[FiberplanError]) -> Iterator[tuple[int, str]]:
    """Lines outside definitions, put together with those that they go on in: the first one's number, and text."""
    defining = {
        bare.count("\n", 0, match.start()) + 1 + k
        for match in _TYPEDEF.finditer(bare)
        for k in range(match.group().count("\n") + 1)
    }
    whole, first = "", 0
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if number in defining or (not whole and (not text or text.startswith("#"))):
            continue
        first = first if whole else number
        whole += text.removesuffix("\\") + " "
        if not text.endswith("\\"):
            yield first, whole
            whole = ""
    if whole:
        raise error(f"{path}: line {first}: goes on in a line that is not there: is the file truncated?")


def _values(text: str) -> list[str]:
    """What a row says after its name, comments left out."""
    values = []
    for quoted, _, array, comment, plain in _TOKEN.findall(text):
        if comment:
            break
        values.append(re.sub(r"\\(.)", r"\1", quoted) or array.strip() or plain)
    return values
