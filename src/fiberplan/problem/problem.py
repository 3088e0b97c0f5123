"""What is asked of a planner: from where, to where, how far apart, and what matters most.

Validated when made, so that planners need not: joint ranges, contacts at the start and contacts at the goal. A NaN goal
row means "anywhere safe". A goal that cannot be kept is refused, or with ``conflicts="drop"`` given up with its cause.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fiberplan.arrays import LARGEST, Frozen, FrozenDict, number, read_only, shortened
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.problem.configuration_choice import clear_goals
from fiberplan.problem.faults import Touch, named, out_of_range, refuse_touching, touches
from fiberplan.problem.goals import Dropped, settled_goals
from fiberplan.problem.guesses import fitted
from fiberplan.problem.left_out import of_known_positioners
from fiberplan.problem.solution import refuse_unreachable
from fiberplan.problem.starts import starting_state
from fiberplan.problem.state import State
from fiberplan.problem.targets import MOST_PRIORITY, Targets
from fiberplan.tolerances import EQUALITY, RANGE, START_RANGE


@dataclass(frozen=True, eq=False)
class Problem(Frozen):
    """Move from `start` to `goal`, always at least `margin` apart.

    After construction `goal` holds only goals that are kept: rows of offline positioners and of dropped goals are NaN,
    and `requested` has what was asked for.

    Raises:
        ProblemError: shapes or values that make no sense; a start in contact, outside its range or in its zone of
            avoidance; with ``conflicts="raise"`` a goal of that kind. The message names positioners and values.
    """

    plane: FocalPlane
    start: np.ndarray  #: (n, 2) commanded alpha, beta [rad]; a `State` is taken, too
    goal: np.ndarray  #: (n, 2) [rad]; NaN rows: anywhere safe
    margin: float = 0.0  #: clearance to keep at all times [mm]
    priority: np.ndarray | None = None  #: (n,) larger matters more; 1 unless given
    conflicts: Literal["raise", "drop"] = "raise"
    alternatives: np.ndarray | None = None  #: (n, k, 2) other configurations that reach the same targets, NaN-padded
    dropped: Mapping[int, Dropped] = field(default_factory=dict)  #: goals given up, by positioner
    notes: tuple[str, ...] = ()  #: what belongs in the plan beside its motion
    position_error: np.ndarray | None = (
        None  #: (n,) more room for some: how far off each arm may be [mm]; 0 unless given
    )
    near_start: Literal["raise", "open"] = "raise"  #: a start nearer than the margin is refused, or opened first
    assumptions: tuple[str, ...] = ()  #: what a proof of the plan rests on, beside those of the focal plane
    state: State | None = None  #: where `start` comes from, where it is more than angles
    wished: np.ndarray | None = None
    """(n,) True: the goal of an idle positioner, which gives way to all others and is no target; False unless given."""
    left_out: tuple[str, ...] = ()  #: targets that were wanted and given to no positioner, a sentence each: lost
    source: str = ""  #: where the targets come from: a file, or what the field is called; empty if nobody said
    requested: np.ndarray = field(init=False)  #: (n, 2) the goals before any were dropped

    def __post_init__(self) -> None:
        if isinstance(self.start, State):
            self._take_state(self.start)
        self._check_values()
        object.__setattr__(self, "requested", self.goal)
        self._check_start()
        goal, dropped = settled_goals(self)
        object.__setattr__(self, "goal", goal)
        object.__setattr__(self, "dropped", FrozenDict(dropped))

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
        requested = problem._configuration("requested", requested)
        object.__setattr__(problem, "requested", requested)
        kept = problem.has_goal
        wrong = kept & (~plane.online | (requested != problem.goal).any(axis=1))
        wrong[list(problem.dropped)] |= kept[list(problem.dropped)]
        if wrong.any():
            i = int(np.argmax(wrong))
            raise ProblemError(f"goal: {named(plane, i)} has a goal that is not the one it was asked for", (i,))
        return problem

    def _take_state(self, state: State) -> None:
        """A start that says who can move and how well it is known; guesses are fitted to those whose place is known."""
        plane, n = self.plane, self.plane.n
        if len(state.angles) != n:
            raise ProblemError(f"{state.source}: a state of {len(state.angles)} positioners for {n}")
        if not (plane.online <= state.online).all():
            plane = plane.replace(online=plane.online & state.online)
        given = np.zeros(n) if self.position_error is None else read_only(self.position_error, unit="mm")
        start, guesses = fitted(plane, state, float(self.margin) + EQUALITY)
        object.__setattr__(self, "plane", plane)
        object.__setattr__(self, "state", state)
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "position_error", np.maximum(given, state.position_error))
        object.__setattr__(self, "notes", (*self.notes, *state.notes))
        object.__setattr__(self, "assumptions", (*self.assumptions, *state.assumptions, *guesses))

    def _check_values(self) -> None:
        """Arrays through the door, and values that can be meant."""
        n = self.plane.n
        error = np.zeros(n) if self.position_error is None else self.position_error
        error = read_only(error, unit="mm", name="position error", error=ProblemError)
        error = read_only(np.broadcast_to(error, (n,)) if error.ndim == 0 else error)
        if error.shape != (n,) or not np.all((error >= 0) & (error <= LARGEST)):
            raise ProblemError(f"position error must be one length or {n}, of 0 to {LARGEST:g} mm")
        object.__setattr__(self, "position_error", error)
        object.__setattr__(self, "assumptions", tuple(self.assumptions))
        if self.near_start not in ("raise", "open"):
            raise ProblemError(f"near_start must be 'raise' or 'open', got '{self.near_start}'")
        for name in ("start", "goal"):
            object.__setattr__(self, name, self._configuration(name, getattr(self, name)))
        if self.alternatives is not None:
            object.__setattr__(self, "alternatives", self._checked_alternatives())
        object.__setattr__(self, "dropped", self._checked_dropped())
        if isinstance(self.margin, bool | np.bool_):
            raise ProblemError(f"margin must be a length of 0 mm or more, got {self.margin}")
        object.__setattr__(self, "margin", number(self.margin, "mm", "margin", ProblemError))
        priority = np.ones(n) if self.priority is None else self.priority
        priority = read_only(priority, name="priority", error=ProblemError)
        if priority.shape != (n,) or not np.all((priority >= 0) & (priority <= MOST_PRIORITY)):
            raise ProblemError(f"priority must be {n} finite numbers of 0 or more, at most {MOST_PRIORITY:g}")
        wished = np.zeros(n, bool) if self.wished is None else self.wished
        wished = read_only(wished, bool, name="wished", error=ProblemError)
        if wished.shape != (n,):
            raise ProblemError(f"wished must have shape ({n},), got {wished.shape}")
        object.__setattr__(self, "wished", wished)
        object.__setattr__(self, "left_out", tuple(self.left_out))
        object.__setattr__(self, "priority", read_only(np.where(wished, 0.0, priority)) if wished.any() else priority)
        if not (np.isfinite(self.margin) and self.margin >= 0):
            raise ProblemError(f"margin must be a length of 0 mm or more, got {self.margin}")
        if self.conflicts not in ("raise", "drop"):
            raise ProblemError(f"conflicts must be 'raise' or 'drop', got '{self.conflicts}'")

    def _configuration(self, name: str, angles: Any) -> np.ndarray:
        array = read_only(angles, unit="rad", name=name, error=ProblemError)
        if array.shape != (self.plane.n, 2):
            raise ProblemError(f"{name} must have shape ({self.plane.n}, 2), got {array.shape}")
        return array

    def _checked_alternatives(self) -> np.ndarray:
        n = self.plane.n
        others = read_only(self.alternatives, unit="rad", name="alternatives", error=ProblemError)
        if others.ndim != 3 or others.shape[::2] != (n, 2):
            raise ProblemError(f"alternatives must have shape ({n}, k, 2), got {others.shape}")
        bad = np.isinf(others).any(axis=2) | (np.isnan(others[..., 0]) != np.isnan(others[..., 1]))
        if bad.any():
            i, k = (int(index) for index in np.argwhere(bad)[0])
            raise ProblemError(
                f"alternatives: {named(self.plane, i)}: number {k + 1} must be two finite angles, or two NaN", (i,)
            )
        return others

    def _checked_dropped(self) -> FrozenDict[int, Dropped]:
        for i, why in self.dropped.items():
            if not (isinstance(i, int | np.integer) and 0 <= i < self.plane.n):
                raise ProblemError(f"dropped: there is no positioner {shortened(i)} among {self.plane.n}")
            if not isinstance(why, Dropped):
                raise ProblemError(f"dropped: {named(self.plane, int(i))} needs a Dropped, got {shortened(repr(why))}")
        return FrozenDict({int(i): why for i, why in self.dropped.items()})

    def __repr__(self) -> str:
        goals, lost = int(self.has_goal.sum()), len(self.dropped)
        of = f"{goals} goals of {self.n} positioners" + (f", {lost} dropped" if lost else "")
        return f"<Problem on '{shortened(self.plane.name)}': {of}, margin {self.margin:g} mm>"

    @classmethod
    def from_targets(
        cls,
        plane: FocalPlane,
        targets: Targets,
        start: np.ndarray | State | None = None,
        margin: float = 0.0,
        conflicts: Literal["raise", "drop"] = "raise",
        near_start: Literal["raise", "open"] = "open",
        position_error: np.ndarray | float | None = None,
    ) -> "Problem":
        """The problem of bringing every positioner to its target.

        Positioners whose position the targets' source does not know are taken as offline where `start` says, or else as
        folded; each such assumption is a note. Of a four-bar arm's configurations that reach its target the quickest
        that touches no one is taken.

        Args:
            plane: the array.
            targets: at most one per positioner.
            start: a state, or (n, 2) commanded angles [rad]; folded unless given; NaN rows of unknown positions count
                as folded.
            margin: clearance to keep at all times [mm].
            near_start: "open" lets pairs that begin nearer than the margin come apart first, "raise" refuses them.
            position_error: (n,) or shared: how far off each arm may be [mm].
            conflicts: "drop" gives up targets that are out of reach, touch something at rest, or are of positioners
                that `plane` has not or that have one already, instead of refusing.

        Raises:
            TargetError: targets that name no positioner, or one that `plane` does not have; with "raise", targets out
                of reach.
            ProblemError: as `Problem`; with "raise", two four-bar arms without configurations that do not touch.
        """
        margin = number(margin, "mm", "margin", ProblemError)
        if conflicts == "drop":
            targets = of_known_positioners(targets, plane)
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
        problem = cls(
            plane,
            start=starting_state(plane, targets, start),  # type: ignore[arg-type]
            goal=goal,
            margin=margin,
            priority=solution.priority,
            conflicts=conflicts,
            alternatives=solution.alternatives if solution.alternatives.shape[1] else None,
            dropped={i: Dropped(f"out of reach: {why}") for i, why in solution.unreachable.items()}
            | {i: Dropped(f"no such fiber: {why}") for i, why in solution.lacking.items()}
            | {i: Dropped(f"angles and position disagree: {why}") for i, why in solution.apart.items()},
            notes=(*targets.notes, *solution.notes),
            assumptions=solution.named,
            wished=solution.wished,
            left_out=targets.left_out,
            source=targets.source,
            near_start=near_start,
            position_error=position_error,  # type: ignore[arg-type]
        )
        if start is None:
            problem._refuse_folded_beside(targets.disabled_at(plane))
        return problem

    def _refuse_folded_beside(self, disabled: Mapping[int, Any]) -> None:
        """A start that nobody stated is no start where a folded arm would overlap a disabled one."""
        inside = [c for c in self._start_contacts if c[2] < 0 and any(arm in disabled for arm in c[:2])]
        refuse_touching(
            self.plane, self.margin, "start: these cannot be folded beside disabled arms; say where they stand", inside
        )

    @cached_property
    def roomy(self) -> FocalPlane:
        """The focal plane with bodies thicker by their arms' position errors: clearances in it allow for the errors."""
        error = self.position_error
        assert error is not None  # set on construction
        if not error.any():
            return self.plane
        return self.plane.thicker(error)

    @cached_property
    def opening(self) -> tuple[tuple[int, int, float], ...]:
        """Pairs that begin nearer than a planner can begin with: positioner, positioner or -1 - k, clearance [mm]."""
        return tuple((a, self.plane.public(b), gap) for a, b, gap in self._start_contacts)

    @cached_property
    def _start_contacts(self) -> list[Touch]:
        return touches(self.roomy, self.start, self.margin)

    @property
    def needs_opening(self) -> bool:
        """Whether the start is nearer than a planner can begin with, or a joint of it a little out of range."""
        return bool(self.opening) or bool(out_of_range(self.plane, self._movable_start))

    @property
    def _movable_start(self) -> np.ndarray:
        """(n, 2) the start of those that can move, else NaN: no range binds who stays where it is."""
        return np.where(self.plane.online[:, None], self.start, np.nan)

    @property
    def n(self) -> int:
        """Number of positioners."""
        return self.plane.n

    @property
    def has_goal(self) -> np.ndarray:
        """(n,) whether a positioner has a goal that is kept."""
        return ~np.isnan(self.goal[:, 0])

    @property
    def weight(self) -> np.ndarray:
        """(n,) what the loss of each goal costs: even a target without priority is worth more than a wish."""
        assert self.priority is not None  # set on construction, as `wished` is
        assert self.wished is not None
        if not self.wished.any():
            return self.priority
        return np.where(self.wished, 0.0, np.maximum(self.priority, np.finfo(float).tiny))

    def giving_up(self, dropped: Mapping[int, Dropped], goal: np.ndarray | None = None) -> "Problem":
        """The problem with more goals given up, which stay `requested`.

        Args:
            dropped: positioner -> why.
            goal: (n, 2) of those that keep theirs [rad]; as they are unless given.
        """
        kept = self.goal if goal is None else goal
        asked = np.where(np.isnan(kept), self.requested, kept)
        return dataclasses.replace(self, goal=asked, dropped={**self.dropped, **dropped})

    def _check_start(self) -> None:
        bad = np.flatnonzero(~np.all(np.isfinite(self.start), axis=1))
        if len(bad):
            raise ProblemError(f"start: {named(self.plane, bad[0])} has no finite angles", (int(bad[0]),))
        far = out_of_range(self.plane, self._movable_start, START_RANGE if self.near_start == "open" else RANGE)
        if far:
            raise ProblemError(f"start: {next(iter(far.values()))}", tuple(far))
        if self.near_start == "raise":
            near = [touch for touch in self._start_contacts if not touch[2] >= self.margin - EQUALITY]
            refuse_touching(self.plane, self.margin, "start", near)
