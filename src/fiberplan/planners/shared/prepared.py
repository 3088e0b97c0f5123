"""What every planner is spared: starts nearer than the margin, and arms whose place is not quite known.

`prepared` goes around a planner's `plan`. The planner is given a problem whose start it can begin with, among bodies
that are thicker by the position errors; what it returns is put behind the motion that opened the start.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.plan.outcomes import all_blockers, settled_outcome
from fiberplan.planners.shared.opening import Opened, opened
from fiberplan.problem import Problem

_Method = TypeVar("_Method", bound=Callable[..., Plan])


def prepared(method: _Method) -> _Method:
    """A planner's `plan` for problems as they come."""

    @functools.wraps(method)
    def plan(self: Any, problem: Problem, *arguments: Any, **options: Any) -> Plan:
        if not problem.needs_opening:
            if problem.roomy is problem.plane:
                return method(self, problem, *arguments, **options)
            opening = Opened(Trajectory.at_rest(problem.start))
        else:
            opening = opened(problem.roomy, problem.start, problem.margin, options.get("report"))
        found = method(self, _from_there(problem, opening), *arguments, **options)
        return _whole(problem, opening, found, getattr(self, "max_time", None) is not None)

    return plan  # type: ignore[return-value]


def _from_there(problem: Problem, opening: Opened) -> Problem:
    """The rest of the problem: who is wedged stays, and goals that touch it there are dropped."""
    plane, goal = problem.roomy, np.array(problem.goal)
    if opening.wedged:
        stay = np.zeros(plane.n, bool)
        stay[[arm for i, others in opening.wedged.items() for arm in (i, *others) if arm < plane.n]] = True
        plane, goal[stay] = plane.replace(online=plane.online & ~stay), np.nan
    return Problem(
        plane,
        start=opening.motion.end,
        goal=goal,
        margin=problem.margin,
        priority=problem.priority,
        conflicts="drop",
        alternatives=problem.alternatives,
    )


def _whole(problem: Problem, opening: Opened, found: Plan, timed: bool) -> Plan:
    """The plan of the whole problem."""
    plane, public = problem.plane, problem.plane.public
    blockers = {i: tuple(map(public, others)) for i, others in opening.wedged.items()}
    stays = ~found.problem.plane.online & plane.online

    def outcome(i: int) -> Outcome:
        settled = settled_outcome(problem, i)
        if i in opening.wedged and settled is not Outcome.OFFLINE and settled is not Outcome.DROPPED:
            return Outcome.DEADLOCKED
        if settled is not None:
            return settled
        if stays[i]:
            return Outcome.DEADLOCKED
        late = timed and found.outcomes[i] is Outcome.INFEASIBLE  # the time that opening took proves nothing
        return Outcome.DEADLOCKED if late else found.outcomes[i]

    seconds = opening.motion.duration
    notes = [f"the start is opened first, in {seconds:.3f} s"] if seconds else []
    if opening.wedged:
        notes.append("wedged, and left where they stand: " + ", ".join(plane.ids[i] for i in sorted(opening.wedged)))
    return dataclasses.replace(
        found,
        problem=problem,
        trajectory=opening.motion.then(found.trajectory),
        outcomes=tuple(outcome(i) for i in range(problem.n)),
        blockers=all_blockers(problem, dict(found.blockers) | blockers),
        notes=(*problem.notes, *notes, *(note for note in found.notes if note not in problem.notes)),
    )
