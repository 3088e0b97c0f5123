"""The motion in the loop: whoever is lost on the way loses its target to another, and all is planned again.

A plan that loses a positioner names those in its way. Its option and that of the first of them are ruled out together,
as if they touched; around them the choice is made anew, everything else standing as it is; and the motion is planned
again. What is ruled out stays so, and there are finitely many pairs; an option that nobody with a target was in the way
of, or that is lost after a few rounds, is ruled out alone.

When all arrive, two that alone set how long it takes, since they have to get past each other, are parted in the same
way, as long as that costs no priority and the motion gets shorter.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from fiberplan.plan import Outcome, Plan
from fiberplan.planners.protocol import Planner
from fiberplan.problem import Problem, Targets
from fiberplan.survey.catalogue import Catalogue
from fiberplan.survey.choices import Choices
from fiberplan.survey.conflicts import ConflictTable
from fiberplan.survey.local_search import local_search

_JOINTLY = 8  #: rounds in which pairs are ruled out; after that, single options
_SAME = 0.01  #: part of a time by which another has to differ to be another
_ROUNDS = 30  #: after which whoever is still lost has no target
_SHORTER = 5  #: times that two who set how long it takes are parted
_TRIES = 200  #: steps of local search for each option around a loss


class Arrived(NamedTuple):
    """A set of options that all arrive."""

    chosen: np.ndarray  #: options, in rising order
    choices: Choices  #: with what was ruled out
    plan: Plan | None
    rounds: int  #: times that was planned


def targets_of(there: Problem, catalogue: Catalogue, table: ConflictTable, chosen: np.ndarray) -> Targets | None:
    """The targets of these options as a plan takes them, with the angles that were found not to touch; None if none."""
    if not len(chosen):
        return None
    rows = table.options.target[chosen]
    fiber = catalogue.fiber
    assert fiber is not None  # set on construction
    return Targets(
        x=catalogue.x[rows],
        y=catalogue.y[rows],
        positioner=tuple(there.plane.ids[i] for i in table.options.positioner[chosen]),
        priority=catalogue.priority[rows],
        fiber=tuple(fiber[row] for row in rows.tolist()) if any(fiber) else None,
        angles=table.options.angles[chosen],
        source=catalogue.source,
        rows=tuple(catalogue.rows[row] for row in rows.tolist()),
    )


def goals_of(there: Problem, catalogue: Catalogue, table: ConflictTable, chosen: np.ndarray) -> Problem:
    """The problem of bringing everyone to these options, from where they stand."""
    goal, priority = np.full((there.n, 2), np.nan), np.ones(there.n)
    who = table.options.positioner[chosen]
    goal[who], priority[who] = table.options.angles[chosen], catalogue.priority[table.options.target[chosen]]
    return dataclasses.replace(there, goal=goal, priority=priority, conflicts="drop")


def arriving(
    there: Problem,
    catalogue: Catalogue,
    table: ConflictTable,
    choices: Choices,
    chosen: np.ndarray,
    planner: Planner,
    seed: int,
) -> Arrived:
    """Plan the motion to `chosen`, and choose again around whoever is lost until nobody is."""
    for rounds in range(1, _ROUNDS + 1):
        plan = planner.plan(goals_of(there, catalogue, table, chosen))
        lost = chosen[np.isin(choices.robot[chosen], plan.lost)]
        if not len(lost):
            break
        pairs = [_ruled_out(plan, choices, chosen, v, rounds <= _JOINTLY) for v in lost.tolist()]
        choices = choices.without(np.array(pairs, np.int64))
        chosen = _chosen_again(there, choices, chosen, lost, seed)
    arrived = ~np.isin(choices.robot[chosen], plan.lost)  # whoever the last round lost has nothing
    found = Arrived(chosen[arrived], choices, plan, rounds)
    return found if len(plan.lost) else _shortened(there, catalogue, table, found, planner, seed)


def _chosen_again(there: Problem, choices: Choices, chosen: np.ndarray, last: np.ndarray, seed: int) -> np.ndarray:
    """The choice `chosen` made anew around the options `last`, which come in again if there is room for them."""
    kept_first = np.concatenate([np.setdiff1d(chosen, last), last])
    near = _around(there, choices, choices.robot[last])
    return local_search(choices, _TRIES * len(near), seed, begin=kept_first, around=near)


def _shortened(
    there: Problem, catalogue: Catalogue, table: ConflictTable, found: Arrived, planner: Planner, seed: int
) -> Arrived:
    """The same priority in less time, if those who set the time, being two in each other's way, can be parted."""
    choices, plan = found.choices, found.plan
    assert plan is not None  # it is planned before it is shortened
    for _ in range(_SHORTER):
        others = [bound for bound in plan.bounds if bound.kind != "kinematic"]
        longest = max(others, key=lambda bound: bound.seconds, default=None)
        if longest is None or longest.seconds < plan.makespan * (1 - _SAME) or plan.interrupted:
            break
        setting = found.chosen[np.isin(choices.robot[found.chosen], longest.positioners)]
        if not len(setting):
            break
        choices = choices.without(setting[[0, -1]][None])
        ways = [_chosen_again(there, choices, found.chosen, one, seed) for one in (setting[:1], setting[-1:])]
        chosen = max(ways, key=lambda way: tuple(found.choices.weight[way].sum(axis=0)))
        if _worth(found.choices, chosen) < _worth(found.choices, found.chosen):
            break
        other = planner.plan(goals_of(there, catalogue, table, chosen))
        found = found._replace(rounds=found.rounds + 1)
        if len(other.lost) or other.interrupted or other.makespan > plan.makespan * (1 - _SAME):
            break
        plan = other
        found = found._replace(chosen=chosen, plan=plan)
    return found


def _worth(choices: Choices, chosen: np.ndarray) -> tuple[int, ...]:
    """Totals of all levels but motion."""
    return tuple(choices.weight[chosen, :-1].sum(axis=0).tolist())


def _ruled_out(plan: Plan, choices: Choices, chosen: np.ndarray, v: int, jointly: bool) -> tuple[int, int]:
    """The option v, which was lost, and that of the first who was in its way; v twice: it is ruled out alone."""
    i = int(choices.robot[v])
    by_robot = dict(zip(choices.robot[chosen].tolist(), chosen.tolist(), strict=True))
    others = [by_robot[j] for j in plan.blockers.get(i, ()) if j in by_robot and j != i]
    if not jointly or plan.outcomes[i] is Outcome.INFEASIBLE or not others:
        return v, v
    return v, others[0]


def _around(there: Problem, choices: Choices, robots: np.ndarray) -> np.ndarray:
    """Options of these positioners and of all that could touch them."""
    pairs = there.plane.pairs_within(there.margin)
    inside = np.zeros(there.n, bool)
    inside[robots] = True
    beside = inside[pairs].any(axis=1)
    inside[pairs[beside].ravel()] = True
    return np.flatnonzero(inside[choices.robot])
