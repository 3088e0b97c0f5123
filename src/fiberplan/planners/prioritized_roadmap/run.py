"""Priority orders, one pass after the other, and the plan that the best of them makes."""

from typing import NamedTuple

import numpy as np

from fiberplan.errors import ProblemError
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome
from fiberplan.plan.outcomes import settled_outcome
from fiberplan.planners.prioritized_roadmap.prioritized import Pass, Task
from fiberplan.planners.prioritized_roadmap.roadmap import Path, cells, middle_edges, paths, travel_time
from fiberplan.planners.shared.memory import refuse_large
from fiberplan.problem import Problem
from fiberplan.tolerances import SLACK, UNDER_LIMIT

_PATH_BYTES = 1000.0  # of a path of a roadmap, on average


class Settings(NamedTuple):
    """The fields of `PrioritizedRoadmap` of the same names."""

    grid: tuple[int, int]
    edges: int
    dt: float
    collision_dt: float
    max_stops: int
    max_time: float
    orders: int
    garages: bool
    varying: bool
    aside: bool
    continuous: bool
    early_abort: bool
    seed: int


class Search:
    """Passes in one order after the other, and who has been given up so far."""

    def __init__(self, settings: Settings, problem: Problem):
        self.settings, self.problem = settings, problem
        plane = problem.plane
        self.rng = np.random.default_rng(settings.seed)
        self.most = int(np.ceil(settings.max_time / settings.dt - 1e-9)) - 1
        self.near = Neighbourhood.of(plane, problem.margin)
        self._refuse_long_steps()
        self._refuse_large()
        self.points = {i: cells(plane, i, settings.grid) for i in map(int, np.flatnonzero(plane.online))}
        self.pairs = {i: middle_edges(len(p), settings.edges, self.rng) for i, p in self.points.items()}
        self.targets = {i for i in self.points if problem.has_goal[i]}
        self.held: set[int] = set()
        self.lost: dict[int, tuple[int, ...]] = {}
        self.checks = self.rest_checks = self.passes = 0

    def _refuse_long_steps(self) -> None:
        plane = self.problem.plane
        width = np.minimum(plane.upper - plane.lower, 4 * np.pi)
        longest = float((width / (plane.max_speed * UNDER_LIMIT)).max())
        if self.settings.dt > longest:
            raise ProblemError(
                f"prioritized-roadmap: a step of {self.settings.dt:g} s is longer than the longest edge takes on "
                f"{plane.name}, {longest:.3f} s"
            )

    def _refuse_large(self) -> None:
        """Refuse more paths and states in time than fit into memory."""
        plane, settings, times = self.problem.plane, self.settings, float(self.most + 1)
        cells, stops = float(np.prod(settings.grid)), min(settings.max_stops, self.most) + 1
        poses, states = 16.0 * len(plane.arms.arm) * times, 3.0 * (stops + 1) * times**2
        paths = int(plane.online.sum()) * (cells + 2.0 * settings.edges) * _PATH_BYTES
        refuse_large(
            poses + states + paths,
            f"prioritized-roadmap: {plane.n} positioners, {cells:g} cells and {self.most} steps of {settings.dt:g} s",
        )

    def _task(self) -> Task:
        """The task as it is with those targets that are still wanted."""
        problem, settings = self.problem, self.settings
        plane = problem.plane
        goal = np.array(plane.folded)
        wanted = sorted(self.targets)
        goal[wanted] = problem.goal[wanted]
        still = [i for i in range(plane.n) if i in self.held or i not in self.points]
        goal[still] = problem.start[still]
        return Task(
            plane=plane,
            near=self.near,
            limit=problem.margin + SLACK,
            start=problem.start,
            goal=goal,
            roadmaps={i: self.roadmap(i, goal[i]) for i in self.points if i not in self.held},
            dt=settings.dt,
            most=self.most,
            max_stops=settings.max_stops,
            looks=0 if settings.continuous else int(np.ceil(settings.dt / settings.collision_dt - 1e-9)),
            garages=settings.garages,
            varying=settings.varying,
            aside=settings.aside,
            early_abort=settings.early_abort,
        )

    def roadmap(self, i: int, goal: np.ndarray) -> list[Path]:
        """Paths of arm `i` from its start to `goal`, quickest first."""
        plane, dt = self.problem.plane, self.settings.dt
        return paths(plane, i, self.problem.start[i], goal, self.points[i], self.pairs[i], dt, self.most)

    def run(self) -> Pass:
        """Passes until one brings everyone there, or the one that loses least; whoever is stuck is held, and again."""
        while True:
            task = self._task()
            order = self._longest_first(task)
            tried: set[tuple[int, ...]] = set()
            stuck: list[int] | None = None  # in the pass that had fewest
            best: tuple[tuple[float, ...], Pass] | None = None
            for _ in range(self.settings.orders):
                tried.add(tuple(order))
                attempt = self._pass(task, order)
                self.passes += 1
                if not attempt.failed and not attempt.stuck:
                    return attempt
                if stuck is None or len(attempt.stuck) < len(stuck):
                    stuck = attempt.stuck
                if not attempt.stuck and (best is None or self._cost(attempt) < best[0]):
                    best = self._cost(attempt), attempt
                order = self._another(order, next(iter([*attempt.failed, *attempt.stuck])), tried)
            if best is not None:
                met = best[1].failed
                self.lost |= {i: tuple(map(self.problem.plane.public, met[i])) for i in met}
                return best[1]
            for i in stuck or ():
                self._hold(i)

    def _cost(self, attempt: Pass) -> tuple[float, ...]:
        """Priority of the targets that a pass loses, and how many."""
        priority = self.problem.priority
        assert priority is not None  # set on construction
        return float(sum(priority[i] for i in attempt.failed)), float(len(attempt.failed))

    def _hold(self, i: int) -> None:
        """Leave an arm where it is that nobody could plan around otherwise."""
        self.held.add(i)
        if i in self.targets:
            self.targets.remove(i)
            self.lost[i] = ()

    def _longest_first(self, task: Task) -> list[int]:
        """Arms by the estimated time of their direct way, longest first (ties: by index)."""
        times = {i: float(travel_time(task.plane, i, task.start[i], task.goal[i])) for i in task.roadmaps}
        return sorted(task.roadmaps, key=lambda i: (-times[i], i))

    def _another(self, order: list[int], failed: int, tried: set[tuple[int, ...]]) -> list[int]:
        """An order not tried yet: the arm that failed goes first, or else a random one."""
        other = [failed] + [i for i in order if i != failed]
        for _ in range(20):
            if tuple(other) not in tried:
                break
            other = [order[k] for k in self.rng.permutation(len(order))]
        return other

    def _pass(self, task: Task, order: list[int]) -> Pass:
        """One pass. An arm that fails retracts, or stays where it is, if it can; the others are still planned."""
        attempt = Pass(task)
        for i in range(task.plane.n):
            if i not in task.roadmaps:
                attempt.hold(i)
        for i in order:
            if attempt.arm(i):
                continue
            if i in self.targets:
                attempt.failed[i] = attempt.blockers(i)
                if attempt.over(i, self.roadmap(i, task.plane.folded[i])):
                    continue
            if not attempt.stay(i):
                attempt.stuck.append(i)
        self.checks += int(attempt.tally[-2])
        self.rest_checks += int(attempt.tally[-1])
        return attempt

    def motion(self, done: Pass) -> Trajectory:
        """The motion that a pass without failures makes."""
        problem = self.problem
        knots = [
            done.motions[i].knots(self.settings.dt) if i in done.motions else (np.zeros(1), problem.start[[i]])
            for i in range(problem.n)
        ]
        return Trajectory.from_knots(
            np.repeat(np.arange(problem.n), [len(times) for times, _ in knots]),
            np.concatenate([times for times, _ in knots]),
            np.concatenate([angles for _, angles in knots]),
            problem.n,
        )

    def outcome(self, i: int) -> Outcome:
        """What became of positioner `i`."""
        return settled_outcome(self.problem, i) or (Outcome.DEADLOCKED if i in self.lost else Outcome.ARRIVED)

    def notes(self, done: Pass) -> list[str]:
        """What the outcomes do not say."""
        ids = self.problem.plane.ids
        passes = f"in {self.passes} pass{'es' if self.passes > 1 else ''}"
        notes = [f"{self.checks} pair checks under way and {self.rest_checks} of arms at their goals, {passes}"]
        notes += done.repairs
        notes += [f"positioner '{ids[i]}' loses its target: no order brought everyone there" for i in sorted(self.lost)]
        if self.held:
            notes.append("held at the start: " + ", ".join(ids[i] for i in sorted(self.held)))
        return notes
