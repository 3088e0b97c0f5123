"""A plan as the page wants it: strings as JSON, numbers as base64 of little-endian arrays, so that 5,000 stay light."""

from typing import Any

import numpy as np

from fiberplan.plan import Outcome, Plan
from fiberplan.plan.diagnosis import Diagnosis, Loss, Reversals, Slow, cause, diagnose
from fiberplan.visuals import style
from fiberplan.visuals.origin import Origin, facts, title
from fiberplan.visuals.packing import finite, packed
from fiberplan.visuals.plane_data import motion_data, plane_data
from fiberplan.visuals.proof_data import proof_data
from fiberplan.visuals.settings import said_settings


def page_data(plan: Plan, origin: Origin | None = None) -> dict[str, Any]:
    """Everything the page shows, ready for `json.dumps`."""
    problem, plane = plan.problem, plan.problem.plane
    origin = origin or Origin()
    names = list(style.OUTCOMES)
    diagnosis, wished = diagnose(plan), np.asarray(problem.wished)
    return {
        **plane_data(plane),
        **motion_data(plan.trajectory),
        **proof_data(plane, plan.trajectory, plan.certificate, plan.faults(), problem.assumptions),
        "title": title(plan, origin),
        "origin": facts(plan, origin),
        "summary": str(plan),
        "lowerBound": plan.lower_bound,
        "planner": plan.planner,
        "parameters": said_settings(plan.parameters),
        "seed": plan.seed,
        "timings": {str(key): float(value) for key, value in plan.timings.items()},
        "notes": list(dict.fromkeys(map(str, (*plan.notes, *problem.notes, *plane.notes)))),
        "margin": problem.margin,
        "lost": list(map(int, plan.lost)),
        "arrived": int((~wished[plan.having(Outcome.ARRIVED)]).sum()),
        "displaced": [{"positioner": int(i), "cause": cause(plan, int(i))} for i in plan.displaced],
        "outcomes": [
            {"key": style.css_name(o), "label": style.LABELS[o], "meaning": o.value, "lost": o in style.LOST}
            for o in names
        ],
        "outcome": packed([names.index(o) for o in plan.outcomes], "u1"),
        "priority": packed(problem.priority, "<f4"),
        "goal": packed(plane.fibers(problem.requested), "<f4"),
        "losses": [_loss(loss) for loss in diagnosis.losses],
        "diagnosis": _diagnosis(diagnosis),
    }


def group_of(loss: Loss) -> str:
    """What a list of losses is grouped by: the outcome, and of dropped goals the kind of cause."""
    label = style.LABELS[loss.outcome]
    kind = loss.cause.partition(":")[0]
    return f"{label}: {kind}" if loss.outcome is Outcome.DROPPED else label


def _loss(loss: Loss) -> dict[str, Any]:
    return {
        "positioner": loss.positioner,
        "group": group_of(loss),
        "cause": loss.cause,
        "priority": loss.priority,
        "distance": finite(loss.distance),
        "blockers": list(map(int, loss.blockers)),
    }


def _diagnosis(diagnosis: Diagnosis) -> dict[str, Any]:
    """What set the makespan, and how smooth the motion is."""

    def slow(one: Slow) -> dict[str, Any]:
        return {"positioner": one.positioner, "stops": finite(one.stops), "needed": one.needed}

    def reversals(count: Reversals) -> dict[str, Any]:
        return {"median": count.median, "most": count.most, "positioner": count.positioner}

    return {
        "boundBy": None if diagnosis.bound_by is None else slow(diagnosis.bound_by),
        "slowest": [slow(one) for one in diagnosis.slowest],
        "pairBounds": list(map(str, diagnosis.pair_bounds)),
        "reversals": {"alpha": reversals(diagnosis.alpha), "beta": reversals(diagnosis.beta)},
    }
