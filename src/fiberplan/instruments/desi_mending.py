"""DESI devices whose rows have a cell that cannot be used: offline, with what is usual in place of that cell.

Nothing is known of a device whose place, petal or name cannot be read: it is left out, which a proof has to say.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fiberplan.tables.input_table import InputTable

_PLACES = ("PETAL_LOC", "OFFSET_X", "OFFSET_Y")
_MEASURES = ("LENGTH_R1", "LENGTH_R2", "OFFSET_T", "OFFSET_P", "PHYSICAL_RANGE_T", "PHYSICAL_RANGE_P")
_EXPANSIONS = tuple(f"KEEPOUT_EXPANSION_{axis}_{kind}" for axis in ("PHI", "THETA") for kind in ("RADIAL", "ANGULAR"))
_FLAGS = {"DEVICE_CLASSIFIED_NONFUNCTIONAL": "True", "CLASSIFIED_AS_RETRACTED": "False", "LINPHI": "True"}
_FLAGS |= {"FIBER_INTACT": "False"}
_SAYS = {"true", "false", "yes", "no", "1", "0", ""}


def mended(table: InputTable, least_range: float) -> tuple[InputTable, tuple[str, ...]]:
    """The table without cells that cannot be used, and a sentence for each device that had one.

    Lengths, offsets and ranges become the median of their columns, expansions the largest, angles unknown.

    Args:
        table: of devices.
        least_range: of a joint [deg]; a smaller one is not believed.
    """
    faults: dict[int, str] = {}
    columns = {name: list(map(str, table.cells(name))) for name in table.columns}

    def put(name: str, rows: Sequence[int], cell: str) -> None:
        known = next(own for own in columns if own.lower() == name.lower())
        for row in rows:
            columns[known][row] = cell

    lost: dict[int, str] = {}
    for row, (cell, petal) in enumerate(zip(table.cells("LOCATION"), table.cells("PETAL_LOC"), strict=True)):
        location = str(cell).strip()
        if not location.isdigit() or str(int(location) // 1000) != str(petal).strip():
            lost[row] = f"LOCATION is '{location}' and PETAL_LOC '{petal}'"
    for name in _PLACES:
        table.numbers(name, faults=lost)
    for name in _MEASURES:
        wrong: dict[int, str] = {}
        values = table.numbers(name, faults=wrong)
        if "RANGE" in name:
            wrong |= {int(row): f"{name} is {values[row]:g} deg" for row in np.flatnonzero(values <= least_range)}
        usual = f"{np.median([value for row, value in enumerate(values) if row not in wrong] or [np.nan]):.6g}"
        put(name, list(wrong), usual)
        for row, text in wrong.items():
            faults.setdefault(row, f"{text}, taken as {usual}")
    for name in (*_EXPANSIONS, "POS_T", "POS_P"):
        if name in table:
            wrong = {}
            most = np.nanmax(table.numbers(name, blank=np.nan, faults=wrong), initial=0.0)
            put(name, list(wrong), f"{most:.6g}" if name in _EXPANSIONS else "")
            for row, text in wrong.items():
                faults.setdefault(row, text)
    for name, cautious in _FLAGS.items():
        if name in table:
            bad = [row for row, cell in enumerate(table.cells(name)) if str(cell).strip().lower() not in _SAYS]
            put(name, bad, cautious)
            for row in bad:
                faults.setdefault(row, f"{name} is '{table.cells(name)[row]}'")
    put("DEVICE_CLASSIFIED_NONFUNCTIONAL", list(faults), "True")

    ids = [str(cell).strip() for cell in table.cells("LOCATION")]
    where = "left out, nothing is known of where it stands"
    said = [
        f"device {ids[row]} is {where if row in lost else 'offline'}: {table.rows[row]}: {text}"
        for row, text in sorted((faults | lost).items())
    ]
    kept = [row for row in range(len(table)) if row not in lost]
    columns = {name: [cells[row] for row in kept] for name, cells in columns.items()}
    return replace(table, columns=columns, rows=tuple(table.rows[row] for row in kept)), tuple(said)
