"""Clearance of pieces and of arms against shapely, with the compiler off."""

import itertools

import numpy as np
import pytest
import shapely
import shapely.affinity

from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import (
    clearance,
    clearance_within,
    clearances,
    far_apart,
    frames_clearance,
    meet,
    piece_to_piece,
)
from fiberplan.kernels.convex import convex_distance
from references import four_bar_plane, geometry, make_plane, placed, sampled_clearance

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
SHAPES = [
    np.array([[0.5, 0.3]]),
    np.array([[-1.5, 0.2], [1.5, -0.4]]),
    np.array([[-1.0, -1.0], [2.0, 0.0], [0.0, 1.5]]),
    SQUARE * [4.0, 0.5],
    SQUARE[::-1] * 3.0,  # clockwise, and large enough to hold the others
    np.array([[2.0, 0.0], [0.6, 1.9], [-1.6, 1.2], [-1.6, -1.2], [0.6, -1.9]]),
]


def two_of(first, second):
    """Two positioners: the pieces of the first are of `first`, the other's of `second`; (plane, their pieces)."""
    bodies = [Body(first, 0.25, closed=len(first) > 2), Body(second, 0.5, closed=len(second) > 2)]
    return make_plane([[0, 0], [0, 0]], bodies, length=0.0)


def cases():
    rng = np.random.default_rng(0)
    for first, second in itertools.product(SHAPES, SHAPES):
        plane = two_of(first, second)
        for reach in (0.3, 2.0, 5.0):
            at = rng.normal(0, reach, 2)
            plane = plane.replace(base=np.array([[0.0, 0.0], at]))
            q = rng.uniform(-3, 3, (2, 2))
            frames = frame(plane.arms, 0, *q[0]), frame(plane.arms, 1, *q[1])
            p, r = int(plane.arms.arm["first_piece"][0]), int(plane.arms.arm["first_piece"][1]) + 1
            shapes = [
                geometry(placed(plane, i, plane.bodies[i], q[i][None]), plane.bodies[i].closed)[0] for i in (0, 1)
            ]
            yield plane.arms, frames, (p, r), shapes


def test_pieces_of_any_number_of_vertices():
    apart = []
    for arms, (frame_i, frame_j), (p, r), (a, b) in cases():
        d2, wx, wy = piece_to_piece(arms, frame_i, p, frame_j, r)
        expected = shapely.distance(a, b)
        assert np.sqrt(d2) == pytest.approx(expected, abs=1e-12)
        assert np.hypot(wx, wy) == pytest.approx(expected, abs=1e-12)
        assert shapely.distance(shapely.affinity.translate(a, wx, wy), b) < 1e-12
        back, _, _ = piece_to_piece(arms, frame_j, r, frame_i, p)
        assert np.sqrt(back) == pytest.approx(expected, abs=1e-12)
        apart.append(expected > 0)
    assert 0.2 < np.mean(apart) < 0.8


def outline(rng, count):
    """Points on an ellipse, round about: convex, thin or wide, edges long and short."""
    at = np.sort(rng.uniform(0, 2 * np.pi, count))
    return np.stack([3 * np.cos(at), rng.uniform(0.05, 3) * np.sin(at)], axis=1)


def distances(first, second, at):
    """What the kernel has between two outlines, the second moved by `at` [mm]: distance and vector."""
    plane = two_of(first, second).replace(base=np.array([[0.0, 0.0], at]))
    p, r = 0, int(plane.arms.arm["first_piece"][1]) + 1
    d2, wx, wy = convex_distance(plane.arms, frame(plane.arms, 0, 0.0, 0.0), p, frame(plane.arms, 1, 0.0, 0.0), r)
    return np.sqrt(d2), np.array([wx, wy])


def test_outlines_of_many_corners_near_and_far():
    rng, known = np.random.default_rng(2), []
    for k in range(200):
        first, second = outline(rng, rng.integers(3, 30)), outline(rng, rng.integers(3, 30))
        at = rng.normal(0, 1, 2) * [0.5, 3.0, 8.0, 300.0][k % 4]
        a, b = shapely.Polygon(first), shapely.Polygon(second + at)
        if k % 5 == 0:  # led to within 1e-6 mm of each other, or of touching
            ends = shapely.shortest_line(a, b)
            at = at - (1 - 1e-6) * np.subtract(*np.array(ends.coords)[::-1]) if ends.length else at
            b = shapely.Polygon(second + at)
        found, vector = distances(first, second, at)
        assert found == pytest.approx(shapely.distance(a, b), abs=1e-12)
        assert np.hypot(*vector) == pytest.approx(found, abs=1e-12)
        assert shapely.distance(shapely.affinity.translate(a, *vector), b) < 1e-12
        known.append(shapely.distance(a, b))
    assert min(k for k in known if k) < 1e-3
    assert max(known) > 100
    assert known.count(0.0) > 20


def test_edges_that_hardly_overlap_are_as_far_apart_as_they_are():
    """Squares beside each other, corner by corner: the corners are almost as near as the edges."""
    for gap in (0.01, 1.0, 3.0):
        for overlap in (1e-12, 1e-9, 8e-9, 1e-7, -1e-9):
            found, vector = distances(5 * SQUARE, 5 * SQUARE, np.array([10 + gap, 10 - overlap * gap]))
            assert found == pytest.approx(gap, abs=1e-13)
            assert vector == pytest.approx([gap, 0.0], abs=1e-8 * gap)


def test_outlines_that_just_touch_or_lie_in_line():
    for at, expected in (
        ([2.0, 0.0], 0.0),  # edge on edge
        ([2.0, 2.0], 0.0),  # corner on corner
        ([2.0 + 1e-9, 2.0], 1e-9),
        ([0.0, 0.0], 0.0),  # one in place of the other
        ([0.1, 0.0], 0.0),  # in line
        ([7.0, 0.0], 5.0),
        ([2.0 - 1e-9, 0.5], 0.0),
    ):
        assert distances(SQUARE, SQUARE, np.array(at))[0] == pytest.approx(expected, abs=1e-15)
    for point in ([1.0, 0.5], [0.0, 0.0], [1.0, 1.0], [-0.999, 0.999]):  # on an edge, within, a corner
        assert distances(np.array([[0.0, 0.0]]), SQUARE, -np.array(point))[0] == 0.0
    flat = np.array([[-3.0, 0.0], [0.0, -1e-9], [3.0, 0.0]])  # as good as on a line
    for at, expected in (([8.0, 0.0], 2.0), ([0.0, 2.0], 2.0), ([5.0, 3.0], 3.0), ([0.5, 0.0], 0.0)):
        assert distances(flat, flat, np.array(at))[0] == pytest.approx(expected, abs=2e-9)


def test_unknown_frames_are_not_numbers():
    for first, second in itertools.product(SHAPES[:3], SHAPES[:3]):
        plane = two_of(first, second)
        known, unknown = frame(plane.arms, 0, 0.1, 0.2), frame(plane.arms, 1, np.nan, 0.0)
        p, r = 0, int(plane.arms.arm["first_piece"][1]) + 1
        assert np.isnan(piece_to_piece(plane.arms, known, p, unknown, r)[0])
        assert np.isnan(piece_to_piece(plane.arms, unknown, r, known, p)[0])
        only_second = frame(plane.arms, 1, 0.0, np.nan)
        assert np.isnan(piece_to_piece(plane.arms, known, p, only_second, r)[0])
        assert np.isnan(piece_to_piece(plane.arms, only_second, r, known, p)[0])
        assert np.isnan(clearance(plane.arms, 0, 0.0, 0.0, 1, 0.0, np.nan))
        assert np.isnan(clearance(plane.arms, 0, 0.0, np.nan, 1, 0.0, 0.0))


def test_who_meets_whom():
    names = ("a", "b", "c")
    choices = [("a", ("a",)), ("b", ("a", "c")), ("c", ()), ("b", ()), ("c", None)]
    for (mine, met), (other, also) in itertools.product(choices, choices):
        bodies = [Body(SHAPES[0], 0.0, category=name, meets=(), name=name) for name in names]
        bodies[0:0] = [Body(SHAPES[0], 0.0, category=mine, meets=met), Body(SHAPES[0], 0.0, category=other, meets=also)]
        arms = make_plane([0, 0], bodies).arms
        expected = met is None or also is None or other in met or mine in also
        assert meet(arms, 0, 1) == expected == meet(arms, 1, 0)


def test_far_apart_is_by_circles_and_of_outlines_only():
    answers = []
    for arms, (frame_i, frame_j), (p, r), (a, b) in cases():
        radii = float(arms.piece[p]["radius"] + arms.piece[r]["radius"])
        centers, reach = [], 0.0
        for piece, frame_ in ((arms.piece[p], frame_i), (arms.piece[r], frame_j)):
            points = arms.vertices[piece["first"] : piece["last"]]
            middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
            reach += np.linalg.norm(points - middle, axis=1).max()
            base, turn = complex(*frame_[:2]), complex(*frame_[6:8])
            centers.append(base + turn * complex(*middle))
        room = abs(centers[1] - centers[0]) - reach - radii
        outlines = a.geom_type == "Polygon" or b.geom_type == "Polygon"
        for gap in (room - 1e-6, room + 1e-6, -1.0, -reach - radii - 9.0, np.inf):
            far = gap + reach + radii
            found = far_apart(arms, frame_i, p, frame_j, r, gap)
            assert found == (outlines and 0.0 < far < np.inf and gap < room)
            answers.append(found)
            if found:
                assert shapely.distance(a, b) - radii > gap - 1e-9
    assert 0.1 < np.mean(answers) < 0.9


def mixed_plane(rng):
    """Two positioners with bodies of three kinds at two heights, and three obstacles."""
    bodies = (
        Body(np.array([[0.0, 0.0], [8.0, 0.5]]), rng.uniform(0.2, 1.0, 2), category="low", meets=("low",)),
        Body(SHAPES[5] + [5.0, 0.0], 0.3, closed=True, category="high", meets=("high",)),
        Body(SHAPES[2], 0.2, closed=True, link="alpha", category="low", meets=("low",)),
        Body(np.zeros((1, 2)), 0.7, link="base", category="low", meets=("low",)),
    )
    fixed = (
        Obstacle("post", rng.uniform(-12, 12, (1, 2)), 1.0, category="low", meets=("high",)),
        Obstacle("plate", SQUARE * 2 + rng.uniform(-12, 12, 2), 0.1, closed=True, category="high", meets=("low",)),
        Obstacle("wall", rng.uniform(-12, 12, (2, 2)), 0.1, category="low", meets=()),
    )
    length = rng.uniform(1, 5, 2)
    return make_plane(rng.uniform(-6, 6, (2, 2)), bodies, fixed, length=length, zero=rng.uniform(-3, 3, (2, 2)))


def test_arms():
    rng = np.random.default_rng(5)
    all_found = []
    for seed in range(8):
        plane = mixed_plane(rng) if seed % 3 else four_bar_plane(rng)
        angles = plane.with_obstacles(rng.uniform(-4, 4, (plane.n, 2)))
        pairs = np.array([(i, j) for i, j in itertools.combinations(range(len(angles)), 2) if i < plane.n])
        pairs = np.concatenate([pairs, pairs[:, ::-1]])
        expected = [sampled_clearance(plane, i, j, angles[[i]], angles[[j]])[0] for i, j in pairs]
        found = clearances(plane.arms, angles, pairs)
        np.testing.assert_allclose(found, expected, atol=1e-9)
        for (i, j), gap in zip(pairs, found, strict=True):
            frames = frame(plane.arms, i, *angles[i]), frame(plane.arms, j, *angles[j])
            assert frames_clearance(plane.arms, i, frames[0], j, frames[1]) == gap
            assert clearance(plane.arms, i, *angles[i], j, *angles[j]) == gap
            for floor, cap in ((-np.inf, 3.0), (1.0, np.inf), (-9.0, -5.0), (0.0, 2.0)):
                within = clearance_within(plane.arms, i, frames[0], j, frames[1], floor, cap)
                if gap >= floor:
                    assert within == min(gap, cap)
                else:
                    assert gap <= within < floor or within == cap < floor
        all_found += list(found)
    assert 0.1 < np.mean(np.array(all_found) < 0) < 0.9


def test_overlap_saturates_and_layers_that_never_meet_are_infinitely_far():
    arm, other = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.5), Obstacle("post", [[5.0, 0.0]], 0.5)
    plane = make_plane([0, 0], [arm], [other], length=0.0)
    assert clearance(plane.arms, 0, 0.0, 0.0, 1, 0.0, 0.0) == -2.0
    apart = make_plane(
        [0, 0], [Body(arm.points, 1.5, category="a", meets=())], [Obstacle("b", [[5.0, 0]], 1, meets=())]
    )
    assert clearance(apart.arms, 0, 0.0, 0.0, 1, 0.0, 0.0) == np.inf
