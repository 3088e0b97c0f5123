"""The fields of `Targets` from the columns of a table (`docs/targets.md`).

Surveys write a row for every robot, also where there is nothing to observe: such rows are refused all at once, or left
out by name.
"""

import re
from typing import Any

import numpy as np

from fiberplan.errors import TargetError
from fiberplan.tables.input_table import InputTable

META = "fiberplan"  #: key of a table's meta data under which there is more about its targets
PLACES = (("x", "y"), ("alpha", "beta"))
_COLUMNS = ("positioner", "x", "y", "alpha", "beta", "priority", "fiber", "parity", "assigned", "on_target", "disabled")
_NOBODY = re.compile(r"(-\d+(\.0*)?|nan|none|null)?", re.IGNORECASE)  # names that name no positioner
_PARITIES = {"right": 1.0, "left": -1.0, "any": 0.0, "": 0.0}


def target_fields(table: InputTable, drop: bool = False) -> dict[str, Any]:
    """The fields of `Targets`, of the rows that can be used."""
    table.refuse_twins(*_COLUMNS)
    has_angles = "alpha" in table or "beta" in table
    if "x" in table or "y" in table or not has_angles:
        table.require("x", "y")
    if has_angles:
        table.require("alpha", "beta")
    unknown, faults = np.full(len(table), np.nan), dict[int, str]()
    place = [
        table.numbers(name, "mm", blank=np.nan, faults=faults) if name in table else unknown for name in ("x", "y")
    ]
    angles = [
        table.numbers(name, "rad", "deg", blank=np.nan, faults=faults) if has_angles else unknown
        for name in ("alpha", "beta")
    ]
    has_place, has_pose = (np.isfinite(pair).all(axis=0) for pair in (place, angles))
    for row in map(int, np.flatnonzero(~has_place & ~has_pose)):
        missing = [
            f"{name} is {table.said(name, row)}"
            for name, values in zip(("x", "y", "alpha", "beta"), (*place, *angles), strict=True)
            if name in table and np.isnan(values[row])
        ]
        faults.setdefault(row, " and ".join(missing[:2]))
    for row in map(int, np.flatnonzero(np.isnan(angles[0]) != np.isnan(angles[1]))):
        name = "alpha" if np.isnan(angles[0][row]) else "beta"
        faults.setdefault(row, f"{name} is {table.said(name, row)}, and only the other angle is given")
    fields: dict[str, Any] = {"x": place[0], "y": place[1], "angles": np.stack(angles, axis=1)}
    doubtful: dict[int, str] = {}
    fields |= _optional(table, faults, doubtful if drop else None)
    remarks = _remarks(table)
    remarks["notes"] += tuple(
        f"{table.rows[row]} of {table.source}: {why}: taken as disabled" for row, why in doubtful.items()
    )
    if drop:
        _only_first(table, fields.get("positioner"), faults)
    kept = np.array([row not in faults for row in range(len(table))], bool)
    if faults:
        remarks |= _left_out(table, faults, remarks["notes"], drop)
    fields = {name: _rows(values, kept) for name, values in fields.items()}
    if "site" in table:
        remarks["site"] = _site(table)
    return fields | remarks | {"source": table.source, "rows": _rows(table.rows, kept)}


def _only_first(table: InputTable, ids: tuple[str, ...] | None, faults: dict[int, str]) -> None:
    """Put rows whose positioner has a target in an earlier row that can be used into `faults`."""
    first: dict[str, int] = {}
    for row, id_ in enumerate(ids or ()):
        if row not in faults and (before := first.setdefault(id_, row)) != row:
            faults[row] = f"positioner '{id_}' already has a target in {table.rows[before]}"


def _rows(values: Any, kept: np.ndarray) -> Any:
    if isinstance(values, np.ndarray):
        return values[kept]
    return tuple(value for value, keep in zip(values, kept, strict=True) if keep)


def _optional(table: InputTable, faults: dict[int, str], doubtful: dict[int, str] | None) -> dict[str, Any]:
    """What a table may say of each target beside its place; rows that cannot be used are put into `faults`.

    A robot of which it cannot be read whether it is disabled must not be moved: it is put into `doubtful`, if that is
    given, else refused.
    """
    fields: dict[str, Any] = {}
    if "positioner" in table:
        fields["positioner"] = table.names("positioner", blank="")
        for row, id_ in enumerate(fields["positioner"]):
            if _NOBODY.fullmatch(id_):
                faults.setdefault(row, f"positioner is {id_ or 'empty'}")
    if "priority" in table:
        fields["priority"] = table.numbers("priority", faults=faults)
        for row in map(int, np.flatnonzero(fields["priority"] < 0)):
            faults.setdefault(row, f"priority is {fields['priority'][row]:g}, expected a finite number of 0 or more")
    if "fiber" in table:
        fields["fiber"] = table.texts("fiber", blank="")
    if "second_name" in table:
        fields["second_names"] = table.texts("second_name", blank="")
    if "parity" in table:
        fields["parity"] = _parity(table, faults)
    for name, usual in (("assigned", True), ("on_target", True), ("disabled", False)):
        if name in table:
            fields[name] = table.flags(name, usual, doubtful if name == "disabled" else faults)
    if "on_target" in fields:
        fields["assigned"] = fields.get("assigned", True) & fields.pop("on_target")
    if "base_x" in table and "base_y" in table:
        base = [table.numbers(name, "mm", faults=faults) for name in ("base_x", "base_y")]
        fields["base"] = np.stack(base, axis=1)
    return fields


def _site(table: InputTable) -> str:
    """The observatory that all rows are of."""
    sites = table.texts("site", blank="")
    first = next((site for site in sites if site), "")
    for row, site in enumerate(sites):
        if site and site.lower() != first.lower():
            raise table.fail(row, f"site is {site}, and {first} before")
    return first


def _left_out(table: InputTable, faults: dict[int, str], notes: tuple[str, ...], drop: bool) -> dict[str, Any]:
    """Notes on rows that cannot be used, if they are to be left out, and which of them are lost targets.

    A robot whose row says no place has no target, and loses none; a place that was given was wanted.

    Raises:
        TargetError: they are not to be, or there are no others; one line that counts and names them all.
    """
    rows = sorted(faults)
    if not drop or len(rows) == len(table):
        hint = "" if len(rows) == len(table) else "; --conflicts drop leaves them out"
        if len(rows) == 1:
            raise table.fail(rows[0], faults[rows[0]] + hint.replace("them", "it"))
        causes: dict[str, list[str]] = {}
        for row in rows:
            causes.setdefault(faults[row], []).append(table.rows[row])
        text = "; ".join(f"{', '.join(where)}: {cause}" for cause, where in causes.items())
        raise TargetError(f"{table.source}: {len(rows)} of {len(table)} rows cannot be used: {text}{hint}")
    places = [name for pair in PLACES for name in pair if name in table]
    lost = [row for row in rows if any(table.said(name, row) not in ("empty", "nan") for name in places)]
    said = {row: f"{table.rows[row]} of {table.source} was left out: {faults[row]}" for row in rows}
    said |= {row: f"{said[row]}; its target is lost" for row in lost}
    return {"notes": (*notes, *said.values()), "left_out": tuple(said[row] for row in lost)}


def _remarks(table: InputTable) -> dict[str, Any]:
    """What `write_targets` says of positioners without a target."""
    said = table.meta.get(META, {})
    try:
        found: dict[str, Any] = {name: tuple(map(str, said.get(name, ()))) for name in ("offline", "notes", "left_out")}
        found |= {name: said[name] for name in ("prefer", "site") if said.get(name)}
        if said.get("idle"):
            found["idle"] = np.array(said["idle"], float).reshape(-1, 2)
    except (AttributeError, TypeError, ValueError):
        raise TargetError(f"{table.source}: what its meta data say under '{META}' cannot be read") from None
    return found


def lacking_cells(table: InputTable) -> dict[int, str]:
    """Rows that cannot be used, as a cell that they need is masked -> what it is called."""
    masked = {name: np.ma.getmaskarray(np.ma.asarray(cells)) for name, cells in table.columns.items()}
    found: dict[int, str] = {}
    for row, id_ in enumerate(table.columns.get("positioner", [""] * len(table))):
        hidden = {name for name, mask in masked.items() if mask[row].any()}
        lacking: list[str] = [name for name in ("positioner", "priority", "base_x", "base_y") if name in hidden]
        if not any(all(name in table and name not in hidden for name in place) for place in PLACES):
            lacking += [name for name in ("x", "y", "alpha", "beta") if name in hidden]
        if lacking:
            found[row] = f"{lacking[0]} of positioner '{id_}'" if id_ and "positioner" not in hidden else lacking[0]
    return found


def _parity(table: InputTable, faults: dict[int, str]) -> np.ndarray:
    """+1, -1 or 0, also as right, left or any."""
    words = [word.lower() for word in table.texts("parity", blank="any")]
    if all(word in _PARITIES for word in words):
        return np.array([_PARITIES[word] for word in words])
    values = table.numbers("parity", blank=0.0, faults=faults)
    for row in map(int, np.flatnonzero(~np.isin(values, (-1, 0, 1)))):
        faults.setdefault(row, f"parity is {values[row]:g}, expected +1 (right), -1 (left) or 0 (either)")
    return values
