"""What a shell offers for a name that is being typed: the names that begin so."""

from collections.abc import Iterable

import typer


def planner_names(incomplete: str) -> list[str]:
    """Planners, ours and others'."""
    from fiberplan.planners import PLANNERS

    return _beginning(incomplete, PLANNERS)


def instrument_names(incomplete: str) -> list[str]:
    """Built-in instruments and those of other packages; files are left to the shell."""
    from fiberplan.instruments import names

    return _beginning(incomplete, names())


def setting_keys(context: typer.Context, incomplete: str) -> list[str]:
    """Keys of the settings of the planner that is named before, each with its equals sign."""
    from fiberplan.cli.settings import settings_of
    from fiberplan.planners import PLANNERS

    planner = context.params.get("planner") or "direct"
    settings = settings_of(PLANNERS[planner]) if planner in PLANNERS else {}
    return _beginning(incomplete, (f"{key}=" for key in settings))


def formats(incomplete: str) -> list[str]:
    """Formats and controllers that a plan can be exported to."""
    from fiberplan.hardware import CONTROLLERS
    from fiberplan.io.exports import EXPORTS

    return _beginning(incomplete, (*EXPORTS, *CONTROLLERS))


def papers(incomplete: str) -> list[str]:
    """Papers whose experiments can be run."""
    from fiberplan.cli.reproduce import paper_keys

    return _beginning(incomplete, paper_keys())


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
