"""What is asked of a planner: from where, to where, how far apart, and what matters most.

Validated when made, so that planners need not: joint ranges, contacts at the start and contacts at the goal. A NaN goal
row means "anywhere safe". A goal that cannot be kept is refused, or with ``conflicts="drop"`` given up with its cause.
"""

import dataclasses
import numbers
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.clearance import clearances
from fiberplan.problem.configuration_choice import clear_goals
from fiberplan.problem.least_cover import least_cover
from fiberplan.problem.targets import Targets, refuse_unreachable
from fiberplan.tolerances import EQUALITY

_SHOWN = 4  # how many contacts an error message lists


@dataclass(frozen=True)
class Dropped:
    """Why a goal was given up before planning."""

    cause: str
    blockers: tuple[int, ...] = ()  #: positioners it touches; -1 - k is obstacle k


@dataclass(frozen=True, eq=False)
class Problem:
    """Move from `start` to `goal`, always at least `margin` apart.

    After construction `goal` holds only goals that are kept: rows of offline positioners and of dropped goals are NaN,
    and `requested` has what was asked for.

    Raises:
        ProblemError: shapes or values that make no sense; a start in contact, outside its range or in its zone of
            avoidance; with ``conflicts="raise"`` a goal of that kind. The message names positioners and values.
    """

    plane: FocalPlane
    start: np.ndarray  #: (n, 2) commanded alpha, beta [rad]
    goal: np.ndarray  #: (n, 2) [rad]; NaN rows: anywhere safe
    margin: float = 0.0  #: clearance to keep at all times [mm]
    priority: np.ndarray | None = None  #: (n,) larger matters more; 1 unless given
    conflicts: Literal["raise", "drop"] = "raise"
    alternatives: np.ndarray | None = None  #: (n, k, 2) other configurations that reach the same targets, NaN-padded
    dropped: Mapping[int, Dropped] = field(default_factory=dict)  #: goals given up, by positioner
    notes: tuple[str, ...] = ()  #: assumptions that belong in the plan
    requested: np.ndarray = field(init=False)  #: (n, 2) the goals before any were dropped

    def __post_init__(self) -> None:
        self._check_values()
        object.__setattr__(self, "requested", self.goal)
        self._check_start()
        self._settle_goals()

    @classmethod
    def as_settled(cls, plane: FocalPlane, *, requested: np.ndarray, **fields: Any) -> "Problem":
        """A problem whose goals have been settled before: nothing is refused for touching, nothing is dropped.

        Args:
            plane: the array.
            requested: (n, 2) the goals before any were dropped [rad].
            **fields: all others, `goal` and `dropped` as they were settled.

        Raises:
            ProblemError: values that make no sense, or a goal that is kept and was not requested, or of a positioner
                that is offline or whose goal was dropped.
        """
        problem = object.__new__(cls)
        for each in dataclasses.fields(cls):
            if each.init:
                default = each.default_factory() if callable(each.default_factory) else each.default
                object.__setattr__(problem, each.name, fields.pop(each.name, default))
        if fields:
            raise TypeError(f"Problem has no field '{next(iter(fields))}'")
        object.__setattr__(problem, "plane", plane)
        problem._check_values()
        requested = read_only(requested)
        object.__setattr__(problem, "requested", requested)
        kept = problem.has_goal
        wrong = kept & (~plane.online | (requested != problem.goal).any(axis=1))
        wrong[list(problem.dropped)] |= kept[list(problem.dropped)]
        if wrong.any():
            i = int(np.argmax(wrong))
            raise ProblemError(f"goal: {problem._name(i)} has a goal that is not the one it was asked for", (i,))
        return problem

    def _check_values(self) -> None:
        """Arrays through the door, and values that can be meant."""
        n = self.plane.n
        for name in ("start", "goal"):
            array = read_only(getattr(self, name))
            if array.shape != (n, 2):
                raise ProblemError(f"{name} must have shape ({n}, 2), got {array.shape}")
            object.__setattr__(self, name, array)
        object.__setattr__(self, "dropped", dict(self.dropped))
        priority = read_only(np.ones(n) if self.priority is None else self.priority)
        if priority.shape != (n,) or not np.all(np.isfinite(priority) & (priority >= 0)):
            raise ProblemError(f"priority must be {n} finite numbers of 0 or more")
        object.__setattr__(self, "priority", priority)
        number = isinstance(self.margin, numbers.Real) and not isinstance(self.margin, bool)
        if not (number and np.isfinite(self.margin) and self.margin >= 0):
            raise ProblemError(f"margin must be a length of 0 mm or more, got {self.margin}")
        if self.conflicts not in ("raise", "drop"):
            raise ProblemError(f"conflicts must be 'raise' or 'drop', got '{self.conflicts}'")

    @classmethod
    def from_targets(
        cls,
        plane: FocalPlane,
        targets: Targets,
        start: np.ndarray | None = None,
        margin: float = 0.0,
        conflicts: Literal["raise", "drop"] = "raise",
    ) -> "Problem":
        """The problem of bringing every positioner to its target.

        Positioners whose position the targets' source does not know are taken as offline where `start` says, or else as
        folded; each such assumption is a note. Of a four-bar arm's configurations that reach its target the quickest
        that touches no one is taken.

        Args:
            plane: the array.
            targets: at most one per positioner.
            start: (n, 2) commanded angles [rad], folded unless given; NaN rows of unknown positions count as folded.
            margin: clearance to keep at all times [mm].
            conflicts: "drop" gives up targets that are out of reach, or touch something at rest, instead of refusing.

        Raises:
            TargetError: targets that name no positioner, or one that `plane` does not have; with "raise", targets out
                of reach.
            ProblemError: as `Problem`; with "raise", two four-bar arms without configurations that do not touch.
        """
        solution = targets.solve(plane)
        if conflicts != "drop":
            refuse_unreachable(plane, targets.source, solution)
        goal = solution.goal
        if not plane.kinematics.has_parities:
            goal, pair = clear_goals(plane, goal, solution.alternatives, margin + 2.0 * EQUALITY)
            if pair and conflicts != "drop":
                names = " and ".join(f"'{plane.ids[i]}'" for i in pair)
                raise ProblemError(
                    f"goal: positioners {names} touch in all configurations that reach their targets", pair
                )
        where = np.array(plane.folded if start is None else start, float)
        online, notes = plane.online.copy(), list(targets.notes)
        for id_ in targets.offline:
            i = plane.names[id_]
            online[i] = False
            stated = start is not None and where.shape == (plane.n, 2) and bool(np.isfinite(where[i]).all())
            if not stated and where.shape == (plane.n, 2):
                where[i] = plane.folded[i]
            alpha, beta = np.degrees(where[i] if stated else plane.folded[i])
            notes.append(
                f"positioner '{id_}': its position is unknown in {targets.source}, so it is taken as offline, "
                f"{'where the start says' if stated else 'folded'}, at alpha {alpha:.6g}, beta {beta:.6g} deg"
            )
        return cls(
            plane if online.all() else plane.replace(online=online),
            start=where,
            goal=goal,
            margin=margin,
            priority=solution.priority,
            conflicts=conflicts,
            alternatives=solution.alternatives if solution.alternatives.shape[1] else None,
            dropped={i: Dropped(f"out of reach: {why}") for i, why in solution.unreachable.items()}
            | {i: Dropped(f"no such fiber: {why}") for i, why in solution.lacking.items()},
            notes=tuple(notes),
        )

    @property
    def n(self) -> int:
        """Number of positioners."""
        return self.plane.n

    @property
    def has_goal(self) -> np.ndarray:
        """(n,) whether a positioner has a goal that is kept."""
        return ~np.isnan(self.goal[:, 0])

    def _name(self, arm: int) -> str:
        """Positioner or obstacle (arm n + k) as people know it."""
        if arm < self.n:
            return f"positioner '{self.plane.ids[arm]}'"
        return f"obstacle '{self.plane.obstacles[arm - self.n].name}'"

    def _out_of_range(self, angles: np.ndarray) -> dict[int, str]:
        """Positioner -> complaint, for angles outside the joint ranges or in a zone of avoidance (NaN rows are not)."""
        plane = self.plane
        zones = {
            i: f"{self._name(i)}: {plane.avoidance(i, angles)}"
            for i in map(int, np.flatnonzero(plane.in_avoidance(angles)))
        }
        outside = np.argwhere((angles < plane.lower - 1e-9) | (angles > plane.upper + 1e-9))
        return zones | {
            int(i): f"{self._name(i)}: {('alpha', 'beta')[k]} {np.degrees(angles[i, k]):.6g} deg is outside "
            f"{np.degrees(plane.lower[i, k]):.6g} to {np.degrees(plane.upper[i, k]):.6g} deg"
            for i, k in outside[::-1]
        }

    def _forbidden(self, goal: np.ndarray) -> dict[int, str]:
        """Positioner -> complaint, for goals at which its default fiber ends where no fiber may."""
        plane = self.plane
        if not len(plane.forbidden):
            return {}
        ends = plane.fibers(goal)
        found = {}
        for i, disc in enumerate(plane.forbidden_at(ends).tolist()):
            if disc >= 0:
                x, y, radius = plane.forbidden[disc]
                away = float(np.hypot(ends[i, 0] - x, ends[i, 1] - y))
                found[i] = (
                    f"{self._name(i)}: its fiber would end {away:.3f} mm from ({x:.3f}, {y:.3f}) mm, the middle of a "
                    f"forbidden place of radius {radius:.3f} mm"
                )
        return found

    def _contacts(self, angles: np.ndarray) -> list[tuple[int, int, float]]:
        """Pairs of arms closer than the margin at `angles`, at least one of them online, with their clearance [mm].

        Arms without angles (NaN rows) are nowhere, and touch nothing.
        """
        plane, needed = self.plane, self.margin + EQUALITY
        pairs = plane.arm_pairs_within(needed)
        there = np.concatenate([~np.isnan(angles[:, 0]), np.ones(len(plane.obstacles), bool)])
        moves = np.concatenate([plane.online, np.zeros(len(plane.obstacles), bool)])
        i, j = pairs.T
        pairs = read_only(pairs[there[i] & there[j] & (moves[i] | moves[j])], np.int64)
        gaps = clearances(plane.arms, plane.with_obstacles(angles), pairs)
        touching = ~(gaps >= needed)
        return [(int(a), int(b), float(gap)) for (a, b), gap in zip(pairs[touching], gaps[touching], strict=True)]

    def _contact_text(self, a: int, b: int, gap: float) -> str:
        overlap = f"overlap by {self.margin + EQUALITY - gap:.3f} mm"
        return f"{self._name(a)} and {self._name(b)} {overlap} (clearance {gap:.3f} mm, margin {self.margin:g} mm)"

    def _refuse_contacts(self, what: str, contacts: list[tuple[int, int, float]]) -> None:
        if not contacts:
            return
        text = "; ".join(self._contact_text(*c) for c in contacts[:_SHOWN])
        if len(contacts) > _SHOWN:
            text += f"; and {len(contacts) - _SHOWN} more"
        named = sorted({arm for a, b, _ in contacts for arm in (a, b) if arm < self.n})
        raise ProblemError(f"{what}: {text}", tuple(named))

    def _check_start(self) -> None:
        bad = np.flatnonzero(~np.all(np.isfinite(self.start), axis=1))
        if len(bad):
            raise ProblemError(f"start: {self._name(bad[0])} has no finite angles", (int(bad[0]),))
        outside = self._out_of_range(self.start)
        if outside:
            raise ProblemError(f"start: {next(iter(outside.values()))}", tuple(outside))
        self._refuse_contacts("start", self._contacts(self.start))

    def _settle_goals(self) -> None:
        """Refuse or drop the goals that cannot be kept, and clear the rows that no planner has to reach."""
        goal, drop = self.goal.copy(), self.conflicts == "drop"
        half = np.flatnonzero(np.isnan(goal).any(axis=1) != np.isnan(goal).all(axis=1))
        if len(half):
            raise ProblemError(f"goal: {self._name(half[0])} has only one of two angles", (int(half[0]),))
        if np.isinf(goal).any():
            i = int(np.argwhere(np.isinf(goal))[0, 0])
            raise ProblemError(f"goal: {self._name(i)} has an infinite angle", (i,))
        goal[~self.plane.online] = np.nan
        goal[list(self.dropped)] = np.nan
        dropped = dict(self.dropped)
        outside = self._out_of_range(goal)
        if outside and not drop:
            raise ProblemError(f"goal: {next(iter(outside.values()))}", tuple(outside))
        for i, complaint in outside.items():
            dropped[i] = Dropped(f"out of reach: {complaint}")
            goal[i] = np.nan
        places = self._forbidden(goal)
        if places and not drop:
            raise ProblemError(f"goal: {next(iter(places.values()))}", tuple(places))
        for i, complaint in places.items():
            dropped[i] = Dropped(f"forbidden place: {complaint}")
            goal[i] = np.nan
        resting = np.where(self.plane.online[:, None], goal, self.start)
        contacts = self._contacts(resting)
        if not drop:
            self._refuse_contacts("goal", contacts)
        for i, blockers in self._least_loss(contacts).items():
            texts = [self._contact_text(*c) for c in contacts if i in c[:2]]
            numbers = tuple(self.plane.public(b) for b in blockers)
            dropped[i] = Dropped("its goal touches something at rest: " + "; ".join(texts), numbers)
            goal[i] = np.nan
        object.__setattr__(self, "goal", read_only(goal))
        object.__setattr__(self, "dropped", dict(sorted(dropped.items())))

    def _least_loss(self, contacts: list[tuple[int, int, float]]) -> dict[int, list[int]]:
        """Goals of least total priority whose loss removes every contact -> the arms each of them touches."""
        assert self.priority is not None  # set on construction
        online = np.concatenate([self.plane.online, np.zeros(len(self.plane.obstacles), bool)])
        forced = {a if online[a] else b for a, b, _ in contacts if not (online[a] and online[b])}
        free = [(a, b) for a, b, _ in contacts if online[a] and online[b] and a not in forced and b not in forced]
        lost = sorted(forced | least_cover(free, self.priority))
        return {i: [b if a == i else a for a, b, _ in contacts if i in (a, b)] for i in lost}
