"""Quantities as plain numbers of the unit that a field has; plain numbers are of that unit already.

Numpy drops the unit of a quantity and the mask of a masked array without a word: 12 deg/s would be taken as 12 rad/s.
Astropy is imported only once something with a unit arrives, so that those who use plain numbers need not wait for it.
"""

from typing import Any

import numpy as np

from fiberplan.errors import FiberplanError

_KINDS = {"mm": "a length", "rad": "an angle", "s": "a time"}
_KINDS |= {"rad/s": "an angular speed", "rad/s2": "an angular acceleration"}
_NUMBERS = (float, int, bool, str, np.float64, np.int64, np.bool_, type(None))


def plain(values: Any, unit: str = "", name: str = "a value", error: type[FiberplanError] = FiberplanError) -> Any:
    """`values` as plain numbers in `unit`; what has no unit is returned as it is.

    Args:
        values: numbers, an array, a quantity or a table's column, or lists of those.
        unit: "mm", "rad", "rad/s", "rad/s2", "s", any other that astropy knows, or "" for numbers without one.
        name: of the field, for messages.
        error: what to raise.

    Raises:
        error: a unit that cannot be converted, or a masked value; one line that names the field.
    """
    kind = type(values)
    if kind in _NUMBERS or (kind is np.ndarray and values.dtype != object):
        return values
    if kind is np.ndarray:
        values = values.tolist()
    if isinstance(values, list | tuple):
        return [plain(each, unit, name, error) for each in values]
    _refuse_masked(values, name, error)
    if getattr(values, "unit", None) is not None:
        return _converted(values, unit, name, error)
    if getattr(values, "units", None) is not None:  # of another library: numpy would drop them, too
        raise error(f"{name} has units that are not astropy's ({kind.__module__}.{kind.__qualname__})")
    return values


def _refuse_masked(values: Any, name: str, error: type[FiberplanError]) -> None:
    mask = getattr(values, "mask", None)
    if mask is None or callable(mask) or not np.any(mask):
        return
    row = f" in row {np.argwhere(mask)[0][0] + 1}" if np.ndim(mask) else ""
    raise error(f"{name} is masked{row}: leave it out, or give its value")


def _converted(values: Any, unit: str, name: str, error: type[FiberplanError]) -> Any:
    from astropy import units

    numbers = np.asarray(getattr(values, "unmasked", values))
    try:
        return units.Unit(values.unit).to(units.Unit(unit), numbers)
    except (units.UnitsError, ValueError, TypeError):
        wanted = f"{_KINDS[unit]} ({unit})" if unit in _KINDS else unit or "a number without one"
        raise error(f"{name} is in '{values.unit}', expected {wanted}") from None
