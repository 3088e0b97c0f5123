import numpy as np
import pytest

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.instruments import names
from problems import ARM, SEVEN_PLACES

pytestmark = pytest.mark.small

TOML = '\nformat = 1\nname = "tiny"\n' + SEVEN_PLACES + ARM


@pytest.mark.large
@pytest.mark.parametrize(
    ("name", "n", "obstacles"),
    [
        ("sayres2021", 547, 0),
        ("sdss", 500, 66),
        ("hexagonal", 331, 0),
        ("moons", 1009, 0),
        ("makarem2014", 4921, 0),
        ("makarem2016", 1025, 0),
        ("pfs", 2394, 96),
        ("desi", 5000, 0),
        ("spec-s5", 13000, 0),
    ],
)
def test_built_in(name, n, obstacles):
    plane = FocalPlane.load(name)
    assert plane.n == n
    assert len(plane.obstacles) == obstacles
    assert plane.name == name
    assert plane.notes
    assert np.isfinite(plane.clearance(plane.folded)).all()
    assert plane.clearance(plane.folded).min() > 0
    assert name in names()


@pytest.mark.large
@pytest.mark.parametrize("name", names())
def test_what_has_no_source_is_an_assumption(name):
    """Numbers that we chose are said with every proof, not listed among the sources."""
    plane = FocalPlane.load(name)
    assert not any("chosen" in note for note in plane.notes[1:])  # the first is the title
    assert plane.assumptions or name == "sayres2021"  # all of whose numbers are the paper's


def test_numbers_of_the_papers():
    plane = FocalPlane.load("sayres2021")
    np.testing.assert_array_equal(plane.length, 7.4)
    np.testing.assert_array_equal(plane.fiber[0], [15.0, 0.0])
    np.testing.assert_allclose(np.degrees(plane.max_speed[0]), 30.0)
    np.testing.assert_allclose(np.degrees(plane.folded[0]), [0.0, 180.0])
    np.testing.assert_allclose(np.degrees(FocalPlane.load("sdss").max_speed[0]), 12.0)


@pytest.mark.large
def test_makarem2014_has_both_parities_and_the_disc_of_its_safety_distance():
    plane = FocalPlane.load("makarem2014")
    np.testing.assert_array_equal(plane.length, 3.0)
    np.testing.assert_array_equal(plane.fiber[0], [3.0, 0.0])
    np.testing.assert_allclose(np.degrees(plane.max_speed[0]) / 6.0, [30.0, 20.0])  # rpm
    np.testing.assert_allclose(np.degrees([plane.lower[0], plane.upper[0]]), [[0.0, -180.0], [360.0, 180.0]])
    (i, j) = plane.pairs[len(plane.pairs) // 2]
    assert np.hypot(*(plane.base[i] - plane.base[j])) == pytest.approx(10.0)
    k = len(plane.pairs) // 2
    for gap in (2.3, 1.9):  # fibers face to face, so far apart
        angles = plane.folded.copy()
        towards = np.arctan2(*(plane.base[j] - plane.base[i])[::-1])
        bend = 2 * np.arccos((10.0 - gap) / 2 / 6.0)
        angles[i], angles[j] = (towards - bend / 2, bend), (towards + np.pi - bend / 2, bend)
        assert plane.clearance(angles)[k] == pytest.approx(gap - 2.0, abs=1e-9)


def test_built_in_sdss_stands_where_the_real_one_does(calibration):
    nominal, real = FocalPlane.load("sdss"), FocalPlane.load(calibration)
    assert nominal.ids == real.ids
    assert np.abs(nominal.base - real.base).max() < 1.0
    centres = [np.array([o.points.mean(axis=0) for o in plane.obstacles]) for plane in (nominal, real)]
    assert {o.name for o in nominal.obstacles} == {o.name for o in real.obstacles}
    where = dict(zip((o.name for o in real.obstacles), centres[1], strict=True))
    for obstacle, centre in zip(nominal.obstacles, centres[0], strict=True):
        assert np.hypot(*(where[obstacle.name] - centre)) < 2.0


def test_definition(tmp_path):
    path = tmp_path / "tiny.toml"
    path.write_text(TOML)
    plane = FocalPlane.load(path)
    assert plane.ids == FocalPlane.hexagonal(1, 22.4).ids
    np.testing.assert_allclose(np.degrees(plane.max_speed[0]), [30, 20])
    assert plane.bodies[0].radius == 1.5


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("upper = 360", "upper = -360", r"joints.alpha.lower = 0: lower 0 deg is above upper -360 deg"),
        ("folded = 180", "folded = 181", r"joints.beta.folded = 181: folded 181 deg is outside 0 to 180 deg"),
        ("pitch = 22.4", "pitch = 0", r"line 7: grid.pitch = 0: must be above 0"),
        ("pitch = 22.4", "pitch = nan", r"line 7: grid.pitch = nan: must be a finite number"),
        ("pitch = 22.4", "", r"line 4: grid.pitch: is missing"),
        ("pitch = 22.4", "pitch = 22.4\nptich = 3", r"grid.ptich = 3: no such field; did you mean 'pitch'\?"),
        ("pitch = 22.4", 'pitch = "wide"', r"grid.pitch = 'wide': must be a number"),
        ("pitch = 22.4", 'pitch = 22.4\nempty = ["R1C1"]', r"grid.empty: the grid has no hole 'R1C1'; did you mean 'R"),
        ("pitch = 22.4", "pitch = = 22.4", r"line 7, column 9: is not valid TOML"),
        ("radius = 1.5", "radius = -1.5", r"bodies.0.radius = -1.5: must be 0 or more"),
        ("format = 1", "format = 2", r"format = 2: must be 1"),
    ],
)
def test_bad_definition_names_the_field(tmp_path, old, new, message):
    path = tmp_path / "bad.toml"
    path.write_text(TOML.replace(old, new))
    with pytest.raises(InstrumentError, match=message) as caught:
        FocalPlane.load(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_square_obstacle_faces_the_middle(tmp_path):
    path = tmp_path / "tiny.toml"
    path.write_text(TOML + '[[obstacles]]\nname = "c"\nsquare = { distance = 100.0, angle = 90.0, side = 10.0 }\n')
    obstacle = FocalPlane.load(path).obstacles[0]
    assert obstacle.closed
    np.testing.assert_allclose(sorted(obstacle.points.tolist()), [[-5, 95], [-5, 105], [5, 95], [5, 105]])


def rich_plane():
    rng = np.random.default_rng(1)
    plane = FocalPlane.hexagonal(1, 22.4)
    return plane.replace(
        name="Prüfstand",
        base=plane.base + rng.normal(size=(7, 2)),
        zero=rng.normal(size=(7, 2)),
        online=np.array([True, False] * 3 + [True]),
        fiber_offsets={"metrology": rng.normal(14.0, size=(7, 2)), "boss": rng.normal(size=(7, 2))},
        pair_margin=0.1 + 0.2,
        notes=("from a test", "Maße in mm"),
        bodies=(
            Body(
                rng.normal(size=(7, 3, 2)), rng.random(7), closed=True, category="höher", meets=("höher", "b"), name="x"
            ),
            Body(np.array([[0.0, 0.0]]), 0.3, link="alpha", category="b", meets=None, name="y"),
            Body(np.array([[0.0, 0.0], [1.0, 2.0]]), rng.random(7), link="base", meets=(), name="z"),
        ),
        obstacles=(Obstacle("dot", [[1.0, 2.0]], 0.5), Obstacle("edge", [[90.0, 0], [90, 9], [99, 9]], closed=True)),
    )


def assert_same_plane(a, b):
    assert (a.ids, a.name, a.pair_margin, a.notes) == (b.ids, b.name, b.pair_margin, b.notes)
    for field in ("base", "length", "folded", "lower", "upper", "max_speed", "zero", "online"):
        np.testing.assert_array_equal(getattr(a, field), getattr(b, field))
        assert getattr(b, field).dtype.isnative
        assert not getattr(b, field).flags.writeable
    assert list(a.fiber_offsets) == list(b.fiber_offsets)
    for name, offset in a.fiber_offsets.items():
        np.testing.assert_array_equal(offset, b.fiber_offsets[name])
    assert len(a.bodies) == len(b.bodies)
    assert len(a.obstacles) == len(b.obstacles)
    for left, right in zip((*a.bodies, *a.obstacles), (*b.bodies, *b.obstacles), strict=True):
        about = [(s.name, s.closed, s.category, s.meets, getattr(s, "link", None)) for s in (left, right)]
        assert about[0] == about[1]
        points = np.broadcast_to(right.points, np.broadcast_shapes(left.points.shape, right.points.shape))
        np.testing.assert_array_equal(np.broadcast_to(left.points, points.shape), points)
        np.testing.assert_array_equal(*np.broadcast_arrays(left.radius, right.radius))


@pytest.mark.parametrize("make", [rich_plane, lambda: FocalPlane.load("sdss"), lambda: FocalPlane.hexagonal(0, 1.0)])
def test_tables_round_trip_exactly(tmp_path, make):
    plane = make()
    plane.write(tmp_path / "plane.fits")
    assert_same_plane(plane, FocalPlane.load(tmp_path / "plane.fits"))


def test_a_plan_file_is_an_instrument_too(tmp_path, small_plan):
    small_plan.write(tmp_path / "plan.fits")
    assert_same_plane(small_plan.problem.plane, FocalPlane.load(tmp_path / "plan.fits"))
