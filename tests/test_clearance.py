import numpy as np
import pytest

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import clearance, clearances
from references import STAR, links, make_plane, placed, sampled_clearance, varied_plane

ARM = np.array([[0.0, 0.0], [10.0, 0.0]])
BOX = np.array([[0.0, -2.0], [10.0, -2.0], [10.0, 2.0], [0.0, 2.0]])


def gap(plane, i, q_i, j, q_j=(0.0, 0.0)):
    return clearance(plane.arms, i, float(q_i[0]), float(q_i[1]), j, float(q_j[0]), float(q_j[1]))


def test_frames_are_the_direct_formula():
    rng = np.random.default_rng(0)
    plane = varied_plane(rng)
    for _ in range(50):
        i, (alpha, beta) = rng.integers(plane.n), rng.uniform(-9, 9, 2)
        bx, by, ex, ey, c1, s1, c2, s2, *_ = frame(plane.arms, i, alpha, beta)
        elbow, first, second = links(plane, i, np.array([[alpha, beta]]))
        np.testing.assert_allclose([bx, by, ex, ey], [*plane.base[i], *elbow[0]], atol=1e-13)
        expected = np.concatenate([np.cos(first), np.sin(first), np.cos(second), np.sin(second)])
        np.testing.assert_allclose([c1, s1, c2, s2], expected, atol=1e-13)


def test_beta_of_pi_is_folded_back():
    plane = make_plane([0, 0], [Body(ARM, 1.0)], length=10.0)
    np.testing.assert_allclose(plane.fibers(np.array([[0.7, np.pi]])), [[0.0, 0.0]], atol=1e-14)
    np.testing.assert_allclose(placed(plane, 0, plane.bodies[0], np.array([[0.7, np.pi]]))[0, 1], 0.0, atol=1e-14)


@pytest.mark.parametrize("seed", range(12))
def test_random_arms_and_obstacles_agree_with_shapely(seed):
    rng = np.random.default_rng(seed)
    plane = varied_plane(rng)
    angles = rng.uniform(-4, 4, (60, plane.n, 2))
    for i in range(plane.n):
        for j in range(i + 1, plane.n + len(plane.obstacles)):
            q_j = angles[:, j] if j < plane.n else np.zeros((60, 2))
            expected = sampled_clearance(plane, i, j, angles[:, i], q_j)
            found = [gap(plane, i, *pair) for pair in zip(angles[:, i], [j] * 60, q_j, strict=True)]
            back = [gap(plane, j, a, i, b) for a, b in zip(q_j, angles[:, i], strict=True)]
            np.testing.assert_allclose(found, expected, atol=1e-9)
            np.testing.assert_allclose(back, expected, atol=1e-9)


def test_random_arms_do_touch_and_do_not():
    """The scenes of the test above prove something."""
    touching = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        plane = varied_plane(rng)
        q = rng.uniform(-4, 4, (60, 2, 2))
        touching += list(sampled_clearance(plane, 0, 1, q[:, 0], q[:, 1]) < 0)
    assert 0.1 < np.mean(touching) < 0.9


def test_overlap_saturates_at_minus_the_radii():
    plane = make_plane([[0, 0], [3, 0]], [Body(ARM, 1.5)], length=0.0)
    assert gap(plane, 0, (0, np.pi / 2), 1, (0, np.pi / 2)) == pytest.approx(0.0)  # parallel, 3 mm apart
    assert gap(plane, 0, (0, 0.5), 1, (0, 2.0)) == -3.0
    assert gap(plane, 0, (0, 0.2), 1, (0, 2.9)) == -3.0  # however deep


@pytest.mark.parametrize("inner", [np.array([[3.0, 0.0]]), ARM * 0.1 + [3.0, 0.5], BOX * 0.1 + [4.0, 0.0]])
def test_containment_is_contact(inner):
    closed = len(inner) > 2
    outside = Obstacle("outline", BOX, 0.25, closed=True)
    plane = make_plane([0, 0], [Body(inner, 0.5, closed=closed)], [outside], length=0.0)
    assert gap(plane, 0, (0, 0), 1) == -0.75
    assert gap(plane, 1, (0, 0), 0) == -0.75
    hollow = make_plane([0, 0], [Body(inner, 0.1, closed=closed)], [Obstacle("line", BOX, 0.1)], length=0.0)
    assert gap(hollow, 0, (0, 0), 1) > 0  # a line around it is not touched


def test_both_outlines_and_neither_first_vertex_inside():
    across = BOX[:, ::-1] + [5.0, -5.0]  # a cross of two bars
    plane = make_plane([0, 0], [Body(BOX, 0.0, closed=True)], [Obstacle("bar", across, 0.3, closed=True)], length=0.0)
    assert gap(plane, 0, (0, 0), 1) == -0.3


def test_notch_of_a_concave_outline_is_free():
    plane = make_plane([0, 0], [Body(np.zeros((1, 2)), 0.05, link="base")], [Obstacle("star", STAR, closed=True)])
    notch, spike = 2.9 * STAR[0] / np.linalg.norm(STAR[0]), 2.9 * STAR[1] / np.linalg.norm(STAR[1])
    assert gap(plane.replace(base=notch[None]), 0, (0, 0), 1) > 0.3
    assert gap(plane.replace(base=spike[None]), 0, (0, 0), 1) == pytest.approx(-0.05)


@pytest.mark.parametrize(
    ("first", "second", "touch"),
    [
        (("a", ("a",)), ("a", ("a",)), True),
        (("a", ("a",)), ("b", ("b",)), False),
        (("a", ("b",)), ("b", ()), True),  # either is enough
        (("a", ()), ("b", ("a",)), True),
        (("a", ()), ("b", ()), False),
        (("a", ()), ("b", None), True),  # None meets everything
    ],
)
def test_layers(first, second, touch):
    arm = Body(ARM, 1.0, category=first[0], meets=first[1])
    post = Obstacle("post", np.array([[5.0, 0.0]]), 1.0, category=second[0], meets=second[1])
    plane = make_plane([0, 0], [arm], [post], length=0.0)
    assert gap(plane, 0, (0, 0), 1) == (-2.0 if touch else np.inf)


def test_misspelt_categories_are_refused():
    """They would switch collisions off."""
    plane = make_plane([0, 0], [Body(ARM, 1.0, meets=("amr",))])
    with pytest.raises(InstrumentError, match="'amr', a category that nothing has"):
        _ = plane.arms
    with pytest.raises(InstrumentError, match="list of categories"):
        Body(ARM, 1.0, meets="arm")


def test_no_bodies_no_contact():
    plane = make_plane([[0, 0], [1, 0]], [])
    assert gap(plane, 0, (0, 0), 1) == np.inf
    np.testing.assert_array_equal(plane.clearance(np.zeros((2, 2))), [np.inf])


UNKNOWN = [(np.nan, np.nan), (0.0, np.nan), (np.nan, 0.0), (np.inf, 0.0)]


@pytest.mark.parametrize("radius", [0.0, 1.0])
@pytest.mark.parametrize("shape", ["disc", "capsule", "outline", "star"])
def test_unknown_angles_are_never_clear(shape, radius):
    points = {"disc": ARM[1:], "capsule": ARM, "outline": BOX, "star": STAR + np.array([9.0, 0.0])}[shape]
    body = Body(points, radius, closed=shape in ("outline", "star"))
    plane = make_plane([[0, 0], [16, 0]], [body])
    for known in [(0.0, 1.5), (0.0, -1.5), (3.0, 0.0)]:
        for unknown in UNKNOWN:
            assert np.isnan(gap(plane, 0, known, 1, unknown))
            assert np.isnan(gap(plane, 1, unknown, 0, known))
            assert np.isnan(plane.clearance(np.array([known, unknown]))).all()


@pytest.mark.parametrize("closed", [False, True])
def test_unknown_angles_are_never_clear_of_obstacles(closed):
    plane = make_plane([0, 0], [Body(ARM, 0.0)], [Obstacle("camera", BOX + np.array([0.0, 12.0]), closed=closed)])
    for unknown in UNKNOWN:
        assert np.isnan(gap(plane, 0, unknown, 1))
        assert np.isnan(gap(plane, 1, (0.0, 0.0), 0, unknown))


def test_many_pairs_at_once_are_the_same():
    rng = np.random.default_rng(4)
    plane = varied_plane(rng, n=4)
    angles = plane.with_obstacles(rng.uniform(-3, 3, (4, 2)))
    pairs = np.array([[0, 1], [2, 1], [3, 6], [0, 4], [2, 5]])
    one_by_one = [gap(plane, i, angles[i], j, angles[j]) for i, j in pairs]
    np.testing.assert_array_equal(clearances(plane.arms, angles, pairs), one_by_one)
