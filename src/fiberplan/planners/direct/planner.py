"""Straight from field to field, in close to the least time that the joints allow.

Everybody takes the cheapest way of their own over a lattice of (alpha, beta, time); contacts are then repaired one
positioner at a time, and pair by pair where that gets stuck (`fiberplan.planners.direct.search`). What is found is
clear in continuous time; straightening leaves a few knots of it.
"""

import dataclasses
import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from time import monotonic, process_time

import numpy as np

from fiberplan.arrays import in_units, number
from fiberplan.certificates import proven_unreachable
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.plan import Outcome, Plan
from fiberplan.plan.outcomes import all_blockers, settled_outcome
from fiberplan.planners.direct.search import DirectSearch
from fiberplan.planners.direct.trim import as_trajectory
from fiberplan.planners.greedy_fold import GreedyFold
from fiberplan.planners.protocol import PLANNERS
from fiberplan.planners.shared.goal_configurations import faster_goals
from fiberplan.planners.shared.requirements import refuse_bars
from fiberplan.planners.shared.straighten import straighten
from fiberplan.problem import Problem
from fiberplan.tolerances import UNDER_LIMIT

_LEAST_WORK = 5_000  # replans that a small problem gets, too
_HUB_STEP = np.radians(1.0)  # of the fallback's walk
_logger = logging.getLogger(__name__)


@PLANNERS.register("direct")
@dataclass(frozen=True)
class Direct:
    """Field to field by local search with soft conflicts, joint moves of pairs, and the fold hub as fallback (ours).

    Raises:
        ProblemError: a time, budget or turn that is not positive.
    """

    max_time: float | None = None  #: cap of the makespan [s]
    budget: float = 60.0  #: replans per positioner, and 5,000, before goals are given up; a joint one counts as 20
    turn: float = np.radians(6.0)  #: of alpha in one step of the search [rad]
    seed: int = 0  #: of the order of repairs

    name = "direct"
    reference = "ours; soft conflicts after MAPF-LNS2 (Li et al., AAAI 2022), breakout weights (Morris, AAAI 1993)"

    def __post_init__(self) -> None:
        in_units(self, {"max_time": "s", "budget": "", "turn": "rad"}, ProblemError)
        for label, unit in (("max_time", " s"), ("budget", ""), ("turn", " rad")):
            value = getattr(self, label)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise ProblemError(f"direct: {label} must be positive, got {value:g}{unit}")
        if self.turn > np.pi / 4:
            raise ProblemError(f"direct: turn must be at most 45 deg, got {np.degrees(self.turn):g} deg")

    def plan(
        self, problem: Problem, deadline: float | None = None, report: Callable[[str], None] | None = None
    ) -> Plan:
        """Go straight to the goal; what cannot get there is given up, and the rest is planned around it.

        Args:
            problem: the problem.
            deadline: wall-clock seconds after which the best plan so far is returned, marked as interrupted; as it is
                after Ctrl-C.
            report: told about progress, in words.

        Raises:
            ProblemError: arms of four bars.
        """
        refuse_bars(self.name, problem.plane)
        begun = process_time()
        ends = np.inf
        if deadline is not None:
            ends = monotonic() + number(deadline, "s", f"{self.name}: deadline", ProblemError)
        near = Neighbourhood.of(problem.plane, problem.margin)
        goal, late = self._goals(problem, near)
        search = DirectSearch(problem, near, goal, self.turn, self.max_time, self.seed)

        def proceed() -> bool:
            _logger.debug("direct: %s", search)
            if report is not None:
                report(str(search))
            return monotonic() < ends

        try:
            search.begin()
            solved = search.run(int(self.budget * problem.n) + _LEAST_WORK, proceed)
        except KeyboardInterrupt:
            solved = False
        searched = process_time()
        if not solved:
            return self._hub(problem, begun, "interrupted: the fold hub is the best plan so far", interrupted=True)
        motion = as_trajectory(search.lattice.path[: problem.n], search.duration)
        motion = straighten(problem.plane, motion, problem.margin, near)
        barred = [i for i in search.given_up if _is_barred(problem, i)]
        plan = Plan(
            problem=problem,
            trajectory=motion,
            outcomes=_outcomes(problem, search, late, barred),
            planner=self.name,
            parameters=dataclasses.asdict(self),
            seed=self.seed,
            blockers=_blockers(problem, search),
            timings={"search": searched - begun, "straighten": process_time() - searched},
            notes=(*problem.notes, *_notes(problem, search, late, barred, self.max_time)),
        )
        if len(barred) == len(search.given_up):
            return plan
        hub = self._hub(problem, begun, "the fold hub keeps more than the direct way")
        in_time = self.max_time is None or hub.makespan <= self.max_time
        return hub if in_time and hub.kept > plan.kept else plan

    def _goals(self, problem: Problem, search_near: Neighbourhood) -> tuple[np.ndarray, np.ndarray]:
        """Goals (n, 2) to go to [rad], the quickest where there is a choice; and who cannot be there by `max_time`."""
        goal = np.array(faster_goals(problem, search_near))
        late = np.zeros(problem.n, bool)
        if self.max_time is not None:
            needed = np.nan_to_num(np.abs(goal - problem.start) / (problem.plane.max_speed * UNDER_LIMIT)).max(axis=1)
            late = needed > self.max_time
            goal[late] = np.nan
        return goal, late

    def _hub(self, problem: Problem, begun: float, why: str, interrupted: bool = False) -> Plan:
        """The plan of the fold hub, as a plan of this planner."""
        _logger.info("direct: the fold hub is planned: %s", why)
        hub = GreedyFold(step=_HUB_STEP, seed=self.seed).plan(problem)
        return dataclasses.replace(
            hub,
            planner=self.name,
            parameters=dataclasses.asdict(self),
            timings={"search": process_time() - begun},
            notes=(*hub.notes, why),
            interrupted=interrupted,
        )


def _is_barred(problem: Problem, i: int) -> bool:
    """Whether it is proven that what never moves bars positioner `i` from its goal, and from every alternative."""
    if np.isnan(problem.goal[i, 0]):
        return False
    others = [] if problem.alternatives is None else [q for q in problem.alternatives[i] if not np.isnan(q[0])]
    goals = [problem.goal[i], *others]
    return all(proven_unreachable(problem.plane, i, problem.start, goal, problem.margin) for goal in goals)


def _outcomes(problem: Problem, search: DirectSearch, late: np.ndarray, barred: Sequence[int]) -> tuple[Outcome, ...]:
    """An outcome for every positioner, the first that fits."""

    def outcome(i: int) -> Outcome:
        settled = settled_outcome(problem, i)
        if settled is None and (late[i] or i in barred):
            return Outcome.INFEASIBLE
        return settled or (Outcome.DEADLOCKED if i in search.given_up else Outcome.ARRIVED)

    return tuple(outcome(i) for i in range(problem.n))


def _blockers(problem: Problem, search: DirectSearch) -> dict[int, tuple[int, ...]]:
    """Positioner that does not arrive -> who stood in its way; -1 - k is obstacle k."""
    n = problem.n
    given_up = {i: tuple(j if j < n else n - 1 - j for j in arms) for i, arms in search.given_up.items()}
    return all_blockers(problem, given_up)


def _notes(
    problem: Problem, search: DirectSearch, late: np.ndarray, barred: Sequence[int], max_time: float | None
) -> list[str]:
    """What the outcomes do not say."""
    ids, notes = problem.plane.ids, []
    if search.slowest_pair is not None:
        names = " and ".join(ids[i] for i in search.slowest_pair)
        seconds = search.duration * search.slowest_need
        notes.append(f"pair bound: {names} need {seconds:.1f} s even alone (an estimate on a lattice, no proof)")
    if search.slowest_past_fixed is not None:
        name, seconds = ids[search.slowest_past_fixed], search.duration * search.need_past_fixed
        notes.append(f"{name} needs {seconds:.1f} s past what never moves (an estimate on a lattice, no proof)")
    if late.any():
        notes.append(f"proven out of reach within {max_time:g} s by joint speeds: {_listed(ids, np.flatnonzero(late))}")
    if barred:
        notes.append(f"proven barred from their goals by what never moves: {_listed(ids, barred)}")
    if search.held:
        notes.append(f"held at the start: {_listed(ids, sorted(search.held))}")
    return notes


def _listed(ids: tuple[str, ...], who: Iterable[int]) -> str:
    return ", ".join(ids[i] for i in who)
