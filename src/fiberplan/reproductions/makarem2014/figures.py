"""Makarem2014's figures as this run gives them, the paper's own values beside them in grey."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from fiberplan.reproductions.makarem2014 import published
from fiberplan.reproductions.makarem2014.conflict import Conflict
from fiberplan.reproductions.makarem2014.rules import LIMITED, LITERAL, REPAIRED, RULES
from fiberplan.reproductions.makarem2014.trials import Runs
from fiberplan.visuals import style
from fiberplan.visuals.canvas import blank, save

COLOUR = {REPAIRED: style.SERIES[0], LITERAL: style.SERIES[1], LIMITED: style.SERIES[2]}
MARKER = {REPAIRED: "o", LITERAL: "s", LIMITED: "^"}
PAPER = {"color": style.PAPER_SERIES, "linewidth": 1.4, "linestyle": (0, (5, 2))}
N = "number of positioners"
PANELS = 6


def fig5(runs: Runs, path: Path) -> None:
    """Computing time against the number of positioners."""
    figure, (ax,) = blank((6.4, 5.0))
    _against_number(ax, runs, "cpu")
    largest = max(published.RUN_TIME)
    at = np.array([largest / 100, largest])
    ax.plot(at, published.LONGEST_RUN * at / largest, **PAPER, label="Makarem2014")
    ax.set_yscale("log")
    _finish(ax, "Fig. 5: computing time", N, "CPU time [s]")
    save(figure, path)


def fig6(runs: Runs, path: Path) -> None:
    """Motion time against the number of positioners."""
    figure, (ax,) = blank((6.4, 5.0))
    _against_number(ax, runs, "motion_time")
    ax.axhline(2.5, **PAPER, label="Makarem2014: about 2.5 s")
    ax.set_ylim(0)
    _finish(ax, "Fig. 6: motion time, bars are standard deviations", N, "motion time, until all who converge have [s]")
    save(figure, path)


def fig7(conflict: Conflict, path: Path) -> None:
    """Three positioners in a conflict: six moments."""
    figure, axes = blank((11.0, 7.4), columns=3, rows=2)
    plane, d = conflict.plan.problem.plane, published.SPACING
    for ax, k in zip(axes, np.linspace(0, len(conflict.times) - 1, PANELS).round().astype(int), strict=True):
        for i, colour in enumerate(style.SERIES[:3]):
            base, elbow, fiber = plane.base[i], conflict.elbows[k, i], conflict.fibers[k, i]
            ax.plot(*np.array([base, elbow, fiber]).T, "-o", color=colour, linewidth=2.2, markersize=4)
            ax.plot(*conflict.fibers[: k + 1, i].T, color=colour, linewidth=0.9, alpha=0.7)
            ax.plot(*conflict.targets[i], "x", color=colour, markersize=8, markeredgewidth=2)
            ax.add_patch(Circle(tuple(fiber), d / 2, facecolor=colour, alpha=0.25))
            ax.add_patch(Circle(tuple(base), 6.0, fill=False, edgecolor=style.LINE.light))
        ax.set_aspect("equal")
        ax.set_title(f"{conflict.times[k]:.2f} s", loc="left", color=style.INK.light, fontsize=10)
        ax.set_xlabel("x [mm]")
        ax.set_ylabel("y [mm]")
    axes[0].set_title("Fig. 7: 0.00 s", loc="left", color=style.INK.light, fontweight="bold", fontsize=11)
    save(figure, path)


def fig8(conflict: Conflict, path: Path) -> None:
    """Joint speeds in that conflict."""
    figure, axes = blank((10.0, 4.6), columns=2)
    for k, (ax, joint, most) in enumerate(zip(axes, ("theta", "phi"), published.SPEEDS, strict=True)):
        for i, colour in enumerate(style.SERIES[:3]):
            label = f"positioner {conflict.plan.problem.plane.ids[i]}"
            ax.plot(conflict.times, np.degrees(conflict.speeds[:, i, k]), color=colour, linewidth=1.4, label=label)
        for sign in (-1, 1):
            ax.axhline(sign * most, **PAPER, label="limit" if sign > 0 else None)
        _finish(ax, f"Fig. 8: speed of {joint}", "time [s]", f"speed of {joint} [deg/s]")
    save(figure, path)


def _against_number(ax: Axes, runs: Runs, what: str) -> None:
    """Mean and standard deviation of a quantity against the number of positioners, by rule."""
    for rule in RULES:
        some = [trials for (other, _), trials in runs.trials.items() if other is rule]
        sizes = [trials[0].n for trials in some]
        values = [[getattr(trial, what) for trial in trials] for trials in some]
        spread = [np.std(v, ddof=1) if len(v) > 1 else 0.0 for v in values]
        ax.errorbar(
            sizes,
            [np.mean(v) for v in values],
            None if what == "cpu" else spread,
            fmt=MARKER[rule] + "-",
            color=COLOUR[rule],
            label=rule.name,
            markersize=5,
            linewidth=1.4,
            capsize=2,
        )
    ax.set_xscale("log")


def _finish(ax: Axes, title: str, x: str, y: str) -> None:
    """Words, and the legend below."""
    ax.set_title(title, loc="left", color=style.INK.light, fontweight="bold", fontsize=11)
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    legend = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.14), "frameon": False, "fontsize": 9}
    ax.legend(ncols=2, labelcolor=style.INK.light, **legend)
