"""A plan as the page wants it: strings as JSON, numbers as base64 of little-endian arrays, so that 5,000 stay light.

Angles and knots are in single precision, plenty for a drawing. Proven clearances keep double precision, since a bound
must not be rounded up.
"""

import base64
from typing import Any

import numpy as np

from fiberplan.certificates import Certificate, Contact
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import LINKS
from fiberplan.focal_plane.four_bar import FourBar
from fiberplan.plan import Outcome, Plan
from fiberplan.plan.diagnosis import Diagnosis, Reversals, Slow, cause, diagnose
from fiberplan.visuals import style


def _shown(value: Any) -> str:
    """A planner's setting as text; angles are in rad, lengths in mm, times in s."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def page_data(plan: Plan) -> dict[str, Any]:
    """Everything the page shows, ready for `json.dumps`."""
    problem, plane, motion = plan.problem, plan.problem.plane, plan.trajectory
    names = list(style.OUTCOMES)
    smallest, partner = proven_clearance(plan)
    diagnosis, wished = diagnose(plan), np.asarray(problem.wished)
    return {
        "name": plane.name,
        "summary": str(plan),
        "duration": motion.duration,
        "lowerBound": plan.lower_bound,
        "planner": plan.planner,
        "parameters": {str(key): _shown(value) for key, value in plan.parameters.items() if key != "seed"},
        "seed": plan.seed,
        "timings": {str(key): float(value) for key, value in plan.timings.items()},
        "notes": list(dict.fromkeys(map(str, (*plan.notes, *problem.notes, *plane.notes)))),
        "margin": problem.margin,
        "certificate": _certificate(plan, smallest, partner),
        "lost": list(map(int, plan.lost)),
        "arrived": int((~wished[plan.having(Outcome.ARRIVED)]).sum()),
        "displaced": [{"positioner": int(i), "cause": cause(plan, int(i))} for i in plan.displaced],
        "outcomes": [
            {"key": style.css_name(o), "label": style.LABELS[o], "meaning": o.value, "lost": o in style.LOST}
            for o in names
        ],
        "ids": list(plane.ids),
        "outcome": _packed([names.index(o) for o in plan.outcomes], "u1"),
        "base": _packed(plane.base, "<f8"),
        "length": _packed(plane.length, "<f4"),
        "zero": _packed(plane.zero, "<f4"),
        "lower": _packed(plane.lower, "<f4"),
        "upper": _packed(plane.upper, "<f4"),
        "fiber": _packed(plane.fiber, "<f4"),
        "reach": _packed(plane.reach, "<f4"),
        "goal": _packed(plane.fibers(problem.requested), "<f4"),
        "offsets": _packed(motion.offsets, "<u4"),
        "times": _packed(motion.times, "<f4"),
        "angles": _packed(motion.angles, "<f4"),
        "proven": _packed(smallest, "<f8"),
        "provenWith": _packed(partner, "<i4"),
        **_bars(plane),
        "bodies": [_shape(body) | {"link": LINKS[body.link]} for body in plane.bodies],
        "obstacles": [_shape(obstacle) for obstacle in plane.obstacles],
        "causes": {str(loss.positioner): loss.cause for loss in diagnosis.losses},
        "diagnosis": _diagnosis(diagnosis),
        "blockers": {str(i): [int(b) for b in who] for i, who in plan.blockers.items() if len(who)}
        | {str(i): list(map(int, dropped.blockers)) for i, dropped in problem.dropped.items() if dropped.blockers},
    }


def _diagnosis(diagnosis: Diagnosis) -> dict[str, Any]:
    """What is left of each loss, and what set the makespan."""

    def slow(one: Slow) -> dict[str, Any]:
        return {"positioner": one.positioner, "stops": _finite(one.stops), "needed": one.needed}

    def reversals(count: Reversals) -> dict[str, Any]:
        return {"median": count.median, "most": count.most, "positioner": count.positioner}

    return {
        "losses": {
            str(loss.positioner): {"priority": loss.priority, "distance": _finite(loss.distance)}
            for loss in diagnosis.losses
        },
        "boundBy": None if diagnosis.bound_by is None else slow(diagnosis.bound_by),
        "slowest": [slow(one) for one in diagnosis.slowest],
        "pairBounds": list(map(str, diagnosis.pair_bounds)),
        "reversals": {"alpha": reversals(diagnosis.alpha), "beta": reversals(diagnosis.beta)},
    }


def proven_clearance(plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    """Smallest proven clearance (n,) [mm] of every positioner, and with whom (n,): -1 - k is obstacle k.

    Two that cannot move are left out: how they stand is no merit of the plan. Infinite where there is no neighbour.
    """
    certificate, online = plan.certificate, plan.problem.plane.online
    n = plan.problem.n
    smallest, partner = np.full(n, np.inf), np.arange(n)
    pairs = np.asarray(certificate.pairs, np.int64).reshape(-1, 2)
    fixed = np.asarray(certificate.obstacle_pairs, np.int64).reshape(-1, 2)
    movable = online[pairs].any(axis=1)
    beside = online[fixed[:, 0]]
    pairs, fixed = pairs[movable], fixed[beside]
    gaps, fixed_gaps = certificate.clearance[movable], certificate.obstacle_clearance[beside]
    who = np.concatenate([pairs[:, 0], pairs[:, 1], fixed[:, 0]])
    other = np.concatenate([pairs[:, 1], pairs[:, 0], -1 - fixed[:, 1]])
    gap = np.concatenate([gaps, gaps, fixed_gaps])
    order = np.argsort(-gap, kind="stable")  # the smallest is written last and stays
    smallest[who[order]], partner[who[order]] = gap[order], other[order]
    return smallest, partner


def _certificate(plan: Plan, smallest: np.ndarray, partner: np.ndarray) -> dict[str, Any]:
    certificate = plan.certificate
    least = int(np.argmin(smallest)) if np.isfinite(smallest).any() else None
    return {
        "ok": certificate.ok,
        "statement": statement(certificate),
        "margin": certificate.margin,
        "jitter": certificate.jitter,
        "positionError": certificate.position_error,
        "smallest": None if least is None else float(smallest[least]),
        "pair": None if least is None else [least, int(partner[least])],
        "contacts": [_contact(c) for c in certificate.contacts],
        "undecided": [_contact(c) for c in certificate.undecided],
        "resting": [_contact(c) for c in certificate.resting],
        "violations": [*map(str, certificate.violations), *_zones(plan)],
        "opening": [
            {"pair": list(map(int, each.pair)), "time": _finite(each.time), "clearance": each.clearance}
            for each in certificate.opening
        ],
        "geometry": None if certificate.geometry is None else str(certificate.geometry),
        "assumptions": list(dict.fromkeys((*certificate.assumptions, *plan.problem.assumptions))),
        "faults": [fault for fault in plan.faults() if fault != str(certificate)],
    }


def _zones(plan: Plan) -> list[str]:
    """A sentence for each zone of avoidance entered."""
    ids = plan.problem.plane.ids
    return [
        f"positioner '{ids[zone.positioner]}' enters its zone of avoidance at {zone.time:.3f} s: slider "
        f"{zone.slider:.4f} mm"
        for zone in plan.certificate.zones
    ]


def _bars(plane: FocalPlane) -> dict[str, str]:
    """What the page needs to draw four-bar arms: J2 x, y, rocker and orientation of each, and its slider's range."""
    bar = plane.kinematics
    if not isinstance(bar, FourBar):
        return {}
    pivot, _ = bar.rockers(plane.base, plane.folded, plane.zero)
    bars = np.column_stack([pivot, bar.rocker, bar.orientation])
    return {"bars": _packed(bars, "<f8"), "sliders": _packed(np.column_stack([bar.shortest, bar.longest]), "<f8")}


def statement(certificate: Certificate) -> str:
    """What the certificate says, in one sentence."""
    if certificate.ok:
        return f"Proven safe: at every moment all that can touch stay at least {certificate.margin:g} mm apart"
    counts = {
        "contact": len(certificate.contacts),
        "undecided pair": len(certificate.undecided),
        "broken joint limit": len(certificate.violations),
        "forbidden slider length": len(certificate.zones),
    }
    found = ", ".join(f"{n} {what}{'s' * (n > 1)}" for what, n in counts.items() if n)
    return f"Not safe: {found} at a margin of {certificate.margin:g} mm"


def _finite(value: float) -> float | None:
    """JSON has no infinities or NaN: a value that is not finite becomes null."""
    return float(value) if np.isfinite(value) else None


def _contact(contact: Contact) -> dict[str, Any]:
    return {
        "pair": [int(k) for k in contact.pair],
        "time": _finite(contact.time) or 0.0,
        "clearance": _finite(contact.clearance),
    }


def _shape(shape: Any) -> dict[str, Any]:
    return {
        "name": shape.name,
        "points": _packed(shape.points, "<f4"),
        "count": int(shape.points.shape[-2]),
        "shared": shape.points.ndim == 2,
        "radius": _packed(np.atleast_1d(shape.radius), "<f4"),
        "closed": bool(shape.closed),
        "category": shape.category,
        "meets": None if shape.meets is None else list(shape.meets),
    }


def _packed(values: Any, dtype: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=dtype).tobytes()).decode()
