"""Plans as FITS files, format 2 (the columns are listed in ``docs/plan-format.md``).

A file holds all that is needed to check and rebuild a plan: the focal plane, knots, problem, the certificate as it was
when written, and what remains as one JSON string, because FITS header floats lose bits. A SHA-256 over the tables tells
damage, not forgery. Reading trusts no stored proof: `Plan.certificate` is always computed anew.
"""

import hashlib
import io
import os
from pathlib import Path
from typing import Any

from astropy.io import fits

from fiberplan.certificates import Certificate
from fiberplan.errors import FiberplanError, PlanError
from fiberplan.io.plan_tables import certificate_from_tables, plan_from_tables, plan_hdus
from fiberplan.plan import Plan
from fiberplan.tables.atomic import write_whole
from fiberplan.tables.fits_tables import open_fits

FORMAT = 2


def write_plan(plan: Plan, path: str | os.PathLike) -> None:
    """Write a plan with its certificate; the file appears whole or not at all.

    Raises:
        PlanError: the file cannot be written; what was there before is kept.
    """
    write_whole(path, plan_bytes(plan), PlanError)


def plan_bytes(plan: Plan) -> bytes:
    """The plan file's content, the same for the same plan."""
    tables = plan_hdus(plan)
    primary = fits.PrimaryHDU()
    primary.header["ORIGIN"] = "fiberplan"
    primary.header["FPFORMAT"] = (FORMAT, "version of the plan format")
    draft, final = io.BytesIO(), io.BytesIO()
    fits.HDUList([primary, *tables]).writeto(draft)
    content = draft.getvalue()
    with fits.open(io.BytesIO(content), lazy_load_hdus=False, memmap=False) as hdul:
        primary.header["FPSHA256"] = digest(hdul, content)
    fits.HDUList([primary, *tables]).writeto(final)
    return final.getvalue()


def digest(hdul: fits.HDUList, content: bytes) -> str:
    """SHA-256 (hexadecimal) over the format version, and each table's name, columns, units and bytes, in file order."""
    hashed = hashlib.sha256(f"fiberplan {hdul[0].header['FPFORMAT']}\n".encode())
    for hdu in hdul[1:]:
        where, size = hdu.fileinfo()["datLoc"], hdu.header["NAXIS1"] * hdu.header["NAXIS2"]
        lines = [f"{hdu.name} {hdu.header['NAXIS2']}"]
        for k in range(1, hdu.header["TFIELDS"] + 1):
            lines.append(" ".join(str(hdu.header.get(f"{key}{k}", "")) for key in ("TTYPE", "TFORM", "TUNIT")))
        hashed.update("".join(f"{line}\n" for line in lines).encode())
        hashed.update(content[where : where + size])
    return hashed.hexdigest()


def is_plan(path: str | os.PathLike) -> bool:
    """Whether a file says that it is a plan."""
    try:
        with Path(path).open("rb") as file:
            return b"FPFORMAT=" in file.read(2880)
    except OSError:
        return False


def read_plan(path: str | os.PathLike) -> Plan:
    """Read a plan.

    Raises:
        PlanError: no such file, not a plan, truncated, damaged, or of a newer format; one line that says which.
    """
    tables = _tables(Path(path))
    try:
        return plan_from_tables(tables)
    except FiberplanError as error:
        raise PlanError(f"{path}: {error}") from None
    except (KeyError, IndexError, ValueError, TypeError) as error:
        raise PlanError(f"{path}: cannot be used as a plan ({str(error).splitlines()[0]})") from None


def read_certificate(path: str | os.PathLike) -> Certificate:
    """The certificate as it was when the plan was written: a record, not a proof.

    Raises:
        PlanError: as `read_plan`.
    """
    return certificate_from_tables(_tables(Path(path)))


def _tables(path: Path) -> dict[str, Any]:
    """Tables of a plan file whose version and digest are right."""
    with open_fits(path, PlanError) as hdul:
        header = hdul[0].header
        version = header.get("FPFORMAT")
        if not isinstance(version, int):
            raise PlanError(f"{path}: is not a plan (a FITS file without the keyword FPFORMAT)")
        if version > FORMAT:
            raise PlanError(
                f"{path}: is in plan format {version}, this fiberplan reads formats up to {FORMAT}: update it"
            )
        if digest(hdul, path.read_bytes()) != header.get("FPSHA256"):
            raise PlanError(f"{path}: is damaged: its data do not match their SHA-256")
        return {hdu.name: hdu.data for hdu in hdul[1:]}
