"""One of two that motors bring too near each other waits, on the path that it has."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.motion import Trajectory
from fiberplan.shaping.waiting import beginning_later, waits
from references import make_plane

CAPSULE = fp.Body(np.array([[0.0, 0.0], [15.0, 0.0]]), 1.5)
POST = fp.Obstacle("post", [[0.0, 60.0]], 1.0)
MARGIN, UNIT = 0.2, 0.125


def reaching(who, rest=10.0):
    """Three arms in a row, folded; some reach to the right and come back, within 4 s, and then rest."""
    plane = make_plane([[0.0, 0.0], [40.0, 0.0], [80.0, 0.0]], [CAPSULE], [POST], length=7.4, max_speed=4.0)
    knots = np.zeros((4, 3, 2))
    knots[:, :, 1] = np.pi
    for i, alpha in who.items():
        knots[:, i, 0] = alpha
        knots[1, i, 1] = 0.0
    return plane, Trajectory.from_samples(np.array([0.0, 2.0, 4.0, rest]), knots)


def found(plane, motion, longest, lacking=None):
    near = fp.verify(plane, motion, MARGIN)
    lacking = {each.pair: MARGIN - each.clearance for each in near.contacts} if lacking is None else lacking
    return waits(plane, motion, lacking, MARGIN, np.zeros(plane.n), UNIT, [longest])


def test_one_of_two_that_meet_waits_and_no_longer_than_it_has_to():
    plane, motion = reaching({0: 0.0, 1: np.pi})
    assert [each.pair for each in fp.verify(plane, motion, MARGIN).contacts] == [(0, 1)]
    later = found(plane, motion, 10.0)
    assert np.count_nonzero(later) == 1
    assert later.max() / UNIT == int(later.max() / UNIT)
    made = beginning_later(motion, later)
    assert fp.verify(plane, made, MARGIN).ok
    assert made.duration == 10.0  # of those that rest
    sooner = beginning_later(motion, np.where(later > 0.0, later - UNIT, 0.0))
    assert fp.verify(plane, sooner, MARGIN + 0.3).contacts


LEFT, RIGHT, IN, OUT = np.pi, 0.0, np.pi, 0.0


def of_knots(*arms):
    """A motion of (time, alpha, beta) of each arm."""
    offsets = np.cumsum([0, *map(len, arms)])
    times, *angles = np.concatenate([np.array(own, float) for own in arms]).T
    return Trajectory(offsets, times, np.stack(angles, axis=1))


@pytest.mark.parametrize("third_reaches", [False, True])
def test_who_waits_comes_near_nobody_else(third_reaches):
    """The middle one is done sooner, so it waits; longer where it would meet the third, which reaches over later."""
    plane, _ = reaching({})
    first = [(0, RIGHT, IN), (2, RIGHT, OUT), (4, RIGHT, IN), (12, RIGHT, IN), (14, RIGHT + 1, IN)]
    middle = [(0, LEFT, IN), (2, LEFT, OUT), (4, LEFT, IN), (5, RIGHT, IN), (7, RIGHT, OUT), (9, RIGHT, IN)]
    third = [(0, LEFT, IN), (5.25, LEFT, IN), (7.25, LEFT, OUT), (9.25, LEFT, IN)]
    motion = of_knots(first, middle, third if third_reaches else third[:1])
    assert [each.pair for each in fp.verify(plane, motion, MARGIN).contacts] == [(0, 1)]
    later = found(plane, motion, 18.0)
    assert later.tolist() == [0.0, 0.5 if third_reaches else 0.25, 0.0]
    assert fp.verify(plane, beginning_later(motion, later), MARGIN).ok


def test_one_that_meets_two_waits_for_both_and_they_need_not():
    """The outer ones are busy to the end, so that neither can wait."""
    plane, _ = reaching({})
    first = [(0, RIGHT, IN), (2, RIGHT, OUT), (4, RIGHT, IN), (16, RIGHT, IN), (18, RIGHT + 1, IN)]
    middle = [(0, LEFT, IN), (2, LEFT, OUT), (4, LEFT, IN), (5, RIGHT, IN), (7, RIGHT, OUT), (9, RIGHT, IN)]
    third = [(0, LEFT, IN), (5, LEFT, IN), (7, LEFT, OUT), (9, LEFT, IN), (16, LEFT, IN), (18, LEFT + 1, IN)]
    motion = of_knots(first, middle, third)
    assert {each.pair for each in fp.verify(plane, motion, MARGIN).contacts} == {(0, 1), (1, 2)}
    later = found(plane, motion, 18.0)
    assert np.flatnonzero(later).tolist() == [1]
    assert fp.verify(plane, beginning_later(motion, later), MARGIN).ok


@pytest.mark.parametrize(("longest", "helps"), [(4.2, False), (8.0, True)])
def test_nobody_ends_later_than_allowed(longest, helps):
    plane, motion = reaching({0: 0.0, 1: np.pi})
    later = found(plane, motion, longest)
    assert (later is not None) == helps
    if helps:
        assert max(later) + 4.0 <= longest


def test_past_what_stands_waiting_does_not_help():
    plane, motion = reaching({0: 0.0})
    for pair in ((0, -1), (0, 1), (1, 0), (1, 2)):
        assert found(plane, motion, 10.0, {pair: 0.1}) is None
    assert not found(plane, motion, 10.0, {}).any()


def test_the_path_stays_and_the_rest_at_its_end_is_left_out():
    _, motion = reaching({0: 0.0, 1: np.pi})
    made = beginning_later(motion, np.array([0.0, 2.5, 0.0]))
    times, angles = made.knots(1)
    np.testing.assert_array_equal(times, [0.0, 2.5, 4.5, 6.5])
    np.testing.assert_array_equal(angles, motion.knots(1)[1][[0, 0, 1, 2]])
    for i in (0, 2):
        np.testing.assert_array_equal(made.knots(i)[0], motion.knots(i)[0])
