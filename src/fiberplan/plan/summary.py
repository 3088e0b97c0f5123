"""A plan in words, and as the few facts that its exports carry along."""

from typing import TYPE_CHECKING

import numpy as np

from fiberplan import __version__
from fiberplan.plan.diagnosis import Loss, displaced, losses

if TYPE_CHECKING:
    from fiberplan.plan.plan import Plan

_SHOWN = 5  # losses of one outcome that are named


def summary(plan: "Plan") -> str:
    """Lines: who arrived, makespan and bound, what was lost by outcome and priority, and what is proven."""
    lines = [f"{plan.problem.plane.name}, planned by {plan.planner}: {plan}"]
    if plan.interrupted:
        lines.append("interrupted: this is the best plan found until then")
    lines.append(f"makespan {plan.makespan:.6g} s, lower bound {plan.lower_bound:.6g} s")
    lines.extend(bound.said(plan.problem.plane) for bound in plan.bounds)
    lost = sorted(losses(plan), key=lambda loss: (-loss.priority, loss.positioner))
    for outcome in dict.fromkeys(loss.outcome for loss in lost):
        lines.extend(_listed(outcome.name.lower(), [loss for loss in lost if loss.outcome is outcome]))
    lines.extend(displaced(plan))
    lines.extend(plan.problem.left_out)
    lines.append(str(plan.certificate))
    return "\n".join(lines)


def _listed(what: str, lost: list[Loss]) -> list[str]:
    """A heading, the most important few, and how many more there are."""
    priority = sum(loss.priority for loss in lost)
    lines = [f"{what}: {len(lost)} of priority {priority:g} in all"]
    lines += [f"  {loss}, priority {loss.priority:g}" for loss in lost[:_SHOWN]]
    return lines + ([f"  and {len(lost) - _SHOWN} more"] if len(lost) > _SHOWN else [])


def about(plan: "Plan") -> dict[str, object]:
    """What was planned, and how: the meta data of tables."""
    plane, end = plan.problem.plane, plan.end
    return {
        "instrument": plane.name,
        "planner": plan.planner,
        "seed": int(plan.seed),
        "margin_mm": float(plan.problem.margin),
        "makespan_s": float(plan.makespan),
        "certified": bool(plan.certificate.ok),
        "assumptions": list(plan.certificate.assumptions),
        "lost": [plane.ids[int(i)] for i in plan.lost],
        "offline": [plane.ids[int(i)] for i in np.flatnonzero(~end.online)],
        "unknown": [plane.ids[int(i)] for i in np.flatnonzero(end.unknown)],
        "fiberplan": __version__,
    }
