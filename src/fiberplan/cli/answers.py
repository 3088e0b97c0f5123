"""Answers for programs: one JSON document on stdout, whatever the command.

Lengths are in mm, times in s and angles in degrees, as in the commands' options. What is not a finite number is null,
positioners and obstacles are given by their ids, and the exit code is the same as without ``--json``. What goes wrong
is one line on stderr, and nothing on stdout.
"""

import json
import math
from collections.abc import Mapping
from enum import Enum
from typing import Any

from fiberplan.cli.output import say


def say_json(answer: Any) -> None:
    """Print an answer as JSON."""
    say(json.dumps(plain(answer), indent=2, allow_nan=False))


def plain(value: Any) -> Any:
    """A value as JSON knows it: no NaN or infinity, no arrays, enumerations by name, paths as text."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # an array or number of numpy, for which no help should wait
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)
