"""Straight from field to field, in close to the least time that the joints allow.

Everybody takes the cheapest path of their own over a lattice of (alpha, beta, time); contacts are then repaired one
positioner at a time, and pair by pair where that gets stuck (`fiberplan.planners.direct.search`). What is found is
clear in continuous time; straightening leaves a few knots of it.
"""

import dataclasses
import logging
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic, process_time

import numpy as np

from fiberplan.arrays import in_units, number
from fiberplan.certificates import reaction
from fiberplan.errors import ProblemError, interrupted
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory
from fiberplan.plan import Bound, Outcome, Plan
from fiberplan.planners.direct.first import PART, WIDEST, first_search, most_work
from fiberplan.planners.direct.goals import Goals, goals_in_time
from fiberplan.planners.direct.improving import react, shorten
from fiberplan.planners.direct.losses import Losses
from fiberplan.planners.direct.nodes import MOST_BETAS, MOST_STEPS
from fiberplan.planners.direct.search import DirectSearch
from fiberplan.planners.direct.settling import stop_here
from fiberplan.planners.direct.trim import as_trajectory
from fiberplan.planners.greedy_fold import GreedyFold
from fiberplan.planners.protocol import PLANNERS, setting
from fiberplan.planners.shared.prepared import prepared
from fiberplan.planners.shared.requirements import refuse_seed, require_two_links
from fiberplan.planners.shared.straighten import straighten
from fiberplan.problem import Problem

_LEAST_WORK = 5_000  # replans that a small problem gets, too
_HUB_STEP = np.radians(1.0)  # of the fallback's walk
_FEW, _FEW_PART = 20, 0.05  # positioners, or a part of them, that its relief may have to free
_APART = (0.3, 0.6, 1.0)  # [mm] that arms which are late keep after every step, since steps are not all there is
_HUB_KEEPS_MORE = "the fold hub keeps more than the direct path"
_logger = logging.getLogger(__name__)


@PLANNERS.register("direct")
@dataclass(frozen=True)
class Direct:
    """Field to field by local search with soft conflicts, joint moves of pairs, and the fold hub as fallback (ours).

    Raises:
        ProblemError: a time, budget or turn that is not positive.
    """

    max_time: float | None = setting(None, "give up what cannot be done in this time", "s")
    min_reaction: float | None = setting(None, "who stops dead is touched no sooner, where that can be had", "s")
    budget: float = setting(
        60.0, "replans per positioner, and 5,000, until goals are given up; joint ones count as many"
    )
    turn: float = setting(np.radians(6.0), "turn of alpha in one step of the search", "rad")
    seed: int = 0  #: of the order of repairs

    name = "direct"
    reference = "ours; soft conflicts after MAPF-LNS2 (Li et al., AAAI 2022), breakout weights (Morris, AAAI 1993)"

    def __post_init__(self) -> None:
        in_units(self, {"max_time": "s", "min_reaction": "s", "budget": "", "turn": "rad"}, ProblemError)
        refuse_seed(self.name, self.seed)
        for label, unit in (("max_time", " s"), ("min_reaction", " s"), ("budget", ""), ("turn", " rad")):
            value = getattr(self, label)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise ProblemError(f"direct: {label} must be positive, got {value:g}{unit}")
        if self.turn > WIDEST:
            raise ProblemError(f"direct: turn must be at most 45 deg, got {np.degrees(self.turn):g} deg")

    @prepared
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
            ProblemError: four-bar arms; or so many arms and steps that their paths would not fit into memory.
        """
        require_two_links(self.name, problem.plane)
        begun = process_time()
        ends = np.inf
        if deadline is not None:
            ends = monotonic() + number(deadline, "s", f"{self.name}: deadline", ProblemError)
        budget = int(self.budget * problem.n) + _LEAST_WORK
        search: DirectSearch | None = None
        first: Plan | None = None
        solved = stopped = False

        def proceed() -> bool:
            nonlocal stopped
            _logger.debug("direct: %s", search)
            if report is not None:
                report(str(search))
            stopped = not monotonic() < ends
            return not stopped

        try:
            near = Neighbourhood.of(problem.plane, problem.margin)
            goals = goals_in_time(problem, near, self.max_time)
            if deadline is not None:
                search = sooner = first_search(problem, near, goals.angles, self.turn, self.max_time, self.seed)
                enough, late = most_work(problem.n), monotonic() + PART * (ends - monotonic())
                sooner.begin()
                if sooner.run(budget, lambda: proceed() and sooner.work < enough and monotonic() < late):
                    first = self._finished(problem, near, sooner, goals, begun, interrupted=True)
            search = DirectSearch(problem, near, goals.angles, self.turn, self.max_time, self.seed)
            search.begin()
            solved = search.run(budget, proceed)
            if solved:
                shorten(search, proceed)
                if self.min_reaction is not None:
                    _make_late_safe(search, self.min_reaction, proceed)
        except (KeyboardInterrupt, Exception) as error:
            if not interrupted(error):
                raise
            stopped = True
        if search is None:
            return self._hub(problem, begun, Losses.none(problem), interrupted=True)
        if not solved:
            if first is not None and not first.having(Outcome.DEADLOCKED).size:
                return first  # nothing that was stopped keeps more
            stop_here(search)
        try:
            plan = self._finished(problem, near, search, goals, begun, stopped)
        except KeyboardInterrupt:  # finishing takes a moment, and what is found must not be lost: once more
            plan = self._finished(problem, near, search, goals, begun, interrupted=True)
        late_safe = solved and self.min_reaction is not None  # which the first plan is not
        if first is None or not stopped or late_safe:
            return plan
        return min(plan, first, key=lambda each: (-each.kept, each.makespan))

    def _finished(
        self,
        problem: Problem,
        near: Neighbourhood,
        search: DirectSearch,
        goals: Goals,
        begun: float,
        interrupted: bool,
    ) -> Plan:
        """The plan that a search has found, or the fold hub's if that is the better one."""
        searched = process_time()
        motion = as_trajectory(search.lattice.path[: problem.n, : search.steps + 1], search.duration)
        straight = straighten(problem.plane, motion, problem.margin, near)
        if self.min_reaction is None or _reacts(problem, straight, self.min_reaction):
            motion = straight
        motion = self._in_time(problem, goals.angles, motion)
        losses = Losses.of(problem, search, goals, self.max_time, motion.end)
        timings = {"search": searched - begun, "straighten": process_time() - searched}
        notes = [*_coarse(self.turn, search), *losses.notes(problem), *self._too_soon(problem, motion)]
        plan = Plan(
            problem=problem,
            trajectory=motion,
            outcomes=losses.outcomes(problem),
            planner=self.name,
            parameters=dataclasses.asdict(self),
            seed=self.seed,
            blockers=losses.blockers(problem),
            timings=timings,
            notes=(*problem.notes, *notes),
            bounds=_bounds(search),
            interrupted=interrupted,
        )
        if not losses.unproven:
            return plan
        try:
            hub = self._hub(problem, begun, losses, interrupted)
        except KeyboardInterrupt:
            return dataclasses.replace(plan, interrupted=True)
        in_time = self.max_time is None or hub.makespan <= self.max_time
        better = (-hub.kept, hub.makespan) < (-plan.kept, plan.makespan)
        unsafe = interrupted and not plan.certificate.ok
        return hub if unsafe or (in_time and better) else plan

    def _too_soon(self, problem: Problem, motion: Trajectory) -> list[str]:
        """A note if who stops dead may be touched sooner than was asked for."""
        if self.min_reaction is None or _reacts(problem, motion, self.min_reaction):
            return []
        return [f"who stops dead may be touched sooner than {self.min_reaction:g} s later: no plan was found where not"]

    def _in_time(self, problem: Problem, goal: np.ndarray, motion: Trajectory) -> Trajectory:
        """The motion at the joints' very limits, where what planners keep below them would make it late."""
        if self.max_time is None or not motion.duration > self.max_time:
            return motion
        travel = np.nan_to_num(np.abs(goal - problem.start) / problem.plane.max_speed).max(initial=0.0)
        end = max(self.max_time, float(travel))
        times = np.minimum(motion.times * (end / motion.duration), end)
        return Trajectory(motion.offsets, times, motion.angles)

    def _hub(self, problem: Problem, begun: float, losses: Losses, interrupted: bool) -> Plan:
        """The plan of the fold hub, as a plan of this planner, which may know that some cannot arrive at all."""
        _logger.info("direct: the fold hub is planned")
        fold = GreedyFold(step=_HUB_STEP, seed=self.seed)
        hub = dataclasses.replace(fold, relief="none").plan(problem)
        if len(hub.lost) <= max(_FEW, _FEW_PART * problem.n):  # relief of many takes longer than all the rest
            hub = fold.plan(problem)
        why = "interrupted: the fold hub is the best plan so far" if interrupted else _HUB_KEEPS_MORE
        return dataclasses.replace(
            hub,
            outcomes=losses.proven_in(hub.outcomes),
            planner=self.name,
            parameters=dataclasses.asdict(self),
            timings={"search": process_time() - begun},
            notes=(*hub.notes, why),
            interrupted=interrupted,
        )


def _make_late_safe(search: DirectSearch, seconds: float, proceed: Callable[[], bool]) -> None:
    """Look for paths on which arms that are late keep clear; more between nodes, where the first are not proven to."""
    for apart in _APART:
        motion = as_trajectory(search.lattice.path[: search.problem.n, : search.steps + 1], search.duration)
        if _reacts(search.problem, motion, seconds) or not react(search, seconds, apart, proceed):
            return
        shorten(search, proceed)


def _reacts(problem: Problem, motion: Trajectory, seconds: float) -> bool:
    """Whether who stops dead is proven to be touched no sooner than so many seconds later."""
    assert problem.position_error is not None  # set on construction
    return reaction(problem.plane, motion, problem.position_error).seconds >= seconds


def _bounds(search: DirectSearch) -> tuple[Bound, ...]:
    """What set the makespan, if the joints' speeds did not."""
    found = []
    if search.slowest_pair is not None:
        found.append(Bound("pair", float(search.duration * search.slowest_need), search.slowest_pair))
    if search.slowest_past_fixed is not None:
        seconds = float(search.duration * search.need_past_fixed)
        found.append(Bound("obstacle", seconds, (search.slowest_past_fixed,)))
    return tuple(found)


def _coarse(turn: float, search: DirectSearch) -> list[str]:
    """A note if alphas turn more in a step than was asked for."""
    if not search.widest_turn > turn * (1.0 + 1e-6):
        return []
    return [
        f"searched in steps of {search.duration:.3g} s, in which an alpha turns by up to "
        f"{np.degrees(search.widest_turn):.3g} deg, not {np.degrees(turn):.3g} deg: a joint may take "
        f"{MOST_STEPS} steps at most, a beta {MOST_BETAS - 8}"
    ]
