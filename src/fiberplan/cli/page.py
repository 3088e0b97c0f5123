"""What a page tells besides its plan: files, date, and the planner's settings in the units of the command line."""

import os
from typing import TYPE_CHECKING, Any

from fiberplan.plan import Plan

if TYPE_CHECKING:
    from fiberplan.visuals.origin import Origin


def origin_of_file(plan: Plan, file: str | os.PathLike) -> "Origin":
    """Of a plan that was read from `file`."""
    from fiberplan.visuals.origin import Origin

    return Origin.of_file(file, said_settings(plan))


def origin_now(plan: Plan, targets: str | os.PathLike = "", file: str | os.PathLike | None = None) -> "Origin":
    """Of a plan made just now, written to `file` if it was."""
    from fiberplan.visuals.origin import Origin

    return Origin.now(targets, file or "", said_settings(plan))


def said_settings(plan: Plan) -> tuple[tuple[str, str], ...]:
    """Settings of the plan's planner with their units; those that no planner here knows stay as they are."""
    from fiberplan.cli.settings import settings_of, shown
    from fiberplan.planners import PLANNERS

    known = settings_of(PLANNERS[plan.planner]) if plan.planner in PLANNERS else {}

    def said(key: str, value: Any) -> str:
        setting = known.get(key)
        if setting is None or not isinstance(value, float):
            return shown(value)
        return f"{value / setting.factor:.6g} {setting.unit}".strip()

    return tuple((key.replace("_", " "), said(key, value)) for key, value in plan.parameters.items() if key != "seed")
