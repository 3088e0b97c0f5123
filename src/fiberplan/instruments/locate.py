"""Where a TOML file says something: the line of a field, for errors.

``tomllib`` gives values without their places, so the text is cut into statements here, which is easy once it is known
to be valid TOML: a statement ends with a line outside all strings and brackets.
"""

import re
import tomllib
from collections.abc import Iterator, Sequence

Path = tuple[str | int, ...]

_TOKEN = re.compile(
    r"""\"\"\"(?:\\.|[^\\])*?\"{3,5}|'''.*?'{3,5}|"(?:\\.|[^"\\\n])*"|'[^'\n]*'|\#[^\n]*|[\[\]{}\n]""", re.S
)


class Lines:
    """Lines of the fields of a valid TOML text."""

    def __init__(self, text: str):
        self._line: dict[Path, int] = {}
        table: Path = ()
        arrays: dict[Path, int] = {}  # array of tables -> index of the last one
        for line, statement in _statements(text):
            keys = _keys(tomllib.loads(statement))
            if not statement.startswith("["):
                self._note(table, keys, line)
                continue
            table = ()
            for k, key in enumerate(keys):
                table += (key,)
                if statement.startswith("[[") and k == len(keys) - 1:
                    arrays[table] = arrays.get(table, -1) + 1
                self._line.setdefault(table, line)
                if table in arrays:
                    table += (arrays[table],)
            self._note(table, (), line)

    def _note(self, table: Path, keys: Sequence[str], line: int) -> None:
        for k in range(len(keys) + 1):
            self._line.setdefault((*table, *keys[:k]), line)

    def of(self, field: Path) -> int | None:
        """The line of a field, or of the smallest part of the file around it that has one; None for the whole file."""
        for k in range(len(field), 0, -1):
            if field[:k] in self._line:
                return self._line[field[:k]]
        return None


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Line and text of every header and every key with its value."""
    depth, begin, line, first = 0, 0, 1, 1
    for token in _TOKEN.finditer(text + "\n"):
        found = token.group()
        depth += (found in "[{") - (found in "]}")
        line += found.count("\n")
        if found == "\n" and depth == 0:
            statement = text[begin : token.start()].strip()
            if statement and not statement.startswith("#"):
                yield first, statement
            begin, first = token.end(), line


def _keys(parsed: dict) -> tuple[str, ...]:
    """The dotted key that a single statement gives a value to; an inline table is entered where it has one key."""
    keys: tuple[str, ...] = ()
    while isinstance(parsed, dict) and len(parsed) == 1:
        ((key, parsed),) = parsed.items()
        keys += (key,)
        parsed = parsed[0] if isinstance(parsed, list) and len(parsed) == 1 and isinstance(parsed[0], dict) else parsed
    return keys
