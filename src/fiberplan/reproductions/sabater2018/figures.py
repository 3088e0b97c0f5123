"""Pictures: configuration times from park (Fig. 11) and chained (Fig. 12), and the detailed case (Fig. 13)."""

from pathlib import Path

import numpy as np

from fiberplan.plan import Plan
from fiberplan.reproductions.sabater2018.trials import Trial
from fiberplan.visuals import style
from fiberplan.visuals.canvas import blank, save
from fiberplan.visuals.figures.arrays import draw_configuration


def times(trials: list[Trial], title: str, paper: float, path: Path) -> None:
    """How long plans take."""
    figure, (ax,) = blank((6.4, 4.0))
    ax.hist([t.time for t in trials if t.solved], bins=np.arange(-3.0, 124.0, 6.0).tolist(), color=style.SERIES[0])
    ax.axvline(paper, color=style.PAPER_SERIES, linestyle=(0, (5, 2)), label=f"Sabater2018: {paper:g} s")
    ax.set_title(title, loc="left", color=style.INK.light, fontweight="bold", fontsize=11)
    ax.set_xlabel("configuration time [s]")
    ax.set_ylabel("plans")
    ax.legend(frameon=False, labelcolor=style.INK.light)
    save(figure, path)


def snapshots(plan: Plan, path: Path) -> None:
    """The arms at the start, half way and at the end, with their targets."""
    figure, axes = blank((15.0, 5.6), columns=3)
    plane = plan.problem.plane
    goals = plane.fibers(plan.problem.requested)
    turn = np.linspace(0, 2 * np.pi, 200)
    for ax, part in zip(axes, (0.0, 0.5, 1.0), strict=True):
        time = part * plan.makespan
        draw_configuration(ax, plane, plan.trajectory.at(time), plan.outcomes)
        ax.plot(plane.field_radius * np.cos(turn), plane.field_radius * np.sin(turn), color=style.MUTED.light, lw=0.8)
        ax.scatter(*goals.T, s=18, marker="x", color=style.CONTACT.light, zorder=6)
        ax.set_title(f"t = {time:.0f} s", loc="left", color=style.INK.light, fontsize=11)
        ax.set_xlabel("x [mm]")
        ax.set_ylabel("y [mm]")
    save(figure, path)
