"""PrioritizedRoadmap: arms plan one after the other, each over its own roadmap (Sabater2018)."""

from dataclasses import asdict, dataclass
from time import process_time

import numpy as np

from fiberplan.arrays import in_units
from fiberplan.errors import ProblemError
from fiberplan.plan import Plan
from fiberplan.plan.outcomes import all_blockers
from fiberplan.planners.prioritized_roadmap.prioritized import Pass
from fiberplan.planners.prioritized_roadmap.run import Search, Settings
from fiberplan.planners.protocol import PLANNERS, setting
from fiberplan.planners.shared.prepared import prepared
from fiberplan.planners.shared.requirements import refuse_seed
from fiberplan.problem import Problem


@PLANNERS.register("prioritized-roadmap")
@dataclass(frozen=True)
class PrioritizedRoadmap:
    """Prioritized planning over roadmaps in joint space, with a limit on start-stops.

    Every step is shown clear as a whole, at every `collision_dt` or by the motion bound, so plans need no buffer for
    what happens between looks. On failure other priority orders are tried, and then the order that loses least is
    taken: whoever fails in it loses its target and retracts, or stays where it is. One that can do neither in any order
    is held from the beginning, and everyone plans around it.

    Raises:
        ProblemError: a setting that makes no sense; planning raises it for a step longer than the longest edge takes.
    """

    grid: tuple[int, int] = setting((8, 6), "cells of the roadmap over the two joint ranges")
    edges: int = setting(24, "random middle edges of a roadmap, at most")
    dt: float = setting(6.0, "step", "s")
    collision_dt: float = setting(0.1, "longest time that one collision check stands for", "s")
    max_stops: int = setting(1, "start-stops allowed for each arm")
    max_time: float = setting(120.0, "a motion takes less than this", "s")
    orders: int = setting(8, "priority orders tried before a target is dropped")
    garages: bool = setting(False, "an arm that fails may wait in a private garage")
    varying: bool = setting(
        False, "priorities may change in time: an arm that blocks another yields from some moment on"
    )
    aside: bool = setting(False, "an arm that has arrived may move aside and come back")
    continuous: bool = setting(False, "check as rarely as the motion bound allows, not every collision_dt")
    early_abort: bool = setting(False, "leave out searches that cannot succeed")
    seed: int = 0  #: of middle edges and priority orders

    name = "prioritized-roadmap"
    reference = "Sabater2018, sections 3 and 4"

    def __post_init__(self) -> None:
        refuse_seed(self.name, self.seed)

        def refuse(label: str, what: str) -> ProblemError:
            return ProblemError(f"prioritized-roadmap: {label} must be {what}, got {getattr(self, label)}")

        in_units(self, {"dt": "s", "collision_dt": "s", "max_time": "s"}, ProblemError)
        if isinstance(self.grid, str):  # as on the command line, "8x6"
            counts = [int(k) if k.isdigit() else 0 for k in self.grid.split("x")]
            object.__setattr__(self, "grid", tuple(counts))
        if len(self.grid) != 2 or not all(isinstance(k, int) and 1 <= k <= 1000 for k in self.grid):
            raise refuse("grid", "two counts from 1 to 1000")
        for label in ("dt", "collision_dt", "max_time"):
            if not (np.isfinite(getattr(self, label)) and getattr(self, label) > 0):
                raise refuse(label, "a time above 0 s")
        for label, least in (("edges", 0), ("max_stops", 0), ("orders", 1)):
            if not getattr(self, label) >= least:
                raise refuse(label, f"{least} or more")
        if self.collision_dt > self.dt:
            raise refuse("collision_dt", f"at most the step, {self.dt:g} s")
        if self.dt >= self.max_time:
            raise refuse("dt", f"less than max_time, {self.max_time:g} s")

    @prepared
    def plan(self, problem: Problem) -> Plan:
        """A motion in which whoever could be planned arrives, with start-stops within the limit."""
        begun = process_time()
        search = self.search(problem)
        done = search.run()
        return self.plan_of(search, done, process_time() - begun)

    def search(self, problem: Problem) -> Search:
        """A search for such a motion that has not begun."""
        return Search(Settings(**asdict(self)), problem)

    def plan_of(self, search: Search, done: Pass, seconds: float) -> Plan:
        """The plan that a pass without failures makes.

        Args:
            search: what was searched, and who was given up before.
            done: the pass.
            seconds: of CPU that all this took [s].
        """
        problem = search.problem
        return Plan(
            problem=problem,
            trajectory=search.motion(done),
            outcomes=tuple(search.outcome(i) for i in range(problem.n)),
            planner=self.name,
            parameters=asdict(self),
            seed=self.seed,
            blockers=all_blockers(problem, search.lost),
            timings={"search": seconds},
            notes=(*problem.notes, *search.notes(done)),
        )
