"""Proofs, of safety and of there being no way, that know nothing of planners."""

from fiberplan.certificates.safety import Certificate, Contact, ZoneEntry, verify
from fiberplan.certificates.unreachable import proven_unreachable

__all__ = ["Certificate", "Contact", "ZoneEntry", "proven_unreachable", "verify"]
