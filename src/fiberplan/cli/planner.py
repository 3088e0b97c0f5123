"""A planner by its name and the settings that were given for it."""

import inspect
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from fiberplan.cli.settings import Setting, assigned, found, settings_of
from fiberplan.errors import FiberplanError
from fiberplan.plan import Plan
from fiberplan.planners import PLANNERS, Planner
from fiberplan.problem import Problem
from fiberplan.tables.table_reader import read_text
from fiberplan.tables.wording import one_line


def chosen_planner(name: str, seed: int, assignments: Sequence[str] = (), file: Path | None = None) -> Planner:
    """The planner called `name` with the settings of a TOML file and, over them, of assignments ``key=value``.

    Raises:
        FiberplanError: no such planner, one without such a setting, or a value that it refuses.
    """
    make = PLANNERS.find(name)
    settings = settings_of(make)
    given = {} if file is None else _of_file(file, name, settings)
    given |= _of_assignments(assignments, name, settings)
    if "seed" in inspect.signature(make).parameters:
        given["seed"] = seed
    elif seed:
        raise FiberplanError(f"planner {name} chooses nothing at random, so it takes no --seed")
    try:
        return make(**given)
    except ValueError as error:  # how a planner of another package may refuse a value
        raise FiberplanError(f"planner {name}: {error}") from error


def _of_file(file: Path, planner: str, settings: dict[str, Setting]) -> dict[str, Any]:
    try:
        content = tomllib.loads("\n".join(read_text(file, FiberplanError)))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise FiberplanError(f"{file}: is not valid TOML: {one_line(error)}") from None
    try:
        chosen = {key: found(planner, key, settings) for key in content}
    except FiberplanError as error:
        raise FiberplanError(f"{file}: {error}") from None
    return {key: chosen[key].convert(value, f"{file}: ") for key, value in content.items()}


def _of_assignments(assignments: Sequence[str], planner: str, settings: dict[str, Setting]) -> dict[str, Any]:
    written = assigned(assignments, "--set", f"fiberplan planners {planner}")
    return {key: found(planner, key, settings).parse(text) for key, text in written.items()}


def settings_facts(planner: Planner) -> dict[str, Any]:
    """What is set of a planner, in the units of the command line."""
    return {key: setting.of(planner) for key, setting in settings_of(type(planner)).items()}


def planned_by(
    planner: Planner,
    problem: Problem,
    deadline: float | None,
    tell: Callable[[str], None],
    controller: str | None = None,
    options: Mapping[str, Any] = MappingProxyType({}),
) -> Plan:
    """What the planner makes of the problem, fit for the accelerations and least speeds of its focal plane's motors.

    A planner that gets better with time is told when to stop, and tells how far it is.

    Args:
        planner: any.
        problem: to plan.
        deadline: wall-clock seconds for each time that it is asked.
        tell: told how far things are.
        controller: whose motors are to execute it, if any.
        options: of that controller's `write`.

    Raises:
        FiberplanError: a deadline for a planner that takes the time it takes, or what the controller cannot do.
    """
    takes = inspect.signature(planner.plan).parameters
    if deadline is not None and "deadline" not in takes:
        raise FiberplanError(f"planner {planner.name} takes no --deadline; direct does")
    given = {"deadline": deadline, "report": tell}
    patient = _Patient(planner, {name: value for name, value in given.items() if name in takes})
    if controller is None:
        from fiberplan.shaping import plan_for_motors

        return plan_for_motors(patient, problem)  # which is the planner's own where motors have no such limits
    from fiberplan.hardware.planned import plan_for

    return plan_for(controller, patient, problem, **options)


class _Patient(NamedTuple):
    """A planner with what else its `plan` is given."""

    planner: Planner
    given: dict[str, Any]

    @property
    def name(self) -> str:
        return self.planner.name

    @property
    def reference(self) -> str:
        return self.planner.reference

    def plan(self, problem: Problem) -> Plan:
        return self.planner.plan(problem, **self.given)
