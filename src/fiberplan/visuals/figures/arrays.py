"""The array at one moment of a plan, or at several in a row, with true shapes, coloured by outcome."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch

from fiberplan.errors import PlanError
from fiberplan.focal_plane import FocalPlane
from fiberplan.plan import Outcome, Plan
from fiberplan.tolerances import ARRIVAL
from fiberplan.visuals import style
from fiberplan.visuals.canvas import WIDE, blank, keyed, keyed_below, titled
from fiberplan.visuals.figures.registry import FIGURES
from fiberplan.visuals.shapes import fixed_outlines, outlines, span

_AROUND = 2.2  # half the width of a detail, in reaches of the positioner in its middle
_MOMENTS = 4  # in a row of snapshots


@FIGURES.register("focal-plane")
def focal_plane(
    plan: Plan, ax: Axes | None = None, time: float | None = None, positioner: str | int | None = None
) -> Axes:
    """Draw the focal plane at one moment.

    Args:
        plan: whose motion.
        ax: to draw on; those of a new figure unless given.
        time: the moment [s]; the end unless given.
        positioner: id or index of the one whose surroundings are drawn; everybody unless given.

    Raises:
        PlanError: a moment outside the motion, or no such positioner.
    """
    ax = blank((WIDE, 6.0))[1][0] if ax is None else ax
    time = moment(plan, plan.makespan if time is None else time)
    _draw_at(ax, plan, time, positioner)
    verdict = "proven safe" if plan.certificate.ok else "NOT SAFE"
    titled(ax, f"{plan.problem.plane.name}, t = {time:.1f} s of {plan.makespan:.1f} s", "x [mm]", "y [mm]")
    keyed(ax, handles=legend(plan), title=verdict)
    ax.get_legend().get_title().set_color((style.SAFE if plan.certificate.ok else style.CONTACT).light)
    return ax


@FIGURES.register("snapshots")
def snapshots(
    plan: Plan,
    axes: Sequence[Axes] | None = None,
    times: Sequence[float] | None = None,
    positioner: str | int | None = None,
) -> list[Axes]:
    """Draw the focal plane at several moments, side by side.

    Args:
        plan: whose motion.
        axes: to draw on, one a moment; those of a new figure unless given.
        times: the moments [s]; evenly from start to end unless given.
        positioner: id or index of the one whose surroundings are drawn; everybody unless given.

    Raises:
        PlanError: a moment outside the motion, no such positioner, or another number of axes than of moments.
    """
    count = _MOMENTS if axes is None else len(axes)
    moments = [moment(plan, t) for t in (np.linspace(0.0, plan.makespan, count) if times is None else times)]
    if axes is None:
        axes = blank((WIDE, 1.1 + 0.94 * WIDE / max(len(moments), 1)), columns=len(moments))[1]
    if len(axes) != len(moments):
        raise PlanError(f"{len(moments)} moments need as many axes, got {len(axes)}")
    for k, (ax, time) in enumerate(zip(axes, moments, strict=True)):
        _draw_at(ax, plan, time, positioner)
        titled(ax, f"t = {time:.1f} s", "x [mm]", "" if k else "y [mm]")
        ax.tick_params(labelleft=k == 0)
    (left, right), (bottom, top) = (
        np.transpose([ax.get_xlim() for ax in axes]),
        np.transpose([ax.get_ylim() for ax in axes]),
    )
    for ax in axes:  # one scale, though arms reach farther out at one moment than at another
        ax.set(xlim=(left.min(), right.max()), ylim=(bottom.min(), top.max()))
    keyed_below(axes, legend(plan), columns=6)
    return list(axes)


def moment(plan: Plan, time: float) -> float:
    """`time` [s] as a moment of the motion.

    Raises:
        PlanError: it is none.
    """
    if not 0 <= time <= plan.makespan + 1e-9:
        raise PlanError(f"time {time:g} s is not within the motion, which lasts {plan.makespan:.6g} s")
    return float(time)


def draw_configuration(
    ax: Axes, plane: FocalPlane, angles: np.ndarray, outcomes: Sequence[Outcome], who: np.ndarray | None = None
) -> None:
    """Draw the positioners `who` (all unless given) at `angles` (n, 2) [rad], and the obstacles, to equal scale."""
    draw_fixed(ax, plane)
    chosen = slice(None) if who is None else who
    scale = _points_per_mm(ax, plane, who)
    line, fine = float(np.clip(0.8 * scale, 0.2, 1.6)), float(np.clip(0.2 * scale, 0.0, 0.3))
    for links in plane.kinematics.skeleton(plane, angles):
        ax.add_collection(LineCollection(list(links[chosen]), colors=style.MUTED.light, linewidths=line, zorder=2))
    colours = np.array([style.OUTCOMES[outcome].light for outcome in outcomes])
    for some in outlines(plane, who):
        faces = colours[some.positioners] if some.link == "beta" else style.LINE.light
        alone = len(some.offsets) - 1 == len(np.unique(some.positioners))
        rim = fine if alone else 0.0  # pieces of one body touch, and a rim would show their seams
        shapes = some.split(some.placed(plane, angles))
        ax.add_collection(PolyCollection(shapes, facecolor=faces, edgecolor=style.PAPER.light, linewidth=rim, zorder=3))
    ax.set_aspect("equal")
    ax.grid(False)
    ax.autoscale_view()
    ax.margins(0.02)


def _points_per_mm(ax: Axes, plane: FocalPlane, who: np.ndarray | None) -> float:
    """How large a millimetre will be drawn, about."""
    low, high = span(plane if who is None else plane.subset(who, np.array([], int)))
    return float(72.0 * ax.get_figure().get_figwidth() * ax.get_position().width / (high - low).max())


def draw_fixed(ax: Axes, plane: FocalPlane) -> None:
    """Draw the obstacles, and the places where no fiber may end."""
    shapes = fixed_outlines(plane)
    ax.add_collection(PolyCollection(shapes, facecolor=style.OBSTACLE.light, edgecolor="none", zorder=1))
    for x, y, radius in plane.forbidden:
        ax.add_patch(Circle((x, y), radius, fill=False, edgecolor=style.CONTACT.light, linewidth=0.6, zorder=4))


def draw_goals(ax: Axes, plan: Plan, angles: np.ndarray) -> None:
    """A dot on every target, white where a fiber is at it; a cross on a lost one, and a line to it from the fiber."""
    plane = plan.problem.plane
    goals, fibers = plane.fibers(plan.problem.requested), plane.fibers(angles)
    there = np.linalg.norm(fibers - goals, axis=1) <= ARRIVAL
    ax.scatter(*goals[~there].T, s=4, color=style.MUTED.light, linewidths=0, zorder=1.5)
    ax.scatter(*goals[there].T, s=2, color=style.PAPER.light, linewidths=0, zorder=5)
    lost = np.array([i for i in plan.lost if np.isfinite(goals[i]).all()], dtype=np.int64)
    if len(lost):
        colours = [style.OUTCOMES[plan.outcomes[i]].light for i in lost]
        away = np.stack([fibers[lost], goals[lost]], axis=1)
        ax.add_collection(LineCollection(list(away), colors=colours, linestyles=":", linewidths=1.2, zorder=6))
        ax.scatter(*goals[lost].T, s=60, marker="x", color=style.PAPER.light, linewidths=3.4, zorder=7)
        ax.scatter(*goals[lost].T, s=45, marker="x", color=colours, linewidths=1.6, zorder=8)


def legend(plan: Plan) -> list[Patch | Line2D]:
    """What the colours mean, and how many there are of each."""
    counts = {outcome: len(plan.having(outcome)) for outcome in style.OUTCOMES}
    handles: list[Patch | Line2D] = [
        Patch(facecolor=colour.light, label=f"{style.LABELS[outcome]}  {counts[outcome]}")
        for outcome, colour in style.OUTCOMES.items()
        if counts[outcome]
    ]
    if len(plan.lost):
        cross = Line2D([], [], marker="x", linestyle="", markeredgewidth=1.6, color=style.MUTED.light)
        cross.set_label("lost target")
        handles.append(cross)
    if plan.problem.plane.obstacles:
        handles.append(Patch(facecolor=style.OBSTACLE.light, label="obstacle"))
    return handles


def _draw_at(ax: Axes, plan: Plan, time: float, positioner: str | int | None) -> None:
    """Everybody, or the surroundings of one, at a moment."""
    plane, angles = plan.problem.plane, plan.trajectory.at(time)
    if positioner is None:
        draw_configuration(ax, plane, angles, plan.outcomes)
        draw_goals(ax, plan, angles)
        return
    i = plan[positioner].index
    half = _AROUND * plane.reach[i]
    seen = np.abs(plane.base - plane.base[i]).max(axis=1) <= half + plane.reach.max()
    draw_configuration(ax, plane, angles, plan.outcomes, np.flatnonzero(seen))
    draw_goals(ax, plan, angles)
    for axis, middle in zip((ax.set_xlim, ax.set_ylim), plane.base[i], strict=True):
        axis(middle - half, middle + half)
    ax.plot(*plane.fibers(angles)[i], "o", markersize=4, color=style.INK.light, zorder=9)
