"""Segments against shapely, on fixed inputs few enough for the compiler to be off."""

import numpy as np
import pytest
import shapely

from fiberplan.kernels.segments import point_to_segment, segment_to_segment, segments_cross

SPECIAL = [  # touching, parallel, collinear, one within the other, zero-length, crossing
    (0, 0, 4, 0, 0, 3, 4, 3), (0, 0, 4, 0, 1, 0, 2, 0), (0, 0, 4, 0, 6, 0, 9, 0), (0, 0, 4, 0, 4, 0, 9, 5),
    (0, 0, 4, 0, 2, 0, 2, 5), (0, 0, 4, 4, 0, 4, 4, 0), (1, 1, 1, 1, 4, 5, 4, 5), (2, 2, 2, 2, 0, 0, 4, 0),
    (0, 0, 4, 0, 0, 0, 4, 0), (0, 0, 0, 4, 3, 1, 3, 9), (-9, 3, 9, 3, 1, -2, 1, 8), (5, 5, 5, 5, 5, 5, 5, 5),
]  # fmt: skip


def inputs():
    rng = np.random.default_rng(0)
    values = [SPECIAL, rng.integers(-3, 4, (150, 8)), rng.uniform(-5, 5, (150, 8))]
    short = rng.uniform(-1, 1, (60, 8))
    short[:, 4:] = 0.02 * short[:, 4:] + np.tile(rng.uniform(-1, 1, (60, 2)), 2)
    return np.concatenate([*values, short, short[:, [4, 5, 6, 7, 0, 1, 2, 3]]]).astype(float)


def lines(points):
    """Shapely segments of points (n, 2, 2), or points where both ends are one."""
    same = (points[:, 0] == points[:, 1]).all(axis=1)
    return np.where(same, shapely.points(points[:, 0]), shapely.linestrings(points))


def test_distance_and_vector():
    values = inputs()
    found = np.array([segment_to_segment(*v) for v in values])
    a, b = values[:, :4].reshape(-1, 2, 2), values[:, 4:].reshape(-1, 2, 2)
    expected = shapely.distance(lines(a), lines(b))
    np.testing.assert_allclose(np.sqrt(found[:, 0]), expected, atol=1e-12)
    np.testing.assert_allclose(np.hypot(found[:, 1], found[:, 2]), expected, atol=1e-12)
    assert shapely.distance(lines(a + found[:, None, 1:]), lines(b)).max() < 1e-12
    assert (expected == 0).sum() > 50
    assert (expected > 0).sum() > 50


def test_crossing_is_of_the_insides():
    for v in inputs():
        a, b = v.reshape(2, 2, 2)
        if (a[0] == a[1]).all() or (b[0] == b[1]).all():
            continue
        assert segments_cross(*v) == shapely.crosses(shapely.LineString(a), shapely.LineString(b)), v


@pytest.mark.filterwarnings("ignore")
def test_crossings_of_every_shape_and_direction_are_found():
    """A tiny one across a long one, a long one across a tiny one, and two nearly in line that meet at their ends."""
    shapes = [
        (0, 0, 100, 0, 50, -0.01, 50.001, 0.01), (50, -0.01, 50.001, 0.01, 0, 0, 100, 0),
        (0, 0, 10, 0, 19.8, 0.02, 9.8, -2e-4), (0, 0, 1e4, 0, 5e3, -1e-4, 5e3, 1e-4),
    ]  # fmt: skip
    for values in shapes:
        for turn in (0.0, np.pi / 2, 1.0, 4.0):
            c, s = np.cos(turn), np.sin(turn)
            points = np.array(values, float).reshape(4, 2) @ np.array([[c, s], [-s, c]])
            assert segments_cross(*points.ravel())
            assert segment_to_segment(*points.ravel()) == (0.0, 0.0, 0.0)


def test_segments_on_one_line_do_not_cross_by_rounding():
    rng = np.random.default_rng(0)
    said = 0
    for _ in range(600):
        angle, gap = rng.uniform(0, 2 * np.pi), rng.uniform(1.0, 600.0)
        along = np.array([np.cos(angle), np.sin(angle)])
        v = np.concatenate([x * along for x in (-gap / 2 - 80.0, -gap / 2, gap / 2, gap / 2 + 80.0)])
        said += segments_cross(*v)
        assert np.sqrt(segment_to_segment(*v)[0]) == pytest.approx(gap, abs=1e-9)
    assert said  # rounding did put ends on both sides


def test_point_to_segment():
    assert point_to_segment(1.0, 2.0, 0.0, 0.0, 4.0, 0.0) == (4.0, 0.0, -2.0)
    assert point_to_segment(-3.0, 4.0, 0.0, 0.0, 4.0, 0.0) == (25.0, 3.0, -4.0)
    assert point_to_segment(9.0, 4.0, 0.0, 0.0, 6.0, 0.0) == (25.0, -3.0, -4.0)
    assert point_to_segment(3.0, 4.0, 0.0, 0.0, 0.0, 0.0) == (25.0, -3.0, -4.0)
    rng = np.random.default_rng(1)
    for v in rng.uniform(-3, 3, (60, 6)):
        p, line = shapely.Point(v[:2]), shapely.LineString(v[2:].reshape(2, 2))
        d2, wx, wy = point_to_segment(*v)
        assert np.sqrt(d2) == pytest.approx(p.distance(line), abs=1e-12)
        assert shapely.Point(v[0] + wx, v[1] + wy).distance(line) < 1e-12
