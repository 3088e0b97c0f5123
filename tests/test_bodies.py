import numpy as np
import pytest
import shapely

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.outlines import side
from fiberplan.kernels.clearance import clearance
from references import STAR, make_plane

pytestmark = pytest.mark.small

SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
COMB = np.array([[0, 0], [9, 0], [9, 5], [8, 5], [8, 1], [6, 1], [6, 5], [5, 5], [5, 1], [3, 1], [3, 5], [0, 5]], float)


def random_star(rng, count):
    """A simple outline around the origin with notches."""
    angle = (np.arange(count) + rng.uniform(0, 0.9, count)) * 2 * np.pi / count
    return rng.uniform(0.5, 6.0, count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def pieces_of(points, closed=True):
    return Obstacle("o", points, closed=closed).pieces()


def is_convex(piece):
    if len(piece) < 4:
        return True
    shape = shapely.Polygon(piece)
    return shape.is_valid and shape.area == pytest.approx(shape.convex_hull.area, rel=1e-9)


def test_discs_capsules_and_lines():
    assert [len(p) for p in pieces_of(SQUARE[:1], closed=False)] == [1]
    assert [len(p) for p in pieces_of(SQUARE[:2], closed=False)] == [2]
    line = pieces_of(SQUARE, closed=False)
    assert len(line) == 3
    np.testing.assert_array_equal(np.concatenate([line[0], line[1][1:], line[2][1:]]), SQUARE)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("outline", [SQUARE, COMB, STAR, random_star(np.random.default_rng(0), 12)])
def test_outlines_are_covered_by_convex_pieces_exactly(outline, reverse):
    outline = outline[::-1] if reverse else outline
    pieces = pieces_of(outline)
    assert all(is_convex(piece) for piece in pieces)
    union = shapely.union_all([shapely.Polygon(p) for p in pieces])
    assert union.symmetric_difference(shapely.Polygon(outline)).area < 1e-9
    assert sum(shapely.Polygon(p).area for p in pieces) == pytest.approx(shapely.Polygon(outline).area, rel=1e-12)


def test_random_outlines_keep_their_area():
    rng = np.random.default_rng(5)
    for _ in range(150):
        outline = random_star(rng, rng.integers(3, 16))
        outline = np.roll(outline[:: rng.choice([-1, 1])], rng.integers(16), axis=0)
        if not shapely.Polygon(outline).is_valid:
            continue
        pieces = pieces_of(outline)
        assert all(is_convex(piece) for piece in pieces)
        assert sum(shapely.Polygon(p).area for p in pieces) == pytest.approx(shapely.Polygon(outline).area)
        points = rng.uniform(-6, 6, (20, 2))
        inside = shapely.contains_xy(shapely.Polygon(outline), *points.T)
        found = np.any([shapely.contains_xy(shapely.Polygon(p).buffer(1e-9), *points.T) for p in pieces], axis=0)
        np.testing.assert_array_equal(found, inside)


def test_points_along_straight_edges_are_harmless():
    many = shapely.get_coordinates(shapely.segmentize(shapely.Polygon(COMB), 0.5))[:-1]
    pieces = pieces_of(many)
    assert sum(shapely.Polygon(p).area for p in pieces) == pytest.approx(shapely.Polygon(COMB).area)
    square = shapely.get_coordinates(shapely.segmentize(shapely.Polygon(SQUARE), 0.4))[:-1]
    assert len(pieces_of(square)) == 1  # still convex


CROSSING = {
    "bow tie": [[0, 0], [2, 0], [0, 2], [2, 2]],
    "uneven bow tie": [[0, 0], [2, 2], [2, 0], [0, 1]],
    "pentagram": [[np.cos(4 * np.pi * k / 5), np.sin(4 * np.pi * k / 5)] for k in range(5)],
    "crossed tail": [[0, 0], [3, 0], [3, 1], [1, -1], [0, -1]],
    "crossed legs": [[0, 0], [4, 0], [4, 3], [1, -1], [3, -1], [0, 3]],
}


@pytest.mark.parametrize("name", CROSSING)
def test_outline_that_crosses_itself_is_refused(name):
    with pytest.raises(InstrumentError, match="crosses itself"):
        pieces_of(np.array(CROSSING[name], float))


@pytest.mark.parametrize("outline", [[[0, 0], [1, 0], [2, 0]], [[0, 0], [2, 2], [1, 1], [3, 3]]])
def test_outline_without_area_is_refused(outline):
    """It has no inside, and every point of the endless line through it would seem to lie there."""
    with pytest.raises(InstrumentError):
        pieces_of(np.array(outline, float))


@pytest.mark.parametrize("roll", range(4))
@pytest.mark.parametrize("outline", [SQUARE, COMB[[0, 1, 2, 11]]])
def test_outline_may_repeat_its_first_point(outline, roll):
    """As files often write rings; the extra point adds nothing, least of all along the lines of the edges."""
    ring = np.roll(outline, roll, axis=0)
    ring = np.concatenate([ring, ring[:1]])
    post = Body(np.array([[0.0, 0.0]]), 0.5, link="base")
    for corner in outline:
        for far in ([0.0, 50.0], [50.0, 0.0], [-50.0, 0.0], [0.0, -50.0]):
            plane = make_plane([corner + far], [post], [Obstacle("ring", ring, closed=True)])
            expected = shapely.Polygon(outline).distance(shapely.Point(corner + far)) - 0.5
            assert clearance(plane.arms, 0, 0.0, 0.0, 1, 0.0, 0.0) == pytest.approx(expected)


def test_pieces_of_each_positioners_own_points():
    points = np.stack([SQUARE, SQUARE * 3])
    body = Body(points, 0.0, closed=True)
    np.testing.assert_array_equal(body.pieces(1)[0], SQUARE * 3)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"points": np.empty((0, 2))}, "shape"),
        ({"points": np.array([1.0, 2.0])}, "shape"),
        ({"points": np.array([[1.0, np.nan]])}, "finite"),
        ({"points": np.array([[1.0, np.inf]])}, "finite"),
        ({"radius": -1.0}, "radius -1.0"),
        ({"radius": np.nan}, "radius nan"),
        ({"link": "gamma"}, "gamma"),
    ],
)
def test_body_errors_name_the_body_and_the_value(change, complaint):
    with pytest.raises(InstrumentError, match=complaint) as caught:
        Body(**({"points": SQUARE, "radius": 1.0, "name": "wrist"} | change))
    assert "wrist" in str(caught.value)
    if "link" not in change:
        with pytest.raises(InstrumentError, match="camera"):
            Obstacle(**({"points": SQUARE, "radius": 1.0, "name": "camera"} | change))


def test_bodies_keep_their_own_read_only_copy():
    points = SQUARE.copy()
    body = Body(points, 1.0)
    points[:] = 9.0
    np.testing.assert_array_equal(body.points, SQUARE)
    with pytest.raises(ValueError, match="read-only"):
        body.points[0, 0] = 1.0


def test_valid_outlines_whose_edges_nearly_touch_are_taken():
    """Down to distances that squared are zero; what shapely calls valid has an inside, and all of it is covered."""
    rng, taken = np.random.default_rng(0), 0
    for _ in range(700):
        outline = random_star(rng, rng.integers(5, 14))
        moved, edge = rng.integers(len(outline), size=2)
        one, other = outline[edge], outline[(edge + 1) % len(outline)]
        if moved in (edge, (edge + 1) % len(outline)):
            continue
        across = np.array([one[1] - other[1], other[0] - one[0]]) / np.hypot(*(other - one))
        outline[moved] = (
            one + rng.uniform() * (other - one) + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-17, -3) * across
        )
        if not shapely.Polygon(outline).is_valid:
            continue
        taken += 1
        pieces = pieces_of(outline)
        assert sum(shapely.Polygon(p).area for p in pieces) == pytest.approx(shapely.Polygon(outline).area, rel=1e-9)
    assert taken > 150


TOUCHING = {
    "vertex on an edge": [[0, 0], [4, 0], [4, 4], [2, 0], [0, 4]],
    "vertex on a vertex": [[0, 0], [4, 0], [4, 4], [2, 1], [0, 4], [0, 2], [2, 1], [0, 1]],
    "edge on an edge": [[0, 0], [4, 0], [4, 4], [3, 0], [1, 0], [0, 4]],
    "spike": [[0, 0], [4, 0], [9, 0], [4, 0], [4, 4], [0, 4]],
}


@pytest.mark.parametrize("name", TOUCHING)
@pytest.mark.parametrize("scale", [1.0, 1e-150, 1e150, 0.1])
def test_outline_that_touches_itself_is_refused(name, scale):
    with pytest.raises(InstrumentError, match="crosses itself"):
        pieces_of(np.array(TOUCHING[name], float) * scale)


def test_sides_are_exact():
    a, b = np.array([0.5, 0.5]), np.array([12.0, 12.0])
    for k in range(-20, 21):
        c = np.array([24.0 + k * 2.0**-48, 24.0])  # rounding alone would call most of these collinear, or worse
        assert side(a, b, c) == -np.sign(k)
        assert side(b, a, c) == np.sign(k)


@pytest.mark.large
@pytest.mark.parametrize("shape", ["star", "comb"])
def test_outlines_of_thousands_of_vertices(shape):
    if shape == "star":
        outline = random_star(np.random.default_rng(1), 3000)
    else:
        teeth = np.stack([np.arange(1500.0), np.where(np.arange(1500) % 2, 9.0, 1.0)], axis=1)
        outline = np.concatenate([teeth, [[1499.0, 0.0], [0.0, 0.0]]])
    area = sum(shapely.Polygon(piece).area for piece in pieces_of(outline))
    assert area == pytest.approx(shapely.Polygon(outline).area, rel=1e-9)


def test_positioners_of_one_outline_share_its_pieces():
    plane = FocalPlane.hexagonal(1, 22.4)
    notched = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 1.0], [0.0, 3.0]])
    outlines = np.stack([notched + [0.1 * (i % 2), 0.0] for i in range(plane.n)])
    radii = np.linspace(0.1, 0.7, plane.n)
    made = plane.replace(bodies=(Body(outlines, radii, closed=True), Body(SQUARE, 0.2, closed=True, link="alpha")))
    arms = made.arms
    for i in range(plane.n):
        mine = arms.piece[arms.arm["first_piece"][i] : arms.arm["last_piece"][i]]
        shapes = [arms.vertices[piece["first"] : piece["last"]] for piece in mine]
        for shape, piece in zip(shapes, [*made.bodies[0].pieces(i), SQUARE], strict=True):
            np.testing.assert_array_equal(shape, piece)
        np.testing.assert_allclose(mine["radius"], [*[radii[i]] * (len(mine) - 1), 0.2])
    assert len(np.unique(arms.piece["first"])) == 2 * (len(made.bodies[0].pieces(0))) + 1


def test_distance_from_an_obstacle():
    notched = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 1.0], [0.0, 3.0]])
    points = np.array([[1.0, 1.0], [2.0, 2.0], [6.0, 1.0], [2.0, -3.0]])
    filled = [0.0, np.sqrt(0.5), 2.0, 3.0]
    for outline in (notched, notched[::-1]):
        np.testing.assert_allclose(Obstacle("o", outline, closed=True).distance(points), filled)
    np.testing.assert_allclose(
        Obstacle("o", notched, 0.5, closed=True).distance(points), np.fmax(np.array(filled) - 0.5, 0)
    )
    np.testing.assert_allclose(Obstacle("o", notched[:2]).distance(points), [1.0, 2.0, np.sqrt(5), 3.0])
    np.testing.assert_allclose(Obstacle("o", notched[:1], 1.0).distance(points), np.hypot(*points.T) - 1.0)
