"""The fields of a survey in the order in which they are observed.

A chain is observed in one go: its first field begins folded, each other one where the one before ended. Fields of
different chains may be planned at the same time.
"""

import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiberplan.arrays import Frozen, read_only, shortened, texts
from fiberplan.errors import TargetError
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import given_table, read_table

_WANTED = (("id",),)  # columns of the table in a file of several
_UNITS = {"ra": "rad", "dec": "rad", "position_angle": "rad", "year": "yr"}


@dataclass(frozen=True, eq=False)
class Fields(Frozen):
    """Fields, in order.

    Raises:
        TargetError: no fields, a name that is empty or given twice, or centres that are not finite.
    """

    ids: tuple[str, ...]  #: names
    chain: tuple[str, ...] = ()  #: names of the chains; all in one unless given
    ra: np.ndarray = None  # type: ignore[assignment]  #: (k,) of the centre [rad]; NaN: targets have x and y
    dec: np.ndarray = None  # type: ignore[assignment]  #: (k,) [rad]
    position_angle: np.ndarray = None  # type: ignore[assignment]  #: (k,) of y, north through east; 0 unless given [rad]
    year: np.ndarray = None  # type: ignore[assignment]  #: (k,) Julian year when it is observed; NaN: nothing moves
    source: str = "fields"  #: a file, for messages
    rows: tuple[str, ...] = ()  #: (k,) where each stands in it

    def __post_init__(self) -> None:
        object.__setattr__(self, "ids", texts(self.ids, f"{self.source}: id", TargetError))
        k = len(self.ids)
        object.__setattr__(self, "rows", tuple(self.rows) or tuple(f"row {j + 1}" for j in range(k)))
        chain = texts(self.chain, f"{self.source}: chain", TargetError) or ("",) * k
        object.__setattr__(self, "chain", chain)
        blanks = {"ra": np.nan, "dec": np.nan, "position_angle": 0.0, "year": np.nan}
        for name, unit in _UNITS.items():
            value = getattr(self, name)
            label = f"{self.source}: {name}"
            value = read_only(np.full(k, blanks[name]) if value is None else value, float, unit, label, TargetError)
            object.__setattr__(self, name, value)
            if value.shape != (k,):
                raise TargetError(f"{label} must have shape ({k},), got {value.shape}")
        if not k:
            raise TargetError(f"{self.source}: there are no fields")
        if len(chain) != k or len(self.rows) != k:
            raise TargetError(f"{self.source}: {k} fields, but {len(chain)} chains and {len(self.rows)} rows")
        seen: dict[str, int] = {}
        for j, id_ in enumerate(self.ids):
            if not id_:
                raise TargetError(f"{self.source}: {self.rows[j]}: id is empty")
            if (first := seen.setdefault(id_, j)) != j:
                raise TargetError(f"{self.source}: {self.rows[j]}: id '{id_}' is that of {self.rows[first]}, too")
        half = np.isnan(self.ra) != np.isnan(self.dec)
        beyond = np.abs(self.dec) > np.pi / 2
        for bad, said in ((half, "ra and dec: one is missing"), (beyond, "dec is beyond a pole")):
            if bad.any():
                raise TargetError(f"{self.source}: {self.rows[int(np.argmax(bad))]}: {said}")

    def __len__(self) -> int:
        return len(self.ids)

    def __repr__(self) -> str:
        return f"<Fields: {len(self)} in {len(set(self.chain))} chains from '{shortened(self.source)}'>"

    @property
    def on_sky(self) -> bool:
        """Whether all of them have a centre on the sky."""
        return bool(np.isfinite(self.ra).all())

    @classmethod
    def of(cls, given: Any) -> "Fields":
        """Fields from a `Fields`, a table of astropy, or a file's path; columns as in `read`.

        Raises:
            TargetError: none of these, or one that cannot be used; one line that names column, row and value.
        """
        if isinstance(given, Fields):
            return given
        return cls._from(given_table(given, "fields", "fields are a table", TargetError, _WANTED))

    @classmethod
    def read(cls, path: str | os.PathLike) -> "Fields":
        """Fields from any table that astropy reads.

        Columns: ``id``; for targets on the sky ``ra``, ``dec`` [deg]; optionally ``position_angle`` [deg], ``year``
        (Julian, such as 2027.5) and ``chain``.

        Raises:
            TargetError: a file, column, unit or value that cannot be used; one line that names it.
        """
        return cls._from(read_table(path, TargetError, wanted=_WANTED))

    @classmethod
    def _from(cls, table: InputTable) -> "Fields":
        table.refuse_twins("id", "chain", *_UNITS)
        table.require("id", *(("ra", "dec") if "ra" in table or "dec" in table else ()))
        given: dict[str, Any] = {
            name: table.numbers(name, unit, "deg" if unit == "rad" else unit)
            for name, unit in _UNITS.items()
            if name in table
        }
        if "chain" in table:
            given["chain"] = table.names("chain", blank="")
        return cls(ids=table.names("id"), **given, source=table.source, rows=table.rows)
