"""Plans from park and plans chained, by the paper's planner and with what it leaves for later."""

from dataclasses import dataclass, replace
from time import process_time

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion.moves import start_stops
from fiberplan.plan import Plan
from fiberplan.planners.prioritized_roadmap import PrioritizedRoadmap
from fiberplan.problem import Problem
from fiberplan.scenes.assigned import assignment_plan

MARGIN = 1.0  #: for timing and tolerance, between arms [mm]
PAPER = PrioritizedRoadmap(orders=1)
REPLANNING = replace(PAPER, orders=12, garages=True)
CONTINUOUS = replace(PAPER, continuous=True)


@dataclass(frozen=True)
class Trial:
    """What became of one plan."""

    number: int
    solved: bool  #: every target is reached
    proven: bool
    stops: int  #: most start-stops of any arm
    time: float  #: configuration time [s]
    computing: float  #: CPU [s]
    losses: tuple[str, ...]  #: arm and cause


def fields(plane: FocalPlane, seeds: range) -> list[np.ndarray]:
    """Goals (n, 2) of one assignment plan a seed [rad]."""
    return [assignment_plan(plane, seed, margin=MARGIN).configuration(plane) for seed in seeds]


def run(plane: FocalPlane, goals: list[np.ndarray], planner: PrioritizedRoadmap, chained: bool) -> list[Trial]:
    """Plan each of `goals` from park, or all but the first from the one before."""
    starts = goals[:-1] if chained else [plane.folded] * len(goals)
    ends = goals[1:] if chained else goals
    return [
        trial(k, Problem(plane, start, end, MARGIN), planner)
        for k, (start, end) in enumerate(zip(starts, ends, strict=True))
    ]


def trial(number: int, problem: Problem, planner: PrioritizedRoadmap) -> Trial:
    """Plan once, and judge."""
    begun = process_time()
    plan = planner.plan(problem)
    computing = process_time() - begun
    return Trial(
        number=number,
        solved=not len(plan.lost) and plan.makespan < planner.max_time,
        proven=not plan.faults(),
        stops=int(start_stops(plan.trajectory).max()),
        time=plan.makespan,
        computing=computing,
        losses=tuple(_loss(plan, int(i)) for i in plan.lost),
    )


def _loss(plan: Plan, i: int) -> str:
    """Arm, cause and who was in the way."""
    plane = plan.problem.plane
    who = [plane.ids[b] for b in plan.blockers.get(i, ())[:3] if b >= 0]
    return f"{plane.ids[i]}, " + (f"in the way: {', '.join(who)}" if who else "no way in time, or its place is taken")
