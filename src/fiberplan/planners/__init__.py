"""Planners, one package a method, and the contract that each of them keeps.

`direct` (ours, the default), `greedy_fold` (Sayres2021), `navigation_function` (Makarem2014), `elliptic_navigation`
(Makarem2016) and `prioritized_roadmap` (Sabater2018) each open with a page: the algorithm in its own symbols, and which
file holds which line of it. `amending` changes one goal of a plan that exists, `homing` says who may look for its
joints' stops at the same time, `shared` holds what several use, and `protocol` is the contract as a type.

**A planner** is a frozen dataclass. Its fields are the method's settings, with units beside them and defaults that
work, best made by `protocol.setting`, so that the command line lists them; it refuses senseless ones with
`ProblemError`. It has a `name` (its key in `PLANNERS`), a `reference`, and one
method, `plan(problem) -> Plan`.

**What `plan` is given**: a `Problem` that is valid already, so start and goals are within ranges and clear of each
other by the margin. `problem.start` is (n, 2) [rad]; a NaN row of `problem.goal` (n, 2) means anywhere safe.

**What `plan` promises**, whatever becomes of the goals:

1. The trajectory begins at `problem.start`, keeps ranges and speeds (plan at `max_speed * UNDER_LIMIT`), and is
   certified by `fiberplan.verify` at `problem.margin`, complete or not. Offline positioners do not move. A search
   should keep `SLACK` more than the margin, so that the proof has room (`fiberplan.tolerances`). Accelerations and
   least speeds, where the plane has them, are left to `fiberplan.shaping.plan_for_motors`, which plans and shapes.
2. A positioner that cannot arrive is an outcome, never an error. An error is for what the method does not know at all,
   such as a kind of arm, and is raised before any work is done.
3. The same problem, settings and seed give the same plan, whatever the number of threads; every random choice comes
   from `seed`, and budgets count work, not seconds. A plan cut short by a clock or by Ctrl-C is marked `interrupted`.
4. One `Outcome` for every positioner, the first that fits: OFFLINE, DROPPED and NO_TARGET are settled by the problem
   (`plan.outcomes.settled_outcome`); ARRIVED if its fiber ends within `ARRIVAL` of its goal; INFEASIBLE only with a
   proof; DEADLOCKED otherwise, with `blockers` naming those in its path where they are known.

**How a trajectory is made**: knots (time, alpha, beta) for each positioner, even motion between them, rest before the
first and after the last. `Trajectory.from_samples` takes common times, `Trajectory.then` appends, the constructor takes
ragged arrays.

A whole planner, which the tests run::

    import numpy as np
    import fiberplan as fp
    from dataclasses import dataclass
    from fiberplan.plan.outcomes import settled_outcome
    from fiberplan.tolerances import UNDER_LIMIT

    @dataclass(frozen=True)
    class OneAfterTheOther:
        # each positioner in turn goes straight to its goal, if that is proven safe
        name = "one-after-the-other"
        reference = "an example"

        def plan(self, problem):
            plane, motion = problem.plane, fp.Trajectory.at_rest(problem.start)
            outcomes = [settled_outcome(problem, i) or fp.Outcome.DEADLOCKED for i in range(plane.n)]
            for i in np.flatnonzero(problem.has_goal):
                end = motion.end.copy()
                end[i] = problem.goal[i]
                seconds = max(0.01, np.max(np.abs(end - motion.end) / plane.max_speed) / UNDER_LIMIT)
                move = fp.Trajectory.from_samples([0.0, seconds], [motion.end, end])
                if fp.verify(plane, move, problem.margin).ok:
                    motion, outcomes[i] = motion.then(move), fp.Outcome.ARRIVED
            return fp.Plan(problem, motion, tuple(outcomes), self.name)

To be found by name, on the command line and in the tables of ``make bench-planners``, a planner is registered where it
is defined (``docs/architecture.md``). It then has to pass the suite of promises, `test_promises` in
``tests/test_planners.py``: all scenes there, for every setting listed in its `SETTINGS`.
"""

from fiberplan.planners.amending.one_goal import amend
from fiberplan.planners.direct import Direct
from fiberplan.planners.elliptic_navigation import EllipticNavigationFunction
from fiberplan.planners.greedy_fold import GreedyFold
from fiberplan.planners.homing import HomingGroups, homing_groups
from fiberplan.planners.navigation_function import NavigationFunction
from fiberplan.planners.prioritized_roadmap import PrioritizedRoadmap
from fiberplan.planners.protocol import PLANNERS, Planner
from fiberplan.planners.separating import separate

__all__ = [
    "PLANNERS",
    "Direct",
    "EllipticNavigationFunction",
    "GreedyFold",
    "HomingGroups",
    "NavigationFunction",
    "Planner",
    "PrioritizedRoadmap",
    "amend",
    "homing_groups",
    "separate",
]
