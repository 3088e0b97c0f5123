"""The SDSS readers on three made-up positioners, against formulas in complex numbers; no real data are needed."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from fiberplan.errors import InstrumentError, TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.problem import Problem, Targets

pytestmark = pytest.mark.small

SMALL = Path(__file__).parent / "fixtures" / "sdss"
#: hole -> (hole's centre, x axis, place in the hole's frame, first link, alpha and beta offset [deg], metrology fiber)
ROBOTS = {
    "R0C1": (-1 + 2j, 0.6 + 0.8j, 0.3j, 7.25, 10.0, -3.0, 14.5 - 0.5j),
    "R0C2": (22 + 1j, -1j, -0.2, 7.0, 0.0, 0.0, 14.25),
    "R+1C1": (11 + 20j, -1j, 0.1 + 0.2j, 7.5, -2.0, 1.0, 14 + 0.5j),
}


@pytest.fixture
def plane():
    return FocalPlane.load(SMALL)


@pytest.fixture
def folder(tmp_path):
    return Path(shutil.copytree(SMALL, tmp_path / "small"))


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_robots_stand_in_the_frames_of_their_holes(plane):
    assert plane.ids == tuple(ROBOTS)  # row by row of the grid, not as in the files
    for alpha, beta in np.random.default_rng(0).uniform(0.0, 3.0, (5, 2)):
        fibers = plane.fibers(np.tile([alpha, beta], (3, 1)), "metrology")
        for i, (centre, axis, place, first, a, b, fiber) in enumerate(ROBOTS.values()):
            elbow = np.exp(1j * (alpha + np.radians(a)))
            tip = first * elbow + fiber * elbow * np.exp(1j * (beta + np.radians(b)))
            there = centre + axis * (place + tip)
            np.testing.assert_allclose(fibers[i], [there.real, there.imag], atol=1e-12)


def test_what_else_the_folder_says(plane):
    assert list(plane.fiber_offsets) == ["metrology", "apogee", "boss"]
    names = {obstacle.name: obstacle for obstacle in plane.obstacles}
    np.testing.assert_array_equal(names["fiducial F1"].points, [[40.0, 0.5]])
    assert any("R+1C2" in note and "no positioner" in note for note in plane.notes)
    assert not any("F1" in note and "no positioner" in note for note in plane.notes)
    np.testing.assert_allclose(np.degrees(plane.folded), np.tile([0.0, 180.0], (3, 1)))
    assert plane.online.all()


def test_a_configuration_is_read_by_metrology_fibers(plane):
    targets = Targets.read(SMALL / "confSummary-small.par", prefer="angles")  # its positions are of no arm
    assert targets.positioner == ("R0C1", "R+1C1")
    assert targets.offline == ("R0C2",)
    np.testing.assert_array_equal([targets.x, targets.y], [[3.25, 12.5], [4.5, 18.75]])
    np.testing.assert_allclose(np.degrees(targets.angles), [[30.0, 90.0], [200.5, 45.0]])
    problem = Problem.from_targets(plane, targets, conflicts="drop")
    assert problem.plane.online.tolist() == [True, False, True]
    assert any("R0C2" in note and "offline" in note for note in problem.notes)
    np.testing.assert_allclose(problem.requested[[0, 2]], targets.angles)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("positionerTable", "dx,dy", "delta,dy", r"positionerTable.csv: no column 'dx'"),
        ("positionerTable", "R0C1", "R00C1", r"line 3: .*no hole 'R00C1'; did you mean"),
        ("positionerTable", "R0C2", "R0C1", r"line 4: hole 'R0C1' was already given in line 3"),
        ("positionerTable", "7.25", "nan", r"line 3: alphaArmLen is nan"),
        ("wokCoords", "-1,2,0,0.6", "left,2,0,0.6", r"line 3: xWok is 'left', not a number"),
        ("wokCoords", "0.6,0.8,0,-0.8,0.6", "0.6,0.8,0,0.8,-0.6", r"line 3: .*not the axes of a rotated frame"),
        ("wokCoords", "0.6,0.8,0,-0.8,0.6", "6,8,0,-8,6", r"line 3: .*not the axes of a rotated frame"),
        ("fiducialCoords", "40,0.5", "40,inf", r"fiducialCoords.csv: line 2: yWok is inf"),
    ],
)
def test_broken_folders(folder, name, old, new, message):
    edit(folder / f"{name}.csv", old, new)
    with pytest.raises(InstrumentError, match=message) as refused:
        FocalPlane.load(folder)
    assert "\n" not in str(refused.value)


def test_a_robot_with_a_bad_cell_is_offline_with_what_is_usual(folder):
    """Of its column; each is named in notes and assumptions."""
    for old, new in (("7.25", "nan"), ("14.25", "long")):
        edit(folder / "positionerTable.csv", old, new)
    plane = FocalPlane.load(folder, conflicts="drop")
    assert plane.online.tolist() == [False, False, True]
    assert plane.length.tolist() == [7.25, 7.0, 7.5]  # the median of 7 and 7.5
    said = [line for line in plane.assumptions if "is offline" in line]
    assert [line.partition(":")[0] for line in said] == [f"positioner {name} is offline" for name in ("R0C1", "R0C2")]
    assert "line 3: alphaArmLen is nan, taken as the median" in said[0]
    assert set(said) <= set(plane.notes)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (' "first of two"', "", r"line 23: 9 values for the 10 columns of FIBERMAP"),
        ("FIBERMAP 303 R+1C1 BOSS", "FIBERMAP 303 R0C1 BOSS", r"line 25: BOSS fiber of hole 'R0C1' was already given"),
        ("xwok;", "there;", r"no column 'xwok'"),
        ("} FIBERMAP;", "} OTHER;", r"no struct FIBERMAP"),
        ("3.25 4.5 30", "3.25 4.5 east", r"line 23: alpha is 'east', not a number"),
    ],
)
def test_broken_configurations(folder, old, new, message):
    path = folder / "confSummary-small.par"
    edit(path, old, new)
    with pytest.raises(TargetError, match=message) as refused:
        Targets.read(path)
    assert "\n" not in str(refused.value)


def test_a_configuration_without_rows(folder):
    path = folder / "confSummary-small.par"
    path.write_text("\n".join(line for line in path.read_text().splitlines() if not line.startswith("FIBERMAP")))
    with pytest.raises(TargetError, match="FIBERMAP has no rows"):
        Targets.read(path)


@pytest.mark.parametrize("name", ["gfaCoords.csv", "fiducialCoords.csv"])
def test_what_is_no_table_of_places_is_refused_though_it_is_empty(folder, name):
    """Headings alone say that there are none; a line of anything else says nothing."""
    heading = (folder / name).read_text().splitlines()[0]
    (folder / name).write_text(heading + "\n")
    assert any(f"{name} has no rows" in note for note in FocalPlane.load(folder).notes)
    (folder / name).write_text("garbage\n")
    with pytest.raises(InstrumentError, match=name):
        FocalPlane.load(folder)
