"""A certificate as the page wants it: the verdict in a sentence, what it rests on, and who comes how near when.

Proven clearances keep double precision, since a bound must not be rounded up.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fiberplan.certificates import Certificate, Contact
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.visuals.approaches import approaches
from fiberplan.visuals.packing import finite, packed


def proof_data(
    plane: FocalPlane,
    motion: Trajectory,
    certificate: Certificate,
    faults: Sequence[str] = (),
    assumed: Sequence[str] = (),
) -> dict[str, Any]:
    """What is proven of a motion.

    Args:
        plane: whose motion it is.
        motion: of all its positioners.
        certificate: of this motion.
        faults: what does not hold besides.
        assumed: what all this rests on besides.
    """
    smallest, partner = proven_clearance(plane, certificate)
    near = approaches(plane, motion, certificate)
    closest = [
        {"pair": list(a.pair), "time": a.time, "clearance": a.clearance, "proven": finite(a.proven)}
        for a in near.closest
    ]
    return {
        "certificate": _certificate(plane, certificate, smallest, partner)
        | {
            "faults": [fault for fault in faults if fault != str(certificate)],
            "assumptions": list(dict.fromkeys((*certificate.assumptions, *assumed))),
        },
        "proven": packed(smallest, "<f8"),
        "provenWith": packed(partner, "<i4"),
        "closest": closest,
        "near": {
            "first": packed(near.near[:, 0], "<i4"),
            "second": packed(near.near[:, 1], "<i4"),
            "bound": packed(near.bounds, "<f8"),
        },
        "clearances": {
            "times": packed(near.times, "<f4"),
            "gaps": packed(near.gaps, "<f4"),
            "first": packed(near.pairs[:, 0], "<i4"),
            "second": packed(near.pairs[:, 1], "<i4"),
        },
    }


def proven_clearance(plane: FocalPlane, certificate: Certificate) -> tuple[np.ndarray, np.ndarray]:
    """Smallest proven clearance (n,) [mm] of every positioner, and with whom (n,): -1 - k is obstacle k.

    Two that cannot move are left out: how they stand is no merit of the plan. Infinite where there is no neighbour.
    """
    online = plane.online
    smallest, partner = np.full(plane.n, np.inf), np.arange(plane.n)
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


def _certificate(
    plane: FocalPlane, certificate: Certificate, smallest: np.ndarray, partner: np.ndarray
) -> dict[str, Any]:
    least = int(np.argmin(smallest)) if np.isfinite(smallest).any() else None
    return {
        "ok": certificate.ok,
        "statement": statement(certificate),
        "margin": certificate.margin,
        "jitter": certificate.jitter,
        "positionError": certificate.position_error,
        "smallest": None if least is None else finite(smallest[least]),
        "pair": None if least is None else [least, int(partner[least])],
        "contacts": [_contact(c) for c in certificate.contacts],
        "undecided": [_contact(c) for c in certificate.undecided],
        "resting": [_contact(c) for c in certificate.resting],
        "violations": [*map(str, certificate.violations), *_zones(plane, certificate)],
        "opening": [
            {"pair": list(map(int, each.pair)), "time": finite(each.time), "clearance": each.clearance}
            for each in certificate.opening
        ],
        "geometry": None if certificate.geometry is None else str(certificate.geometry),
    }


def _zones(plane: FocalPlane, certificate: Certificate) -> list[str]:
    """A sentence for each zone of avoidance entered."""
    return [
        f"positioner '{plane.ids[zone.positioner]}' enters its zone of avoidance at {zone.time:.3f} s: slider "
        f"{zone.slider:.4f} mm"
        for zone in certificate.zones
    ]


def _contact(contact: Contact) -> dict[str, Any]:
    return {
        "pair": [int(k) for k in contact.pair],
        "time": finite(contact.time) or 0.0,
        "clearance": finite(contact.clearance),
    }
