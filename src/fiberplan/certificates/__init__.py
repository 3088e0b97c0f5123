"""Proofs of safety that know nothing of planners."""

from fiberplan.certificates.verify import Certificate, Contact, ZoneEntry, verify

__all__ = ["Certificate", "Contact", "ZoneEntry", "verify"]
