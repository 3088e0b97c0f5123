"""What comes of allocating: who takes what, how good that is, what the motion cost, and why not the rest."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fiberplan.arrays import Frozen, FrozenDict
from fiberplan.errors import TargetError
from fiberplan.io.target_files import write_table
from fiberplan.plan import Plan
from fiberplan.problem import Problem, Targets
from fiberplan.survey.catalogue import Catalogue
from fiberplan.survey.choices import Choices
from fiberplan.survey.conflicts import ConflictTable
from fiberplan.survey.quotas import Quotas
from fiberplan.survey.reasons import Reason, Why, reasons

if TYPE_CHECKING:
    from astropy.table import QTable


class Tier(NamedTuple):
    """What is kept of a tier."""

    tier: int
    targets: int  #: allocated
    value: float  #: total priority
    bound: float  #: no allocation that keeps as much of the tiers before has more


class Quota(NamedTuple):
    """Required positions of a category in a region."""

    category: str
    region: int
    required: int
    allocated: int


@dataclass(frozen=True, eq=False)
class Allocation(Frozen):
    """Which positioner takes which target."""

    catalogue: Catalogue
    problem: Problem  #: nobody has a goal in it: where everyone stands, who can move, the margin
    table: ConflictTable  #: options, and which of them touch
    choices: Choices  #: the same as numbers, with what each option is worth
    chosen: np.ndarray  #: (k,) options that are taken, in the order of their positioners
    tiers: tuple[Tier, ...]
    quotas: tuple[Quota, ...]
    plan: Plan | None  #: motion to the targets, all of which it reaches; None if it was not asked for
    rounds: int  #: times that was planned; 1: everyone arrived at once
    price: float  #: total priority given up for the motion's sake
    solver: str
    seed: int
    interrupted: bool  #: a deadline came before the best set was proven, and another machine may find another one
    required: Quotas
    targets: Targets | None = None  #: as `fiberplan plan` takes them; None if there are none

    @property
    def value(self) -> float:
        """Total priority of what is allocated; required positions have none."""
        return float(sum(tier.value for tier in self.tiers))

    @property
    def bound(self) -> float:
        """What `value` is at most, at rest: of each tier the most that there is beside what is kept of those before."""
        return float(sum(tier.bound for tier in self.tiers))

    @property
    def gap(self) -> float:
        """Part of the bound that is not reached."""
        return 1.0 - self.value / self.bound if self.bound > 0 else 0.0

    @property
    def rows(self) -> np.ndarray:
        """(k,) row in the catalogue of each allocated target, in the order of `targets`."""
        return self.table.options.target[self.chosen]

    @property
    def positioners(self) -> np.ndarray:
        """(k,) who takes each."""
        return self.table.options.positioner[self.chosen]

    @cached_property
    def reasons(self) -> Mapping[int, Reason]:
        """Row in the catalogue of each target that has no positioner -> why."""
        parts = self.problem, self.catalogue, self.table, self.choices, self.chosen, self.required
        return FrozenDict(reasons(*parts))

    def __repr__(self) -> str:
        return f"<Allocation: {self}>"

    def __str__(self) -> str:
        much = f"value {self.value:g} of at most {self.bound:g}"
        return f"{len(self.chosen)} of {len(self.catalogue)} targets allocated to {self.problem.n} positioners, {much}"

    def to_table(self) -> "QTable":
        """A row for each allocated target: what `Targets.to_table` has, and `target` (id), `tier` and `category`.

        Raises:
            TargetError: there is none.
        """
        if self.targets is None:
            raise TargetError(f"{self.catalogue.source}: no target is allocated")
        table, rows = self.targets.to_table(), self.rows
        assert self.catalogue.category is not None  # set on construction
        table["target"] = np.array([self.catalogue.ids[row] for row in rows.tolist()], str)
        table["tier"] = self.catalogue.tier[rows]
        table["category"] = np.array([self.catalogue.category[row] for row in rows.tolist()], str)
        return table

    def counts(self) -> dict[Why, int]:
        """How many targets are not allocated for each kind of reason."""
        found = [reason.why for reason in self.reasons.values()]
        return {why: found.count(why) for why in Why if why in found}

    def write(self, path: str | os.PathLike) -> None:
        """Write `to_table` in the format that the file's name says; `Targets.read` reads it.

        Raises:
            TargetError: nothing is allocated, no such format, or a file that cannot be written.
        """
        write_table(self.to_table(), path)
