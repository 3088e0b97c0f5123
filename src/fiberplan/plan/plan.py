"""What a planner returns: a motion that is safe as it stands, and an outcome for every positioner.

Complete or not, the trajectory begins at the problem's start; a positioner that cannot arrive is an outcome, never an
error, and the rest is planned around where it waits.
"""

import dataclasses
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fiberplan.arrays import Frozen, FrozenDict, shortened
from fiberplan.arrays.door import number
from fiberplan.arrays.seeds import seed_complaint
from fiberplan.certificates import Certificate, needed_guesses, verify
from fiberplan.errors import PlanError, TrajectoryError
from fiberplan.motion import Trajectory
from fiberplan.plan.bounds import Bound
from fiberplan.plan.outcomes import Outcome, contradictions
from fiberplan.plan.positioner import PositionerPlan, plan_table, positioner_plan, positioner_plans
from fiberplan.plan.summary import about, summary
from fiberplan.problem import Problem, State
from fiberplan.registry import io_function, notebook_function
from fiberplan.tolerances import ARRIVAL

if TYPE_CHECKING:
    from astropy.table import QTable


@dataclass(frozen=True, eq=False)
class Plan(Frozen):
    """A planned motion.

    Raises:
        PlanError: the trajectory does not begin at the start, or outcomes do not fit the problem, or no seed.
    """

    problem: Problem
    trajectory: Trajectory
    outcomes: tuple[Outcome, ...]  #: one per positioner
    planner: str  #: its name in `fiberplan.planners.PLANNERS`
    parameters: Mapping[str, Any] = field(default_factory=dict)  #: the planner's settings
    seed: int = 0
    blockers: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    """Positioner that did not arrive -> those in its way; -1 - k is obstacle k."""
    timings: Mapping[str, float] = field(default_factory=dict)  #: CPU seconds per stage
    notes: tuple[str, ...] = ()  #: assumptions and warnings
    interrupted: bool = False  #: by Ctrl-C or a deadline: what was best by then
    bounds: tuple[Bound, ...] = ()  #: who needs longer than the joints' speeds ask for, whatever the others do

    def __post_init__(self) -> None:
        for name in ("parameters", "blockers", "timings"):
            object.__setattr__(self, name, FrozenDict(getattr(self, name)))
        object.__setattr__(self, "outcomes", tuple(self.outcomes))
        n = self.problem.n
        if len(self.outcomes) != n or self.trajectory.n != n:
            raise PlanError(f"{n} positioners, but {len(self.outcomes)} outcomes and {self.trajectory.n} motions")
        off = np.abs(self.trajectory.start - self.problem.start).max(axis=1)
        if np.any(off > 1e-9):
            i = int(np.argmax(off))
            raise PlanError(f"positioner '{self.problem.plane.ids[i]}' begins {off[i]:.3g} rad from the stated start")
        for i, contradiction in contradictions(self.problem, self.outcomes):
            raise PlanError(f"positioner '{self.problem.plane.ids[i]}': {contradiction}")
        object.__setattr__(self, "bounds", tuple(self.bounds))
        for i in (i for bound in self.bounds for i in bound.positioners if not 0 <= i < n):
            raise PlanError(f"a bound names positioner {i}, and there are {n}")
        if complaint := seed_complaint(self.seed):
            raise PlanError(complaint)

    @property
    def makespan(self) -> float:
        """Time until the last positioner stops [s]."""
        return self.trajectory.duration

    @cached_property
    def lower_bound(self) -> float:
        """No plan in which these positioners arrive can be faster [s]: the longest least time of a joint's turn."""
        arrived = self.having(Outcome.ARRIVED)
        travel = self.problem.plane.least_time(self._ends - self.problem.start[:, None])
        shortest = np.nanmin(travel[arrived].max(axis=2), axis=1, initial=np.inf)
        return float(shortest.max(initial=0.0))

    @property
    def _ends(self) -> np.ndarray:
        """(n, k, 2) configurations in which each positioner is at its goal [rad], NaN-padded: the goal comes first."""
        goal, others = self.problem.goal[:, None], self.problem.alternatives
        return goal if others is None else np.concatenate([goal, others], axis=1)

    @cached_property
    def certificate(self) -> Certificate:
        """Proof that the motion is safe at the problem's margin, by the independent `fiberplan.verify`."""
        problem = self.problem
        proof = verify(
            problem.plane,
            self.trajectory,
            problem.margin,
            position_error=0.0 if problem.position_error is None else problem.position_error,
            opening=problem.near_start == "open" or problem.needs_opening,
        )
        return dataclasses.replace(proof, assumptions=(*proof.assumptions, *problem.assumptions))

    def having(self, outcome: Outcome) -> np.ndarray:
        """Indices of the positioners with this outcome."""
        return np.array([i for i, o in enumerate(self.outcomes) if o is outcome], dtype=np.int64)

    @property
    def lost(self) -> np.ndarray:
        """Indices of the positioners that had a target and do not end at it, those that cannot move included.

        Idle positioners have none, wherever they were wished to stand.
        """
        asked = ~np.isnan(self.problem.requested[:, 0])
        asked[list(self.problem.dropped)] = True
        asked &= ~self._wished
        failed = {Outcome.DROPPED, Outcome.INFEASIBLE, Outcome.DEADLOCKED}
        gone = np.array([outcome in failed for outcome in self.outcomes], bool)
        stuck = np.array([outcome is Outcome.OFFLINE for outcome in self.outcomes], bool)
        if (stuck & asked).any():
            plane, problem = self.problem.plane, self.problem
            away = np.linalg.norm(plane.fibers(self.trajectory.end) - plane.fibers(problem.requested), axis=1)
            gone |= stuck & ~(away <= ARRIVAL)
        return np.flatnonzero(gone & asked)

    @property
    def _wished(self) -> np.ndarray:
        assert self.problem.wished is not None  # set on construction
        return self.problem.wished

    @property
    def displaced(self) -> np.ndarray:
        """Indices of the idle positioners that end elsewhere than they were wished to; no target is lost by it."""
        wished = self._wished & ~np.isnan(self.problem.requested[:, 0])
        there = np.array([outcome is Outcome.ARRIVED for outcome in self.outcomes], bool)
        return np.flatnonzero(wished & self.problem.plane.online & ~there)

    def state_at(self, t: float) -> State:
        """Where everyone is at time `t` [s] of the motion."""
        t = number(t, "s", "t", TrajectoryError)
        problem = self.problem
        unknown = np.zeros(problem.n, bool) if problem.state is None else problem.state.unknown
        error = np.zeros(problem.n) if problem.position_error is None else problem.position_error
        return State(self.trajectory.at(t), problem.plane.online, error, unknown, f"plan at {t:g} s")

    @property
    def end(self) -> State:
        """Where everyone is in the end."""
        return self.state_at(self.makespan)

    @cached_property
    def needed_guesses(self) -> Mapping[int, bool]:
        """Positioner whose place is a guess -> whether the proof needs it; False: it is safe wherever that stands."""
        who = np.flatnonzero(self.end.unknown)
        if not len(who):
            return FrozenDict()
        problem = self.problem
        assert problem.position_error is not None  # set on construction
        needed = needed_guesses(problem.plane, self.trajectory, problem.margin, who, problem.position_error)
        return FrozenDict(zip(who.tolist(), needed.tolist(), strict=True))

    @property
    def arrivals(self) -> str:
        """How many of those that had a target end at it, as "498 of 500"."""
        arrived = int((~self._wished[self.having(Outcome.ARRIVED)]).sum())
        return f"{arrived} of {arrived + len(self.lost)}"

    @property
    def kept(self) -> float:
        """Total priority of the positioners that arrive."""
        assert self.problem.priority is not None  # set on construction
        return float(self.problem.priority[self.having(Outcome.ARRIVED)].sum())

    @property
    def _away(self) -> np.ndarray:
        """(n,) how far each positioner ends from the nearest configuration in which it is at its goal [mm].

        That is the largest distance of any fiber: the other elbow may bring one fiber to its place and not the next.
        """
        plane, end = self.problem.plane, self.trajectory.end
        there = [plane.fibers(end, fiber) for fiber in plane.fiber_offsets]
        away = []
        for goal in np.moveaxis(self._ends, 1, 0):
            wanted = [plane.fibers(goal, fiber) for fiber in plane.fiber_offsets]
            apart = np.linalg.norm(np.subtract(there, wanted), axis=2)
            away.append(np.fmax.reduce(apart))  # NaN: a fiber that the positioner does not carry
        return np.fmin.reduce(away)

    def faults(self) -> list[str]:
        """What in the plan does not hold: unsafe motion, or a positioner said to arrive that does not."""
        plane = self.problem.plane
        faults = [] if self.certificate.ok else [str(self.certificate)]
        away = self._away
        for i in self.having(Outcome.ARRIVED):
            if not away[i] <= ARRIVAL:
                faults.append(f"positioner '{plane.ids[i]}' is said to arrive but ends {away[i]:.4g} mm from its goal")
        return faults

    def __repr__(self) -> str:
        return f"<Plan of '{shortened(self.problem.plane.name)}' by {shortened(self.planner, 40)}: {self}>"

    def _repr_html_(self) -> str:
        return notebook_function("plan_html")(self)

    def __str__(self) -> str:
        ratio = f" ({self.makespan / self.lower_bound:.2f} x the lower bound)" if self.lower_bound > 0 else ""
        return f"{self.arrivals} arrived in {self.makespan:.1f} s{ratio}"

    def __getitem__(self, positioner: str | int) -> PositionerPlan:
        """What the plan says of one positioner, by id or index.

        Raises:
            PlanError: there is none (an `errors.UnknownPositionerError`, which is a KeyError, too).
        """
        return positioner_plan(self, positioner)

    def __iter__(self) -> Iterator[PositionerPlan]:
        return positioner_plans(self)

    def summary(self) -> str:
        """The plan in words: who arrived, makespan and bound, what was lost and why, and what is proven."""
        return summary(self)

    def to_table(self) -> "QTable":
        """A row a positioner, in the focal plane's order.

        Columns: positioner (id), outcome; start, goal (as requested; NaN: none) and end, each as commanded alpha and
        beta [deg], such as goal_alpha; priority, cause (empty where nothing was lost) and blockers, separated by
        commas. The meta data say what was planned, and how.
        """
        table = plan_table(self)
        table.meta.update(about(self))
        return table

    def write(self, path: str | os.PathLike, certificate: bool = True) -> None:
        """Write everything, with its certificate, as one FITS file.

        Args:
            path: of the file.
            certificate: whether what shows each pair clear is written too, which `fiberplan replay` checks.

        Raises:
            PlanError: the file cannot be written; what was there before is kept.
        """
        io_function("write_plan")(self, path, certificate)

    @classmethod
    def read(cls, path: str | os.PathLike) -> "Plan":
        """Read a plan written by `write`.

        Raises:
            PlanError: no such file, not a plan, damaged, or of a newer format.
        """
        return io_function("read_plan")(path)
