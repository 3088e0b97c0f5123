"""ESO parameter files (PAF), the ``.cfg`` text of VLT instruments: one ``KEYWORD value;`` a line, ``#`` for comments.

A value is a number or "quoted text", a keyword alone (``PAF.HDR.START;``) a mark. Every value remembers its line, so
that what cannot be used is named by it. Source: the headers of the MOONS configuration files themselves.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from fiberplan.errors import FiberplanError
from fiberplan.tables.table_reader import read_text
from fiberplan.tables.wording import nearest

_STATEMENT = re.compile(r'([A-Za-z][\w.]*)\s*("[^"]*"|[^\s;"#]*)\s*;\s*(?:#.*)?$')


class Value(NamedTuple):
    """A value as the file has it."""

    text: str
    line: int


@dataclass(frozen=True, eq=False)
class ParameterFile:
    """The statements of one file, by keyword."""

    source: str  #: the file, as errors name it
    values: Mapping[str, Value]
    error: type[FiberplanError]  #: what to raise

    def fail(self, keyword: str, complaint: str) -> FiberplanError:
        """The error to raise about a keyword that is there."""
        return self.error(f"{self.source}: line {self.values[keyword].line}: {keyword} {complaint}")

    def _value(self, keyword: str) -> Value:
        if keyword not in self.values:
            raise self.error(f"{self.source}: no keyword {keyword}{nearest(keyword, self.values)}")
        return self.values[keyword]

    def number(self, keyword: str, least: float = -math.inf) -> float:
        """A finite number of at least `least`."""
        text = self._value(keyword).text
        try:
            number = float(text)
        except ValueError:
            raise self.fail(keyword, f"is '{text}', not a number") from None
        if not math.isfinite(number):
            raise self.fail(keyword, f"is {text}, not a finite number")
        if number < least:
            raise self.fail(keyword, f"is {text}, expected {least:g} or more")
        return number

    def flag(self, keyword: str) -> bool:
        """Whether a "T" or "F" is a "T"."""
        text = self._value(keyword).text
        if text not in ("T", "F"):
            raise self.fail(keyword, f"is '{text}', expected T or F")
        return text == "T"

    def numbered(self, prefix: str) -> list[str]:
        """Numbers k, as written, of which the file has keywords ``<prefix><k>.<...>``, in its order."""
        found = re.compile(re.escape(prefix) + r"(\d+)\.")
        return list(dict.fromkeys(match[1] for keyword in self.values if (match := found.match(keyword))))


def read_paf(path: Path, error: type[FiberplanError]) -> ParameterFile:
    """All statements of a PAF file.

    Raises:
        error: no such file, a line that is no statement, or a keyword given twice; its line is named.
    """
    values: dict[str, Value] = {}
    for number, line in enumerate(read_text(path, error), 1):
        if not (text := line.strip()) or text.startswith("#"):
            continue
        match = _STATEMENT.match(text)
        if match is None:
            missing = "" if ";" in text.split("#")[0] else " (no ';': is the file truncated?)"
            raise error(f"{path}: line {number}: expected 'KEYWORD value;', got '{text[:60]}'{missing}")
        keyword = match[1]
        if keyword in values:
            raise error(f"{path}: line {number}: {keyword} was already given in line {values[keyword].line}")
        values[keyword] = Value(match[2].strip('"').strip(), number)
    return ParameterFile(str(path), values, error)
