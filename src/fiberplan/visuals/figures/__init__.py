"""Figures of a plan for papers and reports: `draw` by kind, or the functions themselves on axes of one's own.

- `registry`: `FIGURES`, all kinds by name; a kind is registered where it is defined
- `arrays`: the focal plane at a moment, or at several side by side
- `joint_profiles`: joint angles and speeds over time
- `clearances`: proven clearance over time, and its histogram
- `durations`: when positioners stop, against what they need, and the bounds
- `workspaces`: who reaches where, and who can touch whom
- `joint_spaces`: the joint space of one positioner and what blocks it
- `chosen`: who is drawn where nobody is named

They need matplotlib, which is slow to import, so `fiberplan.visuals` imports this package when it is asked for.
"""

import os
from typing import Any

from fiberplan.errors import FiberplanError
from fiberplan.plan import Plan
from fiberplan.visuals.canvas import figure_format, save
from fiberplan.visuals.figures.arrays import focal_plane, snapshots
from fiberplan.visuals.figures.clearances import clearance, histogram
from fiberplan.visuals.figures.durations import makespan
from fiberplan.visuals.figures.joint_profiles import joints, speeds
from fiberplan.visuals.figures.joint_spaces import joint_space
from fiberplan.visuals.figures.registry import FIGURES, Drawing
from fiberplan.visuals.figures.workspaces import coverage, multiplicity

__all__ = [
    "FIGURES",
    "clearance",
    "coverage",
    "draw",
    "focal_plane",
    "histogram",
    "joint_space",
    "joints",
    "kind",
    "makespan",
    "multiplicity",
    "snapshots",
    "speeds",
]


def kind(name: str) -> Drawing:
    """What draws figures of this kind.

    Raises:
        FiberplanError: there is none; the message names all.
    """
    if name not in FIGURES:
        raise FiberplanError(f"no figure '{name}'; there are {', '.join(FIGURES)}")
    return FIGURES[name]


def draw(plan: Plan, name: str, path: str | os.PathLike, **options: Any) -> None:
    """Draw a figure of a plan and write it, whole or not at all.

    Args:
        plan: what is drawn.
        name: the kind, a key of `FIGURES`.
        path: ends in .svg, .pdf or .png.
        options: those of the kind's function.

    Raises:
        FiberplanError: no such kind, an ending of no figure, or what the kind's function refuses.
    """
    drawing = kind(name)
    figure_format(path)
    drawn = drawing(plan, **options)
    save((drawn[0] if isinstance(drawn, list) else drawn).figure, path)
