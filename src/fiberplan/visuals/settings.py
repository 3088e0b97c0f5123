"""A planner's settings in words, with their units: angles in degrees.

The units are those of the planners' own fields, written down again since drawing imports no planner, which takes longer
than all the rest of showing a plan; a test compares them. Settings of planners of other packages stay as they are.
"""

import math
from collections.abc import Mapping
from typing import Any

UNITS = {
    **dict.fromkeys(("turn", "step", "max_travel"), "rad"),
    **dict.fromkeys(("max_time", "min_reaction", "dt", "collision_dt", "near", "stall_time", "patience"), "s"),
    **dict.fromkeys(("D", "d", "convergence", "influence"), "mm"),
    "lambda1": "1/mm^2",
    **dict.fromkeys(("lambda2", "lambda3"), "rad/s mm^2"),
}
"""Setting -> its unit in the library, whichever planner has it."""


def said_settings(parameters: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Name and value of each setting as text, but for the seed."""
    return [(str(key), _said(value, UNITS.get(key, ""))) for key, value in parameters.items() if key != "seed"]


def _said(value: Any, unit: str) -> str:
    if unit == "rad" and isinstance(value, float):
        value, unit = math.degrees(value), "deg"
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return f"{text} {unit}".strip() if value is not None else text
