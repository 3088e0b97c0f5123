"""An order of fields that shortens the motion: against all orders of a few, and within windows."""

import itertools

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.plan import Outcome
from fiberplan.scenes.decisive import row
from fiberplan.scenes.uniform import uniform_field
from fiberplan.survey import order
from problems import hexagon

pytestmark = pytest.mark.small


def at(plane, goal):
    """A plan that stands at a goal already, which is all that an order looks at."""
    still = fp.Trajectory.from_samples([0.0], goal[None])
    return fp.Plan(fp.Problem(plane, goal, goal), still, (Outcome.ARRIVED,) * plane.n, "none")


def fields(plane, count):
    return [at(plane, uniform_field(plane, seed)) for seed in range(count)]


def turned(plane, *degrees):
    """Fields in which the first of two arms has turned so far."""
    return [at(plane, plane.folded + np.radians([[turn, 0.0], [0.0, 0.0]])) for turn in degrees]


def motion(plane, listed, path):
    stops = [plane.folded, *(listed[k].trajectory.end for k in path)]
    return sum(plane.least_time(b - a).max() for a, b in itertools.pairwise(stops))


def test_fields_along_a_line_are_taken_as_they_lie():
    plane = row(2)
    found = order(turned(plane, 40.0, 10.0, 30.0, 20.0))
    assert found.fields == (1, 3, 2, 0)
    speed = np.degrees(plane.max_speed[0, 0])
    assert found.seconds == pytest.approx(40.0 / speed)
    assert found.given == pytest.approx((40.0 + 30.0 + 20.0 + 10.0) / speed)


@pytest.mark.parametrize("seed", range(2))
def test_few_fields_are_in_the_best_order_or_close_to_it(seed):
    plane = hexagon(1)
    listed = fields(plane, 24)[5 * seed : 5 * seed + 5]
    found = order(listed)
    assert found.seconds == pytest.approx(motion(plane, listed, found.fields))
    best = min(motion(plane, listed, path) for path in itertools.permutations(range(5)))
    assert found.seconds <= 1.05 * best
    assert found.given == pytest.approx(motion(plane, listed, range(5)))


@pytest.mark.large
def test_many_fields_are_a_permutation_that_is_shorter_than_given():
    plane = hexagon(1)
    found = order(fields(plane, 24), plane.folded)
    assert sorted(found.fields) == list(range(24))
    assert found.seconds < 0.85 * found.given
    assert found == order(fields(plane, 24), fp.State.folded(plane))


def test_every_field_is_observed_within_its_window():
    plane = hexagon(1)
    listed = fields(plane, 12)
    opens = np.random.default_rng(0).permutation(12) * 60.0
    windows = np.stack([opens, opens + 150.0], axis=1)
    found = order(listed, windows=windows, exposure=50.0)
    assert not found.left_out
    now, here = 0.0, plane.folded
    for k in found.fields:
        there = listed[k].trajectory.end
        now = max(now + plane.least_time(there - here).max(), windows[k, 0]) + 50.0
        assert now <= windows[k, 1]
        here = there


def test_a_field_that_is_never_visible_is_left_out():
    listed = turned(row(2), 10.0, 20.0)
    found = order(listed, windows=[[0.0, 1.0], [0.0, np.inf]], exposure=5.0)
    assert (found.fields, found.left_out, found.given) == ((1,), (0,), np.inf)


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"windows": [[0.0, 1.0]]}, "windows must be 2 rows"),
        ({"windows": [[3.0, 1.0], [0.0, 1.0]]}, "windows must be 2 rows"),
        ({"exposure": -1.0}, "exposure must be a time"),
        ({"state": np.zeros((3, 2))}, r"a state of shape \(3, 2\) for 2"),
    ],
)
def test_orders_that_make_no_sense(settings, complaint):
    with pytest.raises(ProblemError, match=complaint):
        order(turned(row(2), 10.0, 20.0), **settings)
    with pytest.raises(ProblemError, match="there are no fields"):
        order([])
    with pytest.raises(ProblemError, match="different focal planes"):
        order([*turned(row(2), 10.0), *fields(hexagon(1), 1)])
