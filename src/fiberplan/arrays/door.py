"""One door for arrays: native byte order, C-contiguous, read-only, so each kernel compiles once and none mutates."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from fiberplan.arrays.units import plain
from fiberplan.errors import FiberplanError

LARGEST = 4e9  #: no length is larger: beyond it floating-point numbers round off more than proofs have room for [mm]


def read_only(
    values: Any,
    dtype: DTypeLike = np.float64,
    unit: str = "",
    name: str = "",
    error: type[FiberplanError] = FiberplanError,
) -> np.ndarray:
    """A read-only, C-ordered copy of `values` in native byte order (a read-only array that fits is passed through).

    Args:
        values: an array or what makes one, or a quantity.
        dtype: of the array.
        unit: of its numbers; quantities are converted to it.
        name: of the field, where a user may give it.
        error: what to raise about such a field.

    Raises:
        error: a unit of another kind, a masked value, or with a `name` what makes no array of numbers.
    """
    if (
        type(values) is np.ndarray
        and not values.flags.writeable
        and values.flags.c_contiguous
        and values.dtype == np.dtype(dtype)
        and values.base is None
    ):
        return values
    values = plain(values, unit, name or "an array", error)
    try:
        given = np.asarray(values)
        _refuse_loss(given, np.dtype(dtype))
        array = np.array(given, dtype=dtype, order="C")
    except (TypeError, ValueError) as problem:
        if not name:
            raise
        raise error(f"{name} cannot be taken as numbers ({str(problem).splitlines()[0]})") from None
    array.setflags(write=False)
    return array


def _refuse_loss(given: np.ndarray, wanted: np.dtype) -> None:
    """Numpy takes any word for true, a NaN as well, and the real part of a complex number, without an error."""
    if wanted.kind == "b" and (given.dtype.kind not in "biuf" or np.isnan(given).any()):
        raise TypeError("true, false, 1 or 0 is wanted")
    if wanted.kind == "f" and given.dtype.kind == "c":
        raise TypeError("complex numbers have a part too many")


def number(value: Any, unit: str, name: str, error: type[FiberplanError] = FiberplanError) -> float:
    """One number in `unit`; a quantity is converted to it.

    Raises:
        error: no number or several, a unit of another kind, a masked value, or a finite length beyond `LARGEST`; one
            line that names the field.
    """
    if type(value) is float:
        return value if unit != "mm" else _measurable(value, name, error)
    given, value = value, plain(value, unit, name, error)
    try:
        if isinstance(value, bool | np.bool_ | str | bytes) or np.ndim(value):
            raise TypeError
        value = float(value)
    except (TypeError, ValueError, OverflowError):
        shown = " ".join(repr(given).split())[:60]
        raise error(f"{name} must be one number{f' [{unit}]' if unit else ''}, got {shown}") from None
    return value if unit != "mm" else _measurable(value, name, error)


def _measurable(value: float, name: str, error: type[FiberplanError], unit: str = "mm") -> float:
    if LARGEST < abs(value) < np.inf:
        raise error(f"{name} is {value:g} {unit}, more than the {LARGEST:g} {unit} that can be computed with")
    return value


def not_negative(value: Any, unit: str, name: str, error: type[FiberplanError] = FiberplanError) -> float:
    """One number from 0 to `LARGEST` in `unit`, which is "mm" or "s"; as `number` otherwise."""
    value = number(value, unit, name, error)
    if not 0 <= value < np.inf:
        kind = {"mm": "length", "s": "time"}[unit]
        raise error(f"{name} must be a {kind} of 0 {unit} or more, got {value:g}")
    return _measurable(value, name, error, unit)


def in_units(thing: Any, units: Mapping[str, str], error: type[FiberplanError]) -> None:
    """Give fields of a frozen dataclass the units that they are documented in; a field that is None stays None.

    Args:
        thing: a dataclass with a `name`, while it is being made.
        units: field -> unit.
        error: what to raise about a field, by `thing.name` and its own.
    """
    for field, unit in units.items():
        value = getattr(thing, field)
        if value is not None and type(value) is not float:
            object.__setattr__(thing, field, number(value, unit, f"{thing.name}: {field}", error))


def texts(values: Any, name: str, error: type[FiberplanError] = FiberplanError) -> tuple[str, ...]:
    """Names or words as text, also from a table's column.

    Raises:
        error: a masked value.
    """
    return tuple(each.decode() if isinstance(each, bytes) else str(each) for each in plain(values, "", name, error))
