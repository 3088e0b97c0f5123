"""What is wrong with an instrument file, in our own words: its line, the field, the value, and what it must be."""

import typing
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from fiberplan.errors import InstrumentError
from fiberplan.instruments.definition_model import Definition
from fiberplan.instruments.locate import Lines, Path
from fiberplan.tables.wording import nearest, one_line

_SHOWN = 4  # complaints said in full
_WORDS = {
    "missing": "is missing",
    "extra_forbidden": "no such field",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "string_type": "must be text",
    "string_too_short": "must not be empty",
    "bool_type": "must be true or false",
    "list_type": "must be a list",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "tuple_type": "must be two numbers",
    "greater_than": "must be above {gt:g}",
    "greater_than_equal": "must be {ge:g} or more",
    "less_than_equal": "must be {le:g} or less",
    "too_short": "must have {min_length} or more entries",
    "too_long": "must have {max_length} entries, not {actual_length}",
    "literal_error": "must be {expected}",
    "union_tag_invalid": "must be one of {expected_tags}",
    "union_tag_not_found": "is missing",
}


@dataclass(frozen=True)
class Complaint:
    """One thing wrong with a field."""

    field: Path  #: keys and indices that lead to it
    text: str


class DefinitionError(InstrumentError):
    """Everything that is wrong with a definition, without file and lines."""

    def __init__(self, *complaints: Complaint):
        super().__init__("; ".join(complaint.text for complaint in complaints))
        self.complaints = complaints


def complaints_of(error: ValidationError, said: dict[str, Any]) -> list[Complaint]:
    """What pydantic found wrong with the parsed file `said`."""
    found = []
    for problem in error.errors():
        field = _field(problem["loc"], said, problem["type"] in ("missing", "extra_forbidden"))
        if problem["type"].startswith("union_tag"):
            field += ("kind",)
        text = _WORDS.get(problem["type"], problem["msg"].removeprefix("Value error, "))
        text = text.format(**problem.get("ctx", {})) if problem["type"] in _WORDS else text
        if problem["type"] == "extra_forbidden":
            text += nearest(str(field[-1]), _fields_beside(problem["loc"]))
        found.append(Complaint(field, text))
    return found


def message(complaints: Sequence[Complaint], text: str, said: dict[str, Any]) -> str:
    """One line about a file of that `text`: the first few complaints in full, and the fields of a few more."""
    lines = Lines(text)
    shown = [_said(complaint, lines, said) for complaint in complaints[:_SHOWN]]
    if more := complaints[_SHOWN:]:
        names = ", ".join(_name(complaint.field) for complaint in more[:_SHOWN])
        shown.append(f"and {len(more)} more: {names}{', ...' if len(more) > _SHOWN else ''}")
    return "; ".join(shown)


def _said(complaint: Complaint, lines: Lines, said: dict[str, Any]) -> str:
    line, value = lines.of(complaint.field), _value(complaint.field, said)
    where = f"line {line}: " if line else ""
    if not complaint.field:
        return where + complaint.text
    shown = f" = {_shown(value)}" if isinstance(value, str | int | float) else ""
    return f"{where}{_name(complaint.field)}{shown}: {complaint.text}"


def _shown(value: str | float) -> str:
    """A value as the file has it."""
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return one_line(text if len(text) <= 40 else text[:37] + "...")


def _name(field: Path) -> str:
    return ".".join(text if (text := str(key)) and text.isprintable() else repr(key) for key in field)


def _field(loc: tuple[str | int, ...], said: Any, ends_in_key: bool) -> Path:
    """Where pydantic says it is, less the names of the alternatives it chose between.

    Args:
        loc: pydantic's path.
        said: the parsed file.
        ends_in_key: the last of `loc` is a field for sure, whether the file has it or not.
    """
    field: Path = ()
    for k, key in enumerate(loc):
        if _value((*field, key), said) is not None or (ends_in_key and k == len(loc) - 1):
            field += (key,)
    return field


def _value(field: Path, said: Any) -> Any:
    """What the file says there; None if nothing."""
    try:
        for key in field:
            said = said[key]
    except (KeyError, IndexError, TypeError):
        return None
    return said


def _fields_beside(loc: tuple[str | int, ...]) -> set[str]:
    """Names of the fields that could stand where an unknown one does."""
    parts: list[type[BaseModel]] = [Definition]
    for key in loc[:-1]:
        holding = [part for part in parts if key in part.model_fields]
        if holding:
            parts = list(_parts_in(holding[0].model_fields[str(key)].annotation))
        elif isinstance(key, str):
            parts = [part for part in parts if key in typing.get_args(part.model_fields["kind"].annotation)]
    return {name for part in parts for name in part.model_fields}


def _parts_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """The parts of a definition that a type can hold."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in typing.get_args(annotation):
        yield from _parts_in(inner)
