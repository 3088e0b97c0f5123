"""Targets of a survey: what each is worth, how often it is to be observed, and where it is in which field.

They are on the sky, or already in the focal plane: then a row is a target in a field, and a target has as many rows as
fields that it lies in. Only what is still to be observed is offered to a field; required categories, such as sky, are
offered always.
"""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from fiberplan.arrays import Frozen, read_only, shortened, texts
from fiberplan.errors import TargetError
from fiberplan.survey.batch.fields import Fields
from fiberplan.survey.catalogue import Catalogue
from fiberplan.survey.sky import SkyPositions, Telescope
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import given_table
from fiberplan.tables.wording import nearest

_SKY = {"ra": "rad", "dec": "rad", "pm_ra": "rad/yr", "pm_dec": "rad/yr", "epoch": "yr"}
_IN_FILES = {"rad": "deg", "rad/yr": "mas/yr", "yr": "yr"}


@dataclass(frozen=True, eq=False)
class SurveyTargets(Frozen):
    """Targets, on the sky or in the focal plane of each field.

    Raises:
        TargetError: what `Catalogue` refuses, visits that are no whole number of 1 or more, or a target that is given
            twice on the sky, or twice in one field.
    """

    listed: Catalogue  #: rows; x and y are zeros where `sky` is given
    sky: SkyPositions | None = None  #: of the rows
    field: tuple[str, ...] | None = None  #: of the rows, names of fields, where x and y are given
    visits: np.ndarray = None  # type: ignore[assignment]  #: (rows,) fields in which a target is wanted; 1 unless given

    def __post_init__(self) -> None:
        m = len(self.listed)
        visits = np.ones(m) if self.visits is None else self.visits
        visits = read_only(visits, float, name=f"{self.listed.source}: visits", error=TargetError)
        if (self.sky is None) == (self.field is None):
            raise TargetError(f"{self.listed.source}: give ra and dec of the targets, or x and y with a column 'field'")
        if self.field is not None:
            object.__setattr__(self, "field", texts(self.field, f"{self.listed.source}: field", TargetError))
        sizes = {len(visits), len(self.sky if self.sky is not None else self.field or ())}
        if sizes != {m}:
            raise TargetError(f"{self.listed.source}: columns of different lengths for {m} targets")
        bad = ~((visits >= 1) & (visits % 1 == 0) & (visits < 1e9))
        if bad.any():
            row = int(np.argmax(bad))
            said = f"visits is {visits[row]:g}, expected a whole number of 1 or more"
            raise TargetError(f"{self.listed.source}: {self.listed.rows[row]}: {said}")
        object.__setattr__(self, "visits", read_only(visits, np.int64))
        seen: dict[tuple[str, str], int] = {}
        for row, key in enumerate(zip(self.listed.ids, self.field or ("",) * m, strict=True)):
            if (first := seen.setdefault(key, row)) != row:
                where = f" in field '{key[1]}'" if key[1] else ""
                said = f"target '{key[0]}' is that of {self.listed.rows[first]}{where}, too"
                raise TargetError(f"{self.listed.source}: {self.listed.rows[row]}: {said}")

    def __len__(self) -> int:
        return len(self.ids)

    def __repr__(self) -> str:
        return f"<SurveyTargets: {len(self)} from '{shortened(self.listed.source)}'>"

    @cached_property
    def _numbers(self) -> dict[str, int]:
        return {id_: k for k, id_ in enumerate(dict.fromkeys(self.listed.ids))}

    @property
    def ids(self) -> tuple[str, ...]:
        """Names of the targets, each once."""
        return tuple(self._numbers)

    @cached_property
    def target(self) -> np.ndarray:
        """(rows,) which target each row is of."""
        return read_only([self._numbers[id_] for id_ in self.listed.ids], np.int64)

    @cached_property
    def first(self) -> np.ndarray:
        """(targets,) the first row of each target, which says its class, tier and visits."""
        return read_only(np.unique(self.target, return_index=True)[1], np.int64)

    def repeated(self, categories: Iterable[str]) -> np.ndarray:
        """(targets,) whether a target is of one of these categories, and so is never done with."""
        assert self.listed.category is not None  # set on construction
        wanted = set(categories)
        return np.array([self.listed.category[row] in wanted for row in self.first.tolist()], bool)

    @classmethod
    def of(cls, given: Any) -> "SurveyTargets":
        """Targets from a `SurveyTargets`, a table of astropy, or a file's path.

        Columns are those of `Catalogue.read`, and ``visits``; and ``field`` beside x and y, or places on the sky
        instead: ``ra``, ``dec`` [deg], ``pm_ra``, ``pm_dec`` [mas/yr] and ``epoch`` [yr].

        Raises:
            TargetError: none of these, or one that cannot be used; one line that names column, row and value.
        """
        if isinstance(given, SurveyTargets):
            return given
        wanted = ("ra", "dec"), ("x", "y")
        return cls._from(given_table(given, "catalogue", "a survey's catalogue is a table", TargetError, wanted))

    @classmethod
    def _from(cls, table: InputTable) -> "SurveyTargets":
        table.refuse_twins("field", "visits", *_SKY)
        given: dict[str, Any] = {"visits": table.numbers("visits", blank=1.0)} if "visits" in table else {}
        if "ra" not in table:
            table.require("x", "y", "field")
            return cls(Catalogue.from_columns(table), field=table.names("field"), **given)
        table.require("dec")
        columns = {name: table.numbers(name, unit, _IN_FILES[unit]) for name, unit in _SKY.items() if name in table}
        sky = SkyPositions(**columns, source=table.source, rows=table.rows)
        return cls(Catalogue.from_columns(table, np.zeros((len(table), 2))), sky=sky, **given)

    def turned(self) -> "SurveyTargets":
        """The same with priorities turned round, as those of a `Catalogue`."""
        return dataclasses.replace(self, listed=self.listed.turned())

    def lying_in(self, fields: Fields, telescope: Telescope | None) -> "LyingIn":
        """Which targets lie in which of these fields.

        Raises:
            TargetError: targets on the sky and fields without a centre, no telescope, or a field that there is not.
        """
        return LyingIn(self, fields, telescope)


class LyingIn:
    """Rows and places of the targets in each field; found when it is asked for, so that memory stays small."""

    def __init__(self, targets: SurveyTargets, fields: Fields, telescope: Telescope | None):
        self._targets, self._fields, self._telescope = targets, fields, telescope
        source = targets.listed.source
        if targets.sky is not None:
            if telescope is None:
                raise TargetError(f"{source}: targets with ra and dec need a telescope")
            if not fields.on_sky:
                row = fields.rows[int(np.argmax(np.isnan(fields.ra)))]
                raise TargetError(f"{fields.source}: {row}: needs ra and dec, since targets are on the sky")
            years = fields.year[np.isfinite(fields.year)]
            span = np.abs(years[:, None] - [targets.sky.epoch.min(), targets.sky.epoch.max()]).max(initial=0.0)
            moved = 1.01 * span * float(np.hypot(targets.sky.pm_ra, targets.sky.pm_dec).max())
            self._chord = 2 * np.sin(min(telescope.radius + moved, np.pi) / 2)
            self._tree = cKDTree(targets.sky.directions)
            centres = SkyPositions(fields.ra, fields.dec)
            self._centre = centres.directions
            return
        number = {id_: k for k, id_ in enumerate(fields.ids)}
        assert targets.field is not None  # one of the two is given
        for k, id_ in enumerate(targets.field):
            if id_ not in number:
                said = f"there is no field '{id_}'{nearest(id_, number)}"
                raise TargetError(f"{source}: {targets.listed.rows[k]}: {said}")
        of = np.array([number[id_] for id_ in targets.field], np.int64)
        self._by_field = np.argsort(of, kind="stable")
        self._from = np.searchsorted(of[self._by_field], np.arange(len(fields) + 1))

    def of(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows (m,) that lie in field k, in rising order, and their places (m, 2) [mm]."""
        targets, fields = self._targets, self._fields
        if targets.sky is None:
            rows = self._by_field[self._from[k] : self._from[k + 1]]
            return rows, np.stack([targets.listed.x[rows], targets.listed.y[rows]], axis=1)
        assert self._telescope is not None  # checked on construction
        rows = np.sort(np.array(self._tree.query_ball_point(self._centre[k], self._chord), np.int64))
        there = targets.sky.some(rows).at(float(fields.year[k]))
        centre = float(fields.ra[k]), float(fields.dec[k]), float(fields.position_angle[k])
        places = self._telescope.place(there, *centre)
        inside = np.isfinite(places[:, 0])
        return rows[inside], places[inside]
