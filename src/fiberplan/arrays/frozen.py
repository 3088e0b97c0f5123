"""What cannot be changed once it is made, and stays so when it is pickled or copied.

Pickle and `copy` rebuild an object without its checks: arrays come back writeable, so that each kernel compiles once
more for them, and a certificate that was cached would outlive the motion it was about. So the state of a `Frozen`
object is its fields alone, and they pass the door again.
"""

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any, NoReturn, TypeVar

import numpy as np

from fiberplan.arrays.door import read_only

K = TypeVar("K")
V = TypeVar("V")


class FrozenDict(dict[K, V]):
    """A dictionary that cannot be changed; what it holds is frozen, too."""

    def __init__(self, items: Mapping[K, V] | Iterable[tuple[K, V]] = ()):
        super().__init__((key, frozen(value)) for key, value in dict(items).items())

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("this mapping cannot be changed: make a dict of it")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type, tuple[dict[K, V]]]:
        return type(self), (dict(self),)


def frozen(value: Any) -> Any:
    """`value` as it cannot be changed: arrays read-only, lists as tuples, dictionaries as `FrozenDict`."""
    if type(value) is np.ndarray:
        return read_only(value, value.dtype)
    if isinstance(value, Mapping):
        return value if type(value) is FrozenDict else FrozenDict(value)
    if type(value) in (list, tuple):
        return tuple(frozen(each) for each in value)
    return value


class Frozen:
    """Base of frozen dataclasses whose pickles and copies are their fields, made read-only again."""

    def __getstate__(self) -> dict[str, Any]:
        return {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        for name, value in state.items():
            object.__setattr__(self, name, frozen(value))


def shortened(text: object, length: int = 60) -> str:
    """One line of at most `length` characters, for a `repr`."""
    line = " ".join(str(text).split())
    return line if len(line) <= length else f"{line[: length - 3]}..."
