"""Why a target has no positioner: out of reach, in contact with what stands still, or less than what it would cost."""

from collections.abc import Mapping
from enum import Enum
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from fiberplan.problem import Problem
from fiberplan.survey.catalogue import Catalogue
from fiberplan.survey.choices import Choices
from fiberplan.survey.conflicts import ConflictTable
from fiberplan.survey.local_search import loss
from fiberplan.survey.quotas import Quotas

_SHOWN = 3  #: of those in the way


class Why(Enum):
    """Kinds of reasons."""

    OUT_OF_REACH = "no positioner that can move brings its fiber there"
    AT_REST = "whoever reaches it would touch something that stands still"
    WORTHLESS = "its priority is 0"
    QUOTA = "no more positions of its category are required, or its positioners are needed for those that are"
    TAKEN = "its positioners take targets that are worth more"
    CONFLICT = "whoever takes it would touch others on targets that are worth more"
    MOTION = "it was found not to be reached together with the others"


class Reason(NamedTuple):
    """Why a target has no positioner."""

    target: int  #: row in the catalogue
    why: Why
    text: str  #: a sentence that names who takes what instead
    positioners: tuple[int, ...] = ()  #: who would have to give something up, or what stands still (-1 - k: obstacle)
    targets: tuple[int, ...] = ()  #: and what: rows in the catalogue


def reasons(
    there: Problem, catalogue: Catalogue, table: ConflictTable, choices: Choices, chosen: np.ndarray, quotas: Quotas
) -> Mapping[int, Reason]:
    """Row of each target without a positioner -> why that is so."""
    taken = np.zeros(len(catalogue), bool)
    taken[table.options.target[chosen]] = True
    told = _Told(there, catalogue, table, choices, chosen, quotas)
    return {int(row): told.reason(int(row)) for row in np.flatnonzero(~taken)}


class _Told:
    """What the reasons are told from."""

    def __init__(
        self,
        there: Problem,
        catalogue: Catalogue,
        table: ConflictTable,
        choices: Choices,
        chosen: np.ndarray,
        quotas: Quotas,
    ):
        self._plane, self._catalogue, self._table = there.plane, catalogue, table
        self._choices, self._quotas = choices, quotas
        self._option = np.full(there.plane.n, -1, np.int64)
        self._option[choices.robot[chosen]] = chosen
        self._groups = np.bincount(choices.group[chosen][choices.group[chosen] >= 0], minlength=len(choices.need))
        self._blocked: dict[int, list[int]] = {}
        for row, by in zip(table.blocked.options.target.tolist(), table.blocked.by.tolist(), strict=True):
            self._blocked.setdefault(row, []).append(by)
        self._near = cKDTree(there.plane.base)

    def reason(self, row: int) -> Reason:
        """Why the target in `row` has no positioner."""
        choices = self._choices
        options = choices.at(self._plane.n + row)
        if not len(options) and row in self._blocked:
            by = tuple(sorted(set(self._blocked[row])))
            names = _listed([self._plane.label(b) for b in by])
            return Reason(row, Why.AT_REST, f"whoever reaches it would touch {names}, which stands still", by)
        if not len(options):
            return Reason(row, Why.OUT_OF_REACH, self._why_out_of_reach(row))
        if self._catalogue.priority[row] == 0 and (choices.group[options] < 0).all():
            return Reason(row, Why.WORTHLESS, "its priority is 0")
        ruled_out = not choices.weight[options].any(axis=1).all()
        rivals = [self._rivals(v) for v in options.tolist()]
        full = [g for g in choices.group[options].tolist() if g >= 0 and self._groups[g] >= choices.need[g]]
        if len(full) == len(options):
            return Reason(row, Why.QUOTA, self._why_full(full[0]))
        if ruled_out or not all(rivals):
            return Reason(row, Why.MOTION, f"{Why.MOTION.value}, and they are worth more")
        best = min(range(len(options)), key=lambda k: loss(choices, int(options[k]), rivals[k]))
        return self._against(row, int(options[best]), rivals[best])

    def _rivals(self, v: int) -> list[int]:
        """Options that are taken and that option v excludes."""
        choices = self._choices
        near = choices.touched(v).tolist()
        own = int(self._option[choices.robot[v]])
        return ([own] if own >= 0 else []) + [u for u in near if self._option[choices.robot[u]] == u]

    def _against(self, row: int, v: int, rivals: list[int]) -> Reason:
        """Told of the option that would cost least."""
        choices, ids = self._choices, self._plane.ids
        robot = int(choices.robot[v])
        who = tuple(int(choices.robot[u]) for u in rivals)
        what = tuple(int(choices.place[u, 1]) - self._plane.n for u in rivals)
        held = [f"{ids[i]} on {self._said(t)}" for i, t in zip(who, what, strict=True)]
        if (choices.group[rivals] >= 0).any() and choices.group[v] < 0:
            return Reason(row, Why.QUOTA, f"a required position would go: {_listed(held)}", who, what)
        at_rest = self._table.indices[self._table.indptr[v] : self._table.indptr[v + 1]]
        if any(i != robot and u not in at_rest for u, i in zip(rivals, who, strict=True)):
            return Reason(row, Why.MOTION, f"{ids[robot]} did not arrive together with {_listed(held)}", who, what)
        if who == (robot,):
            return Reason(row, Why.TAKEN, f"{ids[robot]} takes {self._said(what[0])}", who, what)
        return Reason(row, Why.CONFLICT, f"{ids[robot]} there excludes {_listed(held)}", who, what)

    def _said(self, row: int) -> str:
        """A target as people know it."""
        catalogue = self._catalogue
        assert catalogue.category is not None  # set on construction
        category = catalogue.category[row]
        if category in self._quotas.categories:
            return f"{catalogue.ids[row]} ({category})"
        tier = f"tier {catalogue.tier[row]}, " if len(np.unique(catalogue.tier)) > 1 else ""
        return f"{catalogue.ids[row]} ({tier}priority {catalogue.priority[row]:g})"

    def _why_full(self, group: int) -> str:
        category, region = self._quotas.named(group)
        return f"{self._choices.need[group]} of category {category} are required in region {region}, and there"

    def _why_out_of_reach(self, row: int) -> str:
        plane = self._plane
        point = np.array([self._catalogue.x[row], self._catalogue.y[row]])
        if np.hypot(*point) > plane.field_radius:
            return f"it lies outside the field of radius {plane.field_radius:g} mm"
        if plane.forbidden_at(point[None])[0] >= 0:
            return "it lies where no fiber may end"
        away, nearest = self._near.query(point)
        return f"{Why.OUT_OF_REACH.value}; the nearest is {plane.ids[int(nearest)]}, {away:.3f} mm away"


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more
