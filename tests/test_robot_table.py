"""A table with a row for each robot is an instrument by itself."""

import numpy as np
import pytest
from astropy import units
from astropy.table import QTable

from fiberplan.cli.app import run
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane

pytestmark = pytest.mark.small

TABLE = """# base_x: mm
# alpha_lower: deg
positioner,base_x,base_y,length,fiber_x,alpha_lower,alpha_upper,beta_lower,beta_upper,radius,online
A,0.0,0.0,3.0,3.1,-190,190,-5,185,0.8,1
B,10.4,0.0,2.9,3.0,-195,195,-4,171,0.7,1
C,5.2,9.0,3.1,3.0,-192,192,-6,184,0.8,0
"""


def write(folder, text=TABLE, name="robots.csv"):
    (folder / name).write_text(text)
    return folder / name


def test_three_unequal_robots(tmp_path):
    plane = FocalPlane.load(write(tmp_path))
    assert plane.ids == ("A", "B", "C")
    assert plane.online.tolist() == [True, True, False]
    np.testing.assert_array_equal(plane.base, [[0, 0], [10.4, 0], [5.2, 9.0]])
    np.testing.assert_array_equal(plane.length, [3.0, 2.9, 3.1])
    np.testing.assert_array_equal(plane.fiber, [[3.1, 0], [3.0, 0], [3.0, 0]])
    np.testing.assert_allclose(np.degrees(plane.lower), [[-190, -5], [-195, -4], [-192, -6]])
    np.testing.assert_allclose(np.degrees(plane.folded), [[0, 180], [0, 171], [0, 180]])
    np.testing.assert_array_equal(plane.bodies[0].radius, [0.8, 0.7, 0.8])
    np.testing.assert_array_equal(plane.bodies[0].points[0], [[0, 0], [3.1, 0]])
    assert any("speed" in text for text in plane.assumptions)
    assert any("parked" in text for text in plane.assumptions)


def test_names_of_the_instrument_format_and_units_of_the_columns(tmp_path):
    two = np.ones(2)
    columns = {
        "positioner": ["1", "2"], "x": [0.0, 0.02] * units.m, "y": 0 * two * units.m, "length": 7.4 * two * units.mm,
        "met_x": 15.0 * two * units.mm, "met_y": [0.1, 0.2] * units.mm, "ap_x": 14.0 * two * units.mm,
        "lower_alpha": 0 * two * units.rad, "upper_alpha": 6.0 * two * units.rad, "lower_beta": 0 * two * units.deg,
        "upper_beta": 180.0 * two * units.deg, "speed_alpha": 0.2 * two * units.rad / units.s,
        "speed_beta": 2.0 * two * units.deg / units.s, "folded_alpha": two * units.rad,
        "folded_beta": 3.0 * two * units.rad,
    }  # fmt: skip
    for name in ("robots.ecsv", "robots.fits"):
        QTable(columns).write(tmp_path / name)
        plane = FocalPlane.load(tmp_path / name)
        np.testing.assert_allclose(plane.base, [[0, 0], [20, 0]])
        assert list(plane.fiber_offsets) == ["met", "ap"]
        np.testing.assert_allclose(plane.fiber, [[15, 0.1], [15, 0.2]])
        np.testing.assert_allclose(plane.upper[:, 0], 6.0)
        np.testing.assert_allclose(plane.max_speed, [[0.2, np.radians(2)]] * 2)
        assert plane.assumptions == ()
        assert any("no bodies" in note for note in plane.notes)


def test_focal_planes_in_fits_are_read_as_before(tmp_path, small_plane):
    small_plane.write(tmp_path / "plane.fits")
    assert FocalPlane.load(tmp_path / "plane.fits").name == small_plane.name


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (TABLE.replace("A,0.0", "A,east"), ["line 4", "x is 'east'"]),
        (TABLE.replace("B,10.4", "A,10.4"), ["line 5", "'A' was already given in line 4"]),
        (TABLE.replace("2.9,3.0", ",3.0"), ["line 5", "length is empty"]),
        (TABLE.replace("3.0,-192", ",-192"), ["line 6", "'C'", "fiber_x"]),
        (TABLE.replace("-195,195", "nan,195"), ["line 5", "alpha_lower is nan"]),
        (TABLE.replace("0.7,1", "-0.7,1"), ["line 5", "radius -0.7 mm is negative"]),
        (TABLE.replace("beta_upper", "beta_uper"), ["no column 'upper_beta'"]),
        (TABLE.replace("base_y", "x"), ["'x' and 'base_x' are the same value"]),
        (TABLE.replace("-4,171", "175,171"), ["line 5", "'B'", "175", "171"]),
        (TABLE.replace("0.8,0", "0.8,perhaps"), ["line 6", "online is 'perhaps'"]),
        (TABLE.replace("base_x", "where"), ["line 4", "'A'", "where it is"]),
    ],
)
def test_bad_tables(tmp_path, text, words):
    path = write(tmp_path, text)
    with pytest.raises(InstrumentError) as caught:
        FocalPlane.load(path)
    message = str(caught.value)
    assert all(word in message for word in [str(path), *words]), message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        (("2.9,3.0", ",3.0"), "line 5: length is empty"),
        (("2.9,3.0", "2.9,"), "line 5: fiber_x is empty"),
        (("2.9,3.0", "long,3.0"), "line 5: length is 'long', not a number"),
        (("2.9,3.0", "-2.9,3.0"), "line 5: length: -2.9 mm is negative"),
        (("-4,171", "175,171"), "line 5: lower_beta: lower 175 deg is above upper 171 deg"),
        (("-195,195", ",195"), "line 5: lower_alpha is empty"),
        (("171,0.7,1", "171,thin,1"), "line 5: radius is 'thin', not a number; its arm is taken as thick as any"),
        (("0.7,1", "0.7,perhaps"), "line 5: online is 'perhaps', neither true nor false"),
    ],
)
def test_a_robot_with_a_bad_cell_is_offline_where_that_is_wanted(tmp_path, cells, said):
    path = write(tmp_path, TABLE.replace(*cells))
    with pytest.raises(InstrumentError, match="line 5"):
        FocalPlane.load(path)
    plane, good = FocalPlane.load(path, "drop"), FocalPlane.load(write(tmp_path, name="good.csv"))
    assert plane.online.tolist() == [True, False, False]
    (text,) = [text for text in plane.assumptions if "positioner B is offline" in text]
    assert said in text
    assert text in plane.notes
    for name in ("base", "length", "lower", "upper", "folded"):  # the others are as they were
        np.testing.assert_array_equal(getattr(plane, name)[[0, 2]], getattr(good, name)[[0, 2]])
    assert np.isfinite([plane.length[1], *plane.fiber[1], *plane.folded[1]]).all()


def test_a_robot_that_stands_nobody_knows_where_is_left_out(tmp_path):
    plane = FocalPlane.load(write(tmp_path, TABLE.replace("B,10.4", "B,")), "drop")
    assert plane.ids == ("A", "C")
    np.testing.assert_array_equal(plane.bodies[0].radius, 0.8)
    assert any("positioner B is left out, nothing says where it stands: line 5" in text for text in plane.assumptions)


def test_not_all_robots_carry_each_fiber(tmp_path):
    table = TABLE.replace(",online", ",online,ap_x").replace("0.8,1", "0.8,1,2.5").replace("0.7,1", "0.7,1,")
    plane = FocalPlane.load(write(tmp_path, table.replace("0.8,0", "0.8,0,2.6")))
    np.testing.assert_array_equal(plane.fiber_offsets["ap"], [[2.5, 0], [np.nan, np.nan], [2.6, 0]])
    assert run(["instruments", str(tmp_path / "robots.csv"), "--json"]) == 0


def test_headings_may_have_capital_letters(tmp_path):
    head, rest = TABLE.split("\npositioner", 1)
    line, rows = ("positioner" + rest).split("\n", 1)
    plane = FocalPlane.load(write(tmp_path, f"{head}\n{line.upper()}\n{rows}"))
    np.testing.assert_array_equal(plane.length, [3.0, 2.9, 3.1])


def test_tables_of_targets_are_no_instrument(tmp_path):
    with pytest.raises(InstrumentError, match="is no instrument"):
        FocalPlane.load(write(tmp_path, "positioner,x,y\nA,1,2\n"))
