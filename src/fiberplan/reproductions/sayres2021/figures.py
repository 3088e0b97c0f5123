"""Sayres2021's figures as this run gives them, the paper's own values beside them in grey."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from fiberplan.focal_plane import FocalPlane
from fiberplan.reproductions.sayres2021 import published
from fiberplan.reproductions.sayres2021.relief import Reliefs
from fiberplan.reproductions.sayres2021.rules import CERTIFIED, LITERAL, RULES, SAMPLED, Rule
from fiberplan.reproductions.sayres2021.tables import REGIMES, degrees, most_winding, pool, target_to_target
from fiberplan.reproductions.sayres2021.trials import Sweep
from fiberplan.trajectory import Trajectory
from fiberplan.visuals import style
from fiberplan.visuals.figures import blank, rounded, save

COLOUR = {CERTIFIED: style.SERIES[0], LITERAL: style.SERIES[1], SAMPLED: style.SERIES[2]}
MARKER = {CERTIFIED: "o", LITERAL: "s", SAMPLED: "^"}
SHIFT = {LITERAL: -1.0, SAMPLED: 0.0, CERTIFIED: 1.0}  #: so that markers of equal values stay visible
OURS = {"markersize": 5, "linewidth": 1.4, "capsize": 2}
PAPER = {"color": style.PAPER_SERIES, "linewidth": 1.4, "linestyle": (0, (5, 2))}
BUFFER = "collision buffer [mm]"


def fig10(plane: FocalPlane, motions: list[Trajectory], steps: list[float], path: Path) -> None:
    """One positioner's way to folded at each step: in the focal plane, and its joint angles."""
    i = most_winding(motions)
    figure, (left, right) = blank((10.0, 4.4), columns=2)
    for motion, step, colour, width in zip(motions, steps, style.SERIES, (3.2, 1.2), strict=False):
        times = np.linspace(0.0, motion.duration, 2000)
        at = [motion.at(t) for t in times]
        where, angles = np.array([plane.fibers(a)[i] for a in at]), np.degrees([a[i] for a in at])
        left.plot(*where.T, color=colour, linewidth=width, label=f"fiber, step {degrees(step)}")
        right.plot(times, angles[:, 0], color=colour, linewidth=width, label=f"alpha, step {degrees(step)}")
        right.plot(times, angles[:, 1], color=colour, linewidth=width, ls=":", label=f"beta, step {degrees(step)}")
    for angles, label, face in (
        (motions[0].start, "at the target", "none"),
        (motions[0].end, "folded", style.LINE.light),
    ):
        elbow, fiber = plane.elbows(angles)[i], plane.fibers(angles)[i]
        outline = rounded(np.array([elbow, fiber]), published.RADIUS)
        left.fill(
            *outline.T, facecolor=face, edgecolor=style.MUTED.light, linewidth=1.0, zorder=1, label=f"arm {label}"
        )
    left.plot(*plane.base[i], "+", color=style.INK.light, markersize=9)
    left.set_aspect("equal")
    left.set_title(f"Fig. 10: {plane.ids[i]} from its target to folded")
    left.set_xlabel("x [mm]")
    left.set_ylabel("y [mm]")
    right.set_title("its joint angles")
    right.set_xlabel("time [s]")
    right.set_ylabel("[deg]")
    left.legend(fontsize=8)
    right.legend(fontsize=8)
    save(figure, path)


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
    ax.set_title("Fig. 11: run time of a fold, 547 positioners")
    ax.set_xlabel("step [deg]")
    ax.set_ylabel("CPU time [s]")
    ax.legend()
    save(figure, path)


def fig12(sweep: Sweep, path: Path) -> None:
    """Share of positioners that fold against the buffer."""
    figure, (ax,) = blank()
    _against_buffer(ax, {key: [trial.folded for trial in trials] for key, trials in sweep.items()})
    ax.plot(
        [published.RADIUS, published.FOLDED_BELOW], [published.FOLDED] * 2, **PAPER, label="Sayres2021: at least this"
    )
    _collapse(ax, "falls sharply past this")
    ax.set_title("Fig. 12: share of positioners that fold")
    ax.set_xlabel(BUFFER)
    ax.legend(loc="lower left")
    save(figure, path)


def fig14(coarse: Sweep, fine: Sweep, path: Path) -> None:
    """Chance that a trial deadlocks against the buffer; bars hold 68 % of the belief (Wilson)."""
    figure, (ax,) = blank()
    for sweep, how in ((coarse, "1 deg"), (fine, "0.1 deg")):
        for rule in RULES:
            chances = {b: [not t.complete for t in trials] for (other, b), trials in sweep.items() if other is rule}
            x = np.array(list(chances)) + 0.012 * SHIFT[rule]
            y = np.array([np.mean(some) for some in chances.values()])
            low, high = np.array([_wilson(sum(some), len(some)) for some in chances.values()]).T
            solid = sweep is coarse
            ax.errorbar(
                x,
                y,
                [y - low, high - y],
                fmt=MARKER[rule] + ("-" if solid else ""),
                color=COLOUR[rule],
                markerfacecolor=COLOUR[rule] if solid else "none",
                label=f"{rule.name}, {how}",
                **OURS,
            )
    ax.plot([1.45, 1.6], [published.DEADLOCK] * 2, **PAPER, label="Sayres2021: at most this")
    ax.plot([published.COLLAPSE, 3.0], [1.0, 1.0], **PAPER)
    _collapse(ax, "certain past this")
    ax.set_title("Fig. 14: chance that a trial deadlocks")
    ax.set_xlabel(BUFFER)
    ax.legend(loc="lower right", fontsize=8)
    save(figure, path)


def fig15(reliefs: Reliefs, path: Path) -> None:
    """How many replacements resolve a deadlocked trial, as cumulative shares."""
    figure, axes = blank((10.0, 4.2), columns=2)
    for ax, (side, where) in zip(axes, REGIMES.items(), strict=True):
        for rule in RULES:
            counts = np.sort([len(one.replaced) for one in pool(reliefs, rule, side) if one.replaced])
            if len(counts):
                y = np.arange(len(counts) + 1) / len(counts)
                x = np.concatenate([[0], counts])
                ax.step(
                    x, y, where="post", color=COLOUR[rule], label=f"{rule.name}: {len(counts)} trials", linewidth=1.6
                )
        median = published.REPLACEMENTS[side]
        ax.axvline(median, **PAPER, label=f"Sayres2021, median: {median:g}")
        ax.axhline(0.5, color=style.LINE.light, linewidth=1.0)
        ax.set_xlim(left=0)
        ax.set_ylim(0, 1.02)
        ax.set_title(f"Fig. 15: deadlocked trials at buffers {where}")
        ax.set_xlabel("targets replaced")
        ax.set_ylabel("share resolved by then")
        ax.legend(loc="lower right")
    save(figure, path)


def fig16(sweep: Sweep, reliefs: Reliefs, path: Path) -> None:
    """Fold time and time from target to target against the buffer; bars are standard deviations."""
    figure, axes = blank((10.0, 4.2), columns=2)
    alone = {key: [t.fold_time for t in trials if t.complete] for key, trials in sweep.items()}
    made = {key: [one.trial.fold_time for one in some if one.trial.complete] for key, some in reliefs.items()}
    moves = {key: target_to_target(times) for key, times in made.items()}
    for ax, (middle, spread) in zip(axes, (published.FOLD_TIME, published.MOVE_TIME), strict=True):
        band = {"color": style.LINE.light, "alpha": 0.6, "linewidth": 0}
        ax.axhspan(middle - spread, middle + spread, **band, label="Sayres2021")
        ax.axhline(middle, **PAPER)
        ax.set_xlabel(BUFFER)
        ax.set_ylabel("[s]")
    _against_buffer(axes[0], alone, labelled=", alone")
    _against_buffer(axes[0], made, labelled=", replaced", hollow=True)
    _against_buffer(axes[1], moves, hollow=True)
    axes[0].set_title("Fig. 16: target to folded")
    axes[1].set_title("Fig. 16: target to folded to target, replaced")
    axes[0].legend(fontsize=8)
    axes[1].legend(fontsize=8)
    save(figure, path)


def _against_buffer(
    ax: Axes, values: dict[tuple[Rule, float], list[float]], labelled: str = "", hollow: bool = False
) -> None:
    """Mean and standard deviation by rule and buffer, where there are any values."""
    for rule in RULES:
        some = {buffer: v for (other, buffer), v in values.items() if other is rule and v}
        ax.errorbar(
            np.array(list(some)) + 0.012 * SHIFT[rule] + (0.04 if hollow else 0.0),
            [np.mean(v) for v in some.values()],
            [np.std(v, ddof=1) if len(v) > 1 else 0.0 for v in some.values()],
            fmt=MARKER[rule] + ("" if hollow else "-"),
            color=COLOUR[rule],
            markerfacecolor="none" if hollow else COLOUR[rule],
            label=rule.name + labelled,
            **OURS,
        )


def _collapse(ax: Axes, text: str) -> None:
    """Mark the buffer past which the paper sees folding fail."""
    ax.axvline(published.COLLAPSE, color=style.PAPER_SERIES, linewidth=1.0, linestyle=":", label=f"Sayres2021: {text}")


def _wilson(hits: int, n: int) -> tuple[float, float]:
    """Where a chance lies after `hits` of `n`: Wilson's interval at one standard deviation."""
    centre, half = (hits + 0.5) / (n + 1), np.sqrt(hits * (n - hits) / n + 0.25) / (n + 1)
    return centre - half, centre + half
