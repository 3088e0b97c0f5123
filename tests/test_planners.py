"""Promises that every planner keeps, on scenes where straight motion fails; and the smallest decisive ones."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.plan import Outcome
from fiberplan.planners import PLANNERS
from fiberplan.planners.greedy_fold.joint_relief import Fold
from fiberplan.planners.greedy_fold.losses import Losses
from fiberplan.scenes.uniform import uniform_field

DEG = np.pi / 180.0
COARSE = {"step": 1.0 * DEG}
SHORT = {"grid": (4, 3), "dt": 1.0, "collision_dt": 0.25, "max_time": 25.0, "orders": 1, "early_abort": True}
FUTURE_WORK = ("garages", "continuous")


def hexagon(rings=2, **changes):
    return fp.FocalPlane.hexagonal(rings, 22.4, **changes)


def line(n=2, pitch=22.4):
    """Positioners in a row along x."""
    return hexagon(1).replace(
        ids=tuple(f"P{k}" for k in range(n)),
        base=np.stack([pitch * np.arange(n), np.zeros(n)], axis=1),
        **{
            name: getattr(hexagon(1), name)[:n]
            for name in ("length", "folded", "lower", "upper", "max_speed", "zero", "online")
        },
        fiber_offsets={"fiber": hexagon(1).fiber[:n]},
    )


def exchange():
    """Two arms of which one has to make room for the other."""
    plane = line()
    start = np.array([[281.0, 115.0], [218.0, 35.0]]) * DEG
    goal = np.array([[135.0, 169.0], [29.0, 39.0]]) * DEG
    return fp.Problem(plane, start, goal)


def field_to_field(margin=0.0, rings=4, seed=0):
    plane = hexagon(rings)
    return fp.Problem(plane, uniform_field(plane, seed, margin), uniform_field(plane, seed + 100, margin), margin)


def from_folded(margin=0.0, rings=4, seed=0, **changes):
    plane = hexagon(rings).replace(**changes)
    return fp.Problem(plane, plane.folded, uniform_field(plane, seed, margin), margin)


def offline_across():
    """An arm that cannot move lies across the others' ways; another stands folded."""
    plane = hexagon(2)
    online = np.ones(plane.n, bool)
    online[[9, 3]] = False
    plane = plane.replace(online=online)
    start = plane.folded.copy()
    start[9] = np.radians([30.0, 10.0])
    return fp.Problem(plane, start, uniform_field(plane, 4, 0.0, start=start), 0.0)


def among_obstacles():
    posts = tuple(Obstacle(f"post {k}", [[x, y]], 1.5) for k, (x, y) in enumerate([(11.2, 14.0), (-22.4, 13.0)]))
    wall = Obstacle("wall", [[-60.0, 52.0], [60.0, 52.0], [60.0, 54.0], [-60.0, 54.0]], closed=True)
    plane = hexagon(2).replace(obstacles=(*posts, wall))
    return fp.Problem(plane, plane.folded, uniform_field(plane, 5, 0.5), 0.5)


def park_in_range():
    """SDSS parks at (10, 170) deg, within the joints' ranges."""
    plane = hexagon(3, folded=np.radians([10.0, 170.0]))
    return fp.Problem(plane, plane.folded, uniform_field(plane, 6, 0.0), 0.0)


def unequal():
    """Speeds and arm lengths differ from positioner to positioner, and joints from each other."""
    plane = hexagon(3)
    rng = np.random.default_rng(7)
    speed = np.radians(rng.uniform(10.0, 40.0, (plane.n, 2)))
    plane = plane.replace(max_speed=speed, length=7.4 + rng.uniform(-0.1, 0.1, plane.n))
    return fp.Problem(plane, uniform_field(plane, 7, 0.2), uniform_field(plane, 8, 0.2), 0.2)


def crowded():
    """More than can be folded: some get stuck."""
    return from_folded(margin=3.0, rings=6, seed=3)


def some_without_goal():
    problem = field_to_field(seed=2)
    goal = problem.goal.copy()
    goal[::3] = np.nan
    return fp.Problem(problem.plane, problem.start, goal, 0.0)


SCENES = [
    exchange,
    field_to_field,
    from_folded,
    offline_across,
    among_obstacles,
    park_in_range,
    unequal,
    crowded,
    some_without_goal,
]
SETTINGS = {
    "direct": [{}],
    "greedy-fold": [{"relief": relief, **COARSE} for relief in ("joint", "reverse", "replace", "none")],
    "elliptic-navigation-function": [{"relief": relief} for relief in ("layers", "none")],
    "prioritized-roadmap": [SHORT, SHORT | dict.fromkeys(FUTURE_WORK, True)],
    "navigation-function": [{"mode": mode, "D": 6.0, "d": 3.0, "dt": 0.04} for mode in ("repaired", "literal")],
}
VARIANTS = [
    pytest.param(name, settings, id="-".join([name, *(str(v) for v in settings.values() if isinstance(v, str))]))
    for name in PLANNERS
    for settings in SETTINGS[name]
]


def densely_sampled(plan, count=1500):
    """Smallest clearance seen at many times, between positioners of which one can move [mm]."""
    plane = plan.problem.plane
    moves = plane.online[plane.pairs].any(axis=1)
    times = np.linspace(0.0, plan.makespan, count)
    return min(plane.clearance(plan.trajectory.at(t))[moves].min() for t in times)


@pytest.mark.parametrize("scene", SCENES, ids=lambda s: s.__name__)
@pytest.mark.parametrize(("name", "settings"), VARIANTS)
def test_promises(name, scene, settings):
    """Starts at the start, is certified safe even when incomplete, reaches what it says, names every loss."""
    problem = scene()
    planner = PLANNERS[name](**settings)
    plan = planner.plan(problem)
    plane = problem.plane
    assert plan.planner == name == planner.name
    assert planner.reference
    np.testing.assert_allclose(plan.trajectory.start, problem.start, atol=1e-12)
    assert plan.certificate.ok, (plan.certificate.contacts, plan.certificate.undecided, plan.certificate.violations)
    assert plan.faults() == []
    assert densely_sampled(plan) >= problem.margin
    for i, outcome in enumerate(plan.outcomes):
        arrived = np.allclose(plan.trajectory.end[i], problem.goal[i], atol=1e-9)
        if outcome is Outcome.ARRIVED:
            assert arrived
        elif outcome is Outcome.NO_TARGET:
            assert np.isnan(problem.requested[i, 0])
        elif outcome is Outcome.OFFLINE:
            assert not plane.online[i]
        else:
            assert i in plan.lost
    again = planner.plan(problem)
    for field in ("offsets", "times", "angles"):
        np.testing.assert_array_equal(getattr(again.trajectory, field), getattr(plan.trajectory, field))
    assert again.outcomes == plan.outcomes


def test_scenes_are_decisive():
    """Straight synchronized motion touches in every scene, so that a planner has something to do."""
    for scene in SCENES:
        problem = scene()
        goal = np.where(np.isnan(problem.goal), problem.start, problem.goal)
        times = [0.0, plan_time(problem, goal)]
        straight = fp.Trajectory.from_samples(times, np.stack([problem.start, goal]))
        assert fp.verify(problem.plane, straight, problem.margin).contacts, scene.__name__


def plan_time(problem, goal):
    return float((np.abs(goal - problem.start) / problem.plane.max_speed).max()) * 1.001


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
    plane = line(1)
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
    plane = line()
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
    plane = line()
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
    plane = line(3)
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
    plane = line(2)
    goal = np.radians([[0.0, 0.0], [180.0, 0.0]])  # both reach across: they overlap
    problem = fp.Problem(plane, plane.folded, goal, 0.5, conflicts="drop", priority=np.array([1.0, 2.0]))
    assert list(problem.dropped) == [0]
    plan = fp.planners.GreedyFold(**COARSE).plan(problem)
    assert plan.faults() == []
    assert plan.outcomes == (Outcome.DROPPED, Outcome.ARRIVED)
    assert np.any(plan.trajectory.end[0] != plane.folded[0])


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
