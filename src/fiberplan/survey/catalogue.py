"""A catalogue: places in the focal plane that fibers could go to, and what each is worth.

Nobody has said yet which positioner takes which target; that is what `fiberplan.survey.allocate` finds. Priorities
count against each other within a tier; no target of a tier is given up for one of a later tier (a larger number).
"""

import dataclasses
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fiberplan.arrays import LARGEST, Frozen, read_only, shortened, texts
from fiberplan.errors import TargetError
from fiberplan.io.target_files import refuse_plan
from fiberplan.problem import Targets
from fiberplan.problem.targets import MOST_PRIORITY
from fiberplan.tables.contents import read_whole
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import given_table, read_table

SCIENCE = "science"  #: the category of whatever has none

_WANTED = (("x", "y"),)  # columns of the table in a file of several


@dataclass(frozen=True, eq=False)
class Catalogue(Frozen):
    """Candidate targets.

    Raises:
        TargetError: no targets, a value that is not finite, a negative priority, a tier that is no whole number, or a
            parity other than +1, 0 or -1; the message names the row.
    """

    x: np.ndarray  #: (m,) [mm]
    y: np.ndarray  #: (m,) [mm]
    ids: tuple[str, ...] = ()  #: (m,) names; rows as they stand in the source unless given
    priority: np.ndarray = None  # type: ignore[assignment]  #: (m,) larger matters more; 1 unless given
    tier: np.ndarray = None  # type: ignore[assignment]  #: (m,) whole numbers, smaller goes first; 1 unless given
    fiber: tuple[str, ...] | None = None  #: (m,) kind of fiber that is needed; "" (unless given): the default one
    category: tuple[str, ...] | None = None  #: (m,) such as "science" (unless given), "sky" or "standard"
    parity: np.ndarray = None  # type: ignore[assignment]  #: (m,) +1 right, -1 left, 0 (unless given) either elbow
    source: str = "catalogue"  #: a file, for messages
    rows: tuple[str, ...] = ()  #: (m,) where each target stands in it

    def __post_init__(self) -> None:
        m = np.size(self.x)
        defaults = {"priority": np.ones(m), "tier": np.ones(m), "parity": np.zeros(m)}
        for name in ("x", "y", "priority", "tier", "parity"):
            value, unit = getattr(self, name), "mm" if name in ("x", "y") else ""
            label = f"{self.source}: {name}"
            value = read_only(defaults[name] if value is None else value, float, unit, label, TargetError)
            if value.shape != (m,):
                raise TargetError(f"{label} must have shape ({m},), got {value.shape}")
            object.__setattr__(self, name, value)
        object.__setattr__(self, "rows", tuple(self.rows) or tuple(f"row {k + 1}" for k in range(m)))
        names = {"ids": self.rows, "fiber": ("",) * m, "category": (SCIENCE,) * m}
        for name, default in names.items():
            value = texts(getattr(self, name) or default, f"{self.source}: {name}", TargetError)
            if len(value) != m:
                raise TargetError(f"{self.source}: {name} has {len(value)} entries for {m} targets")
            object.__setattr__(self, name, value)
        self._validate()
        object.__setattr__(self, "tier", read_only(self.tier, np.int64))

    def _validate(self) -> None:
        if not len(self):
            raise TargetError(f"{self.source}: there are no targets")
        for name in ("x", "y"):
            self._refuse(~np.isfinite(getattr(self, name)), name, "")
            self._refuse(np.abs(getattr(self, name)) > LARGEST, name, f" mm, more than {LARGEST:g}")
        ok = np.isfinite(self.priority) & (self.priority >= 0)
        self._refuse(~ok, "priority", ", expected a finite number of 0 or more")
        self._refuse(self.priority > MOST_PRIORITY, "priority", f", expected at most {MOST_PRIORITY:g}")
        self._refuse(~(np.abs(self.tier) < 1e9) | (self.tier % 1 != 0), "tier", ", expected a whole number")
        self._refuse(~np.isin(self.parity, (-1, 0, 1)), "parity", ", expected +1 (right), -1 (left) or 0 (either)")

    def _refuse(self, bad: np.ndarray, name: str, expected: str) -> None:
        """Raise for the first True of `bad`, naming its row and value."""
        if bad.any():
            row = int(np.argmax(bad))
            raise TargetError(f"{self.source}: {self.rows[row]}: {name} is {getattr(self, name)[row]:g}{expected}")

    def __len__(self) -> int:
        return len(self.x)

    def some(self, rows: np.ndarray, places: np.ndarray, source: str) -> "Catalogue":
        """Some of these targets elsewhere, as a field has them; rows are known by their ids.

        Args:
            rows: (k,) which.
            places: (k, 2) where they are in that field [mm].
            source: what messages call the new catalogue.
        """
        assert self.fiber is not None  # set on construction
        assert self.category is not None  # likewise
        chosen = rows.tolist()
        ids = tuple(self.ids[row] for row in chosen)
        return Catalogue(
            x=places[:, 0],
            y=places[:, 1],
            ids=ids,
            priority=self.priority[rows],
            tier=self.tier[rows],
            fiber=tuple(self.fiber[row] for row in chosen),
            category=tuple(self.category[row] for row in chosen),
            parity=self.parity[rows],
            source=source,
            rows=ids,
        )

    def __repr__(self) -> str:
        return f"<Catalogue: {len(self)} targets from '{shortened(self.source)}'>"

    @classmethod
    def of(cls, given: Any) -> "Catalogue":
        """A catalogue from a `Catalogue`, a `Targets` (whoever they are of), a table of astropy, or a file's path.

        Raises:
            TargetError: none of these, or one that cannot be used; one line that names column, row and value.
        """
        if isinstance(given, Catalogue):
            return given
        if isinstance(given, Targets):
            shared = ("x", "y", "priority", "fiber", "parity", "source", "rows")
            fields: dict[str, Any] = {name: getattr(given, name) for name in shared}
            return cls(**fields)
        what = "a catalogue is a table, targets"
        return cls.from_columns(given_table(given, "catalogue", what, TargetError, _WANTED))

    @classmethod
    def read(cls, path: str | os.PathLike, priority_order: Literal["larger", "smaller"] = "larger") -> "Catalogue":
        """A catalogue from any table that astropy reads.

        Columns: ``x``, ``y`` [mm]; optionally ``id``, ``priority``, ``tier``, ``fiber``, ``category``, ``parity``.
        Units in brackets are assumed where none are given; an empty cell is as a column that is missing.

        Args:
            path: of the file.
            priority_order: which priorities matter more in it; "smaller" turns them round, as `turned` does.

        Raises:
            TargetError: a file, column, unit or value that cannot be used; one line that names it.
        """
        if priority_order not in ("larger", "smaller"):
            raise TargetError(f"priority_order must be 'larger' or 'smaller', got '{priority_order}'")
        content = read_whole(Path(path), TargetError)
        refuse_plan(path, content)
        found = cls.from_columns(read_table(path, TargetError, content, wanted=_WANTED))
        return found if priority_order == "larger" else found.turned()

    def turned(self) -> "Catalogue":
        """The same with priorities turned round, so that the smallest matters most; all are worth something."""
        worst, best = self.priority.max(), max(self.priority.min(), 1.0)  # nobody takes what is worth 0
        return dataclasses.replace(self, priority=worst + best - self.priority)

    @classmethod
    def from_columns(cls, table: InputTable, places: np.ndarray | None = None) -> "Catalogue":
        """A catalogue from the columns of a table, which need not have x and y where `places` (m, 2) [mm] are given."""
        columns = ("x", "y", "id", "priority", "tier", "fiber", "category", "parity")
        table.refuse_twins(*columns)
        fields: dict[str, Any] = {} if places is None else {"x": places[:, 0], "y": places[:, 1]}
        if places is None:
            table.require("x", "y")
            fields = {name: table.numbers(name, "mm") for name in ("x", "y")}
        blanks = {"priority": 1.0, "tier": 1.0, "parity": 0.0}
        fields |= {name: table.numbers(name, blank=blank) for name, blank in blanks.items() if name in table}
        if "id" in table:
            ids = table.names("id", blank="")
            fields["ids"] = tuple(id_ or row for id_, row in zip(ids, table.rows, strict=True))
        if "fiber" in table:
            fields["fiber"] = table.texts("fiber", blank="")
        if "category" in table:
            fields["category"] = table.texts("category", blank=SCIENCE)
        return cls(**fields, source=table.source, rows=table.rows)
