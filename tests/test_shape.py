"""Motions made fit for motors that cannot jump: values by hand, and every result proven by `verify`."""

import re

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates import verify
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.motion import Trajectory
from fiberplan.planners import GreedyFold
from fiberplan.scenes.uniform import uniform_field
from fiberplan.shaping import plan_for_motors, replanned, shape
from fiberplan.shaping.bursts import no_slower
from fiberplan.shaping.following import TAIL, followed
from fiberplan.shaping.ramps import ramped
from fiberplan.tolerances import RAMP
from references import make_plane, motion_of

pytestmark = pytest.mark.small

SPEED, ACCELERATION = 2.0, 4.0  # [rad/s, rad/s^2]: half a second to full speed
TIP = Body(np.array([[10.0, 0.0]]), 0.01)


def limited(n=1, bodies=(), slowest=None, acceleration=ACCELERATION, **others):
    base = 50.0 * np.stack([np.arange(n), np.zeros(n)], axis=1)
    return make_plane(
        base,
        bodies,
        max_speed=SPEED,
        max_acceleration=None if acceleration is None else np.full((n, 2), acceleration),
        min_speed=None if slowest is None else np.full((n, 2), slowest),
        **others,
    )


STRAIGHT = motion_of([(0.0, 0.0, 0.0), (1.5, 3.0, 0.0)])  # full speed at once


def test_a_straight_turn_takes_the_least_time_there_is():
    plane = limited()
    made = shape(STRAIGHT, plane)
    assert made.certificate.ok
    assert made.longer == pytest.approx(0.5)
    assert made.trajectory.duration == pytest.approx(float(plane.least_time(np.array([[3.0, 0.0]]))[0, 0]))
    times, angles = made.trajectory.knots(0)
    ramp = times <= 0.5 + 1e-9
    np.testing.assert_allclose(angles[ramp, 0], 0.5 * ACCELERATION * times[ramp] ** 2, atol=1e-12)
    assert made.trajectory.at(1.0)[0, 0] == pytest.approx(1.5)
    assert made.trajectory.end[0, 0] == 3.0


def test_pieces_are_as_few_as_the_allowance_lets_them():
    """A ramp of 0.5 s and 4 rad/s^2 leaves its chord by 0.125 rad, and k pieces by 0.125 / k^2."""
    plane = limited()
    for pieces in (1, 2, 9):
        made = ramped(STRAIGHT, plane, np.array([0.125 / pieces**2 * 1.0001]))
        assert len(made.trajectory.times) == 2 * (pieces + 1)
        assert made.error[0, 0] == pytest.approx(0.125 / pieces**2)
        assert made.error[0, 1] == 0.0
    assert shape(STRAIGHT, plane).error.max() <= RAMP


def test_without_limits_nothing_changes():
    motion = motion_of([(0.0, 0.0, 0.0), (1.0, 1.0, 0.5), (3.0, 2.0, 0.5)], [(0.5, 1.0, 1.0), (1.0, 1.5, 1.0)])
    made = shape(motion, limited(2, acceleration=None))
    np.testing.assert_array_equal(made.trajectory.times, motion.times)
    np.testing.assert_allclose(made.trajectory.angles, motion.angles, atol=1e-15)
    assert made.longer == 0.0


def test_turning_back_takes_as_long_as_it_must():
    """From 2 to -2 rad/s takes a second. Its window meets those of both ends: the motion is a mean over it."""
    there_and_back = motion_of([(0.0, 0.0, 0.0), (0.5, 1.0, 0.0), (1.0, 0.0, 0.0)])
    made = shape(there_and_back, limited())
    assert made.certificate.ok
    assert made.longer <= 1.0 + 1e-9
    assert made.trajectory.end[0, 0] == pytest.approx(0.0, abs=1e-12)
    assert 0.3 < made.trajectory.angles[:, 0].max() < 1.0


def test_windows_that_meet_are_opened_and_no_limit_is_broken():
    rng = np.random.default_rng(3)
    knots = []
    for _ in range(40):
        spans = rng.uniform(0.02, 0.5, 12)
        steps = rng.uniform(-1.0, 1.0, (12, 2)) * SPEED * spans[:, None]
        angles = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        knots.append(np.column_stack([np.append(0.0, np.cumsum(spans)), angles]).tolist())
    motion = motion_of(*knots)
    for slowest in (None, 0.4):
        plane = limited(40, slowest=slowest)
        assert verify(plane, motion).violations
        made = shape(motion, plane)
        assert made.certificate.violations == ()
        assert made.longer <= 2 * SPEED / ACCELERATION + 1e-9
        np.testing.assert_allclose(made.trajectory.start, motion.start, atol=1e-12)
        np.testing.assert_allclose(made.trajectory.end, motion.end, atol=1e-12)


def test_a_joint_too_slow_turns_in_the_middle_and_rests():
    """0.3 rad in 1.5 s at 0.5 rad/s or not at all: 0.6 s of turning, off by 0.09 rad at most."""
    plane = limited(slowest=0.5, acceleration=None)
    motion = motion_of([(0.0, 0.0, 0.0), (1.5, 3.0, 0.3)])
    made = no_slower(motion, plane, np.array([0.1]))
    assert verify(plane, made).ok
    np.testing.assert_allclose(made.times, [0.0, 0.45, 1.05, 1.5], atol=1e-4)
    np.testing.assert_allclose(made.angles, [[0, 0], [0.9, 0], [2.1, 0.3], [3.0, 0.3]], atol=3e-4)


@pytest.mark.parametrize(("follow", "cells"), [(0.1, 1), (0.05, 2), (0.02, 5)])
def test_following_more_closely_takes_more_turns(follow, cells):
    plane = limited(slowest=0.5, acceleration=None)
    made = no_slower(motion_of([(0.0, 0.0, 0.0), (1.5, 3.0, 0.3)]), plane, np.array([follow]))
    assert len(made.times) == 2 * cells + 2
    off = made.sampled(np.linspace(0.0, 1.5, 301))[0, :, 1] - np.linspace(0.0, 0.3, 301)
    assert np.abs(off).max() <= follow
    assert verify(plane, made).ok


def test_a_slow_turn_joins_on_to_a_fast_one():
    """It does not stop between: 0.1 rad at 0.5 rad/s right after, or right before, the turn at 1 rad/s."""
    plane = limited(slowest=0.5, acceleration=None)
    after = no_slower(motion_of([(0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 1.1, 0.0)]), plane, np.array([1.0]))
    np.testing.assert_allclose(after.times, [0.0, 1.0, 1.2, 2.0], atol=1e-4)
    before = no_slower(motion_of([(0.0, 0.0, 0.0), (1.0, 0.1, 0.0), (2.0, 1.1, 0.0)]), plane, np.array([1.0]))
    np.testing.assert_allclose(before.times, [0.0, 0.8, 1.0, 2.0], atol=1e-4)
    between = motion_of([(0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 1.1, 0.0), (3.0, 2.1, 0.0)])
    made = no_slower(between, plane, np.array([1.0]))
    np.testing.assert_allclose(made.times, [0.0, 1.0, 1.1, 1.9, 2.0, 3.0], atol=1e-4)


def test_a_ramp_starts_at_the_least_speed():
    made = shape(STRAIGHT, limited(slowest=0.5))
    assert made.certificate.ok
    times, angles = made.trajectory.knots(0)
    speed = np.diff(angles[:, 0]) / np.diff(times)
    assert speed.min(where=speed > 0, initial=9.0) == pytest.approx(0.5, rel=1e-3)
    assert made.trajectory.end[0, 0] == 3.0


def corner(gap):
    """An arm turns its alpha, then bends. A post stands `gap` [mm] from its path, where the rounded corner passes."""
    motion = motion_of([(0.0, 0.0, 0.0), (1.0, 2.0, 0.0), (2.0, 2.0, -2.0)])
    at = np.array([[2.0 - 0.125, -0.125]])
    plane = limited(bodies=(TIP,))
    post = plane.fibers(at)
    dense = np.array([plane.fibers(motion.at(t))[0] for t in np.linspace(0.0, 2.0, 4001)])
    radius = np.hypot(*(dense - post).T).min() - TIP.radius - gap
    return plane.replace(obstacles=(Obstacle("post", post, radius),)), motion


def test_pairs_that_come_too_near_are_named():
    plane, motion = corner(0.001)
    assert verify(plane, motion).contacts == ()
    made = shape(motion, plane)
    assert list(made.lacking) == [(0, -1)]
    assert 0.0 < made.lacking[0, -1] < 0.2
    assert made.certificate.violations == ()
    assert "1 contacts" in str(made)
    sudden = plane.replace(max_acceleration=100.0 * plane.max_acceleration)
    assert shape(motion, sudden).lacking == {}


class Corner:
    """A planner of one path, which stays the farther from the post the more room it is told to keep."""

    name, reference = "corner", "a test"

    def __init__(self, motion):
        self.motion, self.asked = motion, []

    def plan(self, problem):
        room = float(problem.position_error.max())
        self.asked.append(room)
        knots = motion_of([(0.0, 0.0, 0.0), (1.0 + room, 2.0 + 2.0 * room, 0.0), (2.0 + room, 2.0, -2.0)])
        return fp.Plan(problem, knots, (fp.Outcome.ARRIVED,), self.name)


def test_who_comes_too_near_is_led_past_anew():
    plane, motion = corner(0.001)
    planner = Corner(motion)
    plan = plan_for_motors(planner, fp.Problem(plane, np.zeros((1, 2)), np.array([[2.0, -2.0]])))
    assert planner.asked == [0.0]
    assert plan.certificate.ok
    assert re.fullmatch(r"planned 1 time, \d pairs led past each other anew", plan.notes[-1])


def test_the_planner_is_asked_again_with_more_room(monkeypatch):
    """Where leading pairs past each other anew gets nowhere."""
    monkeypatch.setattr(replanned, "mended", lambda plan, *given, **options: (plan, 0))
    plane, motion = corner(0.001)
    planner = Corner(motion)
    plan = plan_for_motors(planner, fp.Problem(plane, np.zeros((1, 2)), np.array([[2.0, -2.0]])))
    assert planner.asked[0] == 0.0
    assert planner.asked == sorted(planner.asked)
    assert len(planner.asked) > 1
    assert plan.certificate.ok
    assert plan.problem.position_error.max() == 0.0
    assert f"planned {len(planner.asked)} times" in plan.notes[-1]


@pytest.mark.large
def test_a_whole_field_is_planned_for_its_motors():
    plane = fp.FocalPlane.hexagonal(2, 22.4, max_speed=np.radians(12.0)).replace(
        max_acceleration=np.full((19, 2), np.radians(24.0)), min_speed=np.full((19, 2), np.radians(3.0))
    )
    start = uniform_field(plane, 0, 0.5)
    problem = fp.Problem(plane, start, uniform_field(plane, 1, 0.5, start=start), 0.5)
    plain = GreedyFold().plan(problem)
    assert plain.certificate.violations
    plan = plan_for_motors(GreedyFold(), problem)
    assert plan.faults() == []
    assert plan.kept == plain.kept
    assert plan.makespan < plain.makespan + 1.1
    free = fp.Problem(plane.replace(max_acceleration=None, min_speed=None), start, problem.goal, 0.5)
    assert plan_for_motors(GreedyFold(), free).makespan == plain.makespan


@pytest.mark.parametrize("allowance", [0.0, -1.0, np.nan, np.inf])
def test_senseless_allowances_are_refused(allowance):
    with pytest.raises(TrajectoryError, match="shape: allowance must be a positive length"):
        shape(STRAIGHT, limited(), allowance=allowance)


def test_motions_of_another_array_are_refused():
    with pytest.raises(TrajectoryError, match="shape: the motion has 1 positioners, the focal plane 2"):
        shape(STRAIGHT, limited(2))


def test_no_positioners_moves_at_all():
    rest = Trajectory.at_rest(np.zeros((3, 2)))
    assert shape(rest, limited(3, slowest=0.5)).trajectory.duration == 0.0


STEP, SEGMENT = 0.01, 0.1  # [rad, s]: 5 to 20 steps in a segment, 4 more or fewer than before


def steppers(n=1, **others):
    return limited(n, slowest=0.5, acceleration=4.0, **others)


def stepped(motion, plane):
    return shape(motion, plane, segment=SEGMENT, step=np.array([STEP, STEP]))


def test_steps_are_whole_and_obey_their_rules():
    rng = np.random.default_rng(5)
    knots = []
    for _ in range(60):
        spans = rng.uniform(0.1, 2.0, 6)
        steps = rng.uniform(-1.0, 1.0, (6, 2)) * rng.integers(0, 2, (6, 2)) * SPEED * spans[:, None]
        angles = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        knots.append(np.column_stack([np.append(0.0, np.cumsum(spans)), angles]).tolist())
    motion, plane = motion_of(*knots), steppers(60)
    made = stepped(motion, plane)
    assert made.certificate.violations == ()
    counts = np.abs(made.steps)
    assert set(np.unique(counts)) <= {0, *range(5, 21)}
    places = np.concatenate([np.zeros((1, 60, 2)), np.cumsum(made.steps, axis=0)]) * STEP
    for k in range(0, len(places), 7):
        np.testing.assert_allclose(made.trajectory.at(k * SEGMENT), places[k], atol=1e-9)
    np.testing.assert_allclose(made.trajectory.end, motion.end, atol=0.5 * STEP + 1e-9)
    row = np.concatenate([np.zeros((1, 60, 2), int), made.steps, np.zeros((1, 60, 2), int)])
    one_way = np.sign(row[1:]) == np.sign(row[:-1])
    assert np.abs(np.diff(row, axis=0))[one_way].max() <= 4
    assert np.abs(row[1:])[~one_way].max() <= 5


@pytest.mark.parametrize(("steps", "row"), [(5, [5]), (10, [5, 5]), (20, [5, 5, 5, 5]), (3, None), (7, None)])
def test_turns_that_no_stroke_can_make_are_made_there_and_back(steps, row):
    """A segment has 5 steps or none where a joint starts and stops: 3 and 7 steps take a turn back."""
    made = stepped(motion_of([(0.0, 0.0, 0.0), (1.0, steps * STEP, 0.0)]), steppers())
    turns = made.steps[:, 0, 0][made.steps[:, 0, 0] != 0]
    assert turns.sum() == steps
    assert made.certificate.violations == ()
    if row is None:
        assert (turns < 0).any()
        assert np.abs(turns).sum() < 40
    else:
        assert sorted(turns.tolist()) == sorted(row)


def test_whole_steps_keep_ranges_that_their_path_keeps():
    """A turn of 0.55 rad to the end of the range at 0.3 rad/s, where 0.5 is the least, rest, and back again."""
    knots = [(0.0, 0.0, 0.0), (11 / 6, 0.55, -0.53), (2.0, 0.55, -0.53), (3.2, 0.1, -0.1)]
    plane = steppers(lower=np.array([[-0.1, -0.53]]), upper=np.array([[0.55, 0.1]]))
    made = stepped(motion_of(knots), plane)
    assert made.certificate.violations == ()
    np.testing.assert_allclose(made.trajectory.end, [[0.1, -0.1]], atol=0.5 * STEP + 1e-9)


def test_strokes_that_overshoot_stay_off_the_end_of_the_range_by_as_much_as_it_takes():
    """A joint of MOONS that turns back three steps before its range ends: 3 to 21 steps off that end do not do."""
    rules = [np.array([value]) for value in (62, 237, 50, 69)]
    there = [-4, -34, -89, -135, -184, *[-198, -198, -198, -199] * 7, -198, -198, -198, -196, -165, -117, -65, -18]
    back = [22, 67, 119, 162, *[169, 168] * 42, 169, 160, 124, 69, 23]
    wanted = np.array([[0, 0, *there, *[0] * 16, *back, *[0] * 40]])
    low, high = wanted.cumsum().min() - 3, 10_000
    made = np.zeros((1, wanted.shape[1] + TAIL), np.int64)
    assert followed(*rules, wanted, np.array([11]), np.array([low]), np.array([high]), made).all()
    assert made.cumsum().min() >= low
    assert made.sum() == wanted.sum()


@pytest.mark.parametrize(("lower", "upper"), [(0.305, 2.0), (-np.inf, np.inf)])
def test_whole_steps_from_outside_of_a_range_or_without_one(lower, upper):
    """A start just below the range, as planning lets it be, and rest before it moves."""
    motion = motion_of([(0.0, 0.3, 0.0), (0.5, 0.3, 0.0), (1.5, 0.8, 0.0)])
    ranges = {"lower": np.array([[lower, -2.0]]), "upper": np.array([[upper, 2.0]])}
    made = stepped(motion, steppers(folded=np.array([[1.0, 0.0]]), **ranges))
    np.testing.assert_allclose(made.trajectory.end, [[0.8, 0.0]], atol=0.5 * STEP + 1e-9)
    assert (made.steps >= 0).all()


def test_an_end_that_whole_steps_reach_from_beyond_the_range_only_is_refused():
    """Three steps are five there and two back, or eight and five: seven at least, where the range ends at four."""
    with pytest.raises(TrajectoryError, match="'P0' cannot end where it should in whole steps within its range"):
        stepped(
            motion_of([(0.0, 0.0, 0.0), (1.0, 3 * STEP, 0.0)]),
            steppers(lower=np.array([[0.0, -0.1]]), upper=np.array([[4 * STEP, 0.1]])),
        )


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({"segment": 0.1}, "whole steps need both a segment and a step"),
        ({"segment": 0.0, "step": np.ones(2)}, "segment must be a positive time, got 0"),
        ({"segment": 0.1, "step": np.array([0.01, -1.0])}, r"step must be positive angles of shape \(2,\) or \(1, 2\)"),
        ({"segment": 0.1, "step": np.ones(2)}, "'P0': alpha makes 1 to 0 steps in 0.1 s"),
    ],
)
def test_senseless_steps_are_refused(given, complaint):
    with pytest.raises(TrajectoryError, match=complaint):
        shape(STRAIGHT, steppers(), **given)


@pytest.mark.parametrize("turn", [4e-7, 4e-4])
def test_turns_that_take_less_than_a_moment_are_made_at_the_least_speed(turn):
    """A planner's rounding, and a turn of 0.8 ms beside a knot of the other joint."""
    plane = limited(slowest=0.5, acceleration=None)
    motion = motion_of([(0.0, 0.0, 0.0), (0.5 + 5e-7, 0.5, 0.5 * turn), (1.0, 0.5, turn)])
    made = no_slower(motion, plane, np.array([0.1]))
    assert verify(plane, made).ok
    assert made.end[0, 1] == turn
