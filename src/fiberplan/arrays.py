"""One door for arrays: native byte order, C-contiguous, read-only, so each kernel compiles once and none mutates."""

from typing import Any

import numpy as np
from numpy.typing import DTypeLike


def read_only(values: Any, dtype: DTypeLike = np.float64) -> np.ndarray:
    """A read-only, C-ordered copy of `values` in native byte order (a read-only array that fits is passed through)."""
    if (
        isinstance(values, np.ndarray)
        and not values.flags.writeable
        and values.flags.c_contiguous
        and values.dtype == np.dtype(dtype)
        and values.base is None
    ):
        return values
    array = np.array(values, dtype=dtype, order="C")
    array.setflags(write=False)
    return array
