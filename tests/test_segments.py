import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from fiberplan.kernels.segments import point_to_segment, segment_to_segment, segments_cross
from references import segment_distance

COORDINATE = st.one_of(
    st.integers(-3, 3).map(float),  # parallel, touching, collinear and zero-length ones come of themselves
    st.floats(-10, 10, allow_subnormal=False),
    st.floats(-1e-6, 1e-6, allow_subnormal=False),
)
SEGMENTS = st.tuples(*[COORDINATE] * 8)


def distance(values):
    return math.sqrt(segment_to_segment(*values)[0])


def witness(values):
    a, b = np.array(values[:4]).reshape(2, 2), np.array(values[4:]).reshape(2, 2)
    short = [np.abs(s[1] - s[0]).max() < 1e-11 for s in (a, b)]  # shapely divides by the length
    return shapely.distance(
        *[shapely.Point(s[0]) if p else shapely.LineString(s) for s, p in zip((a, b), short, strict=True)]
    )


@settings(max_examples=600, deadline=None, derandomize=True)
@given(SEGMENTS)
def test_agrees_with_textbook_and_shapely(values):
    expected = segment_distance(*np.array(values).reshape(4, 2))
    assert distance(values) == pytest.approx(witness(values), abs=1e-9)
    assert distance(values) == pytest.approx(expected, abs=1e-6)  # the reference itself is poor if nearly parallel


@settings(max_examples=300, deadline=None, derandomize=True)
@given(SEGMENTS)
def test_vector_is_of_that_length_and_joins_the_two(values):
    d2, wx, wy = segment_to_segment(*values)
    assert wx * wx + wy * wy == pytest.approx(d2, rel=1e-12, abs=1e-300)
    ax, ay, bx, by, *other = values
    moved = (ax + wx, ay + wy, bx + wx, by + wy, *other)
    assert distance(moved) <= 1e-9  # carried along the vector, the first touches the second
    if d2 > 0:
        half = (ax + 0.5 * wx, ay + 0.5 * wy, bx + 0.5 * wx, by + 0.5 * wy, *other)
        assert distance(half) == pytest.approx(0.5 * math.sqrt(d2), abs=1e-9)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(SEGMENTS)
def test_symmetric_in_order_and_direction(values):
    ax, ay, bx, by, cx, cy, dx, dy = values
    d2, _, _ = segment_to_segment(*values)
    assert segment_to_segment(cx, cy, dx, dy, ax, ay, bx, by)[0] == pytest.approx(d2, rel=1e-9, abs=1e-18)
    assert segment_to_segment(bx, by, ax, ay, cx, cy, dx, dy)[0] == pytest.approx(d2, rel=1e-9, abs=1e-18)
    mirrored = segment_to_segment(ay, ax, by, bx, cy, cx, dy, dx)
    assert mirrored[0] == pytest.approx(d2, rel=1e-9, abs=1e-18)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((0, 0, 4, 0, 0, 3, 4, 3), 3.0),  # parallel
        ((0, 0, 4, 0, 1, 0, 2, 0), 0.0),  # one within the other
        ((0, 0, 4, 0, 6, 0, 9, 0), 2.0),  # collinear, apart
        ((0, 0, 4, 0, 4, 0, 9, 5), 0.0),  # ends touch
        ((0, 0, 4, 0, 2, 0, 2, 5), 0.0),  # an end on the inside
        ((0, 0, 4, 4, 0, 4, 4, 0), 0.0),  # crossing
        ((1, 1, 1, 1, 4, 5, 4, 5), 5.0),  # two points
        ((2, 2, 2, 2, 0, 0, 4, 0), 2.0),  # point and segment
        ((0, 0, 4, 0, 0, 0, 4, 0), 0.0),  # the same
        ((0, 0, 4, 0, 2, 1e-9, 2, 5), 1e-9),  # not quite touching
    ],
)
def test_special_positions(values, expected):
    values = tuple(map(float, values))
    assert distance(values) == pytest.approx(expected, abs=1e-15)
    swapped = values[4:] + values[:4]
    assert distance(swapped) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("scale", [1e-80, 1e-6, 1.0, 1e6, 1e80])
def test_scales(scale):
    rng = np.random.default_rng(1)
    for values in rng.uniform(-1, 1, (200, 8)):
        assert distance(values * scale) == pytest.approx(distance(values) * scale, rel=1e-9, abs=1e-15 * scale)


@pytest.mark.parametrize("shift", [1e3, 1e6])
def test_far_from_the_origin(shift):
    rng = np.random.default_rng(2)
    for values in rng.uniform(-10, 10, (300, 8)):
        moved = values + shift
        assert distance(moved) == pytest.approx(distance(values), abs=4e-16 * shift * 10)


def test_nearly_parallel_crossings_are_zero():
    rng = np.random.default_rng(3)
    for tilt in 10.0 ** rng.uniform(-15, -1, 300):
        at, angle = rng.uniform(-1, 1, 2), rng.uniform(0, 2 * np.pi)
        u, v = (np.array([np.cos(a), np.sin(a)]) for a in (angle, angle + tilt))
        ends = np.concatenate([at - rng.uniform(1, 9) * u, at + 9 * u, at - 2 * v, at + rng.uniform(1, 5) * v])
        assert distance(ends) <= 1e-14


def test_crossing_means_inside_of_both():
    assert segments_cross(0.0, 0.0, 2.0, 2.0, 0.0, 2.0, 2.0, 0.0)
    assert not segments_cross(0.0, 0.0, 2.0, 2.0, 1.0, 1.0, 2.0, 0.0)  # touches
    assert not segments_cross(0.0, 0.0, 2.0, 0.0, 1.0, 0.0, 3.0, 0.0)  # overlaps in line
    assert not segments_cross(0.0, 0.0, 1.0, 1.0, 0.0, 5.0, 5.0, 0.0)  # the lines cross, the segments do not


def test_not_a_number_stays_so():
    for k in range(8):
        values = [0.0, 0.0, 4.0, 0.0, 1.0, 2.0, 3.0, 3.0]
        values[k - k % 4 : k - k % 4 + 4] = [np.nan] * 4  # a link at an unknown angle: all its points are unknown
        assert np.isnan(segment_to_segment(*values)[0])
    assert np.isnan(point_to_segment(np.nan, 0.0, 0.0, 0.0, 1.0, 0.0)[0])


def test_point_to_segment():
    assert point_to_segment(1.0, 2.0, 0.0, 0.0, 4.0, 0.0) == (4.0, 0.0, -2.0)
    assert point_to_segment(-3.0, 4.0, 0.0, 0.0, 4.0, 0.0) == (25.0, 3.0, -4.0)
    assert point_to_segment(3.0, 4.0, 0.0, 0.0, 0.0, 0.0) == (25.0, -3.0, -4.0)


def test_segments_on_one_line_do_not_cross():
    """Rounding can put the ends of each on both sides of the other, however far apart they are."""
    rng = np.random.default_rng(0)
    for _ in range(3000):
        angle, gap = rng.uniform(0, 2 * np.pi), rng.uniform(1.0, 600.0)
        along = np.array([np.cos(angle), np.sin(angle)])
        a, b, c, d = (x * along for x in (-gap / 2 - 80.0, -gap / 2, gap / 2, gap / 2 + 80.0))
        d2, _, _ = segment_to_segment(*a, *b, *c, *d)
        assert np.sqrt(d2) == pytest.approx(gap, abs=1e-9)
