"""A plan in words, and as the few facts that its exports carry along."""

import re
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from fiberplan import __version__
from fiberplan.plan.bounds import Bound
from fiberplan.plan.closest import closest_pairs
from fiberplan.plan.diagnosis import Loss, displaced, leading_bounds, losses

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
    if plan.certificate.ok:
        lines.append(f"reaction time {reaction_said(plan)}")
    lines.append(str(plan.certificate))
    return "\n".join(lines)


def headline(plan: "Plan") -> tuple[tuple[str, str], ...]:
    """The few facts that tell a good plan from a bad one, each with its name.

    Who arrived, losses by cause, makespan over the bounds, the closest pair, how soon the first contact is if one stops
    dead, how many assumptions the proof rests on.
    """
    lost = [loss for loss in losses(plan) if loss.positioner in plan.lost]
    causes = Counter(re.split("[:;]", loss.cause, maxsplit=1)[0] for loss in lost)  # numbers and names come after
    causes += Counter({"left out of the table": len(plan.problem.left_out)})
    counted = [kind if len(causes) == 1 else f"{count} {kind}" for kind, count in causes.most_common()]
    over = [_over(plan, bound) for bound in leading_bounds(plan)]
    closest = [f"{' and '.join(close.names)}: {_rounded_down(close.clearance)}" for close in closest_pairs(plan)]
    margin = f"; margin {plan.problem.margin:g} mm"
    return (
        ("arrived", plan.arrivals),
        ("losses", f"{causes.total()}: {'; '.join(counted)}" if causes else "none"),
        ("makespan", f"{plan.makespan:.1f} s" + (f": {', '.join(over)}" if over else "") + _at_most(plan)),
        ("closest pair", (closest[0] if closest else "nobody is within reach of anybody") + margin),
        ("reaction", reaction_said(plan) if plan.certificate.ok else "not safe as it is"),
        ("assumptions", str(len(plan.certificate.assumptions) or "none")),
    )


def reaction_said(plan: "Plan") -> str:
    """How soon the first contact is if one stops dead at the worst moment, in words."""
    stall = plan.certificate.tolerates.reaction
    if stall.seconds == np.inf:
        return "unlimited: whoever stops dead, nobody touches it"
    stops, touches = (plan.problem.plane.ids[i] for i in (stall.positioner, stall.other))
    seconds = np.floor(stall.seconds * 1e3) / 1e3
    return f"{seconds:.3f} s: {touches} touches {stops}, if that stops dead at {stall.moment:.3f} s"


def _at_most(plan: "Plan") -> str:
    """How far above the optimum the makespan is at most, by the largest bound that is proven."""
    proven = max((bound.seconds for bound in leading_bounds(plan) if bound.proven), default=0.0)
    if not proven > 0:
        return ""
    percent = np.ceil(1e3 * (plan.makespan / proven - 1.0) - 1e-6) / 10.0
    return f"; proven within {max(0.0, percent):.1f} % of the optimum"


def _over(plan: "Plan", bound: Bound) -> str:
    """How much longer than a bound a plan takes."""
    ratio = f"{plan.makespan / bound.seconds:.2f} x the {bound.kind} bound" if bound.seconds > 0 else "no bound"
    names = " and ".join(plan.problem.plane.ids[i] for i in bound.positioners)
    return f"{ratio} ({bound.seconds:.1f} s{'' if bound.proven else ', an estimate'}: {names})"


def _rounded_down(clearance: float) -> str:
    """A proven lower bound [mm] in words."""
    return f"{np.floor(clearance * 1e3) / 1e3:.3f} mm, proven" if np.isfinite(clearance) else "not proven"


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
