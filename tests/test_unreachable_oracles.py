"""Proofs that a goal cannot be reached against shapely and a search of cells, with the compiler off."""

import numpy as np

from fiberplan.certificates.unreachable import _least_clearance, proven_unreachable
from fiberplan.focal_plane.bodies import Body, Obstacle
from references import four_bar_plane, make_plane, sampled_clearance

CAPSULE = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0)


def test_clearance_of_many_poses_is_of_the_nearest():
    rng = np.random.default_rng(0)
    for _ in range(4):
        posts = [Obstacle(f"post {k}", rng.uniform(-9, 9, (1, 2)), 1.0) for k in range(2)]
        plane = make_plane(rng.uniform(-9, 9, (3, 2)), [CAPSULE], posts)
        fixed, start = np.array([1, 3, 4]), plane.with_obstacles(rng.uniform(-3, 3, (3, 2)))
        poses = rng.uniform(-3, 3, (60, 2))
        found = _least_clearance(plane.arms, 0, fixed, start[fixed], poses)
        gaps = np.min([sampled_clearance(plane, 0, j, poses, np.tile(start[j], (60, 1))) for j in fixed], axis=0)
        apart = found > 0
        assert 5 < apart.sum() < 60
        np.testing.assert_allclose(found[apart], gaps[apart], atol=1e-9)
        assert np.all(gaps[~apart] <= 1e-9)
    assert _least_clearance(plane.arms, 0, fixed[:0], start[:0], poses).tolist() == [np.inf] * 60


def walled(gap, **others):
    """A stiff arm between two posts, past the second of which it fits if `gap` [mm] is positive."""
    posts = (Obstacle("near", [[0.0, 10.0]], 1.5), Obstacle("far", [[0.0, -(15.0 + 2.5 + gap)]], 1.5))
    ends = {"lower": np.array([[-5.0, 0.0]]), "upper": np.array([[1.7, 0.01]])}
    return make_plane([0, 0], [CAPSULE], posts, **(ends | others))


def test_pockets():
    start, goal = np.array([[0.7, 0.0]]), np.array([-3.9, 0.0])
    for gap, closed in ((-0.4, True), (0.4, False)):
        assert proven_unreachable(walled(gap), 0, start, goal, 0.0) == closed, gap
    assert proven_unreachable(walled(0.4), 0, start, goal, 0.8)
    assert not proven_unreachable(walled(-1.0), 0, start, np.array([0.3, 0.0]), 0.0)
    wide = walled(-1.0, lower=np.array([[-np.inf, 0.0]]), upper=np.array([[np.inf, 0.01]]))
    assert not proven_unreachable(wide, 0, start, goal, 0.0)
    many = walled(-1.0, lower=np.array([[-5.0, 0.0]]), upper=np.array([[1.7, 1e9]]))
    assert not proven_unreachable(many, 0, start, goal, 0.0)
    into = np.array([-np.pi / 2, 0.0])  # the goal itself is in the post
    assert proven_unreachable(walled(-3.0), 0, start, into, 0.0)
    flat = walled(-1.0, lower=np.array([[-5.0, 0.0]]), upper=np.array([[1.7, 0.0]]))
    assert proven_unreachable(flat, 0, start, goal, 0.0)
    assert not proven_unreachable(flat, 0, start, np.array([0.3, 0.0]), 0.0)


def test_who_never_moves():
    """An offline arm lies across the path; online it may go away."""
    ends = {"lower": np.tile([-1.0, 0.0], (2, 1)), "upper": np.tile([1.0, 0.01], (2, 1))}
    for order in ([[0, 0], [26, 0]], [[26, 0], [0, 0]]):
        i = 0 if order[0][0] == 0 else 1
        plane = make_plane(order, [CAPSULE], **(ends | {"zero": np.array([[0.0, 0.0], [np.pi, 0.0]])[:: 1 - 2 * i]}))
        start, goal = np.zeros((2, 2)), np.array([0.7, 0.0])
        start[i, 0] = -0.7
        assert not proven_unreachable(plane, i, start, goal, 0.0)
        online = np.ones(2, bool)
        online[1 - i] = False
        assert proven_unreachable(plane.replace(online=online), i, start, goal, 0.0)
        assert not proven_unreachable(plane.replace(online=online), i, start, np.array([-0.5, 0.0]), 0.0)
    four = four_bar_plane(np.random.default_rng(0), n=1)
    assert not proven_unreachable(four, 0, four.folded, four.folded[0], 50.0)


def test_boxes_get_finer_where_coarse_ones_prove_nothing():
    """Six degrees lose 0.8 mm by an arm of 15 mm; narrow boxes tell a gap that is shut by 0.03 mm from an open one."""
    start, goal = np.array([[0.7, 0.0]]), np.array([-3.9, 0.0])
    assert proven_unreachable(walled(-0.03), 0, start, goal, 0.0)
    assert not proven_unreachable(walled(0.03), 0, start, goal, 0.0)


def test_outlines_without_a_radius_block_at_margin_zero():
    """Such outlines are 0 mm apart at least: only their depth tells that they overlap all through a box."""
    bar = Body(np.array([[0.0, -1.0], [10.0, -1.0], [10.0, 1.0], [0.0, 1.0]]), 0.0, closed=True)
    ends = {"lower": np.array([[-5.0, 0.0]]), "upper": np.array([[1.7, 0.01]])}
    square = np.array([[-1.5, -1.5], [1.5, -1.5], [1.5, 1.5], [-1.5, 1.5]])
    start, goal = np.array([[0.7, 0.0]]), np.array([-3.9, 0.0])
    for gap, closed in ((-0.4, True), (0.4, False)):
        away = -(15.0 + 1.5 + gap)  # the bar is part of a stiff arm of 15 mm
        posts = [Obstacle(n, square + [0.0, y], 0.0, closed=True) for n, y in (("near", 10.0), ("far", away))]
        plane = make_plane([0, 0], [bar], posts, **ends)
        assert proven_unreachable(plane, 0, start, goal, 0.0) == closed, gap
