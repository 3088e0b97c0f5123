import numpy as np
import pytest

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body
from references import links, make_plane, varied_plane

pytestmark = pytest.mark.small

ARM = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0)


@pytest.mark.parametrize(("rings", "count"), [(0, 1), (1, 7), (13, 547)])
def test_hexagonal(rings, count):
    plane = FocalPlane.hexagonal(rings, 22.4)
    assert (plane.n, len(set(plane.ids))) == (count, count)
    gaps = np.linalg.norm(plane.base[:, None] - plane.base[None], axis=2)[~np.eye(count, dtype=bool)]
    if count > 1:
        assert gaps.min() == pytest.approx(22.4)
    assert np.linalg.norm(plane.base, axis=1).max() == pytest.approx(22.4 * rings)
    np.testing.assert_allclose(plane.base.mean(axis=0), 0.0, atol=1e-9)
    assert np.all(np.diff(plane.base[:, 1]) > -1e-9)  # row by row from the lowest y
    assert "R0C1" in plane.ids


def test_hexagonal_settings():
    plane = FocalPlane.hexagonal(1, 10.0, (3.0, 4.0), 0.5, [1.0, 2.0], (-1.0, 0.5), (5.0, 3.0), (0.0, 3.0))
    np.testing.assert_array_equal(plane.max_speed, np.tile([1.0, 2.0], (7, 1)))
    np.testing.assert_array_equal(plane.lower[3], [-1.0, 0.5])
    np.testing.assert_array_equal(plane.upper[3], [5.0, 3.0])
    np.testing.assert_allclose(plane.reach, 7.5)
    assert plane.bodies[0].radius == 0.5
    for bad in ({"rings": -1, "pitch": 10.0}, {"rings": 1, "pitch": 0.0}, {"rings": 1, "pitch": np.nan}):
        with pytest.raises(InstrumentError, match="hexagon"):
            FocalPlane.hexagonal(**bad)


def test_pairs_of_the_hexagon():
    """Centre to centre 22.4 mm, reach 7.4 + 15 + 1.5 each: two rings of neighbours, and the third within 5 mm."""
    plane = FocalPlane.hexagonal(3, 22.4)
    gaps = np.linalg.norm(plane.base[:, None] - plane.base[None], axis=2)
    np.testing.assert_array_equal(plane.pairs, np.argwhere(np.triu(gaps < 2 * 23.9 + 5.0, 1)))
    assert np.all(np.bincount(plane.pairs.ravel(), minlength=plane.n) <= 36)
    assert len(plane.replace(pair_margin=0.0).pairs) <= len(plane.pairs)
    assert plane.clearance(plane.folded).shape == (len(plane.pairs),)


def test_fibers_are_the_direct_formula():
    rng = np.random.default_rng(0)
    for seed in range(5):
        plane = varied_plane(np.random.default_rng(seed), n=4).replace(
            fiber_offsets={"a": rng.normal(0, 5, (4, 2)), "b": np.array([3.0, -1.0])}
        )
        angles = rng.uniform(-9, 9, (4, 2))
        for name in (None, "a", "b"):
            u, v = plane.fiber_offsets[name or "a"].T
            for i in range(4):
                elbow, _, second = links(plane, i, angles[i : i + 1])
                c, s = np.cos(second[0]), np.sin(second[0])
                expected = elbow[0] + [c * u[i] - s * v[i], s * u[i] + c * v[i]]
                np.testing.assert_allclose(plane.fibers(angles, name)[i], expected, atol=1e-12)
                np.testing.assert_allclose(plane.elbows(angles)[i], elbow[0], atol=1e-12)
    with pytest.raises(InstrumentError, match="no fiber 'c'; it has a, b"):
        plane.fibers(angles, "c")
    np.testing.assert_array_equal(plane.fibers(angles, "B"), plane.fibers(angles, "b"))


def test_reach_holds_every_body_point():
    for seed in range(10):
        plane = varied_plane(np.random.default_rng(seed))
        farthest = np.zeros(plane.n)
        for body in plane.bodies:
            extent = np.linalg.norm(np.broadcast_to(body.points, (plane.n, *body.points.shape[-2:])), axis=2).max(
                axis=1
            )
            farthest = np.maximum(farthest, extent + body.radius + plane.length * (body.link == "beta"))
        np.testing.assert_allclose(plane.reach, farthest)


CASES = [
    ("base", (1, 0), np.nan, "nan mm is not a finite number"),
    ("base", (1, 1), np.inf, "y base inf mm"),
    ("length", (1,), -2.5, "length -2.5 mm is negative"),
    ("length", (1,), np.nan, "length nan"),
    ("zero", (1, 0), np.nan, "alpha zero nan"),
    ("folded", (1, 1), np.nan, "beta folded nan"),
    ("folded", (1, 1), 70.0, "beta folded 4010.7 deg lies outside"),
    ("lower", (1, 0), np.nan, "alpha lower nan"),
    ("lower", (1, 0), 63.0, "alpha lower 3609.63 deg is above the upper end"),
    ("upper", (1, 0), np.nan, "alpha lower -3600 deg is above the upper end"),
    ("max_speed", (1, 0), 0.0, "alpha max_speed 0 deg/s is not a positive speed"),
    ("max_speed", (1, 1), -1.0, "beta max_speed -57.2958 deg/s"),
    ("max_speed", (1, 1), np.inf, "beta max_speed inf"),
    ("max_speed", (1, 1), np.nan, "beta max_speed nan"),
]


@pytest.mark.parametrize(("name", "where", "value", "complaint"), CASES)
def test_bad_values_are_refused_by_name(name, where, value, complaint):
    plane = make_plane([[0, 0], [20, 0]], [ARM])
    values = getattr(plane, name).copy()
    values[where] = value
    with pytest.raises(InstrumentError) as caught:
        plane.replace(**{name: values})
    assert "'P1'" in str(caught.value)
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


def test_duplicate_ids_shapes_and_emptiness_are_refused():
    plane = make_plane([[0, 0], [20, 0], [40, 0]], [ARM])
    with pytest.raises(InstrumentError, match=r"'x' appears twice \(rows 0 and 2\)"):
        plane.replace(ids=("x", "y", "x"))
    for changed in ({"ids": ("x", "y ", "z")}, {"aliases": ("", "\ty", "")}):
        with pytest.raises(InstrumentError, match=r"'\t?y ?' begins or ends with a blank"):
            plane.replace(**changed)
    with pytest.raises(InstrumentError, match=r"base must have shape \(3, 2\), got \(2, 2\)"):
        plane.replace(base=np.zeros((2, 2)))
    with pytest.raises(InstrumentError, match="online must have shape"):
        plane.replace(online=np.ones(2, bool))
    with pytest.raises(InstrumentError, match="no fiber"):
        plane.replace(fiber_offsets={})
    with pytest.raises(InstrumentError, match="fiber 'fiber' nan"):
        plane.replace(fiber_offsets={"fiber": np.full((3, 2), np.nan)})
    with pytest.raises(InstrumentError, match="no positioners"):
        make_plane(np.empty((0, 2)), [ARM])


@pytest.mark.parametrize(
    "body",
    [
        Body(np.zeros((2, 3, 2)), 1.0, name="wrist"),
        Body(np.zeros((1, 3, 2)), 1.0, name="wrist"),
        Body(np.zeros((3, 2)), np.ones(2), name="wrist"),
    ],
)
def test_bodies_for_another_number_of_positioners_are_refused(body):
    with pytest.raises(InstrumentError, match="wrist"):
        _ = make_plane([[0, 0], [20, 0], [40, 0]], [body]).arms


def test_replace_changes_only_what_it_says():
    plane = varied_plane(np.random.default_rng(3))
    other = plane.replace(online=np.array([True, False, True]))
    assert (plane.online.all(), other.online.tolist()) == (True, [True, False, True])
    np.testing.assert_array_equal(other.base, plane.base)
    assert other.replace(base=plane.base + 1.0).arms.arm["x"][0] == plane.base[0, 0] + 1.0  # nothing stale is kept


def test_arrays_are_read_only_copies():
    base = np.zeros((1, 2))
    plane = make_plane(base, [ARM])
    base[0] = 9.0
    assert plane.base[0, 0] == 0.0
    for array in (plane.base, plane.length, plane.lower, plane.online, plane.fiber, plane.pairs, plane.arms.vertices):
        assert not array.flags.writeable


@pytest.mark.parametrize("seed", range(3))
def test_written_and_loaded_to_the_last_bit(tmp_path, seed):
    rng = np.random.default_rng(seed)
    plane = varied_plane(rng).replace(
        online=np.array([True, False, True]), name="varied", notes=("a note, with a µ",), pair_margin=1.0 / 3.0
    )
    plane.write(tmp_path / "plane.fits")
    again = FocalPlane.load(tmp_path / "plane.fits")
    assert (again.ids, again.name, again.notes, again.pair_margin) == (
        plane.ids,
        plane.name,
        plane.notes,
        plane.pair_margin,
    )
    for name in ("base", "length", "folded", "lower", "upper", "max_speed", "zero", "online"):
        np.testing.assert_array_equal(getattr(again, name), getattr(plane, name))
    for name in ("arm", "piece", "vertices"):
        np.testing.assert_array_equal(getattr(again.arms, name), getattr(plane.arms, name))
    assert list(again.fiber_offsets) == list(plane.fiber_offsets)
    np.testing.assert_array_equal(again.fiber, plane.fiber)
    assert [o.name for o in again.obstacles] == [o.name for o in plane.obstacles]
    angles = rng.uniform(-4, 4, (3, 2))
    np.testing.assert_array_equal(again.clearance(angles), plane.clearance(angles))
