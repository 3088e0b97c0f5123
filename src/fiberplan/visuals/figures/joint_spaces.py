"""The joint space of one positioner: its path, and what its neighbours block at one moment of it."""

from collections import Counter

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch

from fiberplan.certificates import clearance_over_time
from fiberplan.focal_plane.joint_space import AVOIDED, FREE, JointSpace
from fiberplan.focal_plane.joint_space import joint_space as blocked_space
from fiberplan.plan import Plan
from fiberplan.plan.closest import pair_bounds
from fiberplan.visuals import style
from fiberplan.visuals.canvas import WIDE, blank, keyed, titled
from fiberplan.visuals.figures.arrays import moment
from fiberplan.visuals.figures.chosen import chosen
from fiberplan.visuals.figures.registry import FIGURES

_NAMED = 5  # neighbours that have a colour of their own
_TINTS = ("#9ecae8", "#f2b38c", "#8fcdbb", "#c9a3d1", "#f7e08a")  # light enough for a path to be seen on them
_OTHERS = "#d9dee3"
_SLICES = 60  # of the motion, to find the closest moment


@FIGURES.register("joint-space")
def joint_space(
    plan: Plan,
    ax: Axes | None = None,
    positioner: str | int | None = None,
    time: float | None = None,
    cells: int = 360,
) -> Axes:
    """Draw where one positioner cannot be at one moment, by whom, and its whole path from start to end.

    Args:
        plan: whose motion.
        ax: to draw on; those of a new figure unless given.
        positioner: id or index; unless given, one that is worth a look.
        time: the moment [s]; the one at which it is closest to others unless given.
        cells: along either joint.

    Raises:
        PlanError: no such positioner, or a moment outside the motion.
        InstrumentError: fewer than two cells.
    """
    ax = blank((WIDE, 4.6))[1][0] if ax is None else ax
    problem, plane = plan.problem, plan.problem.plane
    (i,) = chosen(plan, None if positioner is None else [positioner], 1)
    time = closest_moment(plan, i) if time is None else moment(plan, time)
    angles = plan.trajectory.at(time)
    space = blocked_space(plane, i, angles, problem.margin, cells)
    edges = [np.degrees(side) for side in (space.alpha[0], space.alpha[-1], space.beta[0], space.beta[-1])]
    pixels, legend = _coloured(plan, space)
    ax.imshow(np.swapaxes(pixels, 0, 1), extent=edges, origin="lower", interpolation="nearest", aspect="auto", zorder=0)
    path = np.degrees(plan.trajectory.knots(i)[1])
    ax.plot(*path.T, color=style.PAPER.light, linewidth=3.4, zorder=3)
    ax.plot(*path.T, ".-", color=style.INK.light, linewidth=1.3, markersize=4, zorder=4, label="its path")
    for what, at, mark in (("start", path[0], "o"), ("end", path[-1], "s")):
        ax.plot(*at, mark, markersize=7, color=style.PAPER.light, markeredgecolor=style.INK.light, zorder=5, label=what)
    asked = np.degrees(problem.requested[i])
    if np.isfinite(asked).all() and int(i) in plan.lost:
        ax.plot(*asked, "x", color=style.CONTACT.light, markersize=9, markeredgewidth=2, zorder=6, label="lost target")
    ax.plot(*np.degrees(angles[i]), "o", color=style.CONTACT.light, markersize=7, zorder=7, label=f"at {time:.2f} s")
    ax.grid(False)
    ax.set_xlim(edges[:2])
    ax.set_ylim(edges[2:])
    alpha, beta = plane.kinematics.joints
    titled(ax, f"{plane.ids[i]}: what blocks it at t = {time:.2f} s", f"{alpha} [deg]", f"{beta} [deg]")
    handles = [*legend, *ax.get_legend_handles_labels()[0]]
    keyed(ax, handles=handles, fontsize=8)
    return ax


def closest_moment(plan: Plan, i: int) -> float:
    """About when positioner `i` is closest to anybody else [s]; half way if nobody comes near."""
    edges = np.linspace(0.0, max(plan.makespan, 1e-9), _SLICES + 1)
    pairs, _ = pair_bounds(plan.problem.plane, plan.certificate)
    mine = pairs[(pairs == i).any(axis=1)]
    bounds = clearance_over_time(plan.problem.plane, plan.trajectory, edges, plan.problem.margin, pairs=mine).clearance
    if not bounds.size:
        return plan.makespan / 2
    k = int(np.argmin(bounds.min(axis=1)))
    return float((edges[k] + edges[k + 1]) / 2)


def _coloured(plan: Plan, space: JointSpace) -> tuple[np.ndarray, list[Patch]]:
    """Pixels (a, b, 3) by who blocks, and what the colours mean: those who block most have one of their own."""
    plane, blocker = plan.problem.plane, space.blocker
    pixels = np.ones((*blocker.shape, 3))
    never_moves = (blocker < 0) & (blocker > AVOIDED)
    never_moves[blocker >= 0] = ~plane.online[blocker[blocker >= 0]]
    counts = Counter(blocker[(blocker >= 0) & ~never_moves].tolist())
    legend = []
    groups = [
        ("blocked by what never moves", style.MUTED.light, never_moves),
        ("zone of avoidance", style.LINE.light, blocker == AVOIDED),
    ]
    ranked = [k for k, _ in counts.most_common()]
    groups += [(f"blocked by {plane.ids[k]}", _TINTS[n], blocker == k) for n, k in enumerate(ranked[:_NAMED])]
    if ranked[_NAMED:]:
        groups.append((f"blocked by {len(ranked) - _NAMED} others", _OTHERS, np.isin(blocker, ranked[_NAMED:])))
    for label, colour, cells in groups:
        if cells.any():
            pixels[cells] = to_rgb(colour)
            legend.append(Patch(facecolor=colour, label=label))
    legend.append(
        Patch(facecolor=style.PAPER.light, edgecolor=style.LINE.light, label=f"free {np.mean(blocker == FREE):.0%}")
    )
    return pixels, legend
