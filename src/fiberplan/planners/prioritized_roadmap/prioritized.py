"""One pass of prioritized planning: arms in turn, each clear of those before it; and what to try when one fails.

An arm that fails may try private garages, get priority from some moment on over whoever is in its way, or have someone
who has arrived moved aside; these are Sabater2018's future work. All of them keep the limit of start-stops.
"""

from dataclasses import dataclass, field

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.prioritized_roadmap.edge_search import search
from fiberplan.planners.prioritized_roadmap.garages import garages
from fiberplan.planners.prioritized_roadmap.motions import Motion
from fiberplan.planners.prioritized_roadmap.roadmap import Path, cut
from fiberplan.planners.prioritized_roadmap.step_checks import Timetable, first_rest

GARAGE_ROOM = 1.0  #: a garage clears everybody's straight way by this much more than asked [mm]


@dataclass(frozen=True, eq=False)
class Task:
    """What one pass works on."""

    plane: FocalPlane
    near: Neighbourhood
    limit: float  #: clearance to keep [mm]
    start: np.ndarray  #: (n, 2) [rad]
    goal: np.ndarray  #: (n, 2) where each arm is to go, its start if nowhere [rad]
    roadmaps: dict[int, list[Path]]  #: of the arms that may move
    dt: float  #: [s]
    most: int  #: steps of the clock
    max_stops: int
    looks: int  #: per step and pair; 0: continuous
    garages: bool = False
    varying: bool = False
    aside: bool = False
    early_abort: bool = False


@dataclass
class Pass:
    """Prioritized planning in one order, arm by arm."""

    task: Task
    motions: dict[int, Motion] = field(default_factory=dict)
    repairs: list[str] = field(default_factory=list)  #: what helped, in words
    failed: dict[int, list[int]] = field(default_factory=dict)  #: arms that lost their target -> who was in the way
    checks: dict[int, int] = field(default_factory=dict)  #: pair checks that each arm's search took
    stuck: list[int] = field(default_factory=list)  #: arms that could not even stay where they are

    def __post_init__(self) -> None:
        task = self.task
        count = len(task.plane.arms.arm)
        self._poses = np.zeros((count, task.most + 1, 2))
        self._until = np.full(count, task.most + 1)
        self._planned = np.arange(count) >= task.plane.n  # obstacles are there from the beginning
        self.tally = np.zeros(count + 2, np.int64)
        self._neighbours = [np.unique(task.near.around(i)).astype(np.int64) for i in range(task.plane.n)]

    def hold(self, i: int) -> None:
        """Arm `i` stays at its start."""
        self._poses[i], self._planned[i] = self.task.start[i], True

    def arm(self, i: int) -> bool:
        """Plan arm `i` against those planned before it; whether that worked."""
        found = self._over(i, self.task.roadmaps[i])
        if found is None and self.task.garages:
            found = self._over(i, self._garage_paths(i))
            if found is not None:
                self.repairs.append(f"{self._name(i)} waits in a garage")
        if found is not None:
            self._settle(i, found)
            return True
        return (self.task.varying or self.task.aside) and self._someone_yields(i)

    def blockers(self, i: int) -> list[int]:
        """Arms that arm `i` met most often in its last searches, those first."""
        met = [j for j in self._neighbours[i] if self._met[j] > 0]
        return sorted(met, key=lambda j: (-self._met[j], j))

    def stay(self, i: int) -> bool:
        """Plan arm `i` to stay where it is, if nobody comes by."""
        return self.over(i, [_still(self.task.start[i])])

    def over(self, i: int, paths: list[Path]) -> bool:
        """Plan arm `i` over one of `paths`, which all end at the same place; whether that worked."""
        found = self._over(i, paths)
        if found is not None:
            self._settle(i, found)
        return found is not None

    def _settle(self, i: int, motion: Motion) -> None:
        self.motions[i], self._planned[i] = motion, True
        self._poses[i] = motion.poses(self.task.most + 1)

    def _name(self, i: int) -> str:
        return self.task.plane.ids[i]

    def _table(self, i: int) -> Timetable:
        others = self._neighbours[i]
        others = others[self._planned[others] & (others != i)]
        moving = [self.motions[j].arrival for j in others if j in self.motions]
        quiet = max(moving, default=0)
        return Timetable(self._poses, self._until, others, self.task.limit, self.task.looks, quiet, self.tally)

    def _over(self, i: int, paths: list[Path], begin: tuple[int, int, int, int] = (0, 0, 0, 0)) -> Motion | None:
        """A motion of arm `i` along the first of `paths` that has one; they all end at the same place."""
        task, table = self.task, self._table(i)
        arms, before = task.plane.arms, self.tally.copy()
        limit = min(task.max_stops, task.most)
        rest_from = -1
        if task.early_abort and paths:
            rest_from = int(first_rest(arms, table, i, *paths[0].configurations[-1], 0))
        found = None
        for path in paths:
            if task.early_abort and path.through > limit:
                continue  # each intermediate vertex is a start-stop
            way, vertex = path.configurations, path.vertex
            steps, stops, rest_from = search(arms, table, i, way, vertex, limit, begin, rest_from, task.early_abort)
            if len(steps):
                found = Motion(path, steps, int(stops))
                break
        self._met = self.tally[: len(before) - 2] - before[:-2]
        if begin[3] == 0:
            self.tally[-2] += 2 * int(np.sum(table.others < task.plane.n))  # both ends, as counted in the paper
        self.checks[i] = self.checks.get(i, 0) + int(self.tally[-2] - before[-2])
        return found

    def _garage_paths(self, i: int) -> list[Path]:
        task = self.task
        limit = task.limit + GARAGE_ROOM
        places = garages(task.plane, i, task.start, task.goal, self._neighbours[i], limit)
        ways = [np.stack([task.start[i], place, task.goal[i]]) for place in places]
        return [path for way in ways if (path := cut(task.plane, i, way, task.dt, task.most)) is not None]

    def _someone_yields(self, i: int) -> bool:
        """Whether arm `i` gets through if one of those in its way yields from some moment on, or moves aside."""
        for j in [j for j in self.blockers(i) if j in self.motions][:3]:
            arrival = self.motions[j].arrival
            moments = range(0, arrival, 2) if self.task.varying else ()
            for moment in (*moments, arrival):
                if moment == arrival and not self.task.aside:
                    continue
                if self._yields(i, j, moment):
                    how = "moves aside" if moment == arrival else f"yields from {moment * self.task.dt:g} s on"
                    self.repairs.append(f"{self._name(j)} {how} for {self._name(i)}")
                    return True
        return False

    def _yields(self, i: int, j: int, moment: int) -> bool:
        """Plan arm `i` as if `j` were gone from `moment` on, then `j` again from there; whether both worked."""
        before = self.motions[j]
        self._until[j] = moment
        found = self._over(i, self.task.roadmaps[i])
        self._until[j] = self.task.most + 1
        if found is None:
            return False
        self._settle(i, found)
        ways = [before.path]
        if self.task.aside:
            ways += self._detours(j, before.path)
        again = self._over(j, ways, before.state(moment))
        if again is None:
            del self.motions[i]
            self._planned[i] = False
            return False
        steps = np.concatenate([before.until(moment), again.steps])
        self._settle(j, Motion(again.path, steps, again.stops))
        return True

    def _detours(self, j: int, path: Path) -> list[Path]:
        """`path`, then from its end over another place and back."""
        goal = path.configurations[-1]
        found = []
        for tail in sorted(self._round_trips(j, goal), key=lambda tail: tail.estimate):
            vertex = np.concatenate([path.vertex[:-1], [len(path.vertex) > 1], tail.vertex[1:]])
            way = np.concatenate([path.configurations, tail.configurations[1:]])
            found.append(Path(way, vertex, path.estimate + tail.estimate, path.through + 2))
        return found

    def _round_trips(self, j: int, goal: np.ndarray) -> list[Path]:
        task = self.task
        places = {tuple(c) for path in task.roadmaps[j] for c in path.configurations[path.vertex]}
        ways = [np.stack([goal, np.array(place), goal]) for place in sorted(places)]
        return [path for way in ways if (path := cut(task.plane, j, way, task.dt, task.most)) is not None]


def _still(at: np.ndarray) -> Path:
    return Path(np.array([at]), np.zeros(1, bool), 0.0, 0)
