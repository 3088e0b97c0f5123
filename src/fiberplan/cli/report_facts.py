"""Plans and certificates as facts for programs: what ``--json`` answers."""

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from fiberplan.cli.report import cautions

if TYPE_CHECKING:
    from fiberplan.certificates import Certificate, Contact
    from fiberplan.focal_plane import FocalPlane
    from fiberplan.plan import Plan


def plan_facts(plan: "Plan", faults: list[str]) -> dict[str, Any]:
    """What a plan does, what it loses and how it is proven."""
    from fiberplan.plan import Outcome
    from fiberplan.plan.diagnosis import displaced, losses

    plane = plan.problem.plane
    return {
        "summary": str(plan),
        "instrument": plane.name,
        "planner": plan.planner,
        "seed": plan.seed,
        "makespan": plan.makespan,
        "lower_bound": plan.lower_bound,
        "interrupted": plan.interrupted,
        "outcomes": {outcome.name: plan.outcomes.count(outcome) for outcome in Outcome},
        "losses": [asdict(loss) for loss in losses(plan)],
        "displaced": displaced(plan),
        "left_out": plan.problem.left_out,
        "certificate": certificate_facts(plane, plan.certificate),
        "unknown": unknown_facts(plan),
        "faults": faults,
        "notes": list(dict.fromkeys((*cautions(plane, plan.problem.margin), *plan.problem.notes, *plan.notes))),
    }


def certificate_facts(plane: "FocalPlane", certificate: "Certificate") -> dict[str, Any]:
    """What a certificate says, with its findings."""

    def touching(contacts: "tuple[Contact, ...]") -> list[dict[str, Any]]:
        labels = [[plane.label(index) for index in contact.pair] for contact in contacts]
        return [
            {"pair": pair, "time": contact.time, "clearance": contact.clearance}
            for pair, contact in zip(labels, contacts, strict=True)
        ]

    return {
        "ok": certificate.ok,
        "summary": str(certificate),
        "margin": certificate.margin,
        "jitter": certificate.jitter,
        "position_error": certificate.position_error,
        "pairs": len(certificate.pairs) + len(certificate.obstacle_pairs),
        "smallest_clearance": certificate.smallest,
        "contacts": touching(certificate.contacts),
        "undecided": touching(certificate.undecided),
        "resting": touching(certificate.resting),
        "zones": [
            {"positioner": plane.ids[zone.positioner], "time": zone.time, "slider": zone.slider}
            for zone in certificate.zones
        ],
        "violations": certificate.violations,
        "opening": [
            {"pair": [plane.label(index) for index in pair.pair], "clearance": pair.clearance, "time": pair.time}
            for pair in certificate.opening
        ],
        "assumptions": certificate.assumptions,
        "tolerates": _tolerated(plane, certificate) if certificate.ok else None,
        "geometry": None if certificate.geometry is None else asdict(certificate.geometry),
    }


def _tolerated(plane: "FocalPlane", certificate: "Certificate") -> dict[str, Any]:
    """What a motion tolerates beyond what its certificate allows for."""
    found = certificate.tolerates
    stall, nobody = found.reaction, -1 - len(plane.obstacles)
    return {
        "jitter": found.jitter,
        "position_error": found.position_error,
        "reaction": stall.seconds,
        "stops": plane.ids[stall.positioner] if stall.positioner >= 0 else None,
        "touches": plane.ids[stall.other] if stall.other >= 0 else None,
        "moment": stall.moment,
        "critical": [
            {"positioner": plane.ids[i], "neighbour": plane.label(int(j)), "position_error": float(found.room[i])}
            for i, j in enumerate(found.critical)
            if j != nobody
        ],
    }


def unknown_facts(plan: "Plan") -> list[dict[str, Any]]:
    """Who is only taken to stand where it is, and where that is [deg]."""
    plane, end = plan.problem.plane, plan.end
    return [
        {
            "positioner": plane.ids[i],
            "alpha": math.degrees(plan.problem.start[i, 0]),
            "beta": math.degrees(plan.problem.start[i, 1]),
            "needed": plan.needed_guesses[i],
        }
        for i in range(plane.n)
        if end.unknown[i]
    ]
