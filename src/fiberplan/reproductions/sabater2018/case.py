"""One plan in detail: what the paper gives in its Tables 1 and 2."""

from dataclasses import dataclass
from time import process_time

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.plan import Plan
from fiberplan.planners.prioritized_roadmap.planner import PrioritizedRoadmap
from fiberplan.problem import Problem
from fiberplan.reproductions.sabater2018.trials import MARGIN

LONGEST = 19  # steps of the paper's longest arm


@dataclass(frozen=True)
class ArmRow:
    """One arm, in the order of planning."""

    name: str
    steps: int  #: of its path
    waits: int  #: steps of standing still before it arrives
    stops: int
    paths: int  #: in its roadmap
    checks: int  #: pair checks, in the paper's unit
    unobstructed: int  #: pair checks if nothing had been in the way: 60 n + 2 with each arm before it
    edges: int  #: of the path taken


@dataclass(frozen=True, eq=False)
class Case:
    """The detailed case."""

    plan: Plan
    computing: float  #: [s]
    checks: int
    rest_checks: int
    arms: tuple[ArmRow, ...]


def detailed(plane: FocalPlane, goals: list[np.ndarray], planner: PrioritizedRoadmap) -> Case:
    """The first plan from park in which everyone arrives and the longest arm takes as many steps as the paper's.

    If there is none such, the one that comes nearest.
    """
    best: Case | None = None
    for goal in goals:
        case = _solve(Problem(plane, plane.folded, goal, MARGIN), planner)
        if len(case.plan.lost):
            continue
        if best is None or _off(case) < _off(best):
            best = case
        if not _off(best):
            break
    if best is None:
        raise RuntimeError("no plan from park was solved in one pass")
    return best


def _off(case: Case) -> int:
    return abs(max(arm.steps for arm in case.arms) - LONGEST)


def _solve(problem: Problem, planner: PrioritizedRoadmap) -> Case:
    begun = process_time()
    search = planner.search(problem)
    done = search.run()
    computing = process_time() - begun
    looks = int(np.ceil(planner.dt / planner.collision_dt - 1e-9))
    rows = []
    for before, (i, motion) in enumerate(done.motions.items()):
        steps = len(motion.path.vertex) - 1
        rows.append(
            ArmRow(
                name=problem.plane.ids[i],
                steps=steps,
                waits=motion.arrival - steps,
                stops=motion.stops,
                paths=len(search.roadmap(i, problem.goal[i])) if not np.isnan(problem.goal[i, 0]) else 0,
                checks=done.checks[i],
                unobstructed=before * (looks * steps + 2),
                edges=1 + motion.path.through,
            )
        )
    plan = planner.plan_of(search, done, computing)
    return Case(plan, computing, search.checks, search.rest_checks, tuple(rows))
