"""Numbers as pages carry them: base64 of little-endian arrays, and JSON without infinities."""

import base64
from typing import Any

import numpy as np


def packed(values: Any, dtype: str) -> str:
    """An array as base64 text, such as "<f4"."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=dtype).tobytes()).decode()


def finite(value: float) -> float | None:
    """JSON has no infinities or NaN: a value that is not finite becomes null."""
    return float(value) if np.isfinite(value) else None
