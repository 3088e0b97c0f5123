"""Robots that begin later so that power supplies have few moving at once: scenes by hand, windows by brute force."""

from functools import partial

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates import verify
from fiberplan.errors import TrajectoryError
from fiberplan.planners import GreedyFold
from fiberplan.scenes.decisive import row
from fiberplan.scenes.uniform import uniform_field
from fiberplan.shaping import load, staggered
from fiberplan.shaping.supply_load import Stretches, most_at_once
from references import motion_of

pytestmark = pytest.mark.small

FAR = row(4, 100.0).replace(max_speed=np.full((4, 2), 2.0))  #: arms that never meet
delayed = partial(staggered, hurry=False)


def turning(*seconds):
    """Alphas that turn at 1 rad/s, each for so long."""
    return motion_of(*([(0.0, 1.0, 2.0), (t, 1.0 + t, 2.0)] for t in seconds))


def plane_of(n):
    return FAR.subset(np.arange(n))


def test_of_two_robots_one_begins_when_the_other_is_done():
    made = delayed(turning(2.0, 2.0), plane_of(2), ("a", "a"))
    assert made.ok
    assert sorted(made.delay.tolist()) == [0.0, 2.0]
    assert made.longer == made.at_least == 2.0
    assert (made.before, made.after) == ({"a": 1.0}, {"a": 0.5})
    assert str(made).startswith("1 of 2 begin later, 2.000 s longer (at least 2.000 s); share that moves at once: a 1.")


def test_long_ones_of_which_too_many_must_overlap():
    """Moving times of 9 s fit twice into 4.5 s, but within less than 6 s all three overlap in the middle."""
    made = delayed(turning(3.0, 3.0, 0.5, 0.5), plane_of(4), ("a",) * 4, 0.25)
    assert made.at_least == made.longer == 4.0
    made = delayed(turning(3.0, 3.0, 3.0), plane_of(3), ("a",) * 3, 2 / 3)
    assert made.ok
    assert made.longer == pytest.approx(3.0)
    assert made.at_least == pytest.approx(3.0, abs=1e-3)  # the sum of moving times leaves 1.5 s


def test_supplies_that_have_enough_are_left_alone():
    motion = turning(2.0, 2.0)
    for supplies, share in ((("a", "b"), 0.5), (("a", "a"), 1.0)):
        made = delayed(motion, plane_of(2), supplies, share)
        assert made.ok
        assert made.trajectory is motion
        assert not made.delay.any()


def test_who_has_time_waits_and_nothing_gets_longer():
    """Two short motions fit one after the other beside a long one: two of three at once."""
    made = delayed(turning(5.0, 2.0, 3.0), plane_of(3), ("a",) * 3, 2 / 3)
    assert made.ok
    assert made.longer == made.at_least == 0.0
    assert made.after["a"] == pytest.approx(2 / 3)
    assert np.count_nonzero(made.delay) == 1
    assert made.delay[0] == 0.0


def test_rests_within_and_after_a_path_do_not_count():
    """The second turns while the first rests, and its last rest does not make the motion longer."""
    motion = motion_of(
        [(0.0, 1.0, 2.0), (1.0, 2.0, 2.0), (2.0, 2.0, 2.0), (3.0, 2.0, 1.0)],
        [(0.0, 1.0, 2.0), (1.0, 2.0, 2.0), (3.0, 2.0, 2.0)],
    )
    made = delayed(motion, plane_of(2), ("a", "a"))
    assert made.ok
    assert made.delay.tolist() == [0.0, 1.0]
    assert made.longer == 0.0


def test_who_begins_later_hurries():
    """At 2 rad/s both need half of their two seconds, so that one may follow the other in the time that there is."""
    motion, plane = turning(2.0, 2.0), plane_of(2)
    made = staggered(motion, plane, ("a", "a"))
    assert made.ok
    assert made.hurried.tolist() == [True, True]
    assert made.at_least == pytest.approx(0.0, abs=1e-5)
    assert made.longer < 0.05
    limited = plane.replace(max_acceleration=np.full((2, 2), 100.0))
    assert not staggered(motion, limited, ("a", "a")).hurried.any()


SIDE = np.radians([30.0, 150.0])  #: an arm that points to the right, or to the left, of two that are stretched out


def side_by_side(*alphas):
    """Two neighbours of which both turn alike, through the same alphas [rad], in a second each."""
    knots = [(float(k), alpha, 0.0) for k, alpha in enumerate(alphas)]
    return row(2).replace(max_speed=np.full((2, 2), 3.0)), motion_of(knots, knots)


@pytest.mark.parametrize(("alphas", "last"), [(SIDE, 1), (SIDE[::-1], 0)])
def test_the_order_is_one_in_which_they_do_not_meet(alphas, last):
    """Both turn to the left: whoever is on the left makes room first."""
    plane, motion = side_by_side(*alphas)
    made = delayed(motion, plane, ("a", "a"), margin=0.5)
    assert made.ok
    assert made.delay[last] == 1.0
    assert made.delay[1 - last] == 0.0
    wrong = motion_of(*(_knots(made.trajectory, k) for k in (1, 0)))
    assert not verify(plane, wrong, 0.5).ok


def _knots(trajectory, k):
    times, angles = trajectory.knots(k)
    return np.column_stack([times, angles]).tolist()


def test_what_cannot_be_is_named():
    """There and back side by side: neither can be there while the other is not."""
    plane, motion = side_by_side(SIDE[0], SIDE[1], SIDE[0])
    made = delayed(motion, plane, ("left", "left"), margin=0.5)
    assert made.certificate.ok
    assert made.over == ("left",)
    assert not made.ok
    assert "left 1.000 before, 1.000 after, 0.500 asked for" in str(made)
    assert made.at_least == 2.0


def test_one_robot_may_always_move():
    made = delayed(turning(1.0, 1.0), plane_of(2), ("a", "b"), 0.1)
    assert made.ok
    assert made.longer == 0.0
    assert made.allowed == {"a": 1.0, "b": 1.0}


def test_over_the_whole_motion_only_its_length_counts():
    """Moving times of 6 s of three robots: at half of them on average that takes 4 s."""
    made = delayed(turning(3.0, 2.0, 1.0), plane_of(3), ("a",) * 3, 0.5, window=np.inf)
    assert made.at_least == pytest.approx(1.0)
    assert made.ok
    assert 1.0 <= made.longer <= 1.6
    longer = motion_of([(0.0, 1.0, 2.0), (3.0, 4.0, 2.0)], [(0.0, 1.0, 2.0), (1.0, 2.0, 2.0)])
    assert delayed(longer, plane_of(2), ("a", "a"), 0.7, window=np.inf).longer == 0.0


def test_a_window_lets_more_move_for_a_moment():
    """Half a second each: on average over two seconds both may move at once, or one after the other."""
    motion = turning(0.5, 0.5, 2.5, 2.5)
    assert load(motion, ("a", "a", "b", "b"), 2.0) == {"a": 0.25, "b": 1.0}
    made = delayed(motion, plane_of(4), ("a", "a", "b", "b"), 0.6, window=2.0)
    assert made.ok
    assert not made.delay[:2].any()
    assert 0.5 < made.after["b"] <= 0.6
    assert made.after["b"] == load(made.trajectory, ("a", "a", "b", "b"), 2.0)["b"]
    assert made.longer >= made.at_least > 1.0


@pytest.mark.parametrize("window", [0.3, 1.0, 2.7, 30.0])
def test_windows_against_every_position(window):
    """Sampled every millisecond none exceeds the largest, and the best sample is as near as the slope allows."""
    rng = np.random.default_rng(5)
    begin = rng.uniform(0.0, 8.0, 40)
    end = begin + rng.uniform(0.05, 1.5, 40)
    duration = 10.0
    exact = most_at_once(Stretches(np.arange(40), begin, end), duration, window)
    width = min(window, duration)
    first = np.linspace(0.0, duration - width, 10_001)[:, None]
    within = np.maximum(0.0, np.minimum(end, first + width) - np.maximum(begin, first)).sum(axis=1) / width
    assert within.max() <= exact + 1e-9
    assert within.max() >= exact - 40 * 0.001 / width


def test_moments_against_every_moment():
    rng = np.random.default_rng(6)
    begin = np.round(rng.uniform(0.0, 8.0, 40), 1)
    end = begin + np.round(rng.uniform(0.1, 1.5, 40), 1)
    moments = np.arange(0.05, 10.0, 0.1)[:, None]
    expected = ((begin < moments) & (moments < end)).sum(axis=1).max()
    assert most_at_once(Stretches(np.arange(40), begin, np.round(end, 1)), 10.0, 0.0) == expected


def test_a_planted_robot_is_found():
    made = delayed(turning(2.0, 1.0, 1.5, 0.5), plane_of(4), ("a",) * 4, 0.25)
    assert load(made.trajectory, ("a",) * 4) == {"a": 0.25}
    for k in range(4):
        knots = [_knots(made.trajectory, i) for i in range(4)]
        knots[k] = [(t + 0.002 if made.delay[k] == 0 else t - 0.002, *angles) for t, *angles in knots[k]]
        assert load(motion_of(*knots), ("a",) * 4) == {"a": 0.5}


@pytest.fixture(scope="module")
def field():
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    start, goal = (uniform_field(plane, seed, 0.5) for seed in (4, 5))
    return GreedyFold().plan(fp.Problem(plane, start, goal, 0.5))


@pytest.mark.large
@pytest.mark.parametrize("window", [0.0, 3.0])
def test_a_dense_field_is_spread_over_its_supplies(field, window):
    supplies = [f"supply {i % 2}" for i in range(field.problem.n)]
    made = staggered(field.trajectory, field.problem.plane, supplies, 0.7, window, margin=0.5)
    assert made.ok, str(made)
    assert max(made.before.values()) > 0.7
    assert made.longer >= made.at_least
    np.testing.assert_array_equal(made.trajectory.start, field.trajectory.start)
    np.testing.assert_array_equal(made.trajectory.end, field.trajectory.end)
    again = staggered(field.trajectory, field.problem.plane, supplies, 0.7, window, margin=0.5)
    np.testing.assert_array_equal(made.delay, again.delay)
    np.testing.assert_array_equal(made.delay, np.round(made.delay, 3))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"share": 0.0}, "share must be above 0 and at most 1, got 0"),
        ({"share": 1.5}, "share must be above 0 and at most 1, got 1.5"),
        ({"window": -1.0}, "window must be a time of 0 s or more, got -1"),
        ({"supplies": ("a",)}, "1 supplies for 2 positioners"),
        ({"margin": -1.0}, "margin must be a length"),
        ({"position_error": [0.1, np.nan]}, "position error must be one length of 0 mm or more, or 2"),
        ({"position_error": [0.1] * 3}, "position error must be one length of 0 mm or more, or 2"),
        ({"plane": FAR}, "the motion has 2 positioners, the focal plane 4"),
    ],
)
def test_what_cannot_be_asked_is_refused(options, says):
    given = {"plane": plane_of(2), "supplies": ("a", "a")} | options
    with pytest.raises(TrajectoryError, match=says):
        staggered(turning(1.0, 1.0), **given)
