"""Instruments from one file and the tables beside it, and what is said of a wrong one."""

import re
from pathlib import Path

import numpy as np
import pytest
from astropy import units as u
from astropy.table import Table

from fiberplan import instruments
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.instruments.locate import Lines
from problems import ARM

pytestmark = pytest.mark.small

ALL = 'format = 1\nname = "mine"\npositioners = "mine.csv"\n' + ARM


@pytest.fixture
def mine(tmp_path):
    """What is loaded, or said, of a TOML file and a table."""

    def load(toml=ALL, table="positioner,x,y\nA,0,0\nB,25,0\n", name="mine.csv", **options):
        (tmp_path / "mine.toml").write_text(toml)
        (tmp_path / name).write_text(table)
        return FocalPlane.load(tmp_path / "mine.toml", **options)

    return load


@pytest.fixture
def refusal(mine, tmp_path):
    """The error, without the folder."""

    def refused(*args, **kwargs):
        with pytest.raises(InstrumentError) as caught:
            mine(*args, **kwargs)
        assert "\n" not in str(caught.value)
        return str(caught.value).replace(f"{tmp_path}/", "")

    return refused


def test_hexagon_of_the_documentation(examples):
    plane = FocalPlane.load(examples / "hexagon.toml")
    assert plane.n == 35
    assert list(plane.fiber_offsets) == ["science", "metrology"]
    assert [o.name for o in plane.obstacles] == ["fiducial R0C4", "fiducial F1", "camera", "edge"]
    assert plane.clearance(plane.folded).min() > 0


def test_table_of_the_documentation(examples):
    plane = FocalPlane.load(examples / "table.toml")
    assert plane.ids == ("1", "2", "3")
    np.testing.assert_array_equal(plane.base, [[-4, 0], [4, 0], [0, 6.9]])
    np.testing.assert_array_equal(plane.length, [2.375, 2.381, 2.370])
    np.testing.assert_array_equal(plane.fiber, [[2.41, 0], [2.39, 0], [2.40, 0]])
    np.testing.assert_allclose(np.degrees(plane.zero), [[12.5, 0], [-81, 0], [140.2, 0]])
    np.testing.assert_allclose(np.degrees(plane.upper), [[370, 180], [372, 180], [368, 180]])
    np.testing.assert_allclose(np.degrees(plane.max_speed), [[60, 60], [60, 45], [60, 60]])
    np.testing.assert_array_equal(plane.bodies[0].radius, [1.0, 1.0, 1.1])
    assert plane.bodies[0].points.shape == (2, 2)
    assert plane.online.tolist() == [True, True, False]
    assert [(o.name, o.radius, o.category) for o in plane.obstacles] == [("dot 1", 0.75, "dot"), ("dot 2", 0.75, "dot")]


def test_list_of_the_documentation(examples):
    plane = FocalPlane.load(examples / "listed.toml")
    assert plane.ids == ("M01", "M02")
    np.testing.assert_array_equal(plane.length, [3.0, 3.02])
    np.testing.assert_array_equal(plane.fiber, [[3, 0], [2.98, 0.05]])
    np.testing.assert_array_equal(plane.bodies[0].radius, [1.0, 1.1])
    assert plane.online.tolist() == [True, False]


def test_outlines_of_the_documentation(examples):
    plane = FocalPlane.load(examples / "outlines.toml")
    phi, theta = plane.bodies
    assert phi.points.shape == (2, 5, 2)  # the shorter outline ends twice
    np.testing.assert_array_equal(phi.points[1], [[-1, -1.2], [3.9, -1.2], [3.9, 1.3], [-1, 1.3], [-1, 1.3]])
    assert len(phi.pieces(1)) == 1
    assert theta.points.shape == (4, 2)
    assert plane.obstacles[0].points.tolist() == [[-10, -8], [20, -8], [22, 8]]
    assert not plane.obstacles[0].closed
    assert np.isfinite(plane.clearance(plane.folded)).all()


def test_units_of_a_table_are_converted(mine, tmp_path):
    table = Table({"positioner": [7, 8], "x": [0.0, 2.5] * u.cm, "y": [0.0, 0.0] * u.mm})
    table["zero_alpha"] = [0.1, -0.2] * u.rad
    table["speed_alpha"] = [0.5, 0.25] * u.rad / u.s
    table["fiber_x"], table["fiber_y"] = [0.014, 0.013] * u.m, [1000.0, 0.0] * u.um
    table["online"] = [True, False]
    for name in ("mine.ecsv", "mine.fits"):
        table.write(tmp_path / name)
        (tmp_path / "mine.toml").write_text(ALL.replace("mine.csv", name))
        plane = FocalPlane.load(tmp_path / "mine.toml")
        assert plane.ids == ("7", "8")
        np.testing.assert_allclose(plane.base, [[0, 0], [25, 0]])
        np.testing.assert_allclose(plane.zero, [[0.1, 0], [-0.2, 0]])
        np.testing.assert_allclose(plane.max_speed[:, 0], [0.5, 0.25])
        np.testing.assert_allclose(plane.fiber, [[14, 1], [13, 0]])
        assert plane.online.tolist() == [True, False]


def test_a_table_beside_a_grid_says_what_is_different_there(mine):
    toml = ALL.replace("[arm]", '[grid]\nkind = "hexagonal"\nrings = 1\npitch = 22.4\nempty = ["R0C1"]\n[arm]')
    plane = mine(toml, "positioner,online,length,x,y\nR0C2,no,,,\nR0C3,,7.5,22.5,0.1\nextra,,,60,0\n")
    regular = FocalPlane.hexagonal(1, 22.4)
    assert plane.ids == (*(id_ for id_ in regular.ids if id_ != "R0C1"), "extra")
    assert [id_ for id_, online in zip(plane.ids, plane.online, strict=True) if not online] == ["R0C2"]
    assert plane.length[plane.index["R0C3"]] == 7.5
    np.testing.assert_array_equal(plane.base[[plane.index["R0C3"], -1]], [[22.5, 0.1], [60, 0]])
    np.testing.assert_array_equal(plane.base[0], regular.base[0])


def test_the_file_itself_wins_over_its_table(mine):
    plane = mine(ALL + '[[positioner]]\nid = "B"\nlength = 8.0\n[[positioner]]\nid = "C"\ndistance = 50\nangle = 90\n')
    assert plane.ids == ("A", "B", "C")
    np.testing.assert_array_equal(plane.length, [7.4, 8.0, 7.4])
    np.testing.assert_allclose(plane.base, [[0, 0], [25, 0], [0, 50]], atol=1e-14)


def test_rectangular_grid(mine):
    grid = '[grid]\nkind = "rectangular"\nrows = 2\ncolumns = 3\npitch = 20\n[arm]'
    plane = mine(ALL.replace('positioners = "mine.csv"\n', "").replace("[arm]", grid))
    assert plane.ids == ("R1C1", "R1C2", "R1C3", "R2C1", "R2C2", "R2C3")
    np.testing.assert_array_equal(plane.base[[0, 5]], [[-20, -10], [20, 10]])


def test_four_bar_arms_in_a_table(mine):
    text = (Path(instruments.__file__).parent / "builtin" / "miradas.toml").read_text(encoding="utf-8")
    ring = FocalPlane.load("miradas")
    grid = text[text.index("[grid]") : text.index("[arm]")]
    toml = text.replace(grid, "").replace('name = "miradas"', 'name = "miradas"\npositioners = "mine.csv"')
    rows = [
        f"{id_},{x!r},{y!r},{110 + k}\n"
        for k, (id_, (x, y)) in enumerate(zip(ring.ids, ring.base.tolist(), strict=True))
    ]
    plane = mine(toml, "positioner,x,y,spacing\n" + "".join(rows))
    np.testing.assert_allclose(plane.kinematics.orientation, ring.kinematics.orientation, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(plane.kinematics.spacing, 110 + np.arange(12))


def test_no_bodies_is_a_note(mine):
    assert "no bodies: nothing can touch" in mine(ALL[: ALL.index("[[bodies]]")]).notes
    assert not any("no bodies" in note for note in mine().notes)


def test_columns_that_nothing_reads_are_a_note(mine):
    assert "not used of mine.csv: column petal, vendor" in mine(table="positioner,x,y,petal,vendor\nA,0,0,3,us\n").notes


@pytest.mark.parametrize(
    ("column", "cell", "said"),
    [
        ("length", "abc", "line 3: length is 'abc', not a number"),
        ("length", "-1", "line 3: length: -1 mm is negative"),
        ("speed_alpha", "0", "line 3: speed_alpha: 0 deg/s is not a positive speed"),
        ("upper_beta", "170", "line 3: upper_beta: folded 180 deg is outside 0 to 170 deg"),
        ("radius_arm", "-1", "line 3: radius_arm: -1 mm is negative"),
        ("online", "maybe", "line 3: online is 'maybe', neither true nor false"),
    ],
)
def test_a_robot_with_a_bad_cell_is_offline_where_that_is_wanted(mine, column, cell, said):
    """What stands in for the cell is what the file says for all, else what the others have; of a radius the largest."""
    good = {"length": "7.0", "speed_alpha": "20", "upper_beta": "180", "radius_arm": "1.5", "online": "yes"}[column]
    table = f"positioner,x,y,{column}\nA,0,0,{good}\nB,25,0,{cell}\n"
    with pytest.raises(InstrumentError, match="line 3"):
        mine(table=table)
    plane = mine(table=table, conflicts="drop")
    assert plane.online.tolist() == [True, False]
    (text,) = plane.assumptions
    assert text.startswith(f"positioner B is offline: {said}")
    assert plane.length[1] == (7.4 if cell == "abc" else plane.length[0])
    assert np.all(plane.bodies[0].radius == 1.5)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("positioner,x,y\nA,0,0\nB,abc,0\n", "mine.csv: line 3: x is 'abc', not a number"),
        ("positioner,x,y\nA,0,0\nB,inf,0\n", "mine.csv: line 3: x is inf"),
        ("positioner,x,y\nA,0,0\n\nA,1,0\n", "mine.csv: line 4: positioner 'A' was already given in line 2"),
        ("positioner,x,y\nA,0,0\nB,1,\n", "mine.csv: line 3: positioner 'B': neither x and y nor distance and angle"),
        ("id,x,y\nA,0,0\n", "mine.csv: no column 'positioner'; it has 'id', 'x', 'y'"),
        ("positioner,x,y,lenght\nA,0,0,7\n", "mine.csv: column 'lenght' is not known; did you mean 'length'?"),
        ("positioner,x,y,speed\nA,0,0,7\n", "mine.csv: column 'speed' is not known; did you mean 'speed_"),
        ("positioner,x,y,radius\nA,0,0,7\n", "mine.csv: column 'radius' is not known; did you mean 'radius_arm'?"),
        (
            "positioner,x,y,speed_alpha\nA,0,0,0\n",
            "mine.csv: line 2: positioner 'A': speed_alpha: 0 deg/s is not a pos",
        ),
        ("positioner,x,y,length\nA,0,0,-1\n", "mine.csv: line 2: positioner 'A': length: -1 mm is negative"),
        (
            "positioner,x,y,lower_beta\nA,0,0,\nB,25,0,200\n",
            "mine.csv: line 3: positioner 'B': lower_beta: lower 200 deg is above upper 180 deg",
        ),
        (
            "positioner,x,y,upper_beta\nA,0,0,\nB,25,0,170\n",
            "mine.csv: line 3: positioner 'B': upper_beta: folded 180 deg is outside 0 to 170 deg",
        ),
        ("positioner,x,y,online\nA,0,0,maybe\n", "mine.csv: line 2: online is 'maybe', neither true nor false"),
        ("positioner,x [deg],y\nA,0,0\n", "mine.csv: column 'x': unit 'deg' is not a length"),
        ("positioner,x,y,speed_beta [mm]\nA,0,0,1\n", "mine.csv: column 'speed_beta': unit 'mm' is not a speed of rot"),
        ("positioner,x,y,radius_arm\nA,0,0,-1\n", "mine.csv: line 2: positioner 'A': radius_arm: -1 mm is negative"),
    ],
)
def test_bad_table_names_line_column_and_value(refusal, table, message):
    assert refusal(table=table).startswith(message)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("upper = 180", "upper = -18", "line 14: joints.beta.lower = 0: lower 0 deg is above upper -18 deg"),
        ("length = 7.4", "length = -7", "line 5: arm.length = -7: must be 0 or more"),
        ("length = 7.4", "length = true", "line 5: arm.length = true: must be a number"),
        ("length = 7.4", "", "line 4: arm.length: is missing"),
        (
            "length = 7.4",
            "length = 1" + "0" * 400,
            "line 5: arm.length = 1000000000000000000000000000000000000...: mus",
        ),
        ("length = 7.4", "length = 1" + "0" * 9000, "is not a usable TOML file"),
        ("[15.0, 0.0]\n[j", "[15.0]\n[j", "line 7: fibers.fiber.1: is missing"),
        ("fiber = [15.0, 0.0]", "", "line 6: fibers: must have 1 or more entries"),
        ("[15.0, 0.0]\n[j", "[15.0, '0']\n[j", "line 7: fibers.fiber.1 = '0': must be a number"),
        ("speed = 20", "", "line 13: joints.beta.speed: is missing, and there is no column 'speed_beta' in mine.csv"),
        ("radius = 1.5", "", "line 18: bodies.0.radius: is missing, and there is no column 'radius_arm' in mine.csv"),
        ("radius = 1.5", "raduis = 1.5", "line 20: bodies.0.raduis = 1.5: no such field; did you mean 'radius'?"),
        ("points = [[0.0, 0.0], [15.0, 0.0]]\n", "", "line 18: bodies.0: needs points, or outlines from a file"),
        ("format = 1", "format = 2", "line 1: format = 2: must be 1"),
        ('name = "mine"\n', "", "name: is missing"),
        ('positioners = "mine.csv"\n', "", "grid: is missing, and neither positioners nor [[positioner]] says where"),
        (
            "[arm]",
            "[grid]\nkind = 'square'\n[arm]",
            "line 5: grid.kind = 'square': must be one of 'hexagonal', 'rect",
        ),
        ("[arm]", "[grid]\nrings = 1\n[arm]", "line 4: grid.kind: is missing"),
        (
            "[arm]",
            "[grid]\nkind = 'hexagonal'\nrings = 1\nptich = 5\n[arm]",
            "line 4: grid.pitch: is missing; line 7: ",
        ),
        (
            "[arm]",
            "[grid]\nkind = 'ring'\ncount = 3\nradius = 5\n[arm]",
            "four_bar arms stand on a grid of kind 'ring'",
        ),
        (
            "points = [[0.0, 0.0], [15.0, 0.0]]",
            "closed = true\npoints = [\n  [0, 0], [4, 4],\n  [4, 0], [0, 4],\n]",
            "line 20: bodies.0.points: body 'arm': a closed outline crosses itself",
        ),
    ],
)
def test_bad_field_names_line_field_and_value(refusal, old, new, message):
    assert refusal(ALL.replace(old, new, 1)).startswith(f"mine.toml: {message}")


def test_every_complaint_is_said_up_to_four_and_the_next_are_named(refusal):
    bad = ALL.replace("upper", "uper").replace("length = 7.4", "length = 'long'")
    assert refusal(bad) == (
        "mine.toml: line 5: arm.length = 'long': must be a number; "
        "line 10: joints.alpha.uper = 360: no such field; did you mean 'upper'?; "
        "line 15: joints.beta.uper = 180: no such field; did you mean 'upper'?"
    )
    bad = bad.replace("speed", "speeed").replace("radius = 1.5", "radius = -1.5")
    assert refusal(bad).endswith("; and 2 more: joints.beta.speeed, bodies.0.radius")


def test_missing_fields_are_said_together(refusal):
    bad = re.sub(r"(?m)^(upper|speed).*$", "", ALL.replace("[arm]\nlength = 7.4\n", "\n\n"))
    assert refusal(bad, "positioner,x,y,length\nA,0,0,7\nB,25,0,\n") == (
        "mine.toml: arm.length: is missing, and column 'length' in mine.csv says none for positioner 'B' in line 3; "
        "line 8: joints.alpha.upper: is missing, and there is no column 'upper_alpha' in mine.csv; "
        "line 13: joints.beta.upper: is missing, and there is no column 'upper_beta' in mine.csv; "
        "line 8: joints.alpha.speed: is missing, and there is no column 'speed_alpha' in mine.csv; "
        "and 1 more: joints.beta.speed"
    )


@pytest.mark.parametrize(
    ("toml", "message"),
    [
        (ALL.replace("7.4", "= 7.4"), "mine.toml: line 5, column 10: is not valid TOML (invalid value)"),
        (ALL + "x = '''", "mine.toml: end of document: is not valid TOML ("),
        (ALL + "x = " + "[" * 20_000 + "]" * 20_000, "mine.toml: is not a usable TOML file (nested too deeply"),
        (ALL.replace("mine.csv", "there.csv"), "there.csv: no such file"),
        (ALL.replace("mine.csv", "."), ": is a folder, expected a file"),
    ],
)
def test_files_that_are_not_there_or_not_what_they_should_be(refusal, toml, message):
    assert message in refusal(toml)


LISTED = (
    ALL.replace('positioners = "mine.csv"\n', "")
    + """
[[positioner]]
id = "A"
x = 0.0
y = 0.0

[[positioner]]
id = "B"
x = 25.0
y = 0.0
"""
)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("speed_beta = 0", "mine.toml: line 30: positioner.1.speed_beta = 0: must be above 0"),
        ("lower_beta = 200", "mine.toml: line 26: positioner 'B': lower_beta: lower 200 deg is above upper 180 deg"),
        ("fibers = { fibre = [1.0, 0.0] }", "mine.toml: line 30: positioner.1.fibers: there is no fiber 'fibre'; did"),
        ("radius = { hand = 1.0 }", "mine.toml: line 30: positioner.1.radius: there is no body 'hand'"),
        ('[[positioner]]\nid = "A"', "mine.toml: line 30: positioner 'A' was already given in line 21"),
    ],
)
def test_bad_entry_of_a_list_names_its_line(refusal, more, message):
    assert refusal(LISTED + more).startswith(message)


OUTLINED = LISTED.replace("points = [[0.0, 0.0], [15.0, 0.0]]", 'outlines = "mine.csv"\nclosed = true')
OUTLINE = "positioner,x,y\nA,0,0\nA,4,0\nA,4,4\nB,0,0\nB,5,0\nB,5,4\n"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (OUTLINE + "C,0,0\n", "mine.csv: line 8: there is no positioner 'C'"),
        (OUTLINE[: OUTLINE.index("B")], "mine.csv: no rows of body 'arm' for positioner 'B'"),
        (OUTLINE + "B,5,-1\nB,0,4\n", "mine.csv: line 5: body 'arm' of positioner 'B': a closed outline crosses itsel"),
        (OUTLINE.replace("x,y", "x,z"), "mine.csv: no column 'y'; it has 'positioner', 'x', 'z'"),
        (OUTLINE.replace("B,5,0", "B,five,0"), "mine.csv: line 6: x is 'five', not a number"),
        (
            "body," + re.sub("(?m)^([AB]),", r"amr,\1,", OUTLINE),
            "mine.csv: no rows of body 'arm'; did you mean 'amr'?",
        ),
        (
            "positioner,x,y,radius\nA,0,0,1\nA,4,0,1\nB,0,0,1\nB,5,0,2\n",
            "mine.csv: line 5: radius 2 mm differs from line 4, of the same shape",
        ),
        ("positioner,x,y,radius\nA,0,0,1\nB,4,0,-1\n", "mine.csv: line 3: radius -1 mm is negative"),
    ],
)
def test_bad_outlines_name_file_line_and_body(refusal, table, message):
    assert refusal(OUTLINED, table).startswith(message)


def test_outlines_give_points_in_order_and_radii(mine):
    rows = "A,2,4,4,.5\nB,1,5,0,\nA,1,4,0,.5\nB,0,0,0,\nA,0,0,0,.5\nB,2,5,4,\n"
    body = mine(OUTLINED, "positioner,vertex,x,y,radius\n" + rows).bodies[0]
    np.testing.assert_array_equal(body.points, [[[0, 0], [4, 0], [4, 4]], [[0, 0], [5, 0], [5, 4]]])
    np.testing.assert_array_equal(body.radius, [0.5, 1.5])


def test_bad_obstacles_name_file_and_line(refusal):
    toml = LISTED + "[[obstacles]]\ntable = 'mine.csv'\n"
    assert refusal(toml, "x,y\n0,0\n").startswith("mine.csv: no column 'name'")
    crossed = "".join(f"edge,{x},{y}\n" for x, y in ((0, 0), (4, 4), (4, 0), (0, 4)))
    assert refusal(toml, "name,x,y\n" + crossed).startswith("mine.csv: line 2: obstacle 'edge': a closed outline cros")
    assert "line 30: obstacles.0: has a name, but" in refusal(toml + "name = 'edge'\n")
    toml = LISTED + "[[obstacles]]\nname = 'edge'\npoints = [[0, 0], [4, 4], [4, 0], [0, 4]]\n"
    assert "line 32: obstacles.0.points: obstacle 'edge': a closed outline crosses itself" in refusal(toml)


def test_holes_without_positioners_are_refused_in_tables(refusal):
    toml = ALL.replace("[arm]", '[grid]\nkind = "hexagonal"\nrings = 1\npitch = 22.4\nempty = ["R0C1"]\n[arm]')
    message = "mine.csv: line 3: hole 'R0C1' has no positioner (grid.empty)"
    assert refusal(toml, "positioner,online\nR0C2,no\nR0C1,no\n") == message
    message = (
        "mine.csv: line 2: positioner 'R0C9': neither x and y nor distance and angle say where it is; did you mean"
    )
    assert refusal(toml, "positioner,online\nR0C9,no\n").startswith(message)


def test_lines_of_fields():
    text = '''# a comment [x]
a = 1
b.c = { d = 2 }  # [[no]]
"e f" = [
  1, # ]
  "]",
]
g = """
[not]
a table"""
[h]
i = \'\'\'
[j]
\'\'\'
[[k]]
l = 1
[k.m]
n = 1
[[k]]
l = 2
[k.m]
n = 2
[[k.o]]
p = 3
'''
    lines = Lines(text)
    places = {("a",): 2, ("b",): 3, ("b", "c"): 3, ("b", "c", "d"): 3, ("e f", 1): 4, ("g",): 8, ("h",): 11}
    places |= {("h", "i"): 12, ("k",): 15, ("k", 0): 15, ("k", 0, "l"): 16, ("k", 0, "m", "n"): 18}
    places |= {("k", 1): 19, ("k", 1, "l"): 20, ("k", 1, "m"): 21, ("k", 1, "m", "n"): 22, ("k", 1, "o", 0, "p"): 24}
    assert {place: lines.of(place) for place in places} == places
    assert lines.of(("k", 1, "m", "missing")) == 21
    assert lines.of(("missing",)) is None


def test_instrument_of_another_case_is_suggested():
    with pytest.raises(InstrumentError, match=r"no instrument 'SDSS'; did you mean 'sdss'\?"):
        FocalPlane.load("SDSS")


def test_lines_of_tables_that_no_header_opens():
    lines = Lines("[a.b]\nc = 1\n[[d.e]]\nf = 1\n")
    assert [lines.of(field) for field in (("a",), ("d",), ("d", "e", 0, "f"))] == [1, 3, 4]


def test_places_where_no_fiber_may_end(examples):
    path = examples / "hexagon.toml"
    path.write_text('forbidden = "spots.csv"\n' + path.read_text())
    (examples / "spots.csv").write_text("x,y,radius\n1.0,2.0,0.5\n")
    np.testing.assert_array_equal(FocalPlane.load(path).forbidden, [[1.0, 2.0, 0.5]])
    (examples / "spots.csv").write_text("x,y,radius\n1.0,2.0,-0.5\n")
    with pytest.raises(InstrumentError, match=r"spots\.csv: line 2: radius -0\.5 mm is negative"):
        FocalPlane.load(path)


def test_a_grid_of_the_holes_nearest_to_the_middle(examples):
    path = examples / "hexagon.toml"
    text = path.read_text().replace("rings = 3 ", "count = 19\nrings = 3 ").replace('empty = ["R0C1"]', "empty = []")
    path.write_text(text)
    plane = FocalPlane.load(path)
    assert plane.n == 19 - 1  # a fiducial stands in one of them
    assert np.hypot(*plane.base.T).max() == pytest.approx(2 * 22.4)
    path.write_text(text.replace("count = 19", "count = 0"))
    with pytest.raises(InstrumentError, match=r"grid\.count = 0: must be 1 or more"):
        FocalPlane.load(path)
