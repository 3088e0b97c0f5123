"""The settings of planners as the command line has them: by key, angles in degrees.

They are read from the planner's dataclass, so those of another package's planner are found as well: key and type are
the field's, unit and help are what `fiberplan.planners.protocol.setting` attached to it. Reading them imports the
planners, so it is left until settings are asked for.
"""

import dataclasses
import math
import re
import types
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from fiberplan.errors import FiberplanError
from fiberplan.planners import PLANNERS
from fiberplan.tables.wording import nearest

_NONE = "none"  # how the command line writes None, for which TOML has no word
_WORDS = {"true": True, "false": False}
_LARGEST = 2**63 - 1  # what kernels can count to
_DIGITS = 12  # of a value in degrees, so that what was 0.1 deg is 0.1 again


@dataclasses.dataclass(frozen=True)
class Setting:
    """One setting of one planner."""

    key: str
    kind: type  #: float, int, bool, str or tuple; object: whatever the planner makes of it
    parts: tuple[type, ...]  #: kinds of a tuple's parts
    choices: tuple[Any, ...]  #: empty: any value of its kind
    optional: bool  #: whether it may be none
    unit: str  #: on the command line
    help: str
    default: Any  #: in that unit
    factor: float = 1.0  #: from that unit to the library's

    @property
    def expected(self) -> str:
        """What a value has to be, in words."""
        if self.choices:
            what = f"one of {', '.join(map(str, self.choices))}"
        else:
            what = _PLAIN.get(self.kind) or f"{len(self.parts)} values such as {shown(self.default)}"
        unit = f" [{self.unit}]" if self.unit else ""
        return f"{what}{unit}{f', or {_NONE}' if self.optional else ''}"

    def parse(self, text: str) -> Any:
        """The value, in the library's unit, that was written ``key=text``.

        Raises:
            FiberplanError: it is none of this setting.
        """
        return self.convert(_parsed(text, self.kind, self.parts), "--set ", text)

    def convert(self, value: Any, source: str, written: object = None) -> Any:
        """`value`, in the unit of the command line, as the library takes it.

        Raises:
            FiberplanError: it does not fit; names the source, the key and the value as it was written.
        """
        if self.optional and value in (None, _NONE):
            return None
        if self.kind is tuple and isinstance(value, str):
            value = _parsed(value, self.kind, self.parts)
        if self.kind is tuple and isinstance(value, list | tuple):
            fits = len(value) == len(self.parts) and all(map(_fits, value, self.parts))
            value = tuple(value)
        else:
            fits = _fits(value, self.kind) and (not self.choices or value in self.choices)
        if not fits:
            said = shown(value) if written is None else written
            raise FiberplanError(f"{source}{self.key}={said}: expected {self.expected}")
        if self.kind is float:
            return value * self.factor if self.factor != 1.0 else float(value)
        return value

    def of(self, planner: object) -> Any:
        """Its value in a planner, in the unit of the command line."""
        return _in_degrees(getattr(planner, self.key), self.factor)


_SIMPLE = (bool, int, float, str)  # bool first, since it is an int
_TURNED = {"rad": "deg", "rad/s": "deg/s"}  # the library's unit -> that of the command line
_PLAIN = {float: "a number", int: "a whole number", bool: "true or false", str: "a word", object: "a value"}


def settings_of(make: Callable[..., Any]) -> dict[str, Setting]:
    """The settings of a planner by key, the seed apart; none of what is no dataclass."""
    if not dataclasses.is_dataclass(make):
        return {}
    try:
        hints = get_type_hints(make)
    except Exception:  # annotations of another package that name what cannot be had at run time
        hints = {}
    fields = [field for field in dataclasses.fields(make) if field.init and field.name != "seed"]
    return {field.name: _setting(field, hints.get(field.name)) for field in fields}


def _setting(field: dataclasses.Field, hint: Any) -> Setting:
    default = field.default
    if default is dataclasses.MISSING:
        default = None if field.default_factory is dataclasses.MISSING else field.default_factory()
    options = get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)
    known = [option for option in options if option is not types.NoneType]
    kind, parts, choices = _kind(known[0] if len(known) == 1 else object, default)
    unit, factor = field.metadata.get("unit", ""), 1.0
    if kind is float and unit in _TURNED:
        unit, factor = _TURNED[unit], math.radians(1.0)
    return Setting(
        key=field.name,
        kind=kind,
        parts=parts,
        choices=choices,
        optional=len(known) < len(options),
        unit=unit,
        help=field.metadata.get("help", ""),
        default=_in_degrees(default, factor),
        factor=factor,
    )


def _kind(hint: Any, default: Any) -> tuple[type, tuple[type, ...], tuple[Any, ...]]:
    """Kind, parts and choices of what is annotated so; without an annotation those of the default."""
    if hint is None:
        hint = next((kind for kind in _SIMPLE if isinstance(default, kind)), object)
    if get_origin(hint) is Literal:
        return type(get_args(hint)[0]), (), get_args(hint)
    if get_origin(hint) is tuple and Ellipsis not in get_args(hint):
        return tuple, get_args(hint), ()
    return (hint if hint in _SIMPLE else object), (), ()


def _in_degrees(value: Any, factor: float) -> Any:
    return float(f"{value / factor:.{_DIGITS}g}") if factor != 1.0 and value is not None else value


def _parsed(text: str, kind: type, parts: tuple[type, ...] = ()) -> Any:
    """What text says, if it says anything of this kind; otherwise the text itself."""
    if kind is bool:
        return _WORDS.get(text, text)
    if kind is int:
        return int(text) if re.fullmatch(r"[+-]?\d{1,30}", text) else text
    if kind is float:
        try:
            return text if "_" in text else float(text)
        except ValueError:
            return text
    if kind is tuple:
        pieces = [piece.strip() for piece in re.split(r"[x,]", text)]
        return tuple(map(_parsed, pieces, parts)) if len(pieces) == len(parts) else text
    return text


def assigned(assignments: Sequence[str], option: str, lists: str) -> dict[str, str]:
    """Key -> text of assignments ``key=text``.

    Args:
        assignments: as they were given.
        option: that gave them.
        lists: a command that lists the keys.

    Raises:
        FiberplanError: one that is no assignment, or a key that is given twice.
    """
    written: dict[str, str] = {}
    for assignment in assignments:
        key, equals, text = (part.strip() for part in assignment.partition("="))
        if not (key and equals):
            raise FiberplanError(f"{option} {assignment}: expected key=value; `{lists}` lists the keys")
        if key in written:
            raise FiberplanError(f"{option} {key} is given twice: {written[key]} and {text}")
        written[key] = text
    return written


def converted(text: str, kind: type, what: str) -> Any:
    """What text says of one of the `_PLAIN` kinds.

    Raises:
        FiberplanError: it says none; names what it was given for.
    """
    value = _parsed(text, kind)
    if not _fits(value, kind):
        raise FiberplanError(f"{what}={text}: expected {_PLAIN[kind]}")
    return float(value) if kind is float else value


def _fits(value: Any, kind: type) -> bool:
    if kind is float:
        return isinstance(value, float) or _fits(value, int)
    if kind is int:
        return isinstance(value, int) and not isinstance(value, bool) and abs(value) <= _LARGEST
    return isinstance(value, kind)


def shown(value: Any) -> str:
    """A value as the command line writes it."""
    if value is None:
        return _NONE
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.{_DIGITS}g}"
    return "x".join(map(shown, value)) if isinstance(value, tuple | list) else str(value)


def found(planner: str, key: str, settings: Mapping[str, Setting]) -> Setting:
    """The setting of this key.

    Raises:
        FiberplanError: there is none; one line says which is meant, or which planner has it.
    """
    if key in settings:
        return settings[key]
    if key == "seed":
        raise FiberplanError("the seed is given by --seed, not as a setting")
    owners = planners_with(key)
    if not settings:
        hint = "; it has none"
    elif owners:
        hint = f"; {' and '.join(owners)} {'has' if len(owners) == 1 else 'have'}"
    else:
        hint = nearest(key, settings) or f"; it has {', '.join(settings)}"
    raise FiberplanError(f"planner {planner} has no setting '{key}'{hint}")


def planners_with(key: str) -> list[str]:
    """Names of the planners that have this setting; of those that can be imported."""
    return [name for name, make in loaded_planners().items() if key in settings_of(make)]


def loaded_planners() -> dict[str, Callable[..., Any]]:
    """Every planner that can be imported, by name."""
    made: dict[str, Callable[..., Any]] = {}
    for name in PLANNERS:
        try:
            made[name] = PLANNERS[name]
        except FiberplanError:
            continue
    return made
