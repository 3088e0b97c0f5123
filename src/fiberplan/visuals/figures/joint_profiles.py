"""Joint angles and joint speeds over time, of a few positioners."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes

from fiberplan.errors import PlanError
from fiberplan.plan import Plan
from fiberplan.visuals import style
from fiberplan.visuals.canvas import WIDE, blank, keyed_below, titled
from fiberplan.visuals.figures.chosen import chosen
from fiberplan.visuals.figures.registry import FIGURES

_SHOWN = 4  # positioners where none is named
_DASHES = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))  # told apart without colour, too


@FIGURES.register("joints")
def joints(
    plan: Plan, axes: Sequence[Axes] | None = None, positioners: Sequence[str | int] | None = None
) -> list[Axes]:
    """Draw both joint angles over time; between knots joints turn evenly, so the lines are exact.

    Args:
        plan: whose motion.
        axes: two, for alpha and beta; those of a new figure unless given.
        positioners: ids or indices; four that are worth a look unless given.

    Raises:
        PlanError: no such positioner, or not two axes.
    """

    def line(ax: Axes, times: np.ndarray, angles: np.ndarray, **how: object) -> None:
        times = np.concatenate([times, [plan.makespan]])
        ax.plot(times, np.degrees(np.append(angles, angles[-1])), marker=".", markersize=3.5, **how)

    limits = np.stack([plan.problem.plane.lower, plan.problem.plane.upper])
    return _profiles(plan, axes, positioners, line, "angle", "[deg]", limits)


@FIGURES.register("speeds")
def speeds(
    plan: Plan, axes: Sequence[Axes] | None = None, positioners: Sequence[str | int] | None = None
) -> list[Axes]:
    """Draw both joint speeds over time, as they are between knots.

    Args:
        plan: whose motion.
        axes: two, for alpha and beta; those of a new figure unless given.
        positioners: ids or indices; four that are worth a look unless given.

    Raises:
        PlanError: no such positioner, or not two axes.
    """

    def line(ax: Axes, times: np.ndarray, angles: np.ndarray, **how: object) -> None:
        speed = np.diff(angles) / np.diff(times)
        edges = np.concatenate([times, [max(plan.makespan, times[-1] + 1e-9)]])
        ax.stairs(np.degrees(np.append(speed, 0.0)), edges, baseline=None, **how)

    most = plan.problem.plane.max_speed
    return _profiles(plan, axes, positioners, line, "speed", "[deg/s]", np.stack([-most, most]))


def _profiles(
    plan: Plan,
    axes: Sequence[Axes] | None,
    positioners: Sequence[str | int] | None,
    line: Callable[..., None],
    what: str,
    unit: str,
    limits: np.ndarray,
) -> list[Axes]:
    """One panel a joint: `line` draws one positioner's; `limits` (2, n, 2) [rad or rad/s] are dotted."""
    axes = blank((WIDE, 3.3), columns=2)[1] if axes is None else list(axes)
    if len(axes) != 2:
        raise PlanError(f"two joints need two axes, got {len(axes)}")
    who, plane = chosen(plan, positioners, _SHOWN), plan.problem.plane
    for k, (ax, joint) in enumerate(zip(axes, plane.kinematics.joints, strict=True)):
        for n, i in enumerate(who):
            times, angles = plan.trajectory.knots(i)
            colour, dash = style.SERIES[n % len(style.SERIES)], _DASHES[n % len(_DASHES)]
            line(ax, times, angles[:, k], color=colour, linestyle=dash, linewidth=1.4, label=plane.ids[i])
        ends = np.unique(np.degrees(limits[:, who, k]))
        for m, end in enumerate(ends[np.isfinite(ends)] if len(ends) <= 4 else []):
            ax.axhline(end, color=style.MUTED.light, linewidth=0.8, linestyle=":", label="" if m else "limit")
        titled(ax, f"{what} of {joint}", "time [s]", f"{joint} {unit}" if what == "angle" else f"{joint} speed {unit}")
        ax.set_xlim(0.0, max(plan.makespan, 1e-9))
    keyed_below(axes, axes[0].get_legend_handles_labels()[0], columns=6)
    return axes
