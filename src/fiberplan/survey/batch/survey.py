"""What comes of a survey, as tables: everything is from the ledger, so that a run that went on says what one run says.

What was recorded by a clock is in a table of its own: all others are the same for the same inputs.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from astropy.table import Table

from fiberplan.arrays import Frozen
from fiberplan.focal_plane import FocalPlane
from fiberplan.survey.batch.fields import Fields
from fiberplan.survey.batch.record import Record
from fiberplan.survey.batch.survey_targets import SurveyTargets

_SLOWEST = 100  # moves of the whole survey that are listed


@dataclass(frozen=True, eq=False)
class Survey(Frozen):
    """A survey, done as far as it could be."""

    plane: FocalPlane
    targets: SurveyTargets
    fields: Fields
    records: tuple[Record, ...]  #: one for each field, in order
    lying: np.ndarray  #: (targets,) in how many fields each target lies
    longest: int  #: fields that had to be done one after the other, however many workers there were
    assumptions: tuple[str, ...] = ()  #: what places in the focal plane, and proofs, rest on

    @property
    def failed(self) -> tuple[Record, ...]:
        """Fields that nothing was written for."""
        return tuple(record for record in self.records if record.why)

    @cached_property
    def seen(self) -> np.ndarray:
        """(targets,) in how many fields each target was observed."""
        taken = [np.array(record.taken, np.int64) for record in self.records]
        return np.bincount(np.concatenate([np.empty(0, np.int64), *taken]), minlength=len(self.targets))

    @property
    def moving(self) -> float:
        """Time that all fields together spend moving [s]."""
        return sum(record.makespan for record in self.records)

    def __repr__(self) -> str:
        return f"<Survey: {self}>"

    def __str__(self) -> str:
        wanted = self.targets.visits[self.targets.first]
        done, taken = int((self.seen >= wanted).sum()), sum(len(record.taken) for record in self.records)
        text = f"{len(self.records) - len(self.failed)} of {len(self.records)} fields planned and proven: "
        text += f"{done} of {len(wanted)} targets complete, {taken} observations, {self.moving:.1f} s moving"
        return text

    def tables(self) -> dict[str, Table]:
        """Tables by name: fields, completeness, by_field (and class), reasons, moves, positioners, times."""
        return {name: _table(columns, list(rows(self))) for name, (columns, rows) in _TABLES.items()}


def _table(columns: tuple[str, ...], rows: list[tuple]) -> Table:
    """A table; a unit stands in brackets behind the name of its column."""
    table = Table()
    for k, column in enumerate(columns):
        name, _, unit = column.partition(" ")
        values = [row[k] for row in rows]
        table[name] = np.array(values) if values else np.array([], float)
        if unit:
            table[name].unit = unit.strip("[]")
    return table


def _fields(survey: Survey) -> Iterator[tuple]:
    for chain, record in zip(survey.fields.chain, survey.records, strict=True):
        offered = sum(count for _, count in record.candidates)
        gap = np.nan if record.clearance is None else record.clearance
        worth = record.value, record.bound, record.price, record.short, record.rounds
        yield record.id, chain, offered, len(record.taken), *worth, record.makespan, record.lower_bound, gap, record.why


def _completeness(survey: Survey) -> Iterator[tuple]:
    """By class and tier: how many targets there are, lie in a field, were observed at all, and as often as wanted."""
    listed, first = survey.targets.listed, survey.targets.first
    assert listed.category is not None  # set on construction
    classes = [(listed.category[row], int(listed.tier[row])) for row in first.tolist()]
    wanted = survey.targets.visits[first]
    for key in sorted(set(classes)):
        mine = np.array([each == key for each in classes])
        inside, some = (survey.lying[mine] > 0).sum(), (survey.seen[mine] > 0).sum()
        done = int((survey.seen[mine] >= wanted[mine]).sum())
        share = done / int(inside) if inside else 0.0
        yield *key, int(mine.sum()), int(inside), int(some), done, share


def _by_field(survey: Survey) -> Iterator[tuple]:
    listed, first = survey.targets.listed, survey.targets.first
    assert listed.category is not None  # set on construction
    for record in survey.records:
        taken = Counter(listed.category[first[target]] for target in record.taken)
        for name, offered in record.candidates:
            yield record.id, name, offered, taken[name], taken[name] / offered


def _reasons(survey: Survey) -> Iterator[tuple]:
    for record in survey.records:
        for name, why, count in record.reasons:
            yield record.id, name, why, count


def _moves(survey: Survey) -> Iterator[tuple]:
    """The slowest moves of all fields, the slowest first."""
    moves = [(record.id, *slow) for record in survey.records for slow in record.slowest]
    yield from sorted(moves, key=lambda move: -move[2])[:_SLOWEST]


def _positioners(survey: Survey) -> Iterator[tuple]:
    """How often each positioner had a target."""
    plane = survey.plane
    had = [np.array(record.positioners, np.int64) for record in survey.records]
    counts = np.bincount(np.concatenate([np.empty(0, np.int64), *had]), minlength=plane.n)
    for i in range(plane.n):
        yield plane.ids[i], float(plane.base[i, 0]), float(plane.base[i, 1]), int(counts[i])


def _times(survey: Survey) -> Iterator[tuple]:
    for record in survey.records:
        yield record.id, *record.times


_FIELDS = ("field", "chain", "offered", "observed", "value", "bound", "price", "short", "rounds")
_TABLES = {
    "fields": ((*_FIELDS, "makespan [s]", "lower_bound [s]", "clearance [mm]", "failed"), _fields),
    "completeness": (("class", "tier", "targets", "in_fields", "observed", "complete", "fraction"), _completeness),
    "by_field": (("field", "class", "offered", "observed", "fraction"), _by_field),
    "reasons": (("field", "class", "reason", "targets"), _reasons),
    "moves": (("field", "positioner", "stop [s]", "least [s]"), _moves),
    "positioners": (("positioner", "x [mm]", "y [mm]", "fields"), _positioners),
    "times": (("field", "cpu [s]", "wall [s]", "tries"), _times),
}
