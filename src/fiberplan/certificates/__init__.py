"""Proofs, of safety and of there being no way, that know nothing of planners."""

from fiberplan.certificates.unreachable import proven_unreachable
from fiberplan.certificates.verify import Certificate, Contact, ZoneEntry, verify

__all__ = ["Certificate", "Contact", "ZoneEntry", "proven_unreachable", "verify"]
