"""Plans as FITS files, format 3 (the columns are listed in ``docs/plan-format.md``).

A file holds all that is needed to check and rebuild a plan: the focal plane, knots, problem, the certificate as it was
when written, and what remains as one JSON string, because FITS header floats lose bits. Reading trusts no stored proof:
`Plan.certificate` is always computed anew.
"""

import os
from pathlib import Path

from fiberplan.certificates import Certificate
from fiberplan.errors import FiberplanError, PlanError
from fiberplan.io.plan_tables import plan_from_tables, plan_hdus
from fiberplan.io.proof_tables import certificate_from_tables
from fiberplan.io.sealed_tables import MISFITS, PLAN, seal, unseal
from fiberplan.plan import Plan
from fiberplan.tables.atomic import write_whole
from fiberplan.tables.contents import read_whole
from fiberplan.tables.wording import one_line


def write_plan(plan: Plan, path: str | os.PathLike, certificate: bool = True) -> None:
    """Write a plan, with what shows it safe unless not wanted; the file appears whole or not at all.

    Raises:
        PlanError: the file cannot be written; what was there before is kept.
    """
    write_whole(path, plan_bytes(plan, certificate), PlanError)


def plan_bytes(plan: Plan, certificate: bool = True) -> bytes:
    """The plan file's content, the same for the same plan."""
    return seal(PLAN, plan_hdus(plan, certificate))


def is_plan(content: bytes) -> bool:
    """Whether a file says that it is a plan."""
    return f"{PLAN.keyword}=".encode() in content[:2880]


def read_plan(path: str | os.PathLike) -> Plan:
    """Read a plan.

    Raises:
        PlanError: no such file, not a plan, truncated, damaged, or of a newer format; one line that says which.
    """
    return plan_from_bytes(read_whole(Path(path), PlanError), path)


def plan_from_bytes(content: bytes, path: str | os.PathLike) -> Plan:
    """The plan in a file that has been read.

    Raises:
        PlanError: as `read_plan`.
    """
    tables = unseal(content, Path(path), [PLAN], PlanError)
    try:
        return plan_from_tables(tables)
    except FiberplanError as error:
        raise PlanError(f"{path}: {error}") from None
    except MISFITS as error:
        raise PlanError(f"{path}: cannot be used as a plan ({one_line(error)})") from None


def read_certificate(path: str | os.PathLike) -> Certificate:
    """The certificate as it was when the plan was written: a record, not a proof.

    Raises:
        PlanError: as `read_plan`.
    """
    tables = unseal(read_whole(Path(path), PlanError), Path(path), [PLAN], PlanError)
    try:
        return certificate_from_tables(tables)
    except MISFITS as error:
        raise PlanError(f"{path}: has no certificate that can be used ({one_line(error)})") from None
