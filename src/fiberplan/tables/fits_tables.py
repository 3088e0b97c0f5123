"""FITS tables in and out: columns with units, text in UTF-8, native byte order at one door.

FITS stores numbers big-endian and text as bytes, and astropy only warns of a file that ends early; here such a file is
an error, and what comes out is native and read-only.
"""

import io
import re
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from astropy.io import fits

from fiberplan.arrays import read_only
from fiberplan.errors import FiberplanError

_WIDTHS = {"L": 1, "K": 8, "D": 8, "A": 1}  # bytes of one value, of the forms that `table_hdu` writes
_FORM = re.compile(rf"(\d{{0,9}})([{''.join(_WIDTHS)}])")
_CHANGING = re.compile(r"(TSCAL|TZERO|TNULL|TDIM)\d+|THEAP|ZIMAGE|ZTABLE")
_MOST_FIELDS = 999  # of a FITS table


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


def open_fits(content: bytes, path: Path, error: type[FiberplanError]) -> fits.HDUList:
    """The HDUs of a FITS file that has been read; their data are not looked at yet.

    Raises:
        error: not FITS, truncated, or a header that cannot be parsed.
    """
    if not content.startswith(b"SIMPLE  ="):
        raise error(f"{path}: is not a FITS file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            hdul = fits.open(
                io.BytesIO(content),
                lazy_load_hdus=False,
                memmap=False,
                character_as_bytes=True,
                disable_image_compression=True,
            )
            end = max(hdu.fileinfo()["datLoc"] + hdu.fileinfo()["datSpan"] for hdu in hdul)
            if end != len(content):
                raise OSError("the data end early")  # astropy only warns of it, and drops a table whose header is cut
            for hdu in hdul:
                _ = [card.value for card in hdu.header.cards]  # which are parsed only now
    except Exception:  # astropy raises what it likes on a damaged file
        raise error(f"{path}: the FITS file is truncated or damaged") from None
    return hdul


def table_data(hdul: fits.HDUList, path: Path, error: type[FiberplanError]) -> dict[str, Any]:
    """The tables of a file that fiberplan wrote, by name.

    Nothing else may be in it: above all no keyword that makes other values of the bytes than `table_hdu` wrote.

    Raises:
        error: an HDU that is no such table; it is named.
    """
    tables: dict[str, Any] = {}
    for number, hdu in enumerate(hdul[1:], 1):
        name = str(hdu.name) or f"number {number}"
        if not isinstance(hdu, fits.BinTableHDU):
            raise error(f"{path}: HDU {name} is no table: not written by fiberplan")
        if name in tables:
            raise error(f"{path}: table {name} is there twice")
        if complaint := _layout_complaint(hdu.header):
            raise error(f"{path}: table {name}: {complaint}: not written by fiberplan")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                tables[name] = hdu.data
        except Exception:
            raise error(f"{path}: the FITS file is truncated or damaged") from None
    return tables


def _layout_complaint(header: fits.Header) -> str | None:
    """What in a table's header is not as `table_hdu` writes it; sizes are held against the file's by `open_fits`."""
    fields = header.get("TFIELDS")
    if type(fields) is not int or not 0 <= fields <= _MOST_FIELDS:
        return f"TFIELDS is {fields}"
    width = 0
    for k in range(1, fields + 1):
        form = _FORM.fullmatch(str(header.get(f"TFORM{k}")))
        if form is None:
            return f"TFORM{k} is {header.get(f'TFORM{k}')}"
        width += int(form[1] or 1) * _WIDTHS[form[2]]
    expected = {"BITPIX": 8, "NAXIS": 2, "NAXIS1": width, "PCOUNT": 0, "GCOUNT": 1}
    for key, value in expected.items():
        if type(header.get(key)) is not int or header[key] != value:
            return f"{key} is {header.get(key)}, expected {value}"
    if not width and header["NAXIS2"]:
        return "its rows have no bytes"
    changing = next((key for key in header if _CHANGING.fullmatch(key)), None)
    return f"{changing} changes its values" if changing else None


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
