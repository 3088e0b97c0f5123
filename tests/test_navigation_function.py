"""NavigationFunction (Makarem2014): what the printed field does, what the repaired one does, what neither may."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.inverse_kinematics import solutions
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.plan import Outcome
from fiberplan.planners import NavigationFunction
from fiberplan.planners.navigation_function.fiber_ends import fiber_ends
from fiberplan.planners.navigation_function.rehearsal import SPARE, rehearse, take_turns
from fiberplan.planners.navigation_function.retract_profile import WAY
from fiberplan.planners.shared.joint_paths import append_joint_ways
from fiberplan.scenes.uniform import uniform_field

DEG = np.pi / 180.0


@pytest.fixture(scope="module")
def whole():
    return fp.FocalPlane.load("makarem2014")


def standing(whole, base, free=False, online=None):
    """Positioners of makarem2014 at `base` (n, 2) [mm]; `free`: joints that turn on and on, as in the paper."""
    n = len(base)
    changes = {name: getattr(whole, name)[:n] for name in ("length", "folded", "max_speed", "zero", "lower", "upper")}
    if free:
        changes["lower"], changes["upper"] = np.full((n, 2), -4 * np.pi), np.full((n, 2), 4 * np.pi)
    return whole.replace(
        ids=tuple(f"P{k}" for k in range(n)),
        base=np.array(base, float),
        fiber_offsets={"fiber": np.array([3.0, 0.0])},
        online=np.ones(n, bool) if online is None else np.array(online),
        **changes,
    )


def hexagon(whole, rings):
    return standing(whole, fp.FocalPlane.hexagonal(rings, 10.0).base)


def angles_at(plane, points, right=True):
    """One elbow solution (n, 2) for fibers at `points` (n, 2) [mm]."""
    who, parity = np.arange(plane.n), np.full(plane.n, 1.0 if right else -1.0)
    return solutions(plane, who, np.array(points, float), plane.fiber, parity)[:, 0]


def either_elbow(plane, start, goal):
    """The problem of going to the fibers of `goal`, on whichever elbow side."""
    found = solutions(plane, np.arange(plane.n), plane.fibers(goal), plane.fiber, np.zeros(plane.n))
    return fp.Problem(plane, start, found[:, 0], alternatives=found[:, 1:])


def field_to_field(plane, seed):
    return either_elbow(plane, uniform_field(plane, 2 * seed), uniform_field(plane, 2 * seed + 1))


def exchange(whole, apart, free=False):
    """Two between which the goals are `apart` [mm], on the line that joins their bases."""
    plane = standing(whole, [[0.0, 0.0], [10.0, 0.0]], free)
    goals = angles_at(plane, [[5.0 - apart / 2, 0.3], [5.0 + apart / 2, -0.3]])
    return fp.Problem(plane, plane.folded, goals)


def closest_fibers(plan, count=800):
    """Smallest distance of two fiber ends at many times [mm]."""
    plane = plan.problem.plane
    i, j = plane.pairs.T
    times = np.linspace(0.0, plan.makespan, count)
    return min(np.hypot(*(f[i] - f[j]).T).min() for f in (plane.fibers(plan.trajectory.at(t)) for t in times))


@pytest.mark.parametrize("seed", range(3))
def test_repaired_brings_all_to_their_goals(whole, seed):
    problem = field_to_field(hexagon(whole, 6), seed)
    plan = NavigationFunction(seed=seed).plan(problem)
    assert plan.faults() == []
    assert set(plan.outcomes) == {Outcome.ARRIVED}
    assert plan.makespan < 2.0 * plan.lower_bound
    assert closest_fibers(plan) >= 2.0
    ends = np.concatenate([problem.goal[:, None], problem.alternatives], axis=1)
    off = np.nanmin(np.abs(ends - plan.trajectory.end[:, None]).max(axis=2), axis=1)
    assert off.max() < 1e-9  # in a configuration that was allowed, exactly


def test_literal_fails_where_goals_are_closer_than_repulsion_reaches(whole):
    """Goals 2.2 mm apart: the printed field rests off target, the repaired one lands; 4.5 mm apart both arrive."""
    near, far = exchange(whole, 2.2, free=True), exchange(whole, 4.5, free=True)
    assert len(NavigationFunction(mode="literal").plan(near).lost) == 2
    assert len(NavigationFunction(mode="literal").plan(far).lost) == 0
    for problem in (near, far):
        plan = NavigationFunction().plan(problem)
        assert len(plan.lost) == 0
        assert plan.faults() == []


def test_literal_descends_as_printed(whole):
    """Alone, a fiber follows minus the gradient of lambda1 |q - q_T|^2 by its joints, at the speeds these allow."""
    plane = standing(whole, [[0.0, 0.0]], free=True)
    start, goal = np.array([[0.3, 1.0]]), np.array([[1.9, 1.8]])
    plan = NavigationFunction(mode="literal").plan(fp.Problem(plane, start, goal))
    assert plan.outcomes == (Outcome.ARRIVED,)
    t = 0.02
    q, elbow = plane.fibers(start)[0], plane.elbows(start)[0]
    pull = -2.0 * (q - plane.fibers(goal)[0])
    jacobian = np.array([[-q[1], q[0]], [-(q - elbow)[1], (q - elbow)[0]]])
    wanted = jacobian @ pull
    turned = plan.trajectory.at(t)[0] - start[0]
    excess = np.max(np.abs(wanted) / plane.max_speed[0])
    assert excess > 1  # the demand is more than the joints can do
    np.testing.assert_allclose(turned / t, wanted / excess, rtol=0.05)


def test_joint_ranges_stop_the_literal_descent_and_not_the_repaired(whole):
    """The short way to the goal leads through alpha = 0, where the joint ends."""
    plane = standing(whole, [[0.0, 0.0]])
    problem = fp.Problem(plane, np.array([[0.3, 0.9]]), np.array([[5.9, 0.9]]))
    assert NavigationFunction(mode="literal").plan(problem).outcomes == (Outcome.DEADLOCKED,)
    assert NavigationFunction().plan(problem).outcomes == (Outcome.ARRIVED,)


@pytest.mark.parametrize("beta", [0.0, np.pi - 1e-9])
def test_singular_poses_are_left(whole, beta):
    """Fully stretched or bent back, pulled along the arm: the printed gradient is zero."""
    plane = standing(whole, [[0.0, 0.0]], free=True)
    goal = angles_at(plane, [[3.0, 1e-12]])
    problem = fp.Problem(plane, np.array([[0.0, beta]]), goal, alternatives=-goal[:, None])
    for seed in range(4):
        plan = NavigationFunction(mode="literal", seed=seed).plan(problem)
        assert plan.outcomes == (Outcome.ARRIVED,)
    sides = {NavigationFunction(mode="literal", seed=s).plan(problem).trajectory.at(0.1)[0, 1] > beta for s in range(8)}
    assert len(sides) == 2


@pytest.mark.parametrize("mode", ["literal", "repaired"])
@pytest.mark.parametrize("dt", [0.01, 0.2])
def test_safe_between_steps(whole, mode, dt):
    """In a step of 0.2 s a fiber moves 5 mm, more than the safety distance: it must not pass through another."""
    problem = field_to_field(hexagon(whole, 3), 4)
    plan = NavigationFunction(mode=mode, dt=dt).plan(problem)
    assert plan.faults() == []
    assert closest_fibers(plan) >= 2.0


def test_six_neighbours_are_all_that_can_come_near(whole):
    """Of the grid's; fewer are fewer, and the order of bases decides."""
    problem = field_to_field(hexagon(whole, 3), 1)
    plans = {m: NavigationFunction(mode="literal", neighbours=m).plan(problem).trajectory for m in (0, 6, 2)}
    np.testing.assert_array_equal(plans[0].angles, plans[6].angles)
    plane = problem.plane
    count = {m: np.diff(fiber_ends(plane, problem.start, problem.goal, 4.0, 0.01, m or None).offsets) for m in (0, 6)}
    assert count[0].max() == 6
    np.testing.assert_array_equal(count[0], count[6])
    wide = standing(whole, [[0.0, 0.0], [9.0, 0.0], [-8.0, 0.0]])
    ends = fiber_ends(wide, wide.folded, wide.folded, 4.0, 0.01, 1)
    assert ends.near["arm"][ends.offsets[0] : ends.offsets[1]].tolist() == [2]


def test_one_without_target_gives_way_to_one_with(whole):
    """It stands where the other wants to be."""
    plane = standing(whole, [[0.0, 0.0], [10.0, 0.0]], free=True)
    start = angles_at(plane, [[-3.0, 0.0], [5.0, 0.1]])
    goal = angles_at(plane, [[5.2, 0.0], [5.0, 0.1]])
    goal[1] = np.nan
    for mode in ("literal", "repaired"):
        plan = NavigationFunction(mode=mode).plan(fp.Problem(plane, start, goal))
        assert plan.outcomes == (Outcome.ARRIVED, Outcome.NO_TARGET)
        assert plan.faults() == []
        assert np.hypot(*(plane.fibers(plan.trajectory.end)[1] - [5.0, 0.1])) > 1.5


@pytest.mark.parametrize("mode", ["literal", "repaired"])
def test_the_way_in_is_closed_by_two_that_cannot_move(whole, mode):
    """Deadlocked, by name; the offline ones stay."""
    plane = standing(whole, [[0.0, 0.0], [10.0, 0.0], [5.0, 8.66]], online=[True, False, False])
    shut = [[0.5, 0.0], [4.2, 1.0], [2.966, 3.137]]
    start = angles_at(plane, shut)
    goal = start.copy()
    goal[0] = angles_at(plane, [[5.0, 2.887], *shut[1:]])[0]
    plan = NavigationFunction(mode=mode).plan(fp.Problem(plane, start, goal))
    assert plan.faults() == []
    assert plan.outcomes == (Outcome.DEADLOCKED, Outcome.OFFLINE, Outcome.OFFLINE)
    assert plan.blockers[0]
    assert set(plan.blockers[0]) <= {1, 2}
    np.testing.assert_array_equal(plan.trajectory.end[1:], start[1:])


@pytest.mark.small
def test_dropped_goals_are_named(whole):
    plane = standing(whole, [[0.0, 0.0], [10.0, 0.0]])
    goal = angles_at(plane, [[5.0, 0.0], [5.5, 0.0]])
    problem = fp.Problem(plane, plane.folded, goal, conflicts="drop", priority=np.array([1.0, 2.0]))
    plan = NavigationFunction().plan(problem)
    assert plan.outcomes == (Outcome.DROPPED, Outcome.ARRIVED)
    assert plan.blockers == {0: (1,)}


def test_theorem_1_is_noted_once_where_it_does_not_hold(whole):
    problem = exchange(whole, 4.5)
    notes = NavigationFunction(mode="literal").plan(problem).notes
    assert len([note for note in notes if "Theorem 1" in note]) == 1
    assert "lambda1 / lambda2 = 20 is not below 0.04762" in notes[-1]
    assert not NavigationFunction(mode="literal", lambda1=0.04, lambda2=1.0).plan(problem).notes


def test_steps_that_overshoot_are_noted():
    """The paper's weights are tuned for arms of 3 mm; longer arms need smaller ones."""
    plane = fp.FocalPlane.hexagonal(0, 22.4)
    problem = fp.Problem(plane, np.radians([[30.0, 90.0]]), np.radians([[60.0, 60.0]]))
    fast, slow = NavigationFunction(mode="literal"), NavigationFunction(mode="literal", lambda1=0.1)
    assert any("overshoots" in note for note in fast.plan(problem).notes)
    assert not any("overshoots" in note for note in slow.plan(problem).notes)
    assert len(slow.plan(problem).lost) == 0


@pytest.mark.small
@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"lambda1": 0.0}, "lambda1 must be a positive weight, got 0"),
        ({"lambda2": -1.0}, "lambda2 must be a positive weight, got -1"),
        ({"lambda1": np.nan}, "lambda1 must be a positive weight"),
        ({"d": 4.0}, "d must be below D, got d 4 mm and D 4 mm"),
        ({"d": 5.0}, "d must be below D"),
        ({"d": 0.0}, "d must be a positive distance"),
        ({"dt": 0.0}, "dt must be a positive time"),
        ({"convergence": np.inf}, "convergence must be a positive distance"),
        ({"ease": 0.9}, "ease must be a number of 1 or more"),
        ({"give_up": 0.0}, "give_up must be a positive number"),
        ({"neighbours": -1}, "neighbours must be a number of 0 or more"),
        ({"mode": "printed"}, "mode must be one of repaired, literal, got 'printed'"),
    ],
)
def test_settings_are_checked(settings, said):
    with pytest.raises(ProblemError, match="navigation-function") as error:
        NavigationFunction(**settings)
    assert said in str(error.value)


@pytest.mark.small
def test_a_step_beyond_the_patrol_zone_is_refused(whole):
    problem = exchange(whole, 4.5)
    with pytest.raises(
        ProblemError, match=r"dt 0\.3 s is so large that positioner 'P0' could move .* beyond its patrol"
    ):
        NavigationFunction(dt=0.3).plan(problem)


def rehearsed(problem, ways):
    """Fiber paths (n, samples, 2) of `ways` if nobody minds the others [mm]."""
    ends = fiber_ends(problem.plane, problem.start, problem.goal, 4.0, 0.01, None)
    paths = np.empty((problem.n, 100, 2), np.float32)
    for i in range(problem.n):
        rehearse(problem.plane.arms, ends, ways[i], i, *problem.start[i], paths[i])
    return ends, paths


def ways_for(n, due):
    ways = np.zeros(n, WAY)
    ways["due"], ways["yields_to"], ways["lean_in"], ways["lean_out"] = due, -1, 0.5, 0.5
    return ways


def test_turns_are_taken_where_two_would_meet(whole):
    """Both come out at the same time through the same place; then one of them earlier, or on its other side."""
    plane = standing(whole, [[0.0, 0.0], [10.0, 0.0]])
    start = np.radians([[0.0, 170.0], [180.0, 170.0]])
    goal = angles_at(plane, [[5.6, 0.9], [4.4, -0.9]], right=True)
    problem = fp.Problem(plane, start, goal)
    ways = ways_for(2, 250)
    ends, paths = rehearsed(problem, ways)
    apart = np.hypot(*(paths[0] - paths[1]).T).min()
    assert apart < 2.0
    left = take_turns(plane.arms, ends, ways, np.array(start), paths, paths[0].copy(), 2.0 + SPARE, 251)
    assert left == 0 or np.hypot(*(paths[0] - paths[1]).T).min() > apart
    _, again = rehearsed(problem, ways)
    np.testing.assert_array_equal(again, paths)
    assert np.hypot(*(again[0] - again[1]).T).min() >= 2.0
    np.testing.assert_allclose(again[:, -1], plane.fibers(goal), atol=1e-5)


def test_the_last_resort_finds_joint_ways(whole):
    """Each stands on the other's way; nobody has moved yet."""
    plane = standing(whole, [[0.0, 0.0], [10.0, 0.0], [60.0, 0.0], [70.0, 0.0]])
    here, there = [[5.7, 0.9], [4.3, -0.9]], [[5.7, -1.0], [4.4, 1.0]]
    start = angles_at(plane, [*here, *(np.array(here) + [60.0, 0.0])])
    goal = angles_at(plane, [*there, *(np.array(there) + [60.0, 0.0])])
    problem = fp.Problem(plane, start, goal)
    near = Neighbourhood.of(plane, 0.0)
    motion = append_joint_ways(problem, near, fp.Trajectory.at_rest(start), goal, np.arange(4), 0)
    assert fp.verify(plane, motion).ok
    np.testing.assert_allclose(motion.end, goal, atol=1e-12)
    np.testing.assert_array_equal(motion.start, start)
    begins = [motion.times[motion.offsets[i]] for i in range(4)]
    assert begins == [0.0] * 4  # the two pairs cannot touch, and go at the same time
