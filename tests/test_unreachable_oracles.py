"""Proofs that a goal cannot be reached against shapely and a search of cells, with the compiler off."""

import numpy as np

from fiberplan.certificates.unreachable import proven_unreachable
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels.arms import frame
from fiberplan.kernels.box_bounds import box_bounds
from fiberplan.kernels.depth import signed_clearance
from references import four_bar_plane, make_plane, sampled_clearance

CAPSULE = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0)


def test_bounds_over_boxes_hold_and_get_sharp():
    """Arms with bodies on all links anywhere in boxes of all widths: within bounds that are no wild guesses."""
    rng = np.random.default_rng(0)
    outline = np.array([[2.0, -1.0], [9.0, -2.0], [8.0, 2.0]])
    bodies = [CAPSULE, Body(outline, 0.3, closed=True), Body(np.array([[0.0, 0.0], [7.0, 1.0]]), 0.5, link="alpha")]
    posts = [Obstacle("post", np.array([[3.0, 4.0]]), 1.0)]
    sharp = 0
    for trial in range(30):
        plane = make_plane(rng.uniform(-12, 12, (2, 2)), bodies[trial % 3 : trial % 3 + 1], posts)
        pair = (0, 1) if trial % 2 else (0, 2)
        half = 10.0 ** rng.uniform(-4, 0) * rng.uniform(0, 1, (2, 2)) * (np.array(pair)[:, None] < 2)
        middle = rng.uniform(-3, 3, (2, 2)) * (np.array(pair)[:, None] < 2)
        frames = [frame(plane.arms, arm, *at) for arm, at in zip(pair, middle, strict=True)]
        args = [x for k in (0, 1) for x in (pair[k], frames[k], *half[k])]
        now, low, high, *ways = box_bounds(plane.arms, *args, 50.0, -50.0)
        off = rng.uniform(-1, 1, (60, 2, 2))
        off[:30] = np.sign(off[:30])
        at = middle + off * half
        seen = [signed_clearance(plane.arms, pair[0], *p[0], pair[1], *p[1]) for p in at]
        assert low - 1e-9 <= min(seen)
        assert max(seen) <= high + 1e-9
        gaps = sampled_clearance(plane, *pair, at[:, 0], at[:, 1])
        assert low - 1e-9 <= min(gaps)
        assert low <= now <= high
        assert (np.array(ways) <= 2 * np.array([40.0, 20.0, 40.0, 20.0]) * half.ravel() * (1 + half.sum())).all()
        sharp += high - max(low, now - (high - now)) < 3 * (max(seen) - min(seen))
    assert sharp > 8


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
