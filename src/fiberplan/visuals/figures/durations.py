"""What takes the time: when each positioner stops, against what its joints alone need, and the bounds."""

import numpy as np
from matplotlib.axes import Axes

from fiberplan.plan import Plan
from fiberplan.plan.diagnosis import leading_bounds, stop_times
from fiberplan.visuals import style
from fiberplan.visuals.canvas import blank, keyed, titled
from fiberplan.visuals.figures.registry import FIGURES

_BOUNDS = {"kinematic": "-.", "pair": "--", "obstacle": ":"}


@FIGURES.register("makespan")
def makespan(plan: Plan, ax: Axes | None = None) -> Axes:
    """Draw when each positioner stops against the time that its joints alone need, with makespan and bounds.

    On the diagonal a positioner takes no longer than it must; the farther above, the longer it waits for others.

    Args:
        plan: whose motion.
        ax: to draw on; those of a new figure unless given.
    """
    figure_made = ax is None
    ax = blank((6.4, 5.0))[1][0] if ax is None else ax
    plane, motion = plan.problem.plane, plan.trajectory
    needed = plane.least_time(motion.end - motion.start).max(axis=1)
    ended = np.nan_to_num(stop_times(motion))
    for outcome, colour in style.OUTCOMES.items():
        who = plan.having(outcome)
        if len(who):
            label = f"{style.LABELS[outcome]}  {len(who)}"
            ax.scatter(needed[who], ended[who], s=9, color=colour.light, linewidths=0, alpha=0.8, label=label)
    end = 1.04 * max(plan.makespan, float(needed.max(initial=0.0)), 1e-9)
    ax.plot([0, end], [0, end], color=style.MUTED.light, linewidth=0.8)
    ax.axhline(plan.makespan, color=style.INK.light, linewidth=1.2, label=f"makespan {plan.makespan:.2f} s")
    for bound in leading_bounds(plan):
        sure = "" if bound.proven else " (estimate)"
        label = f"{bound.kind} bound {bound.seconds:.2f} s{sure}"
        ax.axhline(bound.seconds, color=style.CONTACT.light, linewidth=1.1, linestyle=_BOUNDS[bound.kind], label=label)
    ax.set_xlim(-0.01 * end, end)
    ax.set_ylim(-0.01 * end, end)
    titled(ax, f"{plane.name}: {plan}", "time that the joints alone need [s]", "time at which the positioner stops [s]")
    if figure_made:
        ax.set_aspect("equal")
    keyed(ax, fontsize=8)
    return ax
