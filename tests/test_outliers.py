"""Robots far from their kind are named; ordinary scatter is not."""

import numpy as np
import pytest

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.outliers import one_place_only, unusual

pytestmark = pytest.mark.small


@pytest.fixture
def scattered():
    """37 positioners with the scatter of a real array."""
    plane, rng = FocalPlane.hexagonal(3, 22.4), np.random.default_rng(0)
    return plane.replace(
        length=plane.length + rng.uniform(-0.1, 0.1, plane.n),
        lower=plane.lower - np.radians(rng.uniform(0, 10, (plane.n, 2))),
        upper=plane.upper + np.radians(rng.uniform(0, 10, (plane.n, 2))),
        zero=np.stack([rng.uniform(-np.pi, np.pi, plane.n), np.pi + rng.uniform(-0.1, 0.1, plane.n)], axis=1),
    )


def changed(array, *places):
    """A copy with values put at (index, value)."""
    array = np.array(array, float)
    for where, value in places:
        array[where] = value
    return array


def test_equal_robots_and_ordinary_scatter_are_no_note(scattered):
    assert unusual(FocalPlane.hexagonal(2, 22.4)) == ()
    assert unusual(scattered) == ()
    assert unusual(scattered.subset(np.arange(3))) == ()


@pytest.mark.parametrize(
    ("field", "places", "words"),
    [
        ("length", [(4, 73.9)], ["length 73.9 mm (the others 7.3"]),
        ("length", [(4, 73.9), (9, 74.0), (11, 0.0)], ["length 73.9 mm"]),  # one does not hide another
        ("lower", [((4, 1), np.radians(-73.5))], ["lower end of beta -73.5 deg"]),
        ("upper", [((4, 1), np.radians(263.0))], ["upper end of beta 263 deg"]),
        ("zero", [((4, 1), -np.pi + 1.0)], ["zero of beta"]),
        ("max_speed", [((4, 0), 3.0)], ["speed of alpha 171.887 deg/s (the others 30)"]),
        ("base", [(4, (900.0, 0.0))], ["distance to the next positioner"]),
    ],
)
def test_far_values_are_named(scattered, field, places, words):
    plane = scattered.replace(**{field: changed(getattr(scattered, field), *places)})
    notes = unusual(plane)
    assert len(notes) == len(places)
    assert all(f"'{plane.ids[4]}' is far from its kind" in notes[0] and word in notes[0] for word in words), notes


def test_the_tail_of_a_wide_column_is_no_note(scattered):
    tail = np.concatenate([np.zeros(25), np.linspace(0, 1.5, 12)])
    assert unusual(scattered.replace(length=7.4 + tail)) == ()


def test_a_robot_that_reaches_one_point_only_is_an_assumption(tmp_path, scattered):
    fiber = changed(scattered.fiber, (4, (0.0, 0.0)))
    plane = scattered.replace(length=changed(scattered.length, (4, 0.0)), fiber_offsets={"fiber": fiber})
    assert "reaches one point only" in one_place_only(plane)[0]
    online = np.ones(plane.n, bool)
    online[4] = False
    assert one_place_only(plane.replace(online=online)) == ()
    plane.write(tmp_path / "stand.fits")
    loaded = FocalPlane.load(tmp_path / "stand.fits")
    assert any("far from its kind" in note for note in loaded.notes)
    assert one_place_only(plane)[0] in loaded.assumptions
    loaded.write(tmp_path / "again.fits")
    assert FocalPlane.load(tmp_path / "again.fits").notes == loaded.notes  # said once


def test_many_are_counted(scattered):
    wide = FocalPlane.hexagonal(8, 22.4)
    plane = wide.replace(length=changed(wide.length, (np.arange(60), 9.0)))
    notes = unusual(plane)
    assert len(notes) == 21
    assert notes[-1].startswith("40 more positioners are far from their kind")


def test_real_calibrations_have_few(shared_data):
    folders = {"apo/wok_calibs/sloanFlatCMM": 0, "lco/wok_calibs/duPontFlatCMM": 2}
    for folder, few in folders.items():
        assert len(unusual(FocalPlane.load(shared_data / "sdss" / folder))) == few
