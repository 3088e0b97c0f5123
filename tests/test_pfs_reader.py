"""PFS: made-up files in the forms of its own, and the real ones."""

import numpy as np
import pytest

from fiberplan.errors import InstrumentError, ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.problem import Problem, Targets

pytestmark = pytest.mark.small

MAP = """\\cob  fld   mod      x        y    fiberId  sunss
   -    -     -      -        -          1   emp
   3    1     1   -6.928   -4.000        2   d2
   1    1     1   -6.928    4.000        3   emp
   2    1     1  -13.856   -0.000        4   emp
"""
FIDUCIALS = """ fid  f  type    x      y
   1  1  spoke  -12.0   20.0
 fid  f  type    x      y
  33  2  spoke   40.0    9.0
"""
DOTS = "spotId,x,y,r\n1,-6.9,6.2,0.75\n2,-13.9,2.2,0.75\n"


def folder(path, **files):
    """A folder of made-up files; one of None is left out."""
    texts = {"grandfibermap.txt": MAP, "fiducials.txt": FIDUCIALS, "black_dots_mm-2030.csv": DOTS}
    for name, text in (texts | {key.replace("__", "."): value for key, value in files.items()}).items():
        if text is not None:
            (path / name).write_text(text)
    return path


def xml(**changes):
    """Six cobras, the last of which has a broken phi."""
    arms = []
    for k in range(6):
        values = {
            "Global_base_pos_x": 8.0 * k, "Global_base_pos_y": 4.0, "Link1_Link_Length": 2.4, "Link2_Link_Length": 2.3,
            "CCW_Global_base_ori_z": 350.0, "CW_Global_base_ori_z": 5.0, "Joint2_CCW_limit_angle": -8.0,
            "Joint2_CW_limit_angle": 188.0, "Status": 9 if k == 5 else 1,
        }  # fmt: skip
        values |= changes if k == 0 else {}
        inside = "".join(f"<{name}>{value}</{name}>" for name, value in values.items())
        arms.append(f"<ARM_DATA_CONTAINER><KINEMATICS>{inside}</KINEMATICS></ARM_DATA_CONTAINER>")
    return f"<?xml version='1.0'?><ARM_DATA>{''.join(arms)}</ARM_DATA>"


def test_a_folder(tmp_path):
    plane = FocalPlane.load(folder(tmp_path))
    assert plane.ids == ("1", "2", "3")
    np.testing.assert_allclose(plane.base[0], [-6.928, 4.0])
    assert [obstacle.name for obstacle in plane.obstacles] == ["fiducial 1", "fiducial 33"]
    np.testing.assert_allclose(plane.fibers(plane.folded), plane.base, atol=1e-12)  # phi 0 is folded
    np.testing.assert_allclose(plane.length, 2.375)
    assert any("2.375" in text for text in plane.assumptions)
    again = FocalPlane.load(tmp_path / "grandfibermap.txt")
    np.testing.assert_array_equal(again.forbidden, [[-6.9, 6.2, 0.75], [-13.9, 2.2, 0.75]])


def test_what_a_folder_lacks_is_said(tmp_path):
    plane = FocalPlane.load(folder(tmp_path, **{"fiducials__txt": None, "black_dots_mm-2030__csv": None}))
    assert not plane.obstacles
    assert not len(plane.forbidden)
    for what in ("no fiducials", "no black dots"):
        assert any(what in text for text in plane.notes)
        assert any(what in text for text in plane.assumptions)


def test_no_fiber_may_end_on_a_black_dot(tmp_path):
    plane = FocalPlane.load(folder(tmp_path))
    targets = Targets(np.array([-6.9, -13.9, -6.9]), np.array([6.2, 3.0, -5.0]), positioner=("1", "2", "3"))
    goal = targets.configuration(plane)
    with pytest.raises(ProblemError, match=r"'1': its fiber would end 0\.000 mm from \(-6\.900, 6\.200\) mm") as caught:
        Problem(plane, plane.folded, goal)
    assert caught.value.positioners == (0,)
    problem = Problem.from_targets(plane, targets, conflicts="drop")
    assert list(problem.dropped) == [0]  # 2's is 0.8 mm away from its dot
    assert problem.dropped[0].cause.startswith("forbidden place")
    plane.write(tmp_path / "plane.fits")
    np.testing.assert_array_equal(FocalPlane.load(tmp_path / "plane.fits").forbidden, plane.forbidden)
    away = plane.folded + np.array([0.0, 0.1])  # nothing collides with a dot
    assert not Problem(plane, away, np.full_like(away, np.nan)).dropped


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("grandfibermap__txt", MAP.replace("4.000        3", "x  3"), ["line 4", "y is 'x'"]),
        ("grandfibermap__txt", MAP.replace("   2    1", "   1    1"), ["line 5", "already given in line 4"]),
        ("grandfibermap__txt", MAP[:40], ["no rows"]),
        ("grandfibermap__txt", MAP.replace("4   emp", "4"), ["line 5", "6 values for 7 columns"]),
        ("fiducials__txt", FIDUCIALS.replace("fid", "f"), ["no heading 'fid"]),
        ("fiducials__txt", FIDUCIALS.replace("20.0", "nan"), ["line 2", "y is nan"]),
        ("black_dots_mm-2030__csv", DOTS.replace("0.75", "big"), ["line 2", "r is 'big'"]),
    ],
)
def test_bad_files(tmp_path, name, text, words):
    with pytest.raises(InstrumentError) as caught:
        FocalPlane.load(folder(tmp_path, **{name: text}))
    message = str(caught.value)
    assert all(word in message for word in words), message
    assert "\n" not in message


def test_measured_cobras(tmp_path):
    (tmp_path / "module.xml").write_text(xml(Link1_Link_Length=8.44))
    plane = FocalPlane.load(tmp_path / "module.xml")
    assert plane.ids == tuple("123456")
    np.testing.assert_allclose(plane.length[1:], 2.4)
    np.testing.assert_allclose(plane.fiber[:, 0], 2.3)
    np.testing.assert_allclose(np.degrees(plane.upper[0]), [375, 196])
    assert plane.online.tolist() == [True] * 5 + [False]
    assert any("cobra 6" in note and "phi is broken" in note for note in plane.notes)
    assert any("'1'" in note and "length 8.44 mm" in note for note in plane.notes)  # far from its kind
    stop = np.radians([350.0, 350.0 - 8.0 - 180.0])  # both joints at their stops
    expected = plane.base[1] + 2.4 * np.array([np.cos(stop[0]), np.sin(stop[0])])
    expected += 2.3 * np.array([np.cos(stop[1]), np.sin(stop[1])])
    np.testing.assert_allclose(plane.fibers(np.zeros((6, 2)))[1], expected)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (xml().replace("2.4<", "26.4<").replace("2.3<", "25.9<"), ["median Link1_Link_Length is 26.4", "not in mm"]),
        (xml(Link2_Link_Length="long"), ["cobra 1", "Link2_Link_Length is 'long'"]),
        (xml(Global_base_pos_x=""), ["cobra 1", "Global_base_pos_x is empty"]),
        (xml(Joint2_CW_limit_angle=-90), ["cobra 1", "Joint2_CW_limit_angle is below"]),
        (xml()[:300], ["not an XML file"]),
        ("<ARM_DATA></ARM_DATA>", ["no ARM_DATA_CONTAINER"]),
    ],
)
def test_bad_geometry(tmp_path, text, words):
    (tmp_path / "module.xml").write_text(text)
    with pytest.raises(InstrumentError) as caught:
        FocalPlane.load(tmp_path / "module.xml")
    message = str(caught.value)
    assert all(word in message for word in words), message
    assert "\n" not in message


def test_the_built_in_array_is_that_of_the_real_map(shared_data):
    built_in, real = FocalPlane.load("pfs"), FocalPlane.load(shared_data / "pfs" / "grandfibermap.txt")
    assert built_in.ids == real.ids
    np.testing.assert_allclose(built_in.base, real.base, atol=1e-3)
    ours, theirs = (np.array([o.points[0] for o in plane.obstacles]) for plane in (built_in, real))
    np.testing.assert_allclose(ours, theirs, atol=0.01)
    assert len(real.forbidden) == 2394
    for name in ("length", "lower", "upper", "folded", "zero", "max_speed", "fiber"):
        np.testing.assert_allclose(getattr(built_in, name), getattr(real, name), err_msg=name)
