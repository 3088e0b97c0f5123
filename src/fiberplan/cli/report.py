"""Plans and certificates as lines of text."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fiberplan.certificates import Certificate, Contact
    from fiberplan.focal_plane import FocalPlane
    from fiberplan.plan import Plan


def lost_targets(plan: "Plan") -> Iterator[str]:
    """One line for each target that is lost: the positioner, the cause, and who is in the way."""
    from fiberplan.plan.diagnosis import losses

    for loss in losses(plan):
        if loss.positioner in plan.lost:
            yield f"lost {loss}"


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
