"""Pictures of plans; nothing here knows a kernel or a planner.

- `page`, ``assets/``: one self-contained HTML page of one plan or two (`show`)
- `page_data`, `plane_data`, `proof_data`, `packing`: what it carries, each part for other pages too
- `origin`: where a plan comes from, for title and heading; `settings`: a planner's, with units
- `approaches`: how near arms come to each other over time
- `heights`: what may lie over what
- `night_report`: one page of a night of audited motions; `motion_page`: the page of one of them
- `survey_report`: one page of a survey; `report_page`: what it and that of a night share
- `figures`: figures of a plan for papers and reports, by kind
- `film`: a plan as a film
- `notebook`: plans, focal planes and certificates as notebooks show them
- `widget`: the page of a plan inside a notebook
- `canvas`: blank figures in one style, and figures as files
- `shapes`: true outlines of what is drawn
- `style`: colours and shapes that the page and the pictures share

Figures need matplotlib, which is slow to import, so their functions are imported when they are first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

from fiberplan.visuals.page import show

if TYPE_CHECKING:
    from fiberplan.visuals.figures import (
        FIGURES,
        clearance,
        coverage,
        draw,
        focal_plane,
        histogram,
        joint_space,
        joints,
        makespan,
        multiplicity,
        snapshots,
        speeds,
    )
    from fiberplan.visuals.film import animate
    from fiberplan.visuals.widget import widget

__all__ = [
    "FIGURES",
    "animate",
    "clearance",
    "coverage",
    "draw",
    "focal_plane",
    "histogram",
    "joint_space",
    "joints",
    "makespan",
    "multiplicity",
    "show",
    "snapshots",
    "speeds",
    "widget",
]


def __getattr__(name: str) -> Any:
    """Import what needs matplotlib the first time it is asked for."""
    if name not in __all__:
        raise AttributeError(f"module 'fiberplan.visuals' has no attribute '{name}'")
    home = {"animate": "film", "widget": "widget"}.get(name, "figures")
    value = getattr(importlib.import_module(f"fiberplan.visuals.{home}"), name)
    globals()[name] = value
    return value
