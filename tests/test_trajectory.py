import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fiberplan.errors import TrajectoryError
from fiberplan.motion import Trajectory
from fiberplan.motion.moves import moves
from references import motion_of, sampled

pytestmark = pytest.mark.small


def random_motion(seed, n=4, first=0.0):
    """Ragged knots; the earliest of all is at `first`, some positioners begin later and all end when they like."""
    rng = np.random.default_rng(seed)
    knots = []
    for i in range(n):
        times = np.cumsum(rng.uniform(0.01, 3.0, rng.integers(1, 6)))
        times += first - times[0] if i == 0 or rng.random() < 0.5 else first
        knots.append([(t, *rng.uniform(-5, 5, 2)) for t in times])
    return motion_of(*knots)


def angles_at(motion, times):
    return np.stack([motion.at(t) for t in times])


SEEDS = st.integers(0, 10**6)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(SEEDS)
def test_linear_between_knots_and_held_outside(seed):
    motion = random_motion(seed, first=seed % 3)
    times = np.concatenate([np.linspace(-1, motion.duration + 1, 80), motion.times])
    expected = np.stack([sampled(motion, i, times) for i in range(motion.n)], axis=1)
    np.testing.assert_allclose(angles_at(motion, times), expected, atol=1e-12)
    np.testing.assert_array_equal(motion.at(0.0 - 1), motion.start)
    np.testing.assert_array_equal(motion.at(motion.duration), motion.end)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(SEEDS)
def test_reversed_runs_backwards(seed):
    motion = random_motion(seed)
    back = motion.reversed()
    times = np.linspace(-0.5, motion.duration + 0.5, 90)
    np.testing.assert_allclose(angles_at(back, times), angles_at(motion, motion.duration - times), atol=1e-10)
    assert back.duration == pytest.approx(motion.duration)
    np.testing.assert_allclose(back.reversed().times, motion.times, atol=1e-12)
    np.testing.assert_array_equal(back.reversed().angles, motion.angles)


def test_reversed_keeps_the_duration_of_a_motion_that_begins_late():
    motion = motion_of([(1.0, 0.0, 0.0), (3.0, 1.0, 1.0)], [(2.0, 0.5, 0.5)])
    back = motion.reversed()
    assert back.duration == motion.duration
    np.testing.assert_allclose(back.reversed().at(2.0), motion.at(2.0))


def test_knots_closer_than_the_clock_resolves_can_be_reversed():
    motion = motion_of([(0.0, 0.0, 0.0), (1e-20, 0.0, 0.0), (5.0, 1.0, 1.0)])
    np.testing.assert_allclose(motion.reversed().at(2.5), [[0.5, 0.5]])


@settings(max_examples=80, deadline=None, derandomize=True)
@given(SEEDS, SEEDS)
def test_then_is_one_after_the_other(first_seed, second_seed):
    first, second = random_motion(first_seed), random_motion(second_seed, first=second_seed % 2)
    shift = np.repeat(first.end - second.start, np.diff(second.offsets), axis=0)
    second = Trajectory(second.offsets, second.times, second.angles + shift)
    both = first.then(second)
    assert both.duration == pytest.approx(first.duration + second.duration)
    times = np.linspace(0, first.duration - 1e-6, 60)
    np.testing.assert_allclose(angles_at(both, times), angles_at(first, times), atol=1e-8)
    times = np.linspace(1e-6, second.duration + 1, 60)
    np.testing.assert_allclose(angles_at(both, first.duration + times), angles_at(second, times), atol=1e-8)


def test_there_and_back():
    motion = random_motion(5)
    both = motion.then(motion.reversed())
    np.testing.assert_array_equal(both.start, both.end)
    for t in np.linspace(0, motion.duration, 30):
        np.testing.assert_allclose(both.at(t), both.at(2 * motion.duration - t), atol=1e-9)


def test_then_refuses_a_jump_and_another_number():
    motion = motion_of([(0, 0, 0), (1, 1, 1)], [(0, 0, 0)])
    with pytest.raises(TrajectoryError, match="positioner 1 ends"):
        motion.then(motion_of([(0, 1, 1)], [(0, 0, 0.25)]))
    with pytest.raises(TrajectoryError):
        motion.then(motion_of([(0, 1, 1)]))


def test_from_samples_is_the_same_for_all():
    rng = np.random.default_rng(1)
    times, angles = np.array([0.0, 0.5, 2.0]), rng.normal(size=(3, 5, 2))
    motion = Trajectory.from_samples(times, angles)
    assert (motion.n, motion.duration) == (5, 2.0)
    for t, q in zip(times, angles, strict=True):
        np.testing.assert_allclose(motion.at(t), q, atol=1e-15)
    np.testing.assert_allclose(motion.at(1.25), 0.5 * (angles[1] + angles[2]))
    with pytest.raises(TrajectoryError, match="shape"):
        Trajectory.from_samples(times, angles[:2])
    with pytest.raises(TrajectoryError, match="shape"):
        Trajectory.from_samples(times, angles[..., 0])


def test_at_rest():
    motion = Trajectory.at_rest(np.ones((3, 2)))
    assert motion.duration == 0.0
    np.testing.assert_array_equal(motion.at(7.0), np.ones((3, 2)))
    assert motion.reversed().duration == 0.0


def test_arrays_are_read_only_copies():
    times = np.array([0.0, 1.0])
    motion = Trajectory(np.array([0, 2]), times, np.zeros((2, 2)))
    times[0] = 0.5
    assert motion.times[0] == 0.0
    for array in (motion.offsets, motion.times, motion.angles):
        assert not array.flags.writeable


@pytest.mark.parametrize(
    ("offsets", "times", "angles", "complaint"),
    [
        ([0, 1], [0.0, 1.0], np.zeros((2, 2)), "offsets"),
        ([1, 2], [0.0, 1.0], np.zeros((2, 2)), "offsets"),
        ([], [], np.zeros((0, 2)), "offsets"),
        ([0, 0, 2], [0.0, 1.0], np.zeros((2, 2)), "positioner 0 has no knot"),
        ([0, 2, 1, 3], [0.0, 1.0, 2.0], np.zeros((3, 2)), "positioner 1 has no knot"),
        ([0, 2], [0.0, 1.0], np.zeros((2, 3)), "shape"),
        ([0, 2], [0.0, 1.0], np.zeros((3, 2)), "shape"),
        ([0, 1, 3], [5.0, 1.0, 1.0], np.zeros((3, 2)), "positioner 1: time does not increase after 1.0 s"),
        ([0, 1, 3], [5.0, 2.0, 1.0], np.zeros((3, 2)), "positioner 1"),
        ([0, 2], [-1.0, 1.0], np.zeros((2, 2)), "positioner 0.*-1.0"),
        ([0, 2], [0.0, np.nan], np.zeros((2, 2)), "positioner 0.*nan"),
        ([0, 2], [0.0, np.inf], np.zeros((2, 2)), "positioner 0.*inf"),
        ([0, 1, 2], [0.0, 0.0], np.array([[0.0, 0.0], [0.0, np.nan]]), "positioner 1.*nan"),
        ([0, 1, 2], [0.0, 0.0], np.array([[0.0, 0.0], [np.inf, 0.0]]), "positioner 1.*inf"),
    ],
)
def test_what_is_no_trajectory_is_refused(offsets, times, angles, complaint):
    with pytest.raises(TrajectoryError, match=complaint):
        Trajectory(np.array(offsets, int), np.array(times, float), angles)


def test_even_motion_over_a_knot_is_one_move_and_a_rest_parts_two():
    knots = [(0, 0.0, 0.0), (1, 1.0, 0.0), (2, 2.0, 0.0), (3, 2.0, 0.0), (4, 3.0, 0.0), (5, 3.0, 1.0)]
    found = moves(motion_of(knots))
    assert [(move.segment, move.start, move.duration) for move in found] == [
        (1, 0.0, 2.0),
        (2, 3.0, 1.0),
        (3, 4.0, 1.0),
    ]
    assert [move.speed for move in found] == [(1.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
