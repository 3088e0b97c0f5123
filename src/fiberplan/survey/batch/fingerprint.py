"""Whether inputs are the same: a digest of all numbers and texts in them, to the last bit.

Files' names and the places of rows in them are not of the matter and are left out.
"""

import dataclasses
import hashlib
from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Any

import numpy as np

_ELSEWHERE = {"source", "rows"}  # where something was read


def fingerprint(thing: Any) -> str:
    """Sixteen hexadecimal digits of frozen dataclasses, arrays, mappings, sequences, numbers and texts."""
    whole = hashlib.sha256()
    for part in _parts(thing):
        whole.update(len(part).to_bytes(8, "little") + part)
    return whole.hexdigest()[:16]


def _parts(thing: Any) -> Iterator[bytes]:
    yield type(thing).__name__.encode()
    if isinstance(thing, np.ndarray):
        yield f"{thing.dtype.str} {thing.shape}".encode()
        yield np.ascontiguousarray(thing).tobytes()
    elif dataclasses.is_dataclass(thing):
        for field in dataclasses.fields(thing):
            if field.name not in _ELSEWHERE:
                yield field.name.encode()
                yield from _parts(getattr(thing, field.name))
    elif isinstance(thing, Mapping):
        for key, value in thing.items():
            yield from _parts(key)
            yield from _parts(value)
        yield b"end"
    elif isinstance(thing, tuple | list | frozenset):
        for each in sorted(thing, key=repr) if isinstance(thing, frozenset) else thing:
            yield from _parts(each)
        yield b"end"
    elif isinstance(thing, Enum):
        yield thing.name.encode()
    elif thing is None or isinstance(thing, bool | int | float | str | bytes | np.generic):
        yield repr(thing).encode()
    elif vars(thing) if hasattr(thing, "__dict__") else False:
        yield from _parts({name: value for name, value in vars(thing).items() if not name.startswith("_")})
