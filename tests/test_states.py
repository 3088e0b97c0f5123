"""Where everyone stands, from whatever says it."""

import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import PlanError, ProblemError
from fiberplan.io import EXPORTS, read_state
from test_moons_reader import PITCH, field, paf, write

pytestmark = pytest.mark.small

SMALL = Path(__file__).parent / "fixtures" / "sdss"
ANGLES = ["R-1C1,10,170", "R-1C2,20,170", "R0C1,30,170", "R0C2,40,170", "R0C3,50,170", "R+1C1,60,170", "R+1C2,70,170"]


def table(folder, rows, columns="positioner,alpha,beta", name="state.csv"):
    path = folder / name
    path.write_text("\n".join([columns, *rows]) + "\n")
    return path


def test_a_row_that_is_missing_or_empty_is_unknown_and_offline(tmp_path, small_plane):
    rows = [*ANGLES[:3], "R0C2,nan,nan", *ANGLES[4:6]]
    state = fp.State.read(table(tmp_path, rows), small_plane)
    assert state.unknown.tolist() == [False, False, False, True, False, False, True]
    np.testing.assert_array_equal(state.online, ~state.unknown)
    np.testing.assert_allclose(np.degrees(state.angles[[0, 3, 6]]), [[10, 170], [0, 180], [0, 180]])
    assert state.notes == (f"no angles in {tmp_path}/state.csv for R0C2, R+1C2: taken as offline and folded",)


def test_columns_that_say_more(tmp_path, small_plane):
    rows = [f"{row},{k != 2},{0.1 * k:g}" for k, row in enumerate(ANGLES)]
    state = fp.State.read(table(tmp_path, rows, "positioner,alpha,beta,online,position_error"), small_plane)
    assert np.flatnonzero(~state.online).tolist() == [2]
    np.testing.assert_allclose(state.position_error, 0.1 * np.arange(7))
    assert not state.unknown.any()
    assert state.notes == (f"offline in {tmp_path}/state.csv: R0C1",)
    problem = fp.Problem(small_plane, state, np.full((7, 2), np.nan), 0.3)
    assert not problem.plane.online[2]
    np.testing.assert_allclose(problem.position_error, state.position_error)


def test_second_names(tmp_path, small_plane):
    plane = small_plane.replace(aliases=tuple(f"P{k}" for k in range(7)))
    state = fp.State.read(table(tmp_path, ["P3,40,170", *ANGLES[:3]]), plane)
    np.testing.assert_allclose(np.degrees(state.angles[3]), [40, 170])
    path = table(tmp_path, ["P3,40,170", *ANGLES[:4]])
    with pytest.raises(ProblemError, match="line 6: positioner 'R0C2' was already given in line 2"):
        fp.State.read(path, plane)


def test_a_plan_its_end_and_any_moment_of_it(tmp_path, small_plan, small_plane):
    small_plan.write(tmp_path / "plan.fits")
    half = 0.5 * small_plan.makespan
    for source in (small_plan, tmp_path / "plan.fits"):
        np.testing.assert_array_equal(read_state(source, small_plane).angles, small_plan.trajectory.end)
        state = read_state(source, small_plane, at=half)
        np.testing.assert_array_equal(state.angles, small_plan.trajectory.at(half))
        assert np.flatnonzero(~state.online).tolist() == [6]
        assert "plan" in state.notes[0]
    with pytest.raises(ProblemError, match="a moment of 0 s or more, got -1 s"):
        read_state(small_plan, small_plane, at=-1.0)


def test_our_own_export_says_the_same_as_the_plan(tmp_path, small_plan, small_plane):
    EXPORTS["ecsv"](small_plan, tmp_path / "motion.ecsv")
    for at in (None, 0.0, 0.3 * small_plan.makespan, 2.0 * small_plan.makespan):
        state, wanted = (read_state(source, small_plane, at=at) for source in (tmp_path / "motion.ecsv", small_plan))
        np.testing.assert_allclose(state.angles, wanted.angles, atol=1e-12)
        np.testing.assert_array_equal(state.online, wanted.online)
        np.testing.assert_array_equal(state.unknown, wanted.unknown)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (["R0C2,1,0,180", "R0C2,1,5,180"], "line 3: time of positioner 'R0C2' is 1 s, not after the 1 s in line 2"),
        (["R0C2,1,0,180", "R0C2,2,,180"], "line 3: alpha of a motion is empty"),
    ],
)
def test_bad_motions(tmp_path, small_plane, rows, message):
    path = table(tmp_path, rows, "positioner,time,alpha,beta")
    with pytest.raises(ProblemError, match=re.escape(message)):
        read_state(path, small_plane)


def test_a_table_of_places_has_no_moments(tmp_path, small_plane):
    with pytest.raises(ProblemError, match="a table without a column 'time' is no motion: nothing is known of 3 s"):
        read_state(table(tmp_path, ANGLES), small_plane, at=3.0)


def test_packed_tables_and_plans(tmp_path, small_plane, small_plan):
    path = table(tmp_path, ANGLES)
    packed = tmp_path / "state.csv.gz"
    packed.write_bytes(gzip.compress(path.read_bytes()))
    np.testing.assert_array_equal(read_state(packed, small_plane).angles, read_state(path, small_plane).angles)
    EXPORTS["ecsv"](small_plan, tmp_path / "motion.ecsv")
    (tmp_path / "motion.ecsv.gz").write_bytes(gzip.compress((tmp_path / "motion.ecsv").read_bytes()))
    end = read_state(tmp_path / "motion.ecsv.gz", small_plane).angles
    np.testing.assert_allclose(end, small_plan.trajectory.end, atol=1e-12)
    small_plan.write(tmp_path / "plan.fits")
    content = gzip.compress((tmp_path / "plan.fits").read_bytes())
    (tmp_path / "plan.fits.gz").write_bytes(content)
    assert fp.Plan.read(tmp_path / "plan.fits.gz").outcomes == small_plan.outcomes
    for damaged in (content[:-100], content[:100] + b"\0\0\0\0" + content[104:], content + b"more"):
        (tmp_path / "plan.fits.gz").write_bytes(damaged)
        with pytest.raises(PlanError, match=r"plan.fits.gz: (is truncated|is damaged|the FITS file)"):
            fp.Plan.read(tmp_path / "plan.fits.gz")


def test_a_record_of_sdss(tmp_path):
    plane = fp.FocalPlane.load(SMALL)
    text = (SMALL / "confSummary-small.par").read_text()
    with pytest.raises(ProblemError, match=r"angles and positions of the same rows disagree .* calibration\?$"):
        fp.State.read(SMALL / "confSummary-small.par", plane)  # its positions are of no arm
    text = text.replace("3.25 4.5", "-16.137 9.8863").replace("12.5 18.75", "-4.0312 32.5883")
    (tmp_path / "record.par").write_text(text)
    targets = fp.Targets.read(tmp_path / "record.par")
    state = fp.State.read(tmp_path / "record.par", plane)
    known = targets.indices(plane)
    np.testing.assert_allclose(state.angles[known], targets.angles)
    assert np.flatnonzero(state.unknown).tolist() == sorted(plane.names[id_] for id_ in targets.offline)
    np.testing.assert_array_equal(state.online, ~state.unknown)
    # with a column that says who is disabled
    who = plane.ids[known[0]]
    lines = []
    for line in text.splitlines():
        if "}" in line and "FIBERMAP" in line and "FIBERMAP;" in line.replace(" ", ""):
            lines.append("  int disabled;")
        lines.append(f"{line} {int(who in line.split())}" if line.upper().startswith("FIBERMAP ") else line)
    (tmp_path / "record.par").write_text("\n".join(lines) + "\n")
    state = fp.State.read(tmp_path / "record.par", plane)
    assert not state.online[known[0]]
    assert not state.unknown[known[0]]
    assert any(f"disabled, so offline, in {tmp_path}/record.par: {who}" in note for note in state.notes)


def test_a_field_of_moons(tmp_path):
    plane = fp.FocalPlane.load(write(tmp_path, paf()))
    rows = [
        [PITCH, 30, 39.5168, 10.0133, 0, 1, 2],
        [PITCH, 90, 42.1291, 78.6821, 1, 0, 1],
        [PITCH, 150, 1e6, 0, 0, 0, 0],
    ]
    path = field(tmp_path, rows)
    targets, state = fp.Targets.read(path), fp.State.read(path, plane)
    np.testing.assert_allclose(plane.fibers(state.angles)[:2], np.stack([targets.x, targets.y], axis=1), atol=1e-9)
    assert state.angles[0, 1] * state.angles[1, 1] < 0  # other elbows, as the file asks
    assert state.unknown.tolist() == [False, False, True]


@pytest.mark.parametrize("column", ["x", "X"])
def test_angles_and_places_of_a_start_are_compared(tmp_path, small_plane, column):
    """Whose angles put its fiber far from where the same row says it is stands nobody knows where."""
    ends = small_plane.fibers(np.radians([[float(v) for v in row.split(",")[1:]] for row in ANGLES]))
    ends[1, 0] += 3.0
    ends[3, 0] += 7.0
    rows = [f"{row},{x:.4f},{y:.4f}" for row, (x, y) in zip(ANGLES, ends, strict=True)]
    state = fp.State.read(table(tmp_path, rows, f"positioner,alpha,beta,{column},y"), small_plane)
    assert np.flatnonzero(state.unknown).tolist() == [3]
    assert not state.online[3]
    assert any("7.000 mm from its position (R0C2 in line 5), so that nobody knows" in note for note in state.notes)
    problem = fp.Problem(small_plane, state, np.full((7, 2), np.nan), 0.3)
    assert any("R-1C2 in line 3 3.000 mm" in text for text in problem.assumptions)
    assert "from its position" not in "".join(problem.assumptions)

    rows = [f"{row},{x + 1:.4f},{y:.4f}" for row, (x, y) in zip(ANGLES, ends, strict=True)]
    other = table(tmp_path, rows, "positioner,alpha,beta,x,y")
    with pytest.raises(
        ProblemError,
        match=r"disagree on .*: median 1\.000 mm, largest 8\.000 mm .*of 7 rows; another instrument or calibration\?$",
    ):
        fp.State.read(other, small_plane)


SENT = {"alpha": [[0.0, 1.0], [60.0, 6.0]], "beta": [[180.0, 1.0], [120.0, 7.0]]}  # a path of SDSS-V


def test_a_controllers_file_its_end_and_any_moment_of_it(tmp_path, small_plane):
    """Who is not in the file is unknown; joints are as far off as the controller leaves them."""
    path = tmp_path / "sent.json"
    path.write_text(json.dumps({"trajectory": {"R0C2": SENT}}))
    i = small_plane.index["R0C2"]
    for at, (alpha, beta) in ((None, (60, 120)), (3.5, (30, 155)), (0.5, (0, 180))):
        state = fp.State.read(path, small_plane, at=at)
        np.testing.assert_allclose(np.degrees(state.angles[i]), (alpha, beta))
        assert np.flatnonzero(~state.unknown).tolist() == np.flatnonzero(state.online).tolist() == [i]
        assert 0 < state.position_error[i] < 0.2
    assert f"no angles in {path} for R-1C1" in state.notes[0]
    executed = fp.hardware.sdss.read(path, small_plane, fp.State.folded(small_plane))
    for source in (executed, executed.trajectory):
        state = fp.State.read(source, small_plane, at=3.5)
        np.testing.assert_allclose(np.degrees(state.angles[i]), (30, 155))
        assert state.online[i]
    assert not state.unknown.any()  # a trajectory tells of everyone


def test_a_file_that_only_says_how_far_robots_go_is_no_start(tmp_path, small_plane):
    path = tmp_path / "sent.json"
    numbered = small_plane.replace(ids=tuple(map(str, range(1, 8))))
    path.write_text(json.dumps({"configMotion": {"3": [[100, 0], [100, -100]]}}))
    with pytest.raises(
        ProblemError, match=r"how far robots go, not from where \(a file of moons\); `fiberplan simulate"
    ):
        fp.State.read(path, numbered)
    path.write_text(json.dumps({"configPaths": {"3": np.radians([[0, 10], [0, 20]]).tolist()}}))
    state = fp.State.read(path, numbered)
    np.testing.assert_allclose(np.degrees(state.angles[2]), (10, 20), atol=0.01)
    assert np.flatnonzero(~state.unknown).tolist() == [2]
    path.write_text(json.dumps({"configPaths": {"9": [[0, 0], [10, 20]]}}))
    with pytest.raises(ProblemError, match="9"):
        fp.State.read(path, numbered)
