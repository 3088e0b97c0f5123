"""A planner by its name and the options that were given for it."""

import dataclasses
import difflib
import math
from collections.abc import Mapping
from typing import Any

from fiberplan.errors import FiberplanError
from fiberplan.planners import PLANNERS, Planner

IN_DEGREES = ("step", "max_travel")


def chosen_planner(name: str, seed: int, settings: Mapping[str, Any]) -> Planner:
    """The planner called `name`, with those of its `settings` that are not None.

    Raises:
        FiberplanError: no such planner, one without such a setting, or a value that it refuses.
    """
    if name not in PLANNERS:
        near = difflib.get_close_matches(name, PLANNERS, n=1)
        hint = f"; did you mean {near[0]}?" if near else f"; there are {', '.join(PLANNERS)}"
        raise FiberplanError(f"no planner '{name}'{hint}")
    kind = PLANNERS[name]
    known = {field.name for field in dataclasses.fields(kind)}
    given = {key: value for key, value in settings.items() if value is not None}
    foreign = [key for key in given if key not in known]
    if foreign:
        raise FiberplanError(f"planner {name} has no option --{foreign[0].replace('_', '-')}")
    given |= {key: math.radians(given[key]) for key in IN_DEGREES if key in given}
    return kind(**given, seed=seed)
