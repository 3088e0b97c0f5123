"""FITS tables in and out: columns with units, text in UTF-8, native byte order at one door.

FITS stores numbers big-endian and text as bytes, and astropy only warns of a file that ends early; here such a file is
an error, and what comes out is native and read-only.
"""

import io
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from astropy.io import fits

from fiberplan.arrays import read_only
from fiberplan.errors import FiberplanError
from fiberplan.tables.table_reader import check_file


def table_hdu(
    name: str, columns: Mapping[str, np.ndarray | Sequence[str]], units: Mapping[str, str] | None = None
) -> fits.BinTableHDU:
    """A binary table; arrays (m,) or (m, k) are numbers or booleans, lists and tuples are text."""
    formats = {"b": "L", "i": "K", "f": "D"}
    made = []
    for key, values in columns.items():
        if isinstance(values, np.ndarray):
            array, width = values, "" if values.ndim == 1 else str(values.shape[1])
            form = width + formats[values.dtype.kind]
        else:  # FITS text is bytes; ids may be anything that UTF-8 can say
            array = np.array([text.encode() for text in values], dtype=np.bytes_)
            form = f"{array.dtype.itemsize}A"
        made.append(fits.Column(key, form, (units or {}).get(key), array=array))
    return fits.BinTableHDU.from_columns(made, name=name)


def read_tables(path: Path, error: type[FiberplanError]) -> dict[str, Any]:
    """Tables of a FITS file by name.

    Raises:
        error: no such file, not FITS, or truncated.
    """
    with open_fits(path, error) as hdul:
        return {hdu.name: hdu.data for hdu in hdul if isinstance(hdu, fits.BinTableHDU)}


def open_fits(path: Path, error: type[FiberplanError]) -> fits.HDUList:
    """A FITS file read into memory, every table checked to be all there.

    Raises:
        error: no such file, not FITS, or truncated.
    """
    check_file(path, error)
    try:
        content = path.read_bytes()
    except OSError as problem:
        raise error(f"{path}: cannot be read ({(problem.strerror or str(problem)).lower()})") from None
    if not content.startswith(b"SIMPLE  ="):
        raise error(f"{path}: is not a FITS file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            hdul = fits.open(io.BytesIO(content), lazy_load_hdus=False, memmap=False, character_as_bytes=True)
            end = max(hdu.fileinfo()["datLoc"] + hdu.fileinfo()["datSpan"] for hdu in hdul)
            if end != len(content):
                raise OSError("the data end early")  # astropy only warns of it, and drops a table whose header is cut
            for hdu in hdul:
                _ = hdu.data
    except Exception:  # astropy raises what it likes on a damaged file
        raise error(f"{path}: the FITS file is truncated or damaged") from None
    return hdul


def pick(tables: Mapping[str, Any], name: str, error: type[FiberplanError]) -> Any:
    """A table by name.

    Raises:
        error: it is not there.
    """
    if tables.get(name) is None:
        raise error(f"the file has no table {name}: truncated, or not written by fiberplan")
    return tables[name]


def numbers(table: Any, column: str, dtype: type = float) -> np.ndarray:
    """A column in native byte order, read-only."""
    return read_only(table[column], dtype)


def texts(table: Any, column: str) -> list[str]:
    """A column of text."""
    cells = np.asarray(table[column])
    return [cell.decode() if isinstance(cell, bytes) else str(cell) for cell in cells.tolist()]
