"""Places on the sky, and in the focal plane; which targets lie in which field."""

import numpy as np
import pytest
from astropy import units as u
from astropy.coordinates import SkyCoord
from astropy.table import Table
from astropy.time import Time

from fiberplan.errors import InstrumentError, TargetError
from fiberplan.scenes import clustered_sky
from fiberplan.survey import Fields, SkyPositions, SurveyTargets, Telescope

pytestmark = pytest.mark.small

TOY = Telescope("toy", [2000.0, 0.0, 3e4], 0.02)


def test_y_points_along_the_position_angle_and_x_east_or_west():
    north, east = SkyPositions([2.0], [0.51]), SkyPositions([2.0 + 0.001 / np.cos(0.5)], [0.5])
    assert TOY.place(north, 2.0, 0.5) == pytest.approx(np.array([[0.0, 20.0 + 3e4 * 1e-6]]), abs=1e-9)
    assert TOY.place(east, 2.0, 0.5)[0] == pytest.approx([2.0, 0.0], abs=2e-3)
    turned = TOY.place(east, 2.0, 0.5, np.pi / 2)[0]
    assert turned == pytest.approx([0.0, 2.0], abs=2e-3)
    west = Telescope("toy", TOY.scale, TOY.radius, x_east=False).place(east, 2.0, 0.5)[0]
    assert west == pytest.approx([-2.0, 0.0], abs=2e-3)
    assert np.isnan(TOY.place(SkyPositions([2.0], [0.5201]), 2.0, 0.5)).all()


@pytest.mark.parametrize("name", ["apo", "mayall", "subaru", "sdss", "desi", "pfs"])
def test_there_and_back(name):
    telescope = Telescope.load(name)
    rng = np.random.default_rng(0)
    r, phi = float(telescope.distance(telescope.radius)) * np.sqrt(rng.random(50)), 6.3 * rng.random(50)
    points = np.stack([r * np.cos(phi), r * np.sin(phi)], axis=1)
    centre = 6.28, 1.2, 0.7  # across 0 h, far north
    assert telescope.place(telescope.sky(points, *centre), *centre) == pytest.approx(points, abs=1e-7)
    with pytest.raises(InstrumentError, match="the field ends at"):
        telescope.sky(np.array([[1e4, 0.0]]), *centre)


def test_scales_are_those_of_their_sources():
    theta = np.radians(1.5)
    assert Telescope.load("mayall").distance(theta) == pytest.approx(
        ((8.297e5 * theta - 1750.0) * theta + 1.394e4) * theta, abs=1e-6
    )
    assert Telescope.load("subaru").distance(np.radians(0.5)) == pytest.approx(
        319.88636084 * 0.5 + 15.41683427 * 0.5**3 + 2.68815792 * 0.5**5 + 4.02875740 * 0.5**7
    )


@pytest.mark.filterwarnings("ignore:ERFA")
def test_proper_motion_is_that_of_astropy():
    fast = SkyPositions([1.0, 1.0], [1.2, 1.2], [0.0, 5e-5], [0.0, -4e-5], [2016.0, 2016.0])
    then = fast.at(2030.0)
    assert (then.ra[0], then.dec[0]) == (1.0, 1.2)
    motion = {"pm_ra_cosdec": 5e-5 * u.rad / u.yr, "pm_dec": -4e-5 * u.rad / u.yr}
    now = SkyCoord(1.0 * u.rad, 1.2 * u.rad, obstime=Time(2016.0, format="jyear"), **motion)
    there = now.apply_space_motion(new_obstime=Time(2030.0, format="jyear"))
    assert (then.ra[1], then.dec[1]) == pytest.approx((there.ra.rad, there.dec.rad), abs=1e-9)
    assert then.dec[1] < 1.2


def test_a_target_that_moves_into_a_field_is_in_it():
    fields = Fields(("before", "after"), ra=[1.0, 1.0], dec=[0.0, 0.0], year=[2016.0, 2036.0])
    catalogue = Table({"ra": [1.0, 1.0], "dec": [0.0200001, 0.0], "pm_dec": [-1e-4, 0.0]})
    for name in ("ra", "dec"):
        catalogue[name].unit = "rad"
    catalogue["pm_dec"].unit = "rad/yr"
    lying = SurveyTargets.of(catalogue).lying_in(fields, TOY)
    assert [lying.of(k)[0].tolist() for k in (0, 1)] == [[1], [0, 1]]
    moved = SkyPositions([1.0], [0.0200001 - np.arctan(0.002)])  # along a straight line in space
    assert lying.of(1)[1][0] == pytest.approx(TOY.place(moved, 1.0, 0.0)[0], abs=1e-6)


def test_made_up_sky_is_the_same_for_the_same_seed():
    one, again, other = (clustered_sky(9, 0.02, 100.0, seed) for seed in (1, 1, 2))
    assert all((a == b).all() for a, b in zip(one[0].as_array(), again[0].as_array(), strict=True))
    assert len(one[0]) != len(other[0])
    targets, fields = SurveyTargets.of(one[0]), Fields.of(one[1])
    assert fields.chain == ("night1",) * 9
    lying = targets.lying_in(fields, TOY)
    counts = [len(lying.of(k)[0]) for k in range(9)]
    assert 60 < np.mean(counts) < 140
    assert set(one[0]["category"]) == {"quasar", "galaxy", "star", "sky", "standard"}


def test_nights_take_turns_at_regions_that_share_no_target():
    catalogue, listed = clustered_sky(43, 0.02, 50.0, 1, regions=3)
    fields = Fields.of(listed)
    region = np.arange(43) // 10 % 3
    lying = SurveyTargets.of(catalogue).lying_in(fields, TOY)
    rows = [lying.of(k)[0] for k in range(43)]
    inside = [np.unique(np.concatenate([rows[k] for k in np.flatnonzero(region == r)])) for r in range(3)]
    assert len(np.unique(np.concatenate(inside))) == sum(map(len, inside)) > 43 * 15
    assert len(np.intersect1d(rows[0], rows[1]))


XY = {"id": ["a", "b", "a"], "field": ["1", "1", "2"], "x": [1.0, 2.0, 3.0], "y": [0.0, 0.0, 0.0]}


def test_targets_with_x_and_y_are_given_field_by_field():
    targets = SurveyTargets.of(Table(XY))
    lying = targets.lying_in(Fields(("2", "1")), None)
    assert targets.ids == ("a", "b")
    assert [targets.target[lying.of(k)[0]].tolist() for k in (0, 1)] == [[0], [0, 1]]
    assert lying.of(0)[1].tolist() == [[3.0, 0.0]]


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"field": ["1", "1", "1"]}, "row 3: target 'a' is that of row 1 in field '1', too"),
        ({"field": ["1", "2", "7"]}, "row 3: there is no field '7'"),
        ({"visits": [1, 0, 1]}, "row 2: visits is 0, expected a whole number of 1 or more"),
        ({"dec": [0.0, 0.0, 0.0], "ra": [0.0, 0.0, 0.0]}, "row 3: target 'a' is that of row 1, too"),
        ({"dec": [0.0, 91.0, 0.0], "ra": [0.0, 0.0, 0.0]}, "row 2: dec is 91 deg, expected -90 to 90"),
    ],
)
def test_targets_that_cannot_be_used(change, complaint):
    with pytest.raises(TargetError, match=complaint):
        SurveyTargets.of(Table(XY | change)).lying_in(Fields(("1", "2")), None)


@pytest.mark.parametrize(
    ("columns", "complaint"),
    [
        ({"ra": [1.0], "dec": [1.0]}, "no column 'id'"),
        ({"id": ["a", "a"]}, "row 2: id 'a' is that of row 1, too"),
        ({"id": ["a"], "ra": [1.0]}, "no column 'dec'"),
        ({"id": ["a"], "ra": [1.0], "dec": [95.0]}, "row 1: dec is beyond a pole"),
    ],
)
def test_fields_that_cannot_be_used(columns, complaint):
    with pytest.raises(TargetError, match=complaint):
        Fields.of(Table(columns))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("format = 1\nscale = [1.0]", "radius is"),
        ("format = 1\nscale = 3\nradius = 1", "scale is 3, expected numbers"),
        ("format = 2", "format is 2, expected 1"),
        ("format = 1\nscael = [1.0]", "unknown field 'scael'; did you mean 'scale'"),
        ("format = 1\nscale = [100.0, -60.0]\nradius = 1.0", "the distance from the middle must grow"),
        ("scale", "is not TOML"),
    ],
)
def test_telescopes_that_cannot_be_used(tmp_path, text, complaint):
    path = tmp_path / "my.toml"
    path.write_text(text)
    with pytest.raises(InstrumentError, match=complaint):
        Telescope.load(path)
