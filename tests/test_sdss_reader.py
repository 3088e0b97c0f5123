import shutil

import numpy as np
import pytest
import shapely

from fiberplan.errors import InstrumentError, ProblemError
from fiberplan.focal_plane import Body, FocalPlane
from fiberplan.problem import Problem, Targets

pytestmark = pytest.mark.small


@pytest.fixture
def folder(tmp_path, calibration):
    """A copy of a calibration folder, to break."""
    for name in ("wokCoords", "positionerTable", "fiducialCoords", "gfaCoords"):
        shutil.copy(calibration / f"{name}.csv", tmp_path)
    return tmp_path


@pytest.mark.parametrize("site", ["apo/wok_calibs/sloanFlatCMM", "lco/wok_calibs/duPontFlatCMM"])
def test_real_folders(shared_data, site):
    plane = FocalPlane.load(shared_data / "sdss" / site)
    assert plane.n == 500
    assert len(plane.obstacles) == 66
    assert list(plane.fiber_offsets) == ["metrology", "apogee", "boss"]
    tip = shapely.LineString([[16.2, -0.3], [16.2, 0.3]])  # the arm's flat end, 0.6 mm wide
    (arm,) = plane.bodies
    assert shapely.LineString(arm.points).buffer(arm.radius, quad_segs=64).contains(tip)
    for offset in plane.fiber_offsets.values():  # and every fiber that there is
        assert np.nanmax(np.hypot(*offset.T)) < 16.3
    assert [int(plane.carries(name).sum()) for name in plane.fiber_offsets] == [500, 298, 500]
    assert any("R0C14" in note for note in plane.notes)
    assert not any("(?)" in note for note in plane.notes)
    assert plane.recommended_margin == 0.94
    assert plane.assumptions


def test_robots_are_known_by_number_too(calibration):
    plane = FocalPlane.load(calibration)
    assert plane.ids[plane.index_of("16")] == "R+7C7"
    assert plane.index_of("481") == plane.index_of("R+7C10")
    with pytest.raises(InstrumentError, match=r"has no positioner '77777'$"):
        plane.index_of("77777")


def test_guide_cameras_stand_where_the_team_has_them(calibration):
    """Lines from (-56.54, 276.23) to (56.54, 276.23) mm and five more, each 60 deg farther; 36 robots can reach one."""
    for plane in (FocalPlane.load(calibration), FocalPlane.load("sdss")):
        cameras = [o for o in plane.obstacles if o.name.startswith("guide camera")]
        assert len(cameras) == 6
        first = min(cameras, key=lambda o: -o.points[:, 1].mean())
        np.testing.assert_allclose(np.sort(first.points[:, 0]), [-56.54, 56.54], atol=1e-3)
        np.testing.assert_allclose(first.points[:, 1], 276.23, atol=1e-3)
        assert first.radius == 2.53
        near = plane.obstacle_pairs_within(5.0 - 2 * 1.53 - 2.53 + 1.53)
        names = [plane.obstacles[k].name for k in near[:, 1]]
        assert sum(name.startswith("guide camera") for name in names) >= 30


def test_every_fiber_stands_where_the_observation_says(calibration, conf_summary):
    plane, targets = FocalPlane.load(calibration), Targets.read(conf_summary)
    goal = targets.configuration(plane)
    lines = [line.split() for line in conf_summary.read_text().splitlines() if line.startswith("FIBERMAP")]
    for name in plane.fiber_offsets:
        where = plane.fibers(goal, name)
        rows = [(plane.index[f[2]], float(f[8]), float(f[9])) for f in lines if f[3] == name.upper() and f[6] == "1"]
        assert len(rows) == 490
        rows = [row for row in rows if plane.carries(name)[row[0]]]
        who, x, y = (np.array(column) for column in zip(*rows, strict=True))
        away = np.hypot(where[who, 0] - x, where[who, 1] - y)
        assert np.median(away) < 0.06
        assert np.sqrt(np.mean(away**2)) < 0.2


def test_closest_arms_of_the_observed_design(calibration, conf_summary):
    plane, targets = FocalPlane.load(calibration), Targets.read(conf_summary)
    thin = np.stack([np.zeros((plane.n, 2)), plane.fiber], axis=1)  # elbow to metrology fiber
    gaps = plane.replace(bodies=(Body(thin, 0.0),)).clearance(targets.configuration(plane))
    i, j = plane.pairs[np.nanargmin(gaps)]
    assert {plane.ids[i], plane.ids[j]} == {"R+1C20", "R+1C21"}
    assert np.nanmin(gaps) == pytest.approx(3.97, abs=0.005)


def test_two_goals_are_blocked_by_arms_of_unknown_position(calibration, conf_summary):
    plane, targets = FocalPlane.load(calibration), Targets.read(conf_summary)
    problem = Problem.from_targets(plane, targets, margin=0.8, conflicts="drop")
    assert {plane.ids[i] for i in problem.dropped} == {"R-11C6", "R+9C4"}
    assert problem.has_goal.sum() == 488
    assert sum("its position is unknown" in note for note in problem.notes) == 10
    blockers = {plane.ids[i]: [plane.ids[b] for b in d.blockers] for i, d in problem.dropped.items()}
    assert blockers == {"R-11C6": ["R-12C5"], "R+9C4": ["R+9C5"]}
    with pytest.raises(ProblemError) as caught:
        Problem.from_targets(plane, targets, margin=0.8)
    assert all(id_ in str(caught.value) for id_ in ("R-12C5", "R-11C6", "R+9C4", "R+9C5"))


def test_tables_round_trip(tmp_path, calibration):
    plane = FocalPlane.load(calibration)
    plane.write(tmp_path / "plane.fits")
    again = FocalPlane.load(tmp_path / "plane.fits")
    np.testing.assert_array_equal(plane.bodies[0].points, again.bodies[0].points)
    np.testing.assert_array_equal(plane.clearance(plane.folded), again.clearance(plane.folded))


def edit(path, number, change):
    lines = path.read_text().splitlines()
    lines[number - 1] = change(lines[number - 1])
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(
    ("name", "number", "change", "message"),
    [
        ("positionerTable", 1, lambda s: s.replace("dx", "delta"), "positionerTable.csv: no column 'dx'"),
        ("positionerTable", 3, lambda s: s.replace("R+7C7", "R+77C7"), "line 3: .*no hole 'R\\+77C7'; did you mean"),
        (
            "positionerTable",
            4,
            lambda s: s.replace("R+12C6", "R+7C7"),
            "line 4: hole 'R\\+7C7' was already given in line 3",
        ),
        ("positionerTable", 2, lambda s: s.replace("7.39101267553251", "nan"), "line 2: alphaArmLen is nan"),
        ("positionerTable", 2, lambda s: s.replace("7.39101267553251", "7,4"), "line 2: 21 values for 20 columns"),
        ("wokCoords", 2, lambda s: s.replace("-145.6", "left"), "line 2: xWok is 'left', not a number"),
        (
            "wokCoords",
            2,
            lambda s: s.replace("0,-1,0,1,0,0", "0,-1,0,-1,0,0"),
            "line 2: .*not the axes of a rotated frame",
        ),
        (
            "fiducialCoords",
            2,
            lambda s: s.replace("232.4446586402906", "inf"),
            "fiducialCoords.csv: line 2: yWok is inf",
        ),
    ],
)
def test_broken_folders(folder, name, number, change, message):
    edit(folder / f"{name}.csv", number, change)
    with pytest.raises(InstrumentError, match=message):
        FocalPlane.load(folder)


def test_missing_file_of_a_folder(folder):
    (folder / "positionerTable.csv").unlink()
    with pytest.raises(InstrumentError, match=r"positionerTable\.csv: no such file"):
        FocalPlane.load(folder)


@pytest.mark.parametrize(
    ("name", "what", "left"), [("gfaCoords", "guide cameras", 60), ("fiducialCoords", "fiducials", 6)]
)
@pytest.mark.parametrize("how", ["absent", "headings only"])
def test_folders_without_cameras_or_fiducials_say_so(folder, name, what, left, how):
    path = folder / f"{name}.csv"
    heading = path.read_text().splitlines()[0]
    path.unlink()
    if how != "absent":
        path.write_text(heading + "\n")
    plane = FocalPlane.load(folder)
    assert (plane.n, len(plane.obstacles)) == (500, left)
    why = f"the folder has no {name}.csv" if how == "absent" else f"{name}.csv has no rows"
    assert f"no {what}: {why}" in plane.notes
    assert f"no {what}: {why}" in plane.assumptions


def test_truncated_conf_summary(tmp_path, conf_summary):
    text = conf_summary.read_text()
    path = tmp_path / "confSummary-cut.par"
    path.write_text(text[: text.index("FIBERMAP 40 ") + 60])
    with pytest.raises(Exception, match=r"line \d+: \d+ values for the \d+ columns of FIBERMAP"):
        Targets.read(path)
    path.write_text(text[:300])
    with pytest.raises(Exception, match="no struct FIBERMAP"):
        Targets.read(path)
