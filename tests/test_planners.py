"""The fold hub: its walk, its reliefs, and whom it gives up; what all planners promise is in test_promises."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.plan import Outcome
from fiberplan.planners.greedy_fold.deadlock import Fold
from fiberplan.planners.greedy_fold.losses import Losses
from fiberplan.scenes.decisive import row
from fiberplan.scenes.uniform import uniform_field
from problems import crowded, field_to_field, from_folded, hexagon

DEG = np.pi / 180.0
COARSE = {"step": 1.0 * DEG}


@pytest.mark.parametrize("step", [3.0, 1.0, 0.1])
def test_any_step(step):
    plan = fp.planners.GreedyFold(step=step * DEG).plan(field_to_field(rings=2))
    assert plan.faults() == []
    assert len(plan.lost) == 0


def test_few_knots():
    """The walk changes direction all the time; what is returned does not."""
    plan = fp.planners.GreedyFold(step=0.1 * DEG).plan(from_folded(rings=6))
    assert len(plan.trajectory.times) < 6 * plan.problem.n
    assert plan.certificate.ok


def test_lower_bound_is_the_slowest_joint():
    plane = row(1)
    goal = np.radians([[90.0, 60.0]])
    plan = fp.planners.GreedyFold(**COARSE).plan(fp.Problem(plane, plane.folded, goal))
    assert plan.lower_bound == pytest.approx(4.0)  # beta turns 120 deg at 30 deg/s
    assert plan.makespan >= plan.lower_bound
    assert "1 of 1 arrived in 4.0 s (1.00 x the lower bound)" in str(plan)


def test_fold_hub_goes_by_folded():
    """From field to field each half takes at least as long as its slowest fold."""
    problem = field_to_field(rings=3)
    plan = fp.planners.GreedyFold(**COARSE).plan(problem)
    halves = [np.abs(q - problem.plane.folded).max() / (30 * DEG) for q in (problem.start, problem.goal)]
    assert plan.makespan >= sum(halves) - 1e-6


def test_already_there_is_no_motion():
    plane = hexagon(2)
    plan = fp.planners.GreedyFold().plan(fp.Problem(plane, plane.folded, plane.folded))
    assert plan.makespan == 0.0
    assert set(plan.outcomes) == {Outcome.ARRIVED}


def test_deadlock_without_relief_is_named_and_safe():
    """Some never fold; they are outcomes with names, and the rest arrives around them."""
    plan = fp.planners.GreedyFold(relief="none", **COARSE).plan(crowded())
    stuck = plan.having(Outcome.DEADLOCKED)
    assert len(stuck)
    assert set(plan.blockers) >= set(stuck.tolist())
    assert all(plan.blockers[i] for i in stuck)
    assert plan.certificate.ok
    assert len(plan.having(Outcome.ARRIVED)) > 0.8 * plan.problem.n


def test_one_that_is_at_its_goal_from_the_beginning_has_arrived():
    """It cannot fold past the post, so it is held where it starts, which is where it should be."""
    plane = row(2)
    post = Obstacle("post", [plane.base[0] + [0.0, 18.0]], 1.0)
    ranges = {"lower": np.radians([[-90.0, 0.0], [0.0, 0.0]]), "upper": np.radians([[140.0, 1.0], [360.0, 180.0]])}
    plane = plane.replace(obstacles=(post,), folded=np.radians([[135.0, 0.0], [0.0, 180.0]]), **ranges)
    start = np.radians([[-80.0, 0.0], [0.0, 170.0]])
    plan = fp.planners.GreedyFold(**COARSE).plan(fp.Problem(plane, start, start))
    assert plan.faults() == []
    assert plan.outcomes == (Outcome.ARRIVED, Outcome.ARRIVED)
    assert plan.blockers == {}


def test_joint_relief_loses_less():
    """A joint search frees most of what the plain walk leaves stuck, and never costs safety."""
    lost = {"joint": 0, "none": 0}
    for relief in lost:
        for seed in range(4):
            problem = from_folded(margin=2.0, rings=8, seed=seed)
            plan = fp.planners.GreedyFold(relief=relief, **COARSE).plan(problem)
            assert plan.faults() == []
            lost[relief] += len(plan.lost)
    assert lost["joint"] < lost["none"]


@pytest.mark.parametrize("valued", [0, 1])
def test_the_one_that_matters_less_is_given_up(valued):
    """Of two that are stuck with each other the one of lower priority loses its goal, whichever that is."""
    plane = row(2)
    priority = np.array([1.0, 1.0])
    priority[valued] = 5.0
    goal = np.radians([[60.0, 90.0], [60.0, 90.0]])
    problem = fp.Problem(plane, plane.folded, goal, priority=priority)
    losses = Losses(problem, Neighbourhood.of(plane, 0.0))
    nobody = Fold(fp.Trajectory.at_rest(plane.folded), np.array([], int), {})
    losses.give_up(nobody, Fold(fp.Trajectory.at_rest(goal), np.array([0, 1]), {0: 1, 1: 0}))
    end = losses.end()
    assert losses.outcomes(end)[1 - valued] is Outcome.DEADLOCKED
    assert losses.outcomes(end)[valued] is Outcome.ARRIVED
    assert losses.blockers(end) == {1 - valued: (valued,)}
    np.testing.assert_array_equal(end[valued], goal[valued])
    np.testing.assert_array_equal(end[1 - valued], plane.folded[1 - valued])


def test_a_start_that_cannot_fold_is_held():
    """An arm boxed in by offline ones stays where it is, by name, and the others still go."""
    plane = row(3)
    online = np.array([False, True, True])
    start = np.radians([[300.0, 60.0], [0.0, 180.0], [0.0, 180.0]])
    plane = plane.replace(online=online, upper=np.radians([[360.0, 180.0]] * 3))
    start[1] = np.radians([150.0, 20.0])
    wall = Obstacle("wall", [[10.0, 15.0], [25.0, 15.0], [34.0, 6.0]], 0.5)
    box = Obstacle("box", [[4.0, -6.0], [30.0, -8.0]], 0.5)
    plane = plane.replace(obstacles=(wall, box))
    goal = np.radians([[0.0, 180.0], [40.0, 120.0], [20.0, 100.0]])
    try:
        problem = fp.Problem(plane, start, goal, conflicts="drop")
    except ProblemError as error:  # pragma: no cover - the scene is meant to be legal
        pytest.fail(str(error))
    plan = fp.planners.GreedyFold(relief="none", **COARSE).plan(problem)
    assert plan.certificate.ok
    assert plan.outcomes[0] is Outcome.OFFLINE
    assert plan.outcomes[2] is Outcome.ARRIVED


def test_replaced_targets_are_lost_by_name():
    plan = fp.planners.GreedyFold(relief="replace", **COARSE).plan(crowded())
    assert any("random target" in note for note in plan.notes)
    assert len(plan.having(Outcome.DEADLOCKED))
    assert plan.certificate.ok


@pytest.mark.parametrize("relief", ["joint", "reverse", "replace", "none"])
def test_a_pocket_without_a_way_out_is_given_up(relief):
    """Folded between four posts, one positioner can go nowhere: every relief ends, and says so."""
    posts = tuple(Obstacle(f"post {x:g} {y:g}", [[x, y]], 1.0) for x in (-7.0, 7.0) for y in (-2.51, 2.51))
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(obstacles=posts)
    problem = fp.Problem(plane, plane.folded, np.radians([[90.0, 20.0]]))
    plan = fp.planners.GreedyFold(relief=relief, **COARSE).plan(problem)
    assert plan.outcomes == (Outcome.DEADLOCKED,)
    assert plan.faults() == []


@pytest.mark.parametrize("relief", ["joint", "reverse"])
def test_joints_without_limits(relief):
    """Alpha may turn for ever; the plan is as safe."""
    plane = hexagon(3).replace(lower=np.tile([-np.inf, 0.0], (37, 1)), upper=np.tile([np.inf, np.pi], (37, 1)))
    problem = fp.Problem(plane, plane.folded, uniform_field(plane, 2, 1.0), 1.0)
    plan = fp.planners.GreedyFold(relief=relief, **COARSE).plan(problem)
    assert plan.faults() == []
    assert len(plan.having(Outcome.ARRIVED)) > 30


def test_dropped_goal_stands_elsewhere():
    """A dropped positioner must not stay folded where it would touch a neighbour's goal."""
    plane = row(2)
    goal = np.radians([[0.0, 0.0], [180.0, 0.0]])  # both reach across: they overlap
    problem = fp.Problem(plane, plane.folded, goal, 0.5, conflicts="drop", priority=np.array([1.0, 2.0]))
    assert list(problem.dropped) == [0]
    plan = fp.planners.GreedyFold(**COARSE).plan(problem)
    assert plan.faults() == []
    assert plan.outcomes == (Outcome.DROPPED, Outcome.ARRIVED)
    assert np.any(plan.trajectory.end[0] != plane.folded[0])


@pytest.mark.small
@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"step": 0.0}, "step"),
        ({"step": np.nan}, "step"),
        ({"step": -DEG}, "step"),
        ({"step": 200 * DEG}, "at most 180 deg"),
        ({"max_travel": np.inf}, "max_travel"),
        ({"relief": "hope"}, "'hope'"),
    ],
)
def test_settings_are_checked(settings, said):
    with pytest.raises(ProblemError, match="greedy-fold") as error:
        fp.planners.GreedyFold(**settings)
    assert said in str(error.value)
