"""Sayres2021's figures as this run gives them, the paper's own values beside them in grey."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.reproductions.sayres2021 import published
from fiberplan.reproductions.sayres2021.relief import Reliefs
from fiberplan.reproductions.sayres2021.rules import CERTIFIED, LITERAL, RULES, SAMPLED, Rule
from fiberplan.reproductions.sayres2021.tables import (
    COVERAGE_STEP,
    REGIMES,
    degrees,
    most_winding,
    pool,
    target_to_target,
)
from fiberplan.reproductions.sayres2021.trials import Sweep
from fiberplan.visuals import style
from fiberplan.visuals.canvas import blank, save
from fiberplan.visuals.figures import coverage, multiplicity
from fiberplan.visuals.shapes import rounded

COLOUR = {CERTIFIED: style.SERIES[0], LITERAL: style.SERIES[1], SAMPLED: style.SERIES[2]}
MARKER = {CERTIFIED: "o", LITERAL: "s", SAMPLED: "^"}
SHIFT = {LITERAL: -0.012, SAMPLED: 0.0, CERTIFIED: 0.012}  #: so that equal values stay visible [mm]
BESIDE = 0.045  #: a second series stands this far beside the first [mm]
BARS = {"markersize": 5, "linewidth": 1.4, "capsize": 2}
PAPER = {"color": style.PAPER_SERIES, "linewidth": 1.4, "linestyle": (0, (5, 2))}
TITLE = {"loc": "left", "color": style.INK.light, "fontweight": "bold", "fontsize": 11}
BUFFER = "collision buffer [mm]"


def fig4(plane: FocalPlane, path: Path) -> None:
    """By how many fibers each point is reached."""
    figure, (ax,) = blank((7.2, 5.6))
    coverage(plane, ax, step=COVERAGE_STEP)
    ax.set_title("Fig. 4: how many fibers reach each point", **TITLE)
    save(figure, path)


def fig7(plane: FocalPlane, path: Path) -> None:
    """With how many others each positioner can come into contact."""
    figure, (ax,) = blank((7.2, 5.6))
    multiplicity(plane, ax)
    ax.set_title("Fig. 7: with how many others contact is possible", **TITLE)
    save(figure, path)


def fig10(plane: FocalPlane, motions: list[Trajectory], steps: list[float], path: Path) -> None:
    """One positioner's way to folded at each step: in the focal plane, and its joint angles."""
    i = most_winding(motions)
    figure, (left, right) = blank((10.0, 5.4), columns=2)
    start, end = motions[0].start, motions[0].end
    near = np.flatnonzero(np.hypot(*(plane.base - plane.base[i]).T) < 2.5 * plane.reach[i])
    others = PolyCollection(
        [_arm(plane, start, int(j)) for j in near[near != i]], facecolor=style.LINE.light, alpha=0.6
    )
    others.set_label("other arms at their targets")
    left.add_collection(others)
    left.fill(*_arm(plane, start, i).T, facecolor="none", edgecolor=style.INK.light, label="arm at its target")
    left.fill(*_arm(plane, end, i).T, facecolor=style.OBSTACLE.light, edgecolor=style.INK.light, label="arm folded")
    left.plot(*plane.base[i], "+", color=style.INK.light, markersize=9)
    for motion, step, colour, width in zip(motions, steps, style.SERIES, (3.2, 1.2), strict=False):
        times = np.linspace(0.0, motion.duration, 1500)
        at = [motion.at(t) for t in times]
        fiber, angles = np.array([plane.fibers(a)[i] for a in at]), np.degrees([a[i] for a in at])
        left.plot(*fiber.T, color=colour, linewidth=width, label=f"fiber, step {degrees(step)}")
        right.plot(times, angles[:, 0], color=colour, linewidth=width, label=f"alpha, step {degrees(step)}")
        right.plot(times, angles[:, 1], color=colour, linewidth=width, ls=":", label=f"beta, step {degrees(step)}")
    left.set_aspect("equal")
    middle, half = plane.base[i], 1.1 * plane.reach[i]
    left.set_xlim(middle[0] - half, middle[0] + half)
    left.set_ylim(middle[1] - half, middle[1] + half)
    _finish(left, f"Fig. 10: {plane.ids[i]} from its target to folded", "x [mm]", "y [mm]", columns=2)
    _finish(right, "its joint angles", "time [s]", "joint angle [deg]", columns=2)
    save(figure, path)


def _arm(plane: FocalPlane, angles: np.ndarray, i: int) -> np.ndarray:
    """Outline of a second arm (k, 2) [mm]."""
    return rounded(np.array([plane.elbows(angles)[i], plane.fibers(angles)[i]]), published.RADIUS)


def fig11(times: dict[tuple[Rule, float], list[float]], path: Path) -> None:
    """Run time of a fold against the step."""
    figure, (ax,) = blank()
    for rule in RULES:
        values = {step: some for (other, step), some in times.items() if other is rule}
        x, y = np.degrees(list(values)), [np.mean(some) for some in values.values()]
        ax.plot(x, y, MARKER[rule] + "-", color=COLOUR[rule], label=rule.name, markersize=5, linewidth=1.4)
    ax.plot(*zip(*published.RUN_TIME.items(), strict=True), marker="D", **PAPER, label="Sayres2021")
    ax.set_xscale("log")
    ax.set_yscale("log")
    _finish(ax, "Fig. 11: run time of a fold, 547 positioners", "step [deg]", "CPU time [s]", columns=4)
    save(figure, path)


def fig12(sweep: Sweep, path: Path) -> None:
    """Share of positioners that fold against the buffer."""
    figure, (ax,) = blank((6.4, 4.6))
    shares = {key: [trial.folded for trial in trials] for key, trials in sweep.items()}
    _against_buffer(ax, shares, "", most=1.0)
    below = [published.RADIUS, published.FOLDED_BELOW]
    ax.plot(below, [published.FOLDED] * 2, **PAPER, label="Sayres2021: above this")
    _collapse(ax, "falls sharply past this")
    _finish(ax, "Fig. 12: share of positioners that fold", BUFFER, "share that folds", columns=2)
    save(figure, path)


def fig14(coarse: Sweep, fine: Sweep, path: Path) -> None:
    """Chance that a trial deadlocks against the buffer."""
    figure, (ax,) = blank((6.4, 5.0))
    for sweep, beside, line, how in ((coarse, 0.0, "-", "1 deg"), (fine, BESIDE, "", "0.1 deg")):
        for rule in RULES:
            stuck = {b: [not t.complete for t in trials] for (other, b), trials in sweep.items() if other is rule}
            chance = np.array([np.mean(some) for some in stuck.values()])
            low, high = np.array([_wilson(sum(some), len(some)) for some in stuck.values()]).T
            ax.errorbar(
                np.array(list(stuck)) + SHIFT[rule] + beside,
                chance,
                np.maximum([chance - low, high - chance], 0.0),
                fmt=MARKER[rule] + line,
                color=COLOUR[rule],
                markerfacecolor=COLOUR[rule] if line else "none",
                label=f"{rule.name}, {how}",
                **BARS,
            )
    ax.plot([published.RADIUS - 0.06, published.RADIUS + 0.1], [published.DEADLOCK] * 2, **PAPER)
    ax.plot([published.COLLAPSE, 3.05], [1.0, 1.0], **PAPER, label="Sayres2021: below this, then at this")
    _collapse(ax, "certain past this")
    _finish(ax, "Fig. 14: chance that a trial deadlocks", BUFFER, "chance of a deadlock", columns=2)
    save(figure, path)


def fig15(reliefs: Reliefs, path: Path) -> None:
    """How many replacements resolve a deadlocked trial, as cumulative shares."""
    figure, axes = blank((10.0, 4.6), columns=2)
    width = {LITERAL: 1.6, SAMPLED: 3.6, CERTIFIED: 1.6}
    for ax, (side, where) in zip(axes, REGIMES.items(), strict=True):
        most = max((len(one.replaced) for rule in RULES for one in pool(reliefs, rule, side)), default=0) + 1
        for rule in RULES:
            counts = [len(one.replaced) for one in pool(reliefs, rule, side) if one.replaced]
            if counts:
                x = np.arange(most + 1)
                y = [np.mean(np.array(counts) <= k) for k in x]
                label = f"{rule.name}, {len(counts)} trials"
                ax.step(x, y, where="post", color=COLOUR[rule], linewidth=width[rule], label=label)
        median = published.REPLACEMENTS[side]
        ax.axvline(median, **PAPER, label=f"Sayres2021: median {median:g}")
        ax.axhline(0.5, color=style.MUTED.light, linewidth=0.8, linestyle=":")
        ax.set_xlim(0, max(most, 1.2 * median))
        ax.set_ylim(0, 1.02)
        ax.xaxis.get_major_locator().set_params(integer=True)
        title = f"Fig. 15: replacements at buffers {where}"
        _finish(ax, title, "targets replaced", "share of deadlocked trials resolved", columns=2)
    save(figure, path)


def fig16(sweep: Sweep, reliefs: Reliefs, path: Path) -> None:
    """Fold time and time from target to target against the buffer; bars are standard deviations."""
    figure, axes = blank((10.0, 4.8), columns=2)
    alone = {key: [t.fold_time for t in trials if t.complete] for key, trials in sweep.items()}
    made = {key: [one.trial.fold_time for one in some if one.trial.complete] for key, some in reliefs.items()}
    moves = {key: target_to_target(times) for key, times in made.items()}
    for ax, (middle, spread) in zip(axes, (published.FOLD_TIME, published.MOVE_TIME), strict=True):
        ax.axhspan(middle - spread, middle + spread, color=style.LINE.light, alpha=0.6, linewidth=0, label="Sayres2021")
        ax.axhline(middle, **PAPER)
    _against_buffer(axes[0], alone, ", folds alone")
    _against_buffer(axes[0], made, ", replaced", hollow=True)
    _against_buffer(axes[1], moves, ", replaced", hollow=True)
    _finish(axes[0], "Fig. 16: target to folded", BUFFER, "time [s]", columns=2)
    _finish(axes[1], "Fig. 16: target to folded to target", BUFFER, "time [s]", columns=2)
    save(figure, path)


def _against_buffer(
    ax: Axes,
    values: dict[tuple[Rule, float], list[float]],
    labelled: str,
    hollow: bool = False,
    most: float = np.inf,
) -> None:
    """Mean and standard deviation by rule and buffer, where there are any values; bars end at `most`."""
    for rule in RULES:
        some = {buffer: v for (other, buffer), v in values.items() if other is rule and v}
        middle = np.array([np.mean(v) for v in some.values()])
        spread = np.array([np.std(v, ddof=1) if len(v) > 1 else 0.0 for v in some.values()])
        ax.errorbar(
            np.array(list(some)) + SHIFT[rule] + (BESIDE if hollow else 0.0),
            middle,
            [spread, np.minimum(spread, most - middle)],
            fmt=MARKER[rule] + ("" if hollow else "-"),
            color=COLOUR[rule],
            markerfacecolor="none" if hollow else COLOUR[rule],
            label=rule.name + labelled,
            **BARS,
        )


def _collapse(ax: Axes, text: str) -> None:
    """Mark the buffer past which the paper sees folding fail."""
    ax.axvline(published.COLLAPSE, color=style.PAPER_SERIES, linewidth=1.2, linestyle=":", label=f"Sayres2021: {text}")


def _finish(ax: Axes, title: str, x: str, y: str, columns: int) -> None:
    """Words, and the legend below."""
    ax.set_title(title, **TITLE)
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    legend = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.14), "frameon": False, "fontsize": 9}
    ax.legend(ncols=columns, labelcolor=style.INK.light, **legend)


def _wilson(hits: int, n: int) -> tuple[float, float]:
    """Where a chance lies after `hits` of `n`: Wilson's interval at one standard deviation."""
    centre, half = (hits + 0.5) / (n + 1), np.sqrt(hits * (n - hits) / n + 0.25) / (n + 1)
    return centre - half, centre + half
