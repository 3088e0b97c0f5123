"""Every planner on two or three coarse arms: with the compiler off these run in seconds, kernels and all.

Only limits that Python code reads are lowered here; those in kernels are compiled in, and kept on disk.
"""

from functools import partial

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.plan import Outcome
from fiberplan.planners import PLANNERS, amend
from fiberplan.planners.amending import rerouting
from fiberplan.planners.direct import planner as direct_planner
from fiberplan.planners.direct import search, untangle
from fiberplan.planners.direct.search import DirectSearch
from fiberplan.planners.direct.settling import give_up_one_of
from fiberplan.planners.greedy_fold import joint_relief
from fiberplan.planners.shared import joint_paths
from fiberplan.planners.shared.rrt_connect import joint_path
from fiberplan.problem.resting import place_the_rest
from fiberplan.scenes.decisive import aside, exchange, pinwheel, row
from problems import narrow_exchange

pytestmark = pytest.mark.small
FIELD = {"D": 6.0, "d": 3.0, "dt": 0.1}
COARSE = {"step": np.radians(5.0), "max_travel": np.radians(300.0)}
ROADMAP = {"grid": (2, 2), "edges": 4, "dt": 2.0, "collision_dt": 1.0, "max_time": 16.0, "orders": 1}
TURN = np.radians(30.0)


def stiff(priority=(5.0, 1.0)):
    """Either of two arms gets there, but the last one finds the other in its path."""
    ranges = {"lower": np.radians([[-90.0, 0.0], [40.0, 0.0]]), "upper": np.radians([[140.0, 1.0], [270.0, 1.0]])}
    plane = row(2).replace(folded=np.radians([[80.0, 0.0], [100.0, 0.0]]), **ranges)
    return fp.Problem(plane, plane.folded, np.radians([[-80.0, 0.0], [260.0, 0.0]]), priority=np.array(priority))


def beside():
    """Two arms that turn a little, each on its own side."""
    start = np.radians([[150.0, 120.0], [30.0, 120.0]])
    return fp.Problem(row(2), start, start + np.radians([[40.0, -30.0], [-20.0, 30.0]]))


@pytest.fixture
def impatient(monkeypatch):
    """More steps, joint paths and losses come after a few replans; joint searches are short."""
    for name, few in (("_CHUNK", 5), ("PATIENCE", 5), ("_SECOND_WIND", 5)):
        monkeypatch.setattr(search, name, few)
    monkeypatch.setattr(direct_planner, "_HUB_STEP", np.radians(15.0))
    monkeypatch.setattr(direct_planner, "_LEAST_WORK", 20)
    monkeypatch.setattr(untangle, "_DRAWS", 1)
    monkeypatch.setattr(untangle, "_NODES", 20)
    monkeypatch.setattr(joint_relief, "joint_path", partial(joint_path, most=10))


def arrives(plan):
    assert plan.faults() == []
    assert set(plan.outcomes) == {Outcome.ARRIVED}
    assert plan.makespan >= plan.lower_bound * (1.0 - 1e-9)
    np.testing.assert_allclose(plan.trajectory.end, plan.problem.goal, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("greedy-fold", COARSE),
        ("navigation-function", FIELD),
        ("elliptic-navigation-function", {"dt": 0.25}),
    ],
    ids=["greedy-fold", "navigation-function", "elliptic-navigation-function"],
)
def test_two_exchange_sides(name, settings):
    arrives(PLANNERS[name](**settings).plan(exchange()))


def test_direct_takes_two_past_each_other_in_the_time_that_they_need():
    """Exactly the bound of the pair, which is more than their joints need."""
    plan = fp.planners.Direct(turn=np.radians(45.0)).plan(narrow_exchange())
    arrives(plan)
    (bound,) = plan.bounds
    assert (bound.kind, bound.positioners) == ("pair", (0, 1))
    assert plan.makespan == pytest.approx(bound.seconds)
    assert plan.makespan > 1.1 * plan.lower_bound


def test_one_leaves_its_target_to_let_the_other_pass():
    """By yielding, whether it gets there itself or has to be searched for in the end."""
    plan = fp.planners.NavigationFunction(**FIELD).plan(aside())
    arrives(plan)
    place = plan.problem.goal[0]
    assert max(np.abs(plan.trajectory.at(t)[0] - place).max() for t in np.linspace(0.0, plan.makespan, 50)) > 0.4


@pytest.mark.large
def test_those_who_only_get_there_together_are_searched_for_jointly():
    problem = aside()
    near = Neighbourhood.of(problem.plane, problem.margin)
    search = DirectSearch(problem, near, problem.goal, TURN, None, 3)
    search.begin()
    assert search.touching == 1
    assert search._untangle(search.in_contact, 2, 2) == 0  # no path of so few steps
    steps = search.steps
    assert search._untangle(search.in_contact, 2, 60) == 2
    assert search.touching == 0
    assert search.steps > steps
    np.testing.assert_allclose(search.lattice.path[:2, -1], problem.goal)
    give_up_one_of(search, 0)
    assert search.given_up == {0: (1,)}
    assert np.isnan(search.goal[0]).all()


@pytest.mark.parametrize("stuck", [[0, 1], [1]], ids=["both", "one, which the other has to make room for"])
def test_ways_of_the_stuck_are_put_behind_the_motion(stuck, monkeypatch):
    monkeypatch.setattr(joint_paths, "joint_path", partial(joint_path, most=40))
    problem = aside()
    near = Neighbourhood.of(problem.plane, problem.margin)
    before = fp.Trajectory.from_samples([0.0, 1.0], np.stack([problem.start] * 2))
    motion = joint_paths.append_joint_ways(problem, near, before, problem.goal, np.array(stuck), 3)
    np.testing.assert_allclose(motion.end, problem.goal)
    np.testing.assert_array_equal(motion.at(1.0), problem.start)
    assert fp.verify(problem.plane, motion).ok
    nowhere = joint_paths.append_joint_ways(problem, near, before, problem.start, np.array(stuck), 3)
    assert nowhere is before  # they are there


def test_places_to_rest():
    """Folded where that is clear, else the next clear place, else where it stands."""
    plane = row(2)
    over = np.radians([[0.0, 0.0], [np.nan, np.nan]])  # stretched over where the other would be folded
    near = Neighbourhood.of(plane, 0.5)
    end, nowhere = place_the_rest(plane, over, plane.folded, near, 0.5)
    assert not len(nowhere)
    assert np.abs(end[1] - plane.folded[1]).max() > 0.1
    assert plane.clearance(end).min() >= 0.5
    free, _ = place_the_rest(plane, np.radians([[180.0, 90.0], [np.nan, np.nan]]), plane.folded, near, 0.5)
    np.testing.assert_array_equal(free[1], plane.folded[1])
    stiff = plane.replace(lower=plane.folded, upper=plane.folded)
    end, nowhere = place_the_rest(stiff, over, stiff.folded, near, 0.5)
    assert nowhere.tolist() == [1]
    np.testing.assert_array_equal(end[1], stiff.folded[1])


def test_three_lean_the_other_way():
    plan = fp.planners.GreedyFold(**COARSE).plan(pinwheel())
    assert plan.faults() == []


@pytest.mark.parametrize("name", PLANNERS)
def test_two_that_need_not_care(name):
    settings = {"direct": {"turn": TURN}, "greedy-fold": COARSE, "navigation-function": FIELD}
    settings |= {"elliptic-navigation-function": {"dt": 0.25}, "prioritized-roadmap": ROADMAP}
    arrives(PLANNERS[name](**settings[name]).plan(beside()))


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("relief", ["none", "reverse", "replace", "joint"])
def test_whoever_folds_last_is_given_up_by_name(relief):
    plan = fp.planners.GreedyFold(relief=relief, **COARSE).plan(stiff())
    assert plan.faults() == []
    assert plan.certificate.ok
    assert len(plan.lost)
    for i in plan.lost.tolist():
        assert plan.blockers[i] == (1 - i,)


@pytest.mark.usefixtures("impatient")
def test_direct_gives_up_the_one_that_matters_less():
    plan = fp.planners.Direct(turn=TURN).plan(stiff())
    assert plan.faults() == []
    assert plan.outcomes == (Outcome.ARRIVED, Outcome.INFEASIBLE)
    assert plan.blockers == {1: (0,)}


@pytest.mark.usefixtures("impatient")
def test_direct_stopped_is_safe():
    def report(words):
        assert "2 targets kept" in words
        raise KeyboardInterrupt

    plan = fp.planners.Direct(turn=TURN).plan(stiff(), report=report)
    assert plan.interrupted
    assert plan.certificate.ok


@pytest.mark.parametrize("option", ["garages", "varying", "aside", "continuous", "early_abort"])
def test_roadmaps_of_two_that_are_in_each_others_path(option):
    plan = fp.planners.PrioritizedRoadmap(**ROADMAP | {option: True}).plan(exchange())
    assert plan.faults() == []
    assert plan.certificate.ok
    assert plan.makespan < ROADMAP["max_time"]


@pytest.mark.parametrize("relief", ["none", "layers"])
def test_fields_of_two_that_are_in_each_others_path(relief):
    planner = fp.planners.EllipticNavigationFunction(relief=relief, dt=0.25, max_time=10.0)
    plan = planner.plan(stiff())
    assert plan.faults() == []
    assert plan.certificate.ok


def test_the_field_as_printed():
    plan = fp.planners.NavigationFunction(mode="literal", **FIELD).plan(beside())
    assert plan.faults() == []
    away = np.hypot(*(plan.problem.plane.fibers(plan.trajectory.end) - plan.problem.plane.fibers(plan.problem.goal)).T)
    assert (away < 0.2).all()


def test_one_goal_changes(monkeypatch):
    """The other moves as before, to the last bit."""
    monkeypatch.setattr(rerouting, "_TURN", TURN)
    monkeypatch.setattr(rerouting, "_FEWEST_STEPS", 4)
    before = fp.planners.GreedyFold(**COARSE).plan(beside())
    goal = before.problem.goal[1] + np.radians([10.0, 10.0])
    after = amend(before, 1, goal)
    assert after.faults() == []
    np.testing.assert_array_equal(after.trajectory.end[1], goal)
    np.testing.assert_array_equal(after.trajectory.select([0]).angles, before.trajectory.select([0]).angles)
