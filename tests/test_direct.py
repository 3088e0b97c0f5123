"""What the direct planner promises beyond what all planners do: close to the bound, and losses with their causes."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.plan import Outcome
from fiberplan.planners.direct.search import DirectSearch
from fiberplan.scenes.decisive import pinwheel, row
from fiberplan.scenes.uniform import uniform_field
from problems import field_to_field, hexagon

DEG = np.pi / 180.0


@pytest.mark.parametrize("margin", [0.0, 1.0])
def test_straight_is_close_to_the_bound(margin):
    """Everyone arrives, in much less than by way of folded."""
    for seed in range(3):
        problem = field_to_field(margin, rings=5, seed=seed)
        plan = fp.planners.Direct().plan(problem)
        assert plan.faults() == []
        assert len(plan.lost) == 0
        hub = fp.planners.GreedyFold(step=1.0 * DEG).plan(problem)
        assert plan.lower_bound <= plan.makespan < 0.7 * hub.makespan


def test_few_knots_and_no_dithering():
    problem = field_to_field(1.0, rings=5)
    plan = fp.planners.Direct().plan(problem)
    assert len(plan.trajectory.times) < 7 * problem.n
    owner = np.repeat(np.arange(problem.n), np.diff(plan.trajectory.offsets))
    same = owner[1:] == owner[:-1]
    turns = np.diff(plan.trajectory.angles, axis=0)
    reversals = np.zeros((problem.n, 2), int)
    for d in (0, 1):
        for i in range(problem.n):
            own = turns[same & (owner[1:] == i), d]
            signs = np.sign(own[np.abs(own) > 1e-12])
            reversals[i, d] = (signs[1:] != signs[:-1]).sum()
    assert np.median(reversals) <= 1
    assert reversals.max() <= 6


def test_a_lone_positioner_takes_exactly_its_time():
    """No detour, no rounding up to whole steps."""
    plane = fp.FocalPlane.hexagonal(0, 22.4)
    problem = fp.Problem(plane, np.radians([[10.0, 100.0]]), np.radians([[343.3, 17.7]]))
    plan = fp.planners.Direct().plan(problem)
    assert plan.makespan == pytest.approx(plan.lower_bound, rel=1e-8)
    assert len(plan.trajectory.times) <= 3


def test_standing_still():
    plane = hexagon()
    plan = fp.planners.Direct().plan(fp.Problem(plane, plane.folded, plane.folded))
    assert plan.makespan == 0.0
    assert set(plan.outcomes) == {Outcome.ARRIVED}
    nobody = fp.planners.Direct().plan(fp.Problem(plane, plane.folded, np.full((plane.n, 2), np.nan)))
    assert nobody.makespan == 0.0
    assert set(nobody.outcomes) == {Outcome.NO_TARGET}


def test_one_without_a_goal_makes_room():
    """It stands across the other's goal; it has to go, anywhere."""
    plane = row(2)
    start = np.radians([[120.0, 60.0], [180.0, 0.0]])
    goal = np.radians([[0.0, 0.0], [np.nan, np.nan]])
    problem = fp.Problem(plane, start, goal)
    plan = fp.planners.Direct().plan(problem)
    assert plan.faults() == []
    assert plan.outcomes == (Outcome.ARRIVED, Outcome.NO_TARGET)
    assert np.abs(plan.trajectory.end[1] - start[1]).max() > 10 * DEG


def test_one_without_a_goal_stays_where_it_is_in_nobodys_way():
    plane = row(2)
    start = np.radians([[120.0, 60.0], [0.0, 60.0]])
    goal = np.radians([[150.0, 90.0], [np.nan, np.nan]])
    plan = fp.planners.Direct().plan(fp.Problem(plane, start, goal))
    np.testing.assert_array_equal(plan.trajectory.end[1], start[1])


def behind_posts():
    """The left one's goal lies in a pocket that no way leads into; the right one's does not."""
    posts = tuple(Obstacle(f"post {x:g} {y:g}", [[x, y]], 1.0) for x in (-7.0, 7.0) for y in (-2.51, 2.51))
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(obstacles=posts)
    return fp.Problem(plane, plane.folded, np.radians([[90.0, 20.0]]))


def test_no_way_past_obstacles_is_given_up_with_their_names():
    plan = fp.planners.Direct().plan(behind_posts())
    assert plan.outcomes == (Outcome.INFEASIBLE,)
    assert "proven barred" in plan.notes[-1]
    assert plan.lost.tolist() == [0]
    assert plan.faults() == []
    assert plan.blockers[0]
    assert all(b < 0 for b in plan.blockers[0])


@pytest.mark.parametrize("valued", [0, 1])
def test_the_one_that_matters_less_is_given_up(valued):
    """Stiff arms that sweep the same sector: either gets there, but the last one finds the other in its way."""
    ranges = {"lower": np.radians([[-90.0, 0.0], [40.0, 0.0]]), "upper": np.radians([[140.0, 1.0], [270.0, 1.0]])}
    plane = row(2).replace(folded=np.radians([[80.0, 0.0], [100.0, 0.0]]), **ranges)
    goal = np.radians([[-80.0, 0.0], [260.0, 0.0]])
    for alone in (0, 1):
        only = np.where((np.arange(2) == alone)[:, None], goal, np.nan)
        plan = fp.planners.Direct().plan(fp.Problem(plane, plane.folded, only))
        assert plan.outcomes[alone] is Outcome.ARRIVED
    priority = np.where(np.arange(2) == valued, 5.0, 1.0)
    plan = fp.planners.Direct().plan(fp.Problem(plane, plane.folded, goal, priority=priority))
    assert plan.faults() == []
    assert plan.outcomes[valued] is Outcome.ARRIVED
    assert plan.outcomes[1 - valued] is Outcome.DEADLOCKED
    assert plan.blockers == {1 - valued: (valued,)}


def test_max_time_caps_the_makespan():
    """Who cannot be there in time is proven unable, by its speed alone; the others arrive."""
    problem = field_to_field(rings=2)
    full = fp.planners.Direct().plan(problem)
    cap = 0.8 * full.lower_bound
    plan = fp.planners.Direct(max_time=cap).plan(problem)
    assert plan.makespan <= cap + 1e-9
    assert plan.faults() == []
    travel = (np.abs(problem.goal - problem.start) / problem.plane.max_speed).max(axis=1)
    np.testing.assert_array_equal(plan.having(Outcome.INFEASIBLE), np.flatnonzero(travel > cap))
    assert any("within" in note for note in plan.notes)
    assert len(plan.having(Outcome.ARRIVED)) > 0.5 * problem.n


def with_alternatives(extra):
    """One positioner whose target has a far solution, stated, and others."""
    plane = row(2).replace(lower=np.radians([[0.0, -180.0]] * 2), upper=np.radians([[400.0, 180.0]] * 2))
    start = np.radians([[0.0, 90.0], [0.0, 90.0]])
    goal = np.radians([[370.0, 60.0], [20.0, 90.0]])
    return plane, start, goal, np.radians(np.array(extra, float))


def test_wraps_and_parities_shorten_the_move():
    """Alpha may turn beyond 360 deg, so 370 and 10 deg are one direction; the nearer is taken."""
    plane, start, goal, _ = with_alternatives([[0.0, 0.0]])
    others = np.radians([[[10.0, 60.0]], [[np.nan, np.nan]]])
    long = fp.planners.Direct().plan(fp.Problem(plane, start, goal))
    short = fp.planners.Direct().plan(fp.Problem(plane, start, goal, alternatives=others))
    assert long.makespan > 10.0
    assert short.makespan < 2.0
    assert short.faults() == []
    assert set(short.outcomes) == {Outcome.ARRIVED}
    assert short.lower_bound == pytest.approx(1.0)
    np.testing.assert_allclose(short.trajectory.end[0], np.radians([10.0, 60.0]), atol=1e-12)


def test_an_alternative_that_touches_is_not_taken():
    plane, start, goal, _ = with_alternatives([[0.0, 0.0]])
    goal[0], goal[1] = np.radians([200.0, 100.0]), np.radians([180.0, 0.0])
    others = np.radians([[[0.0, 0.0]], [[np.nan, np.nan]]])
    plan = fp.planners.Direct().plan(fp.Problem(plane, start, goal, alternatives=others))
    assert plan.faults() == []
    np.testing.assert_allclose(plan.trajectory.end[0], goal[0], atol=1e-12)


def test_a_deadline_gives_the_best_so_far():
    """No time at all: the fold hub, whole and safe, and marked."""
    problem = field_to_field(rings=3)
    said = []
    plan = fp.planners.Direct().plan(problem, deadline=0.0, report=said.append)
    assert plan.interrupted
    assert plan.planner == "direct"
    assert plan.faults() == []
    assert len(plan.having(Outcome.ARRIVED)) == problem.n
    assert said
    assert "contacts left" in said[0]
    assert not fp.planners.Direct().plan(problem).interrupted


def test_ctrl_c_gives_the_best_so_far(monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(DirectSearch, "run", interrupted)
    plan = fp.planners.Direct().plan(field_to_field(rings=2))
    assert plan.interrupted
    assert plan.faults() == []


def test_the_seed_is_all_that_chance_knows():
    problem = field_to_field(1.0, rings=4)
    one, again, other = (fp.planners.Direct(seed=seed).plan(problem) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.trajectory.angles, again.trajectory.angles)
    np.testing.assert_array_equal(one.trajectory.times, again.trajectory.times)
    assert other.faults() == []
    assert not np.array_equal(one.trajectory.angles, other.trajectory.angles)


def test_other_speeds_lengths_and_ranges():
    """Unequal arms and speeds, alpha beyond a turn, beta of both signs, extended offline arms."""
    plane = hexagon(3)
    rng = np.random.default_rng(3)
    plane = plane.replace(
        length=7.4 + rng.uniform(-0.3, 0.3, plane.n),
        max_speed=np.radians(rng.uniform(8.0, 40.0, (plane.n, 2))),
        lower=np.tile(np.radians([-200.0, -180.0]), (plane.n, 1)),
        upper=np.tile(np.radians([260.0, 180.0]), (plane.n, 1)),
        online=rng.random(plane.n) > 0.1,
    )
    start = uniform_field(plane.replace(online=np.ones(plane.n, bool)), 1, 0.5)
    goal = uniform_field(plane, 2, 0.5, start=start)
    plan = fp.planners.Direct().plan(fp.Problem(plane, start, goal, 0.5))
    assert plan.faults() == []
    assert len(plan.having(Outcome.ARRIVED)) >= 0.9 * plane.online.sum()


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"max_time": 0.0}, "max_time"),
        ({"max_time": np.nan}, "max_time"),
        ({"budget": -1.0}, "budget"),
        ({"turn": 0.0}, "turn"),
        ({"turn": 60 * DEG}, "45 deg"),
    ],
)
def test_settings_are_checked(settings, said):
    with pytest.raises(ProblemError, match="direct") as error:
        fp.planners.Direct(**settings)
    assert said in str(error.value)


def test_three_that_only_move_together():
    """Each goal is across another's start, around in a ring: no two can do it while the third stands anywhere."""
    plan = fp.planners.Direct().plan(pinwheel())
    assert plan.faults() == []
    assert set(plan.outcomes) == {Outcome.ARRIVED}
