"""Instruments written by hand: a TOML file of nominal values, each with its source beside it, and tables beside it.

What a file does not know is refused. What checks its fields is slow to import, and a plan read from its file needs none
of it: whoever reads a definition imports it.
"""

import os
import re
import tomllib
from pathlib import Path
from typing import Any, Literal

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.instruments.formats import focal_plane_format
from fiberplan.tables.contents import plain_name
from fiberplan.tables.table_reader import read_text
from fiberplan.tables.wording import one_line

_AT = re.compile(r"(.*) \(at (line \d+, column \d+|end of document)\)$")


def _usable(path: Path) -> FocalPlane:
    return read_definition(path, "drop")


@focal_plane_format(
    "toml", "a .toml file written by hand", lambda path: plain_name(path).suffix.lower() == ".toml", _usable
)
def read_definition(path: str | os.PathLike, conflicts: Literal["raise", "drop"] = "raise") -> FocalPlane:
    """The focal plane that a TOML file describes.

    With "drop", a positioner with a cell of a table that cannot be used is offline, and named; one of which nothing
    says where it is, is left out.

    Raises:
        InstrumentError: no such file, not TOML (line and column are named), or a field or table that cannot be used
            (file, line, field and value are named).
    """
    from pydantic import ValidationError

    from fiberplan.instruments.complaints import DefinitionError, complaints_of, message
    from fiberplan.instruments.definition import plane_of
    from fiberplan.instruments.definition_model import Definition
    from fiberplan.instruments.positioner_table import positioner_tables

    path = Path(path)
    text = "\n".join(read_text(path, InstrumentError))
    said = _parsed(path, text)
    try:
        definition = Definition.model_validate(said)
        return plane_of(definition, path, positioner_tables(definition, path, text), conflicts == "drop")
    except ValidationError as error:
        raise InstrumentError(f"{path}: {message(complaints_of(error, said), text, said)}") from None
    except DefinitionError as error:
        raise InstrumentError(f"{path}: {message(error.complaints, text, said)}") from None


def _parsed(path: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = _AT.match(one_line(error))
        what, where = found.groups() if found else (one_line(error), "somewhere")
        raise InstrumentError(f"{path}: {where}: is not valid TOML ({what[0].lower()}{what[1:]})") from None
    except (RecursionError, ValueError):  # brackets in brackets without end, a whole number of thousands of digits
        raise InstrumentError(f"{path}: is not a usable TOML file (nested too deeply, or a number too long)") from None
