import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from fiberplan.focal_plane.bodies import Body
from fiberplan.kernels.arms import acceleration, motion
from references import STAR, make_plane, placed, varied_plane

TURN = st.floats(-3, 3)
TWO_LINKS = st.fixed_dictionaries({"l1": st.floats(0, 20), "x": st.floats(-30, 30), "y": st.floats(-30, 30)})


def largest_displacement(plane, i, start, step, samples=60):
    """How far any body point of positioner i gets from where it was, at any time during an even move."""
    angles = np.asarray(start) + np.linspace(0, 1, samples)[:, None] * np.asarray(step)
    tracks = [placed(plane, i, body, angles) for body in plane.bodies]
    return max(np.linalg.norm(t - t[:1], axis=2).max() for t in tracks)


@settings(max_examples=250, deadline=None, derandomize=True)
@given(TWO_LINKS, st.tuples(TURN, TURN), st.tuples(TURN, TURN))
def test_no_point_moves_farther_than_the_bound(arm, start, step):
    bodies = (Body(np.array([[0.0, 0.0], [arm["x"], arm["y"]]]), 1.0), Body(np.array([[4.0, 3.0]]), 1.0, link="alpha"))
    plane = make_plane([1, 2], bodies, length=arm["l1"])
    assert largest_displacement(plane, 0, start, step) <= motion(plane.arms, 0, *step) + 1e-9


def test_random_bodies_on_all_links():
    rng = np.random.default_rng(1)
    for seed in range(20):
        plane = varied_plane(np.random.default_rng(seed))
        for _ in range(15):
            i, start, step = rng.integers(plane.n), rng.uniform(-9, 9, 2), rng.normal(0, rng.choice([0.01, 1, 5]), 2)
            assert largest_displacement(plane, i, start, step) <= motion(plane.arms, i, *step) + 1e-9


def test_reached_by_small_stretched_moves():
    """The bound is the smallest of its kind: a stretched arm that turns as one attains it."""
    plane = make_plane([0, 0], [Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0)], length=5.0)
    moved = largest_displacement(plane, 0, (0.3, 0.0), (1e-4, 0.0))
    assert 0.999999 * motion(plane.arms, 0, 1e-4, 0.0) < moved <= motion(plane.arms, 0, 1e-4, 0.0)
    turned = motion(plane.arms, 0, 1e-3, -1e-3)
    assert turned == 5e-3  # the second link keeps its direction: only the elbow moves


def test_bodies_that_reach_beyond_the_fiber_count():
    plane = make_plane([0, 0], [Body(STAR * 5, 0.5, closed=True), Body(np.array([[-1.0, 30.0]]), 0.1)], length=3.0)
    assert motion(plane.arms, 0, 0.0, 0.1) >= 0.1 * np.hypot(1, 30)
    long_first = make_plane([0, 0], [Body(np.array([[40.0, 0.0]]), 1.0, link="alpha")], length=3.0)
    assert motion(long_first.arms, 0, 0.1, -0.1) == 4.0


def test_obstacles_and_base_bodies_do_not_move():
    plane = varied_plane(np.random.default_rng(0))
    for k in range(len(plane.obstacles)):
        assert motion(plane.arms, plane.n + k, 1.0, 1.0) == 0.0
        assert acceleration(plane.arms, plane.n + k, 1.0, 1.0) == 0.0
    fixed = make_plane([0, 0], [Body(np.array([[40.0, 0.0]]), 1.0, link="base")], length=0.0)
    assert motion(fixed.arms, 0, 1.0, 1.0) == 0.0


def test_no_point_accelerates_more_than_the_bound():
    rng = np.random.default_rng(2)
    h = 1e-4
    sharpest = 0.0
    for seed in range(40):
        plane = varied_plane(np.random.default_rng(seed))
        i, start, speed = rng.integers(plane.n), rng.uniform(-4, 4, 2), rng.uniform(-2, 2, 2)
        bound = acceleration(plane.arms, i, *speed)
        angles = start + np.array([[-h], [0.0], [h]]) * speed
        for body in plane.bodies:
            before, now, after = placed(plane, i, body, angles)
            found = np.linalg.norm(before - 2 * now + after, axis=1).max() / h**2
            assert found <= bound + 1e-4
            sharpest = max(sharpest, found / bound)
    assert sharpest > 0.9
