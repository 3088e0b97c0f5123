"""Makarem2016's figures as this run gives them, and MOONS' published arrivals in grey."""

from pathlib import Path

import numpy as np

from fiberplan.reproductions.makarem2016.arrays import Runs
from fiberplan.reproductions.makarem2016.conflict import AT_TARGET, Five
from fiberplan.reproductions.makarem2016.moons import Case
from fiberplan.visuals import style
from fiberplan.visuals.canvas import blank, save
from fiberplan.visuals.figures.arrays import draw_configuration

MARKS = {"alone": ("s", style.SERIES[1]), "relief": ("o", style.SERIES[0])}
TITLE = {"loc": "left", "color": style.INK.light, "fontweight": "bold", "fontsize": 11}
BELOW = {
    "loc": "upper center",
    "bbox_to_anchor": (0.5, -0.14),
    "labelcolor": style.INK.light,
    "ncols": 3,
    "frameon": False,
}


def arrivals(runs: Runs, path: Path) -> None:
    """Assigned and arrived in every run on 1025 positioners."""
    figure, axes = blank((10.0, 4.4), columns=2)
    for ax, kind in zip(axes, ("uniform", "clustered"), strict=True):
        asked = [run.asked for run in runs[kind, "alone"]]
        ax.plot(asked, "_", color=style.PAPER_SERIES, markersize=9, label="assigned")
        for mode, (mark, colour) in MARKS.items():
            arrived = [run.arrived for run in runs[kind, mode]]
            ax.plot(arrived, mark, color=colour, markersize=5, label=f"arrived, {mode}")
        ax.set_title(f"1025 positioners, {kind} targets", **TITLE)
        ax.set_xlabel("run")
        ax.set_ylabel("positioners")
        ax.xaxis.get_major_locator().set_params(integer=True)
        ax.set_ylim(0, 1080)
        ax.legend(**BELOW)
    save(figure, path)


def conflict(scene: Five, path: Path) -> None:
    """Six moments of the five, with the way of the one that leaves its target."""
    plan, who = scene.plan, scene.who
    plane = plan.problem.plane
    back = float(scene.times[np.flatnonzero(scene.away[:, who] > AT_TARGET)[-1]])
    between = [(scene.came + scene.when) / 2, (scene.when + back) / 2]
    moments = [0.0, scene.came, between[0], scene.when, between[1], plan.makespan]
    way = np.array([plane.fibers(plan.trajectory.at(t))[who] for t in scene.times])
    figure, axes = blank((11.0, 7.6), rows=2, columns=3)
    for ax, moment in zip(axes, moments, strict=True):
        draw_configuration(ax, plane, plan.trajectory.at(moment), plan.outcomes)
        ax.plot(*way[scene.times <= moment].T, color=style.SERIES[1], linewidth=1.2, zorder=6)
        ax.plot(*plane.fibers(plan.problem.goal).T, "x", color=style.INK.light, markersize=6, zorder=7)
        ax.set_xlim(plane.base[:, 0].min() - 27, plane.base[:, 0].max() + 27)
        ax.set_ylim(plane.base[:, 1].min() - 27, plane.base[:, 1].max() + 27)
        ax.set_title(f"{moment:.1f} s", **TITLE)
        ax.set_xlabel("x [mm]")
        ax.set_ylabel("y [mm]")
    save(figure, path)


def distances(scene: Five, path: Path) -> None:
    """How far each of the five is from its target, all the time."""
    figure, (ax,) = blank((7.5, 4.2))
    for i, id_ in enumerate(scene.plan.problem.plane.ids):
        colour, width = (style.SERIES[1], 2.2) if i == scene.who else (style.PAPER_SERIES, 1.0)
        ax.plot(scene.times, scene.away[:, i], color=colour, linewidth=width, label=id_)
    ax.set_title("five positioners: distance of the fiber from its target", **TITLE)
    ax.set_xlabel("time [s]")
    ax.set_ylabel("distance [mm]")
    ax.legend(**{**BELOW, "ncols": 5})
    save(figure, path)


def moons(cases: list[Case], path: Path) -> None:
    """Share of targets reached, by size of the array."""
    figure, (ax,) = blank((7.5, 4.8))
    for mode, (mark, colour) in MARKS.items():
        shift = 0.97 if mode == "alone" else 1.03
        ours = [(case.targets * shift, case.runs[mode].arrived / case.targets) for case in cases]
        theirs = [(case.targets * shift, case.published[mode][0] / case.targets) for case in cases]
        ax.plot(
            *np.transpose(theirs), mark, color=style.PAPER_SERIES, markerfacecolor="none", label=f"published, {mode}"
        )
        ax.plot(*np.transpose(ours), mark, color=colour, label=f"ours, {mode}")
    ax.set_xscale("log")
    ax.set_ylim(0.5, 1.02)
    ax.set_title("MOONS cases: share of targets reached", **TITLE)
    ax.set_xlabel("positioners with targets")
    ax.set_ylabel("share of targets reached")
    ax.legend(**{**BELOW, "ncols": 2})
    save(figure, path)
