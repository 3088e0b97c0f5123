"""Tables of a survey as files: ECSV, and Parquet where pyarrow is installed."""

import importlib.util
import tempfile
from collections.abc import Mapping
from pathlib import Path

from astropy.table import Table

from fiberplan.errors import FiberplanError
from fiberplan.tables.atomic import write_whole

_FORMATS = {".ecsv": "ascii.ecsv", ".parquet": "parquet"}


def write_tables(tables: Mapping[str, Table], folder: Path) -> list[Path]:
    """Write tables by their names into a folder, which is made if need be; the paths that were written.

    Raises:
        FiberplanError: one cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, table in tables.items():
        for suffix in _FORMATS if importlib.util.find_spec("pyarrow") else (".ecsv",):
            write_whole(folder / f"{name}{suffix}", _content(table, suffix), FiberplanError)
            written.append(folder / f"{name}{suffix}")
    return written


def _content(table: Table, suffix: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:  # astropy writes Parquet to a path only
        draft = Path(folder) / f"table{suffix}"
        table.write(draft, format=_FORMATS[suffix])
        return draft.read_bytes()
