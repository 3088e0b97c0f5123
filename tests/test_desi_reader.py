"""DESI's focal-plane files: a made-up one of two petals, and the real one."""

import re

import numpy as np
import pytest

from fiberplan.errors import InstrumentError, ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.instruments.desi import CRUISE, angles_of, petal
from fiberplan.problem import Problem, State

pytestmark = pytest.mark.small

COLUMNS = {
    "LOCATION": None, "DEVICE_ID": None, "DEVICE_TYPE": None, "PETAL_LOC": None, "LENGTH_R1": "mm", "LENGTH_R2": "mm",
    "OFFSET_T": "deg", "OFFSET_P": "deg", "OFFSET_X": "mm", "OFFSET_Y": "mm", "PHYSICAL_RANGE_T": "deg",
    "PHYSICAL_RANGE_P": "deg", "DEVICE_CLASSIFIED_NONFUNCTIONAL": None, "FIBER_INTACT": None, "POS_T": None,
    "POS_P": None, "CLASSIFIED_AS_RETRACTED": None, "KEEPOUT_EXPANSION_PHI_ANGULAR": "deg",
    "KEEPOUT_EXPANSION_PHI_RADIAL": "mm",
}  # fmt: skip
DEVICES = {
    "3007": ["M01", "POS", 3, 3.1, 3.2, 20, 1.5, 100, 30, 390, 190, False, True, 10, 140, False, 0, 0],
    "3008": ["M02", "POS", 3, 3.0, 3.0, -40, 0, 110.4, 30, 392, 186, True, True, 194, 60, False, 5, 0.1],
    "3009": ["G01", "GIF", 3, "", "", "", "", "", "", "", "", "", "", "", "", "", "", ""],
    "4007": ["M03", "ETC", 4, 2.9, 2.8, 0, 0, 100, 30, 390, 190, False, False, 0, 150, True, 0, 0],
}
SETTINGS = """# made up
PHI_EO = 114.0 # [deg]
# KEEPOUT_PTL = '''[[1.0, 2.0],
#                   [1.0, 2.0]]'''
KEEPOUT_PHI = '''[[4.0, 3.0, -1.0, -1.0, 3.0],
                  [0.,  1.5, 1.0, -1.0, -1.5]]'''
KEEPOUT_THETA = '''[[5.0, 2.0, -2.0, 2.0],
                    [0.0, 2.0, 0.0, -3.0]]'''
KEEPOUT_PTL = '''[[ 20.26, 410.0, 400.0, 325.837, 20.26,  20.26, 420.0, 420.0, 20.26],
                  [  0.0,    0.0, 120.0, 236.0,   13.978, 250.0, 250.0, -5.0, -5.0]]'''
KEEPOUT_GFA = '''[[295.0, 305.0, 320.0], [207.0, 201.0, 220.0]]'''
"""


def write(folder, devices=DEVICES, settings=SETTINGS, name="fp-20300101.ecsv"):
    """A focal-plane file and its settings."""
    lines = ["# %ECSV 1.0", "# ---", "# datatype:"]
    lines += [f"# - {{name: {k}{f', unit: {u}' if u else ''}, datatype: string}}" for k, u in COLUMNS.items()]
    lines += ["# schema: astropy-2.0", " ".join(COLUMNS)]
    lines += [" ".join(str(cell) if cell != "" else '""' for cell in [k, *row]) for k, row in devices.items()]
    (folder / name).write_text("\n".join(lines) + "\n")
    if settings is not None:
        (folder / "collision_settings.conf").write_text(settings)
    return folder / name


def changed(id_, column, value):
    """The devices with one cell changed."""
    row = list(DEVICES[id_])
    row[list(COLUMNS).index(column) - 1] = value
    return DEVICES | {id_: row}


def test_devices_of_a_file(tmp_path):
    plane = FocalPlane.load(write(tmp_path))
    assert plane.ids == ("3007", "3008", "4007")
    assert plane.index_of("M03") == 2
    turn = np.radians(36)
    np.testing.assert_allclose(plane.base[0], [100, 30])
    np.testing.assert_allclose(
        plane.base[2], np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ [100, 30]
    )
    np.testing.assert_allclose(plane.length, [3.1, 3.0, 2.9])
    np.testing.assert_allclose(plane.fiber[:, 0], [3.2, 3.0, 2.8])
    np.testing.assert_allclose(np.degrees(plane.max_speed), CRUISE)
    np.testing.assert_allclose(np.degrees(plane.lower[0]), [-192, 185 - 190 + 3])
    np.testing.assert_allclose(np.degrees(plane.upper[0]), [192, 182])
    np.testing.assert_allclose(np.degrees(plane.folded[0]), [0, 148.5])  # phi 150 deg from the stretched arm
    first = np.radians(20 + 10)
    second = first + np.radians(1.5 + 140)
    ends = [f(first) * 3.1 + f(second) * 3.2 for f in (np.cos, np.sin)]
    angles = angles_of(tmp_path)
    assert angles.ids == plane.ids
    assert angles.known.all()
    np.testing.assert_allclose(plane.fibers(angles.angles)[0], plane.base[0] + ends)
    assert plane.assumptions


def test_who_cannot_move_stands_where_the_file_says(tmp_path):
    plane = FocalPlane.load(write(tmp_path))
    assert plane.online.tolist() == [True, False, True]
    np.testing.assert_allclose(np.degrees(plane.folded[1]), [194, 60])  # beyond its range of 193
    assert any("nonfunctional" in note and "3008" in note for note in plane.notes)
    assert any("fiber" in note and "4007" in note for note in plane.notes)
    unknown = FocalPlane.load(write(tmp_path, changed("3008", "POS_T", "")))
    np.testing.assert_allclose(np.degrees(unknown.folded[1]), [0, 150])
    assert any("no angles" in note and "3008" in note for note in unknown.notes)
    assert angles_of(tmp_path).known.tolist() == [True, False, True]


def test_a_petal_may_start_from_the_file_of_all(tmp_path):
    path = write(tmp_path)
    one = petal(FocalPlane.load(path), 4)
    state = State.read(path, one)
    np.testing.assert_allclose(np.degrees(state.angles), [[0, 150]])
    assert not state.unknown.any()
    with pytest.raises(ProblemError, match="no positioner '3007'"):
        State.read(path, FocalPlane.hexagonal(0, 10.0))


def test_retracted_devices_stay_within_their_envelope(tmp_path):
    plane = FocalPlane.load(write(tmp_path))
    assert np.degrees(plane.lower[2, 1]) == pytest.approx(114)
    assert any("retracted" in note and "4007" in note for note in plane.notes)


def test_outlines_are_made_to_measure(tmp_path):
    plane = FocalPlane.load(write(tmp_path))
    phi, theta = plane.bodies
    np.testing.assert_allclose(phi.points[0], [[4.3, 0], [3.3, 1.5], [-1, 1], [-1, -1], [3.3, -1.5]])
    np.testing.assert_allclose(phi.points[2, 0], [3.9, 0])  # a short second link makes no shorter outline
    radius, angle = np.hypot(3, 1.5) + 0.1, np.arctan2(1.5, 3) + np.radians(5)
    np.testing.assert_allclose(phi.points[1, 1], radius * np.array([np.cos(angle), np.sin(angle)]))
    assert theta.points.shape == (4, 2)  # shared where none is expanded
    assert (phi.link, theta.link) == ("beta", "alpha")
    assert "theta" in phi.meets
    assert theta.meets == ("phi",)


def test_edges_and_cameras_stand_by_petal(tmp_path):
    plane = FocalPlane.load(write(tmp_path))
    names = [obstacle.name for obstacle in plane.obstacles]
    assert names == ["edge of petal 3", "guide camera of petal 3", "edge of petal 4", "guide camera of petal 4"]
    edge = plane.obstacles[0]
    assert not edge.closed
    np.testing.assert_allclose(edge.points, [[20.26, 0], [410, 0], [400, 120], [325.837, 236], [20.26, 13.978]])
    np.testing.assert_allclose(
        plane.obstacles[3].points[0],
        np.array([[np.cos(np.pi / 5), -np.sin(np.pi / 5)], [np.sin(np.pi / 5), np.cos(np.pi / 5)]]) @ [295, 207],
    )
    one = petal(plane, 4)
    assert one.ids == ("4007",)
    assert [obstacle.name for obstacle in one.obstacles] == names[2:]
    with pytest.raises(InstrumentError, match="petal 7"):
        petal(plane, 7)
    near = changed("3007", "OFFSET_Y", 5.3)
    beside = FocalPlane.load(write(tmp_path, near))
    down = np.array([np.radians(-90 - 20), np.radians(-1.5)])  # stretched over the edge
    with pytest.raises(ProblemError, match="edge of petal 3"):
        Problem(beside, beside.folded, np.stack([down, *beside.folded[1:]]))


@pytest.mark.parametrize(
    ("column", "cell", "said", "taken"),
    [
        ("LENGTH_R2", "3,0", "LENGTH_R2 is '3,0', not a number, taken as 2.9", ("fiber", 2.9)),
        ("LENGTH_R1", "nan", "LENGTH_R1 is nan, taken as 2.95", ("length", 2.95)),
        ("OFFSET_T", "", "OFFSET_T is empty, taken as -20", None),
        ("PHYSICAL_RANGE_P", 5, "PHYSICAL_RANGE_P is 5 deg, taken as 188", None),
        ("POS_T", "x", "POS_T is 'x', not a number", None),
        ("KEEPOUT_EXPANSION_PHI_RADIAL", "?", "KEEPOUT_EXPANSION_PHI_RADIAL is '?'", None),
        ("FIBER_INTACT", "maybe", "FIBER_INTACT is 'maybe'", None),
    ],
)
def test_one_bad_cell_makes_its_robot_offline_if_asked(tmp_path, column, cell, said, taken):
    path = write(tmp_path, changed("3007", column, cell))
    with pytest.raises(InstrumentError, match=column):
        FocalPlane.load(path)
    plane = FocalPlane.load(path, "drop")
    assert plane.online.tolist() == [False, False, True]
    (note,) = [note for note in plane.assumptions if note.startswith("device 3007 is offline: line 25: ")]
    assert said in note
    assert note in plane.notes
    if taken:
        assert getattr(plane, taken[0])[0].ravel()[0] == pytest.approx(taken[1])
    whole = FocalPlane.load(write(tmp_path), "drop")
    assert whole.assumptions == FocalPlane.load(tmp_path).assumptions


def test_a_robot_of_unknown_place_is_left_out_by_name(tmp_path):
    for column, cell in (("OFFSET_X", ""), ("PETAL_LOC", 4)):
        plane = FocalPlane.load(write(tmp_path, changed("3007", column, cell)), "drop")
        assert plane.ids == ("3008", "4007")
        assert any(text.startswith("device 3007 is left out, nothing is known") for text in plane.assumptions)


@pytest.mark.parametrize(
    ("devices", "settings", "words"),
    [
        (DEVICES, None, ["collision_settings.conf", "no such file"]),
        (DEVICES, SETTINGS.replace("KEEPOUT_PHI", "KEEPOUT_PSI"), ["no outline KEEPOUT_PHI"]),
        (DEVICES, SETTINGS.replace("[0.,  1.5,", "[0., x,"), ["KEEPOUT_PHI", "two lists"]),
        (DEVICES, SETTINGS.replace("PHI_EO = 114.0", "PHI_EO = wide"), ["PHI_EO is 'wide'"]),
        (DEVICES, SETTINGS.replace("400.0, 325.837", "900.0, 325.837"), ["KEEPOUT_PTL"]),
        (changed("3008", "LENGTH_R2", "3,0"), SETTINGS, ["line 26", "LENGTH_R2", "'3,0'"]),
        (changed("3008", "OFFSET_T", ""), SETTINGS, ["line 26", "OFFSET_T is empty"]),
        (changed("3008", "PETAL_LOC", 4), SETTINGS, ["line 26", "LOCATION is '3008'"]),
        (changed("3008", "PHYSICAL_RANGE_P", 5), SETTINGS, ["line 26", "PHYSICAL_RANGE"]),
        ({"3009": DEVICES["3009"]}, SETTINGS, ["no device"]),
    ],
)  # fmt: skip
def test_bad_files(tmp_path, devices, settings, words):
    path = write(tmp_path, devices, settings)
    with pytest.raises(InstrumentError) as caught:
        FocalPlane.load(path)
    message = str(caught.value)
    assert all(word in message for word in words), message
    assert "\n" not in message


def test_a_truncated_file(tmp_path):
    path = write(tmp_path)
    path.write_text(path.read_text()[:-40])
    with pytest.raises(InstrumentError, match=r"line 28: \d+ values for 19 columns"):
        FocalPlane.load(path)


@pytest.fixture(scope="module")
def real(shared_data):
    return FocalPlane.load(shared_data / "desi")


def test_the_real_focal_plane(shared_data, real):
    assert real.n == 5020
    assert real.online.sum() == 4352
    assert len(real.obstacles) == 20
    angles = angles_of(shared_data / "desi" / "fp-20260219.ecsv").angles
    fibers = real.fibers(angles)
    np.testing.assert_allclose(fibers[0], [-4.837, -29.561], atol=1e-3)
    text = (shared_data / "desi" / "fp-20260219.ecsv").read_text()
    names, *rows = [line.split(" ") for line in text.splitlines() if not line.startswith("#")]
    where = {row[0]: row for row in rows}
    stated = [[float(where[id_][names.index(name)] or "nan") for name in ("PRED_X", "PRED_Y")] for id_ in real.ids]
    away = np.hypot(*(fibers - stated).T)
    assert np.nanmax(away) < 0.62
    assert np.nanmedian(away) == pytest.approx(0.194, abs=1e-3)


def test_phi_outlines_are_those_that_the_real_file_itself_has(shared_data, real):
    text = (shared_data / "desi" / "fp-20260219.ecsv").read_text()
    part = text[text.index("#     phi:") : text.index("#     ptl:")]
    numbers = [[float(x) for x in match.split(",")] for match in re.findall(r"\[([^\]]*)\]", part)]
    outlines = np.stack([numbers[::2], numbers[1::2]], axis=2)[:, :-1]  # the first point is repeated
    names, *rows = [line.split(" ") for line in text.splitlines() if not line.startswith("#")]
    which = {row[0]: int(row[names.index("KEEPOUT_P")]) for row in rows if row[names.index("LENGTH_R1")] != '""'}
    theirs = outlines[[which[id_] for id_ in real.ids]]
    np.testing.assert_allclose(real.bodies[0].points, theirs, atol=1.1e-3)  # they are rounded to 0.001 mm


def test_only_two_devices_touch_at_the_real_angles(shared_data, real):
    angles = angles_of(shared_data / "desi").angles
    with pytest.raises(ProblemError) as caught:
        Problem(real, angles, np.full_like(angles, np.nan), near_start="raise")
    assert [real.ids[i] for i in caught.value.positioners] == ["3171", "3186"]
    Problem(real, real.folded, np.full_like(angles, np.nan))  # the park state touches nothing
