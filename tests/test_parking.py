"""Who is parked, where, and that nobody is where it costs a target: planners that are asked and answer by hand."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan import Outcome
from fiberplan.errors import ProblemError
from fiberplan.planners.parking import plan_with_parking
from fiberplan.scenes.decisive import row

pytestmark = pytest.mark.small
START = np.radians([[150.0, 120.0], [30.0, 120.0]])
GOAL = np.radians([[180.0, 90.0], [np.nan, np.nan]])  #: the second is idle
ASIDE = np.radians([0.0, 150.0])


def planner(*loses, stays=()):
    """A planner that gives up `loses` whenever the second has a goal, and moves everyone else but `stays`."""

    def plan(problem):
        lost = [i for i in loses if not np.isnan(problem.goal[1, 0])]
        still = np.isnan(problem.goal[:, 0]) | np.isin(np.arange(2), [*lost, *stays])
        end = np.where(still[:, None], problem.start, problem.goal)
        outcomes = [Outcome.NO_TARGET if np.isnan(a) else Outcome.ARRIVED for a in problem.goal[:, 0]]
        for i in (*lost, *stays):
            outcomes[i] = Outcome.DEADLOCKED
        motion = fp.Trajectory.from_samples([0.0, 9.0], np.stack([problem.start, end]))
        return fp.Plan(problem, motion, tuple(outcomes), "by hand", blockers=dict.fromkeys((*lost, *stays), ()))

    return plan


@pytest.mark.parametrize(("at", "where"), [(None, "folded"), (ASIDE, "where they were sent")])
def test_the_idle_go_where_they_are_parked_and_have_no_target_all_the_same(at, where):
    problem = fp.Problem(row(2), START, GOAL)
    plan = plan_with_parking(planner(), problem, at)
    assert plan.problem is problem
    assert plan.outcomes == (Outcome.ARRIVED, Outcome.NO_TARGET)
    np.testing.assert_allclose(plan.trajectory.end[1], problem.plane.folded[1] if at is None else at)
    assert plan.notes == (f"parked: 1 of 1 without a target are {where}",)


def test_who_could_not_be_parked_is_named():
    plan = plan_with_parking(planner(stays=(1,)), fp.Problem(row(2), START, GOAL))
    assert plan.outcomes == (Outcome.ARRIVED, Outcome.NO_TARGET)
    assert plan.blockers == {}
    assert plan.notes[-2:] == ("parked: 0 of 1 without a target are folded", "not parked: P1")


def test_nobody_is_parked_where_that_costs_a_target():
    plan = plan_with_parking(planner(0), fp.Problem(row(2), START, GOAL))
    assert plan.outcomes == (Outcome.ARRIVED, Outcome.NO_TARGET)
    np.testing.assert_array_equal(plan.trajectory.end[1], START[1])
    assert plan.notes == ("nobody is parked: that would cost a target",)


def test_without_idle_arms_it_is_the_plan():
    problem = fp.Problem(row(2), START, START)
    asked = []
    plan = plan_with_parking(lambda problem: asked.append(problem) or planner()(problem), problem)
    assert asked == [problem]
    assert plan.notes == ()


@pytest.mark.parametrize("at", [[0.0], [np.nan, 0.0]])
def test_places_that_are_none_are_refused(at):
    with pytest.raises(ProblemError, match=r"park at .* deg: two finite angles are wanted"):
        plan_with_parking(planner(), fp.Problem(row(2), START, GOAL), at)
