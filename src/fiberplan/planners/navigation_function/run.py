"""One descent of a whole array: the arrays that the compiled loops work on, and what is read off them."""

from collections.abc import Callable, Iterable
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from fiberplan.errors import ProblemError
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory
from fiberplan.planners.navigation_function import descent
from fiberplan.planners.navigation_function.descent import FULL, Crowd, Weights
from fiberplan.planners.navigation_function.fiber_ends import fiber_ends
from fiberplan.planners.navigation_function.rehearsal import EVERY, SPARE, take_turns
from fiberplan.planners.navigation_function.repaired import descend_repaired
from fiberplan.planners.navigation_function.retract_profile import MIDDLE, WAY, by_way_of_home
from fiberplan.planners.navigation_function.singular import nudge_sides
from fiberplan.planners.navigation_function.yielding import AHEAD
from fiberplan.planners.shared.goal_configurations import choices_of, chosen, faster_goals, other_parities, travel_times
from fiberplan.planners.shared.joint_paths import append_joint_ways
from fiberplan.planners.shared.memory import refuse_large
from fiberplan.planners.shared.recording import new_record, recorded, with_room
from fiberplan.planners.shared.safe_steps import stepping
from fiberplan.problem import Problem

_REHEARSED = 1.1  # of the common time, so that who is a little late is seen to arrive
_THERE = 1e-7  # [rad]
_MOST_STEPS = 200_000  # that the slowest joint may take; more would take hours, and the rehearsal more memory than most
_SETTLING = 2.0  # [s] for the last stretch to the exact goal


class Settings(NamedTuple):
    """The fields of `NavigationFunction` of the same names."""

    lambda1: float
    lambda2: float
    D: float
    d: float
    dt: float
    convergence: float
    mode: str
    neighbours: int
    ease: float
    give_up: float
    seed: int


class Descent:
    """Where everyone is, and the motion so far; can be run on."""

    def __init__(self, problem: Problem, near: Neighbourhood, settings: Settings):
        plane, n = problem.plane, problem.n
        self.problem, self.near, self.settings = problem, near, settings
        self.weights = Weights(
            float(settings.lambda1), float(settings.lambda2), float(settings.D), float(settings.d), float(settings.dt),
            float(settings.convergence),
        )  # fmt: skip
        self.timings: dict[str, float] = {}  #: CPU of its parts [s]
        self.choices = choices_of(problem)
        times = travel_times(problem, self.choices)
        quickest = times.min(axis=1)
        self.slowest = float(quickest[np.isfinite(quickest)].max(initial=0.0))  #: time of the slowest joint [s]
        self.together = settings.ease * self.slowest  #: time that all may take [s]
        self._refuse_long(quickest)
        if settings.mode == "literal":
            self.goals = faster_goals(problem, near)
        else:
            self.goals = chosen(problem, near, self.choices, self._cost(times))
        most = settings.neighbours or None
        self.ends = fiber_ends(plane, problem.start, self.goals, settings.D, settings.dt, most)
        self.now = stepping(plane, problem.start, problem.margin, near)
        self.record = new_record(problem.start)
        movable = plane.online.copy()
        awake = np.flatnonzero(movable)
        active = np.concatenate([awake, np.zeros(n - len(awake), np.int64)])
        restless = np.zeros(n, bool) if settings.mode == "literal" else movable & ~np.isnan(self.goals[:, 0])
        self.crowd = Crowd(
            active, movable.copy(), restless, movable, nudge_sides(n, settings.seed), np.array([0, len(awake)])
        )
        once_round = 2 * np.pi / float(plane.max_speed[:, 1].min())  # short moves too may have to make room and return
        longest = max(settings.give_up * self.slowest, once_round) / settings.dt
        self.last_step = int(np.ceil(min(longest, max(settings.give_up, 1.0) * _MOST_STEPS)))

    def _refuse_long(self, quickest: np.ndarray) -> None:
        """Refuse what would take too many steps, given the time (n,) [s] that each joint needs at least."""
        steps, ids = self.together / self.settings.dt, self.problem.plane.ids
        if not steps <= _MOST_STEPS:
            i = int(np.argmax(np.where(np.isfinite(quickest), quickest, -1.0)))
            raise ProblemError(
                f"navigation-function: positioner '{ids[i]}' takes {self.slowest:.4g} s at full speed, {steps:.3g} "
                f"steps of {self.settings.dt:g} s, and {_MOST_STEPS:,} are the most: take a longer dt",
                (i,),
            )

    def _cost(self, times: np.ndarray) -> np.ndarray:
        """(n, k) by which choices are ranked: those in time come first, of these the ones on the same elbow side."""
        home = by_way_of_home(self.problem.plane, self.problem.start, self.choices)
        late, never = 1e6, 1e3  # [s] larger than any time
        cost = np.where(np.isfinite(home), home, never + times) + np.where(times <= self.together, 0.0, late)
        return np.where(np.isfinite(times), cost, np.inf)

    def _run(self, kernel: Callable[..., int], *arguments: Any, last_step: int) -> int:
        """Run a compiled loop to its end, with more room for knots whenever it asks."""
        while True:
            self.record = with_room(self.record, 4 * self.problem.n)
            arrays = (self.problem.plane.arms, self.near, self.now, self.record, self.ends, self.crowd)
            why = kernel(*arrays, *arguments, last_step)
            if why != FULL:
                return int(why)

    def run_literally(self) -> int:
        """Descend the printed potential, then let those that converged settle; returns why the descent ended."""
        why = self._run(descent.descend_literally, self.weights, last_step=self.last_step)
        steps = int(self.crowd.counters[0]) + int(np.ceil(_SETTLING / self.settings.dt))
        self._run(descent.settle, self._nearest_goals(), last_step=steps)
        return why

    def _nearest_goals(self) -> np.ndarray:
        """(n, 2) for those that converged, the nearest configuration they may end in [rad]; elsewhere NaN."""
        plane, angles = self.problem.plane, self.angles
        turns = np.round((angles[:, None] - self.choices) / (2 * np.pi)) * 2 * np.pi  # joints may turn on and on
        shifted = self.choices + turns
        inside = np.all((shifted >= plane.lower[:, None]) & (shifted <= plane.upper[:, None]), axis=2)
        options = np.where(np.expand_dims(inside, 2), shifted, self.choices)
        far = np.abs(options - angles[:, None]).max(axis=2)
        best = np.argmin(np.where(np.isnan(far), np.inf, far), axis=1)
        goals = np.take_along_axis(options, best[:, None, None], axis=1)[:, 0]
        away = np.hypot(*(plane.fibers(goals) - plane.fibers(angles)).T)
        return np.where((away <= self.settings.convergence)[:, None], goals, np.nan)

    def run_repaired(self) -> int:
        """Take turns, then move until all have arrived; returns why it ended."""
        n, settings = self.problem.n, self.settings
        ways = np.zeros(n, WAY)
        ways["rank"] = ways["own_rank"] = np.random.default_rng([settings.seed, 0x4A11]).permutation(n)
        ways["lean_in"] = ways["lean_out"] = MIDDLE
        ways["yields_to"] = -1
        ways["arrived"] = np.isnan(self.goals[:, 0])
        ways["other_alpha"], ways["other_beta"] = other_parities(self.problem, self.choices, self.goals).T
        due = int(np.ceil(self.together / settings.dt))
        ways["due"] = due
        samples = int(_REHEARSED * due) // EVERY + 2
        refuse_large(8.0 * (n + 1) * samples, f"navigation-function: {n} positioners rehearsed in {due} steps")
        paths, spare = np.empty((n, samples, 2), np.float32), np.empty((samples, 2), np.float32)
        start, apart = np.array(self.problem.start), settings.d + SPARE
        begun = process_time()
        take_turns(self.problem.plane.arms, self.ends, ways, start, paths, spare, apart, due + 1)
        self.timings["turns"] = process_time() - begun
        top = np.array([float(n)])
        return self._run(descend_repaired, ways, self.weights, top, last_step=max(self.last_step, due + 1))

    @property
    def angles(self) -> np.ndarray:
        """(n, 2) where everyone is [rad]."""
        pose = self.now.pose[: self.problem.n]
        return np.stack([pose["alpha"], pose["beta"]], axis=1)

    def trajectory(self) -> Trajectory:
        """The motion so far."""
        return recorded(self.record, self.settings.dt)

    def finished(self) -> Trajectory:
        """The motion so far, and joint ways for those that it leaves stuck."""
        motion = self.trajectory()
        goal = np.stack([self.ends.end["goal_alpha"], self.ends.end["goal_beta"]], axis=1)  # parities may have changed
        off = np.abs(motion.end - goal).max(axis=1)
        stuck = np.flatnonzero(self.problem.plane.online & (off > _THERE))
        if not len(stuck):
            return motion
        return append_joint_ways(self.problem, self.near, motion, goal, stuck, self.settings.seed)

    def blockers(self, stuck: Iterable[int]) -> dict[int, tuple[int, ...]]:
        """Who stands in the way of each of `stuck`: who refused its last step, or fiber ends close ahead."""
        plane, end = self.problem.plane, self.ends.end
        found = {}
        for i in stuck:
            others = self.ends.near["arm"][self.ends.offsets[i] : self.ends.offsets[i + 1]]
            far = np.hypot(end["x"][others] - end["x"][i], end["y"][others] - end["y"][i])
            close = {int(j) for j in others[far < self.settings.d + AHEAD]}
            refused = int(self.now.pose["blocker"][i])
            arms = close | ({refused} if refused >= 0 else set())
            found[int(i)] = tuple(sorted(plane.public(arm) for arm in arms))
        return found
