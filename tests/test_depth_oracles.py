"""Depth against the hull of all differences of points, and slopes against finite differences of it, compiler off."""

import itertools

import numpy as np
import pytest
import shapely
import shapely.affinity

from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels.arms import frame
from fiberplan.kernels.depth import separation, signed_clearance, signed_clearances, signed_gap
from fiberplan.kernels.slopes import clearance_slopes
from references import make_plane, placed
from test_clearance_oracles import cases, mixed_plane


def points_of(shape):
    """Vertices (k, 2), none twice."""
    return np.unique(shapely.get_coordinates(shape), axis=0)


def reference(a, b):
    """Signed distance of two convex sets of points: of the origin from the hull of all differences."""
    hull = shapely.MultiPoint((b[None] - a[:, None]).reshape(-1, 2)).convex_hull
    origin = shapely.Point(0, 0)
    if hull.geom_type == "Polygon" and hull.contains(origin):
        return -hull.exterior.distance(origin)
    return hull.distance(origin)


def test_pieces():
    depths = []
    for arms, (frame_i, frame_j), (p, r), (a, b) in cases():
        gap, nx, ny = signed_gap(arms, frame_i, p, frame_j, r)
        u, v = points_of(a), points_of(b)
        assert gap == pytest.approx(reference(u, v), abs=1e-9)
        assert np.hypot(nx, ny) == pytest.approx(1.0)
        along = np.array([nx, ny])
        assert (v @ along).min() - (u @ along).max() == pytest.approx(gap, abs=1e-9)  # moved by -gap they touch
        other = np.array([ny, -nx])
        assert separation(arms, frame_i, p, frame_j, r, ny, -nx) == pytest.approx((v @ other).min() - (u @ other).max())
        depths.append(gap < 0)
    assert 0.2 < np.mean(depths) < 0.8


def test_moved_apart_by_the_depth_shapes_only_touch():
    moved = 0
    for arms, (frame_i, frame_j), (p, r), (a, b) in cases():
        gap, nx, ny = signed_gap(arms, frame_i, p, frame_j, r)
        if gap < 0:
            moved += 1
            assert shapely.distance(a, shapely.affinity.translate(b, -gap * nx, -gap * ny)) < 1e-9
            assert not shapely.intersects(a, shapely.affinity.translate(b, (1e-9 - gap) * nx, (1e-9 - gap) * ny))
            for turn in np.linspace(0, 2 * np.pi, 24):  # no direction is shorter
                apart = shapely.affinity.translate(b, -0.98 * gap * np.cos(turn), -0.98 * gap * np.sin(turn))
                assert shapely.intersects(a, apart)
    assert moved > 20


def test_edges_of_a_hundredth_count_like_any():
    """Two plates of 0.04 mm that overlap by a quarter along one axis and by half along the other."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for scale in (0.02, 1.0, 50.0):
        for at in ([1.5, 1.0], [-1.5, 1.0], [1.0, 1.5], [1.0, -1.5]):
            plane = make_plane([[0, 0], np.multiply(at, scale)], [Body(square * scale, 0.0, closed=True)], length=0.0)
            gap = signed_clearance(plane.arms, 0, 0.0, 0.0, 1, 0.0, 0.0)
            assert gap == pytest.approx(-0.5 * scale, rel=1e-9)


def test_two_points_that_are_one():
    plane = make_plane([[0, 0], [0, 0]], [Body(np.zeros((1, 2)), 1.0)])
    at = frame(plane.arms, 0, 0.0, 0.0)
    assert signed_gap(plane.arms, at, 0, at, 1) == (0.0, 1.0, 0.0)
    assert np.isnan(signed_gap(plane.arms, at, 0, frame(plane.arms, 1, np.nan, 0.0), 1)[0])
    assert np.isnan(signed_clearance(plane.arms, 0, 0.0, 0.0, 1, np.nan, 0.0))


def whole(plane, i, j, angles):
    """Signed clearance of two arms whose bodies are all convex."""
    smallest = np.inf

    def bodies(arm):
        if arm >= plane.n:
            o = plane.obstacles[arm - plane.n]
            return [(o.points, o.radius, o.category, o.meets)]
        radii = [float(np.broadcast_to(b.radius, plane.n)[arm]) for b in plane.bodies]
        return [
            (placed(plane, arm, b, angles[[arm]])[0], r, b.category, b.meets)
            for b, r in zip(plane.bodies, radii, strict=True)
        ]

    for (a, r, mine, met), (b, s, other, also) in itertools.product(bodies(i), bodies(j)):
        if other in met or mine in also:
            smallest = min(smallest, reference(a, b) - r - s)
    return smallest


def test_arms_and_slopes():
    rng = np.random.default_rng(3)
    h, signs = 1e-6, []
    for _ in range(5):
        plane = mixed_plane(rng)
        angles = plane.with_obstacles(rng.uniform(-4, 4, (2, 2)))
        pairs = np.array([[0, 1], [1, 0], [0, 2], [1, 3], [4, 1], [3, 0]])
        found = signed_clearances(plane.arms, angles, pairs)
        np.testing.assert_allclose(found, [whole(plane, i, j, angles) for i, j in pairs], atol=1e-9)
        slopes = clearance_slopes(plane.arms, angles, pairs)
        np.testing.assert_array_equal(slopes[:, 0], found)
        for (i, j), row in zip(pairs, slopes, strict=True):
            for d, (arm, joint) in enumerate([(i, 0), (i, 1), (j, 0), (j, 1)]):
                if arm >= plane.n:
                    assert row[1 + d] == 0.0
                    continue
                more, less = angles.copy(), angles.copy()
                more[arm, joint] += h
                less[arm, joint] -= h
                expected = (whole(plane, i, j, more) - whole(plane, i, j, less)) / (2 * h)
                assert row[1 + d] == pytest.approx(expected, abs=2e-3)
        signs += list(found < 0)
    assert 0.1 < np.mean(signs) < 0.9


def test_slopes_of_a_tip_before_a_post():
    """d = sqrt(L^2 + D^2 - 2 L D cos a), whose slope in a is L D sin(a) / d; steps of 1e-5 get it to 1e-9."""
    plane = make_plane([0, 0], [Body(np.array([[10.0, 0.0]]), 1.0)], [Obstacle("post", [[20.0, 0.0]], 1.0)], length=0.0)
    ((gap, alpha, beta, *others),) = clearance_slopes(
        plane.arms, np.array([[0.3, 0.4], [0.0, 0.0]]), np.array([[0, 1]])
    )
    d = np.sqrt(500.0 - 400.0 * np.cos(0.7))
    assert gap == pytest.approx(d - 2.0, abs=1e-12)
    assert alpha == beta == pytest.approx(200.0 * np.sin(0.7) / d, abs=1e-7)
    assert others == [0.0, 0.0]
