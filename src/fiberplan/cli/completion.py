"""What a shell offers for a name that is being typed: the names that begin so."""

from collections.abc import Iterable

import typer


def planner_names(incomplete: str) -> list[str]:
    """Planners, ours and others'."""
    from fiberplan.planners import PLANNERS

    return beginning(incomplete, PLANNERS)


def instrument_names(incomplete: str) -> list[str]:
    """Built-in instruments and those of other packages; files are left to the shell."""
    from fiberplan.instruments import names

    return beginning(incomplete, names())


def setting_keys(context: typer.Context, incomplete: str) -> list[str]:
    """Keys of the settings of the planner that is named before, each with its equals sign."""
    from fiberplan.cli.settings import settings_of
    from fiberplan.planners import PLANNERS

    planner = context.params.get("planner") or "direct"
    settings = settings_of(PLANNERS[planner]) if planner in PLANNERS else {}
    return beginning(incomplete, (f"{key}=" for key in settings))


def formats(incomplete: str) -> list[str]:
    """Formats and controllers that a plan can be exported to."""
    from fiberplan.hardware import CONTROLLERS
    from fiberplan.io.exports import EXPORTS

    return beginning(incomplete, (*EXPORTS, *CONTROLLERS))


def controller_names(incomplete: str) -> list[str]:
    """Controllers, ours and others'."""
    from fiberplan.hardware import CONTROLLERS

    return beginning(incomplete, CONTROLLERS)


def figure_kinds(incomplete: str) -> list[str]:
    """Kinds of figures of a plan."""
    from fiberplan.visuals.figures import FIGURES

    return beginning(incomplete, FIGURES)


def beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    """Those of the names that begin so."""
    return [name for name in names if name.startswith(incomplete)]
