"""A planner by its name and the options that were given for it."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from fiberplan.cli.planner_options import FLAGS
from fiberplan.errors import FiberplanError
from fiberplan.plan import Plan
from fiberplan.planners import PLANNERS, Direct, Planner
from fiberplan.problem import Problem


def chosen_planner(name: str, seed: int, settings: Mapping[str, Any]) -> Planner:
    """The planner called `name`, with those of its `settings` that are not None, in the units of the command line.

    Raises:
        FiberplanError: no such planner, one without such a setting, or a value that it refuses.
    """
    make = PLANNERS.find(name)
    flags = {flag.field: flag for flag in FLAGS.get(name, ())}
    given = {field: value for field, value in settings.items() if value is not None}
    foreign = [field for field in given if field not in flags]
    if foreign:
        raise FiberplanError(f"planner {name} has no option --{foreign[0].replace('_', '-')}")
    given = {field: math.radians(v) if flags[field].unit == "deg" else v for field, v in given.items()}
    return make(**given, seed=seed)


def planned_by(planner: Planner, problem: Problem, deadline: float | None, tell: Callable[[str], None]) -> Plan:
    """What the planner makes of the problem; one that gets better with time is told when to stop, and tells how far.

    Raises:
        FiberplanError: a deadline for a planner that takes the time it takes.
    """
    if isinstance(planner, Direct):
        return planner.plan(problem, deadline=deadline, report=tell)
    if deadline is not None:
        raise FiberplanError(f"planner {planner.name} takes no --deadline; direct does")
    return planner.plan(problem)
