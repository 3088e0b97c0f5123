"""FITS files of fiberplan's own: a version and a SHA-256 over all tables, which tells damage, not forgery.

What a file is, is said by the keyword that holds its version. Data and digest are made of the same bytes, read once.
"""

import hashlib
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from astropy.io import fits

from fiberplan.errors import FiberplanError
from fiberplan.tables.fits_tables import open_fits, table_data

DIGEST = "FPSHA256"
_UNSEALED = 64 * "0"  # in the place of the digest, which is of the tables as they are written
MISFITS = (LookupError, ValueError, TypeError, AttributeError, ArithmeticError, RecursionError)
"""What comes of using tables that hold something else than they should."""


class Kind(NamedTuple):
    """What a file can be."""

    keyword: str  #: in the primary header, with the version
    version: int  #: that is written; older ones are read
    what: str  #: in words
    prefix: str  #: the digest begins with this and the version


PLAN = Kind("FPFORMAT", 3, "plan", "fiberplan")
FOCAL_PLANE = Kind("FPPLANE", 1, "focal plane", "fiberplan focal plane")


def seal(kind: Kind, tables: Sequence[fits.BinTableHDU]) -> bytes:
    """The file's content, the same for the same tables."""
    primary = fits.PrimaryHDU()
    primary.header["ORIGIN"] = "fiberplan"
    primary.header[kind.keyword] = (kind.version, f"version of the {kind.what} format")
    primary.header[DIGEST] = _UNSEALED
    written = io.BytesIO()
    fits.HDUList([primary, *tables]).writeto(written)
    content = written.getvalue()
    with fits.open(io.BytesIO(content), lazy_load_hdus=False, memmap=False) as hdul:
        return content.replace(_UNSEALED.encode(), digest(kind, hdul, content).encode(), 1)


def unseal(
    content: bytes, path: Path, kinds: Sequence[Kind], error: type[FiberplanError], bare: bool = False
) -> dict[str, Any]:
    """The tables by name, of a file that is of one of these kinds, and whose digest is right.

    Args:
        content: of the file.
        path: the file, as errors name it.
        kinds: what it may be.
        error: what to raise.
        bare: whether a file that says neither its kind nor a digest is taken as it is.

    Raises:
        error: truncated, damaged, of another kind or of a newer format; one line that says which.
    """
    with open_fits(content, path, error) as hdul:
        header = hdul[0].header
        kind = next((kind for kind in kinds if kind.keyword in header), None)
        if kind is None:
            if not bare:
                raise error(f"{path}: is not a {kinds[0].what} (a FITS file without the keyword {kinds[0].keyword})")
            if DIGEST in header:
                raise error(
                    f"{path}: is damaged: it has a {DIGEST} but no {' or '.join(kind.keyword for kind in kinds)}"
                )
            return table_data(hdul, path, error)
        version = header[kind.keyword]
        if type(version) is not int or version < 1:
            raise error(f"{path}: is not a {kind.what}: {kind.keyword} is {version!r}, expected 1 or more")
        if version > kind.version:
            raise error(
                f"{path}: is in {kind.what} format {version}, this fiberplan reads formats up to {kind.version}: "
                "update it"
            )
        tables = table_data(hdul, path, error)
        if digest(kind, hdul, content) != header.get(DIGEST):
            raise error(f"{path}: is damaged: its data do not match their SHA-256")
        return tables


def digest(kind: Kind, hdul: fits.HDUList, content: bytes) -> str:
    """SHA-256 (hexadecimal) over the format version, and each table's name, columns, units and bytes, in file order."""
    hashed = hashlib.sha256(f"{kind.prefix} {hdul[0].header[kind.keyword]}\n".encode())
    for hdu in hdul[1:]:
        where, size = hdu.fileinfo()["datLoc"], hdu.header["NAXIS1"] * hdu.header["NAXIS2"]
        lines = [f"{hdu.name} {hdu.header['NAXIS2']}"]
        for k in range(1, hdu.header["TFIELDS"] + 1):
            lines.append(" ".join(str(hdu.header.get(f"{key}{k}", "")) for key in ("TTYPE", "TFORM", "TUNIT")))
        hashed.update("".join(f"{line}\n" for line in lines).encode())
        hashed.update(content[where : where + size])
    return hashed.hexdigest()
