"""What nights need of the command: starts as they were observed, robots out of order, a way home."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.cli.app import run

PARKED = "R-1C1 R-1C2 R0C1 R0C2 R0C3 R+1C1 R+1C2".split()  # noqa: SIM905 (reads as a list of names)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Seven robots at 12 deg/s, and targets of one and of two."""
    monkeypatch.chdir(tmp_path)
    fp.FocalPlane.hexagonal(1, 22.4, max_speed=np.radians(12.0), name="seven").write("seven.fits")
    table("one.csv", {"R0C2": (100, 90)})
    table("two.csv", {"R0C2": (100, 90), "R0C3": (100, 90)})
    table("park.csv", dict.fromkeys(PARKED, (0, 180)))
    return tmp_path


def table(name, rows, more=""):
    lines = [f"positioner,alpha,beta{',priority' if more else ''}"]
    lines += [",".join([id_, *map(str, values)]) for id_, values in rows.items()]
    Path(name).write_text("\n".join(lines) + "\n")


def told(capsys, code, *arguments):
    """What a command prints, which exits so."""
    assert run([str(argument) for argument in arguments]) == code
    out, err = capsys.readouterr()
    return out if code != 2 else err


def plan(capsys, code, targets, *options):
    return told(capsys, code, "plan", "seven.fits", targets, "--margin", 0.8, *options)


# where the robots stand


@pytest.mark.parametrize("hole", ["nan", "absent"])
def test_a_robot_that_was_not_seen_is_offline_and_its_place_an_assumption(folder, capsys, hole):
    rows = dict.fromkeys(PARKED, (10, 170))
    if hole == "nan":
        rows["R0C3"] = ("nan", "nan")
    else:
        del rows["R0C3"]
    table("seen.csv", rows)
    out = plan(capsys, 0, "one.csv", "--start", "seen.csv", "-o", "p.fits")
    assert out.startswith("1 of 1 arrived in 7.5 s")
    assert "note: no angles in seen.csv for R0C3: taken as offline and folded" in out
    said = "  positioner 'R0C3' stands at alpha 0, beta 180 deg (its position is unknown)"
    for text in (out, told(capsys, 0, "verify", "p.fits"), told(capsys, 0, "diagnose", "p.fits")):
        assert f"safe if this one stands where it is taken to stand:\n{said}\n" in text
    where = [{"positioner": "R0C3", "alpha": 0.0, "beta": pytest.approx(180.0), "needed": True}]
    for command in ("verify", "diagnose"):
        assert json.loads(told(capsys, 0, command, "p.fits", "--json"))["unknown"] == where
    told(capsys, 0, "export", "p.fits", "--to", "motions", "-o", "m.ecsv")
    assert "its position is unknown" in (folder / "m.ecsv").read_text()
    assert fp.Plan.read("p.fits").certificate.assumptions == (said.strip(),)


def test_a_plan_goes_on_from_any_moment_of_its_export(folder, capsys):
    plan(capsys, 0, "one.csv", "-o", "p.fits")
    told(capsys, 0, "export", "p.fits", "--to", "ecsv", "-o", "m.ecsv")
    assert plan(capsys, 0, "one.csv", "--start", "m.ecsv").startswith("1 of 1 arrived in 0.0 s")
    for source in ("m.ecsv", "p.fits"):
        out = plan(capsys, 0, "one.csv", "--start", source, "--start-time", 3)
        assert out.startswith("1 of 1 arrived in 5.3 s")
    assert "of which motion? --start names its file" in plan(capsys, 2, "one.csv", "--start-time", 3)
    assert "no motion" in plan(capsys, 2, "one.csv", "--start", "park.csv", "--start-time", 3)


def test_robots_are_switched_off_by_name_or_by_file(folder, capsys):
    (folder / "off.txt").write_text("positioner\nR0C3  # its motor\nR+1C1\n")
    table("seen.csv", dict.fromkeys(PARKED, (10, 170)))
    for options in (["R0C3,R+1C1"], ["R0C3", "--offline", "R+1C1"], ["off.txt"]):
        out = plan(capsys, 1, "two.csv", "--start", "seen.csv", "-o", "p.fits", "--offline", *options)
        assert "note: offline, as --offline says: R0C3, R+1C1" in out
        read = fp.Plan.read("p.fits")
        assert [read.problem.plane.ids[i] for i in np.flatnonzero(~read.end.online)] == ["R0C3", "R+1C1"]
        np.testing.assert_allclose(np.degrees(read.end.angles[[4, 5]]), [[10, 170]] * 2)
    assert "--offline R0C9: seven has no positioner 'R0C9'" in plan(capsys, 2, "one.csv", "--offline", "R0C9")
    (folder / "off.txt").write_text("R0C3\nR0C9\n")
    assert "off.txt: line 2: seven has no positioner 'R0C9'" in plan(capsys, 2, "one.csv", "--offline", "off.txt")


def test_a_start_that_is_nearer_than_the_margin_is_opened(folder, capsys):
    table("near.csv", dict.fromkeys(PARKED, (0, 180)) | {"R0C2": (0, 29.9), "R0C3": (180, 29.9)})
    out = plan(capsys, 0, "park.csv", "--start", "near.csv", "-o", "p.fits")
    line = "opening: R0C2 and R0C3: begins at 0.7885 mm, below the margin of 0.8 mm, only comes apart and has it from"
    assert line in out
    assert line in told(capsys, 0, "verify", "p.fits")
    (pair,) = json.loads(told(capsys, 0, "verify", "p.fits", "--json"))["certificate"]["opening"]
    assert pair["pair"] == ["R0C2", "R0C3"]
    assert 0 < pair["time"] < 0.1


def test_arms_that_touch_are_parted_by_a_command_of_its_own(folder, capsys):
    table("touching.csv", dict.fromkeys(PARKED, (0, 180)) | {"R0C2": (0, 30), "R0C3": (178, 20)})
    text = plan(capsys, 2, "park.csv", "--start", "touching.csv")
    assert "R0C2 and R0C3 overlap (clearance -0.896 mm); `fiberplan separate` parts them" in text
    out = told(capsys, 0, "separate", "seven.fits", "--start", "touching.csv", "--margin", 0.8, "-o", "apart.fits")
    assert "opening: R0C2 and R0C3: begins at -0.8957 mm" in out
    plane = fp.FocalPlane.load("seven.fits")
    assert plane.clearance(fp.Plan.read("apart.fits").end.angles).min() >= 0.8
    assert plan(capsys, 0, "park.csv", "--start", "apart.fits").startswith("7 of 7 arrived")
    both = ["--offline", "R0C2", "--offline", "R0C3"]
    resting = told(capsys, 0, "separate", "seven.fits", "--start", "touching.csv", "--margin", 0.8, *both)
    assert "at rest, neither can move: R0C2 and R0C3" in resting


@pytest.mark.small
def test_a_guess_refuses_no_start(folder, capsys):
    rows = dict.fromkeys(PARKED, (0, 180)) | {"R0C2": (0, 0)}  # stretched over where R0C3 would be folded
    del rows["R0C3"]
    table("seen.csv", rows)
    table("stay.csv", {"R0C2": (0, 0)})
    out = plan(capsys, 0, "stay.csv", "--start", "seen.csv")
    assert "where it was first taken to be it would touch another" in out


# who cannot move


@pytest.mark.parametrize(
    ("targets", "code", "first"), [("two.csv", 1, "1 of 2"), ("only.csv", 1, "0 of 1"), ("rest.csv", 0, "1 of 1")]
)
def test_a_target_of_a_robot_that_cannot_move_is_lost(folder, capsys, targets, code, first):
    table("only.csv", {"R0C2": (100, 90)})
    table("rest.csv", {"R0C2": (0, 180), "R0C3": (100, 90)})
    out = plan(capsys, code, targets, "--offline", "R0C2", "-o", "p.fits")
    assert out.startswith(f"{first} arrived")
    assert ("lost R0C2: offline, cannot move; 9.667 mm from its target\n" in out) == bool(code)
    again = told(capsys, code, "diagnose", "p.fits")
    assert ("lost R0C2: offline, cannot move; " in again) == bool(code)
    assert fp.Plan.read("p.fits").lost.tolist() == [3] * code


def test_the_direction_of_priorities_is_said_and_can_be_chosen(folder, capsys):
    table("both.csv", {"R0C2": (0, 20, 1), "R0C3": (180, 20, 15)}, "priority")
    says = "; priority 1 gives way to 15: larger matters more"
    (line,) = [x for x in plan(capsys, 1, "both.csv", "--conflicts", "drop").splitlines() if x.startswith("lost")]
    assert line.startswith("lost R0C2")
    assert line.endswith(says)
    out = plan(capsys, 1, "both.csv", "--conflicts", "drop", "--priority-order", "smaller")
    assert "lost R0C3" in out
    assert "note: in both.csv smaller priorities matter more: 1 counts as 15, and so on" in out
    np.testing.assert_array_equal(fp.Targets.read("both.csv", "smaller").priority, [15, 1])


# verbs


def test_idle_arms_are_parked(folder, capsys):
    table("out.csv", dict.fromkeys(PARKED, (90, 60)))
    out = plan(capsys, 0, "one.csv", "--start", "out.csv", "--park-idle", "-o", "q.fits")
    assert out.startswith("1 of 1 arrived in 10.0 s")
    assert "note: parked: 6 of 6 without a target are folded" in out
    read = fp.Plan.read("q.fits")
    np.testing.assert_allclose(np.degrees(np.delete(read.end.angles, 3, axis=0)), [[0, 180]] * 6, atol=1e-6)
    assert [outcome.name for outcome in read.outcomes].count("NO_TARGET") == 6
    # R0C2's goal lies over the base of R0C3, so that R0C3 cannot fold
    table("over.csv", {"R0C2": (0, 10)})
    out = plan(capsys, 0, "over.csv", "--start", "out.csv", "--park-idle")
    assert out.startswith("1 of 1 arrived")
    assert "note: not parked: R0C3" in out


@pytest.mark.parametrize("verb", ["fold", "unwind"])
def test_home_around_who_cannot_move(folder, capsys, verb):
    table("out.csv", dict.fromkeys(PARKED, (90, 60)))
    options = ["--start", "out.csv", "--margin", 0.8, "--offline", "R0C1", "-o", "home.fits"]
    told(capsys, 0, verb, "seven.fits", *options)
    read = fp.Plan.read("home.fits")
    wanted = [[90, 60] if id_ == "R0C1" else [0, 180] for id_ in PARKED]
    np.testing.assert_allclose(np.degrees(read.end.angles), wanted, atol=1e-6)
    assert read.certificate.ok


def test_idle_robots_are_parked_where_they_are_sent(folder, capsys):
    out = plan(capsys, 0, "one.csv", "--park-at", "30", "150", "-o", "p.fits")
    assert "parked: 5 of 6 without a target are where they were sent" in out
    assert "not parked: R0C1\n" in out  # there it would touch who is at its target
    end = fp.Plan.read("p.fits").trajectory.end
    five = [k for k, id_ in enumerate(PARKED) if id_ not in ("R0C1", "R0C2")]
    np.testing.assert_allclose(np.degrees(end[five]), [[30, 150]] * 5, atol=1e-9)
    out = plan(capsys, 0, "one.csv", "--park-at", "30", "200", "-o", "p.fits")  # out of their range
    assert "parked: 0 of 6" in out
    assert "not parked: R-1C1, " in out
    out = plan(capsys, 0, "one.csv", "--park-at", "-1e-7", "180")  # out of it by rounding
    assert "parked: 6 of 6 without a target are folded" in out
    assert "park at [nan, 180.0] deg: two finite angles are wanted" in plan(
        capsys, 2, "one.csv", "--park-at", "nan", "180"
    )


def test_rows_that_no_robot_can_have_are_dropped_by_name(folder, capsys):
    Path("more.csv").write_text("positioner,alpha,beta\nR0C2,100,90\nR0C2,90,90\nR9C9,10,20\n")
    assert "line 3: positioner 'R0C2' already has a target in line 2" in plan(capsys, 2, "more.csv")
    out = plan(capsys, 1, "more.csv", "--conflicts", "drop")
    assert out.startswith("1 of 1 arrived")
    assert "line 3 of more.csv was left out: positioner 'R0C2' already has a target in line 2; its target" in out
    assert "line 4 of more.csv was left out: seven has no positioner 'R9C9'" in out


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("R0C2", "--angels", "10", "100"), "No such option '--angels'"),
        (("--angels", "R0C2", "10", "100"), "No such option '--angels'"),
        (("R0C2", "-12", "-x"), "No such option '-x'"),
        (("R0C2", "-12", "three"), "'three' is not a number"),
    ],
)
def test_an_option_that_amend_does_not_have_is_called_so(folder, capsys, arguments, line):
    plan(capsys, 0, "one.csv", "-o", "p.fits")
    said = told(capsys, 2, "amend", "p.fits", *arguments)
    assert line in said
    assert len(said.splitlines()) == 1


def test_instruments_print_what_they_assume(folder, capsys):
    fp.FocalPlane.load("seven.fits").replace(bodies=(), assumptions=("a guess",)).write("bare.fits")
    out = told(capsys, 0, "instruments", "bare.fits")
    assert "assumed: a guess\n" in out
    assert "has no bodies" in out
    said = json.loads(told(capsys, 0, "instruments", "bare.fits", "--json"))
    assert said["assumptions"] == ["a guess"]
    assert "has no bodies" in said["cautions"][0]


def test_goals_are_amended_by_place_by_angles_and_from_a_table(folder, capsys):
    plan(capsys, 0, "one.csv", "-o", "p.fits")
    told(capsys, 0, "amend", "p.fits", "R0C2", "-12", "-3.5", "-o", "q.fits")
    read = fp.Plan.read("q.fits")
    np.testing.assert_allclose(read.problem.plane.fibers(read.end.angles)[3], [-12, -3.5], atol=1e-3)
    told(capsys, 0, "amend", "p.fits", "R0C2", "--angles", "10", "100", "-o", "q.fits")
    np.testing.assert_allclose(np.degrees(fp.Plan.read("q.fits").end.angles[3]), [10, 100])
    told(capsys, 0, "amend", "p.fits", "--goals", "two.csv", "-o", "q.fits")
    np.testing.assert_allclose(np.degrees(fp.Plan.read("q.fits").end.angles[[3, 4]]), [[100, 90]] * 2)
    for arguments, text in (
        (["R0C2", "-99", "0"], "mm from its base, reach"),
        (["R0C9", "0", "0"], "has no positioner 'R0C9'"),
        (["R0C2", "1"], "needs X and Y"),
        (["R0C2", "1", "2", "--angles", "1", "2"], "not by both"),
        ([], "whose goal?"),
        (["R0C2", "--nonsense"], "No such option '--nonsense'"),
    ):
        line = told(capsys, 2, "amend", "p.fits", *arguments)
        assert text in line, line


def test_what_gzip_packed_is_read_by_every_command(folder, capsys):
    plan(capsys, 0, "one.csv", "-o", "p.fits")
    for name in ("p.fits", "one.csv"):
        (folder / f"{name}.gz").write_bytes(gzip.compress((folder / name).read_bytes()))
    assert told(capsys, 0, "verify", "p.fits.gz") == told(capsys, 0, "verify", "p.fits")
    assert plan(capsys, 0, "one.csv.gz", "--start", "p.fits.gz").startswith("1 of 1 arrived in 0.0 s")


# premises


def test_a_recommended_margin_is_taken_and_said(folder, capsys):
    plane = fp.FocalPlane.load("seven.fits")
    plane.replace(recommended_margin=0.6, assumptions=("sizes are guessed",)).write("seven.fits")
    out = told(capsys, 0, "plan", "seven.fits", "one.csv", "-o", "p.fits")
    assert "note: margin 0.6 mm, as is recommended for seven; --margin takes another" in out
    assert "(margin 0.6 mm, 21 pairs)" in out
    assert "assumed: sizes are guessed" in out
    assert "assumed: sizes are guessed" in told(capsys, 0, "verify", "p.fits")


def test_room_for_clocks_and_arms_that_are_off(folder, capsys):
    out = plan(capsys, 0, "two.csv", "--jitter", 0.1, "--position-error", 0.05, "-o", "p.fits")
    assert "note: clocks that are off by 0.1 s are planned for as arms that are off by up to" in out
    told(capsys, 0, "verify", "p.fits", "--jitter", 0.1)
    read = fp.Plan.read("p.fits")
    assert fp.verify(read.problem.plane, read.trajectory, 0.8, jitter=0.1, position_error=0.05).ok


def test_a_motion_is_proven_on_another_description_of_the_array(folder, capsys):
    plan(capsys, 0, "two.csv", "-o", "p.fits")
    plane = fp.FocalPlane.load("seven.fits")
    order = np.arange(7)[::-1]
    plane.replace(bodies=(fp.Body(plane.bodies[0].points, 5.5),)).subset(order).write("thick.fits")
    out = told(capsys, 1, "verify", "p.fits", "--instrument", "thick.fits")
    assert "contact: " in out
    assert "note: the plan's own geometry differs: the radius of " in out
    assert ", by 4 mm at most" in out
    plane.subset(order).write("same.fits")
    assert "differs" not in told(capsys, 0, "verify", "p.fits", "--instrument", "same.fits")
    plane.subset(np.arange(6)).write("less.fits")
    assert "has no positioner R+1C2" in told(capsys, 2, "verify", "p.fits", "--instrument", "less.fits")
