"""Plans and certificates as lines of text, and as facts for programs."""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    from fiberplan.certificates import Certificate, Contact
    from fiberplan.focal_plane import FocalPlane
    from fiberplan.plan import Plan

LISTED = 10  # lost targets that have a line of their own


def lost_targets(plan: "Plan", file: "Path | None" = None) -> Iterator[str]:
    """How many targets are lost by each cause, and a line for those of highest priority.

    Args:
        plan: whose losses.
        file: in which it is kept, if it is: `fiberplan diagnose` tells of all.
    """
    from fiberplan.plan.diagnosis import losses

    lost = sorted((loss for loss in losses(plan) if loss.positioner in plan.lost), key=lambda loss: -loss.priority)
    if len(lost) > 1:
        kinds = Counter(re.split("[:;]", loss.cause, maxsplit=1)[0] for loss in lost)  # numbers and names come after
        for kind, count in kinds.most_common():
            yield f"{count} of {len(lost)} lost: {kind}"
    for loss in lost[:LISTED]:
        yield f"lost {loss}"
    if len(lost) > LISTED:
        tells = (
            "--json lists them all" if file is None else f"`fiberplan diagnose {file}` lists them all, as does --json"
        )
        yield f"and {len(lost) - LISTED} more, of no higher priority: {tells}"


def incomplete(plan: "Plan") -> bool:
    """Whether a target is lost, or was given to no positioner."""
    return bool(len(plan.lost) or plan.problem.left_out)


def cautions(plane: "FocalPlane", margin: float) -> Iterator[str]:
    """What a proof of safety says less about than one may think."""
    if not plane.bodies:
        yield f"{plane.name} has no bodies: nothing can touch, so the proof says nothing"
    elif margin == 0:
        yield "the margin is 0 mm: arms may pass as close as they can without touching; --margin keeps them apart"


def findings(plane: "FocalPlane", certificate: "Certificate") -> Iterator[str]:
    """A line for each contact, undecided pair, zone of avoidance and violation, then for what touches at rest."""
    for what, contacts in (
        ("contact", certificate.contacts),
        ("undecided", certificate.undecided),
        ("at rest, neither can move", certificate.resting),
    ):
        for contact in contacts:
            yield f"{what}: {_contact(plane, contact)}"
    for zone in certificate.zones:
        yield f"zone of avoidance: {plane.ids[zone.positioner]} at {zone.time:.3f} s, slider {zone.slider:.4f} mm"
    for violation in certificate.violations:
        yield f"violation: {violation}"


def _contact(plane: "FocalPlane", contact: "Contact") -> str:
    first, second = (plane.label(index) for index in contact.pair)
    return f"{first} and {second} at {contact.time:.3f} s, clearance {contact.clearance:.4f} mm"


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
    }


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
        "faults": faults,
        "notes": list(dict.fromkeys((*cautions(plane, plan.problem.margin), *plan.problem.notes, *plan.notes))),
    }
