"""How near arms come to each other: over time, and pair by pair. Everything drawn is a proven bound."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes

from fiberplan.certificates import clearance_over_time
from fiberplan.certificates.safety import CAP
from fiberplan.errors import PlanError
from fiberplan.plan import Plan
from fiberplan.plan.closest import pair_bounds
from fiberplan.visuals import style
from fiberplan.visuals.canvas import blank, keyed, titled
from fiberplan.visuals.figures.registry import FIGURES

_PAIRS = 4  # the closest, drawn by themselves
_BINS = 40  # of the histogram, up to the last


@FIGURES.register("clearance")
def clearance(
    plan: Plan, ax: Axes | None = None, positioners: Sequence[str | int] | None = None, slices: int = 160
) -> Axes:
    """Draw the least clearance over time: of all pairs, and of the closest ones each.

    The motion is cut into slices, in each of which the bound drawn is proven, to 0.01 mm. Pairs that stay farther apart
    than 2 mm more than the margin are told from each other no more.

    Args:
        plan: whose motion.
        ax: to draw on; those of a new figure unless given.
        positioners: ids or indices of those whose pairs alone are looked at; everybody unless given.
        slices: how many parts the motion is cut into.

    Raises:
        PlanError: no such positioner, or no slice.
    """
    if slices < 1:
        raise PlanError(f"a motion cannot be cut into {slices} slices")
    ax = blank((7.2, 3.8))[1][0] if ax is None else ax
    problem, plane, top = plan.problem, plan.problem.plane, plan.problem.margin + CAP
    edges = np.linspace(0.0, max(plan.makespan, 1e-9), slices + 1)
    error = 0.0 if problem.position_error is None else problem.position_error
    pairs, whole = pair_bounds(plan.problem.plane, plan.certificate)
    near = whole < top
    if positioners is not None:
        near &= np.isin(pairs, [plan[key].index for key in positioners]).any(axis=1)
    pairs, whole = pairs[near], whole[near]
    bounds = clearance_over_time(plane, plan.trajectory, edges, problem.margin, error, pairs).clearance
    bounds = np.maximum(bounds, whole)
    least = bounds.min(axis=0, initial=np.inf)
    everybody = np.minimum(bounds.min(axis=1, initial=np.inf), top)
    line = np.where(everybody < top, everybody, np.nan)
    ax.stairs(line, edges, baseline=None, color=style.OBSTACLE.light, linewidth=3.6, label="closest of all")
    for n, k in enumerate(np.argsort(least, kind="stable")[:_PAIRS]):
        a, b = (plane.label(int(i)) for i in pairs[k])
        colour = style.SERIES[n + 1]
        near = np.where(bounds[:, k] < top, bounds[:, k], np.nan)
        ax.stairs(near, edges, baseline=None, color=colour, linewidth=1.1, label=f"{a} and {b}: {_down(least[k])} mm")
    _mark(ax.axhline, problem.margin)
    low = float(min(everybody.min(), problem.margin))
    ax.set_ylim(low - 0.05 * (top - low), top)
    ax.set_xlim(0.0, edges[-1])
    titled(ax, f"{plane.name}: proven clearance over time", "time [s]", "clearance [mm]")
    keyed(ax, loc="upper left", bbox_to_anchor=(0.0, -0.15), ncols=3, fontsize=8)
    return ax


@FIGURES.register("histogram")
def histogram(plan: Plan, ax: Axes | None = None) -> Axes:
    """Draw how many pairs come how near at their closest, by the bounds of the certificate.

    Args:
        plan: whose certificate.
        ax: to draw on; those of a new figure unless given.
    """
    ax = blank((6.4, 3.8))[1][0] if ax is None else ax
    certificate = plan.certificate
    top = certificate.margin + CAP
    low = float(np.floor(min(certificate.smallest, certificate.margin) * 10.0) / 10.0)
    width = (top - low) / _BINS
    edges = np.append(low + width * np.arange(_BINS + 1), top + 3.0 * width)
    below = np.zeros(_BINS)
    for kind, bounds, colour in (
        ("two positioners", certificate.clearance, style.SERIES[0]),
        ("positioner and obstacle", certificate.obstacle_clearance, style.SERIES[4]),
    ):
        if len(bounds):
            counts = np.histogram(np.minimum(bounds, top + width), edges)[0]
            far = f", {counts[-1]} of them beyond {top:g} mm" if counts[-1] else ""
            shown = below + counts[:-1]
            ax.stairs(shown, edges[:-1], baseline=below, fill=True, color=colour, label=f"{kind}: {len(bounds)}{far}")
            below = shown
    _mark(ax.axvline, certificate.margin)
    ax.set_xlim(low - width, top)
    title = f"{plan.problem.plane.name}: how near pairs come at their closest"
    titled(ax, title, "proven least clearance of a pair [mm]", "pairs")
    keyed(ax, loc="upper left", bbox_to_anchor=(0.0, -0.15), fontsize=8)
    return ax


def _mark(line: Callable[..., object], margin: float) -> None:
    """A line at the margin."""
    line(margin, color=style.CONTACT.light, linewidth=1.0, linestyle="--", label=f"margin {margin:g} mm")


def _down(value: float) -> str:
    """A proven bound in words, never rounded up."""
    return f"{np.floor(value * 1e3) / 1e3:.3f}"
