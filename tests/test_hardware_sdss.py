"""Trajectory files of SDSS-V: what is written, what it makes the motors do, and what is refused."""

import json

import numpy as np
import pytest
import yaml

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.errors import PlanError, TrajectoryError, UnprovenError
from fiberplan.hardware import sdss
from fiberplan.hardware.sdss import encode
from fiberplan.scenes.uniform import uniform_field

pytestmark = pytest.mark.small

SPEED = np.radians(12.0)
RESTS = {"alpha": [[0.0, 1.0], [0.0, 2.0]], "beta": [[180.0, 1.0], [180.0, 2.0]]}


@pytest.fixture(scope="module")
def seven():
    """Seven arms; robots are known by number, too."""
    plane = fp.FocalPlane.hexagonal(1, 22.4, max_speed=SPEED)
    return plane.replace(aliases=tuple(str(16 + 3 * i) for i in range(plane.n)))


def by_hand(plane, knots, margin=0.0):
    """A plan of knots (time [s], alpha, beta [deg]) by robot; the others rest folded."""
    rows = [(i, *row) for i in range(plane.n) for row in knots.get(plane.ids[i], [(0.0, 0.0, 180.0)])]
    owner, times, alpha, beta = np.array(rows, float).T
    motion = fp.Trajectory.from_knots(owner.astype(int), times, np.radians(np.stack([alpha, beta], axis=1)), plane.n)
    goal = np.where(plane.online[:, None], motion.end, np.nan)
    problem = fp.Problem(plane, motion.start, goal, margin, conflicts="drop")
    outcomes = [fp.Outcome.ARRIVED if o else fp.Outcome.OFFLINE for o in plane.online]
    return fp.Plan(problem, motion, tuple(outcomes), "by hand")


def written(path, trajectory):
    path.write_text(json.dumps({"trajectory": trajectory}))
    return path


def test_points_are_few_and_each_axis_has_its_own(tmp_path, seven):
    """Alpha turns evenly, beta waits; a knot that is not needed is left out; times follow a delay."""
    knots = [(0, 0, 180), (2, 10, 180), (4, 20, 180), (6, 30, 160)]
    done = sdss.write(by_hand(seven, {"R0C2": knots}), tmp_path / "t.json", delay=1.5)
    sent = json.loads((tmp_path / "t.json").read_text())["trajectory"]
    (mine,) = [sent[str(16 + 3 * i)] for i in range(7) if seven.ids[i] == "R0C2"]
    assert np.allclose(mine["alpha"], [[0, 1.5], [30, 7.5]])
    assert np.allclose(mine["beta"], [[180, 1.5], [180, 5.5], [160, 7.5]])
    assert len(sent) == 7  # those that rest, too
    assert done.facts == {"robots": 7, "points": 29, "messages": {"APO": 14, "LCO": 14}, "delay": 1.5}


def test_who_cannot_move_is_not_in_the_file_and_rests_in_the_proof(tmp_path, seven):
    online = np.ones(7, bool)
    online[2] = False
    sdss.write(by_hand(seven.replace(online=online), {}), tmp_path / "t.yaml")
    sent = yaml.safe_load((tmp_path / "t.yaml").read_text())
    assert sorted(sent) == [16, 19, 25, 28, 31, 34]  # numbers, as the control program has them
    executed = sdss.read(tmp_path / "t.yaml", seven)
    assert executed.online.tolist() == online.tolist()
    assert executed.assumptions == (f"{seven.ids[2]} are not in t.yaml: taken as folded, and as never moving",)


@pytest.mark.large
@pytest.mark.parametrize("ending", ["json", "yaml"])
def test_what_is_read_back_is_the_plan_to_a_thousandth_of_a_degree(tmp_path, seven, ending):
    problem = fp.Problem(seven, uniform_field(seven, 1, 0.8), uniform_field(seven, 2, 0.8), 0.8)
    plan = fp.planners.GreedyFold().plan(problem)
    assert len(plan.having(fp.Outcome.ARRIVED)) == 7
    done = sdss.write(plan, tmp_path / f"t.{ending}")
    executed = sdss.read(tmp_path / f"t.{ending}", seven, plan.state_at(0.0))
    times = np.linspace(0.0, plan.makespan, 999)
    away = executed.trajectory.sampled(times + 1.0) - plan.trajectory.sampled(times)
    assert np.degrees(np.abs(away)).max() <= 1e-3 + 1e-9
    np.testing.assert_allclose(executed.trajectory.at(1.0), plan.trajectory.start)
    assert done.certificate.ok
    assert done.certificate.margin == pytest.approx(0.75)
    assert done.certificate.position_error > 0  # the bus cuts angles and times off


def test_the_bus_cuts_off_what_the_joint_error_allows(tmp_path, seven):
    """Angles as int32 of 2^-30 turns and times as int32 of half a millisecond, both cut off, for each axis."""
    alpha = [[0.0, 1.0], [50.123456789, 6.12345], [20.0, 9.98765]]
    beta = [[180.0, 1.0], [140.0, 4.55555], [170.0, 8.12321]]
    executed = sdss.read(written(tmp_path / "t.json", {"R0C2": {"alpha": alpha, "beta": beta}}), seven)
    i, dense = seven.index["R0C2"], np.linspace(0.0, 10.0, 20_001)
    said = executed.trajectory.sampled(dense)[i]
    for joint, points in enumerate((alpha, beta)):
        value, time = np.transpose(points)
        cut = np.interp(dense, np.trunc(time / 0.0005) * 0.0005, np.trunc(value / 360 * 2**30) / 2**30 * 360)
        off = np.abs(np.radians(cut) - said[:, joint]).max()
        assert 0.2 * executed.joint_error[i, joint] < off <= executed.joint_error[i, joint]
    assert (executed.joint_error[np.arange(7) != i] == 0).all()


GOOD = {
    "R0C2": {"alpha": [[0.0, 1.0], [60.0, 6.0]], "beta": [[180.0, 1.0], [150.0, 4.0], [120.0, 7.0]]},
    "R0C3": {"alpha": [[0.0, 1.0], [200.0, 18.0]], "beta": [[180.0, 1.0], [150.0, 18.0]]},
}
TOUCHING = {
    "R0C2": {"alpha": [[0.0, 1.0], [10.0, 2.0], [10.0, 20.0]], "beta": [[180.0, 1.0], [20.0, 15.0], [20.0, 20.0]]},
    "R0C3": {"alpha": [[0.0, 1.0], [180.0, 16.0], [180.0, 20.0]], "beta": [[180.0, 1.0], [20.0, 16.0], [20.0, 20.0]]},
}


def test_a_motion_of_others_is_judged_as_by_hand(tmp_path, seven):
    """The values were found in ten lines of numpy: the union of both axes' times, then `verify`."""
    good = sdss.read(written(tmp_path / "t.json", GOOD), seven)
    assert fp.verify(seven, good.trajectory, 0.8).smallest == pytest.approx(2.460, abs=0.01)
    bad = fp.verify(seven, sdss.read(written(tmp_path / "t.json", TOUCHING), seven).trajectory, 0.8)
    found = [(*(seven.label(k) for k in c.pair), round(c.time, 2)) for c in bad.contacts]
    assert found == [("R0C2", "R0C3", 7.18), ("R0C2", "R+1C2", 8.29)]
    fast = {"R0C2": {"alpha": [[0.0, 1.0], [30.0, 2.0]], "beta": [[180.0, 1.0], [180.0, 2.0]]}}
    proof = fp.verify(seven, sdss.read(written(tmp_path / "t.json", fast), seven), 0.8)
    assert proof.violations == ("positioner 'R0C2': alpha moves at 30 deg/s from 1.000 s, limit 12 deg/s",)


def test_a_dump_says_where_the_others_stand(tmp_path, seven):
    dump = {"trajectory": GOOD, "success": False, "failed_positioners": [16], "start_time": 1.0}
    dump["initial_positions"] = {"R0C2": [0.0, 180.0], "R+1C2": [33.0, 150.0]}
    (tmp_path / "d.json").write_text(json.dumps(dump))
    executed = sdss.read(tmp_path / "d.json", seven)
    i = seven.index["R+1C2"]
    np.testing.assert_allclose(np.degrees(executed.trajectory.start[i]), [33.0, 150.0])
    assert executed.notes == ("failed, the file says: 16",)
    assert "R+1C2" not in executed.assumptions[0]
    assert sdss.accepts(tmp_path / "d.json", (tmp_path / "d.json").read_bytes())


def test_who_begins_elsewhere_is_noted(tmp_path, seven):
    stands = fp.State(seven.folded + np.radians([2.0, 0.0]))
    notes = sdss.read(written(tmp_path / "t.json", GOOD), seven, stands).notes
    assert notes[0] == "R0C2 begins 2 deg from where it stands: controllers refuse"
    assert len(notes) == 2


def test_offline_robots_that_a_file_moves_are_a_violation(tmp_path, seven):
    online = np.ones(7, bool)
    online[seven.index["R0C2"]] = False
    executed = sdss.read(written(tmp_path / "t.json", GOOD), seven, fp.State(seven.folded, online))
    assert "positioner 'R0C2' is offline but its alpha moves from 1.000 s" in fp.verify(seven, executed).violations


@pytest.mark.parametrize(
    ("knots", "says"),
    [
        ([(0, 0, 180), (1, 30, 180)], "'R0C2': alpha turns at 30 deg/s at 1.000 s, motors do 29.3 deg/s"),
        ([(0, 0, 180), (40, 375, 180)], "'R0C2': alpha is 375 deg at 41.000 s, controllers take -10 to 370 deg"),
        ([(0, 0, 180), (1, 1, 180), (1.0003, 1.002, 180), (3, 0, 180)], "alpha turns twice within 0.0003 s at 2.000 s"),
    ],
)
def test_what_controllers_cannot_do_is_refused_before_anything_is_written(tmp_path, seven, knots, says):
    wide = seven.replace(upper=np.tile(np.radians([400.0, 180.0]), (7, 1)), max_speed=np.full((7, 2), 1.0))
    with pytest.raises(PlanError, match=says):
        sdss.write(by_hand(wide, {"R0C2": knots}), tmp_path / "t.json")
    assert not list(tmp_path.iterdir())


def test_bytes_that_do_something_else_are_not_left_behind(tmp_path, seven, monkeypatch):
    """Two robots exchanged by the encoder: what was there before stays."""
    plan = by_hand(seven, {"R0C2": [(0, 0, 180), (5, 30, 150)]})
    right = encode.as_json

    def exchanged(sent):
        sent = [sent[0]._replace(robot=sent[1].robot), sent[1]._replace(robot=sent[0].robot), *sent[2:]]
        return right(sent)

    monkeypatch.setattr(sdss, "as_json", exchanged)
    (tmp_path / "t.json").write_text("before")
    who = seven.ids.index("R0C2")
    swapped = plan if who < 2 else by_hand(seven, {seven.ids[0]: [(0, 0, 180), (5, 30, 150)]})
    with pytest.raises(UnprovenError, match=r"would end .* mm from where the plan has it"):
        sdss.write(swapped, tmp_path / "t.json")
    assert [p.name for p in tmp_path.iterdir()] == ["t.json"]
    assert (tmp_path / "t.json").read_text() == "before"


@pytest.mark.parametrize(
    ("held", "says"),
    [
        ({"R9C9": RESTS}, "has no positioner 'R9C9'"),
        ({"R0C2": RESTS, "16": RESTS, "R-1C1": RESTS}, "R-1C1 is given twice"),
        ({"R0C2": {"alpha": [[0, 1]]}}, r"robot R0C2: beta: no points"),
        ({"R0C2": RESTS | {"beta": [[180, 2], [170, 1]]}}, "robot R0C2: beta: point 2 is at 1 s, before 2 s"),
        ({"R0C2": RESTS | {"beta": [[180, 1], [170, 1]]}}, "beta: point 2 is elsewhere at 1 s"),
        ({"R0C2": RESTS | {"beta": [["x", 1]]}}, "beta: point 1: 'x' is not a finite number"),
        ({"R0C2": RESTS | {"beta": [[1, 2, 3]]}}, r"beta: point 1 is \[1, 2, 3\], expected \[deg, s\]"),
    ],
)
def test_bad_files_are_one_line(tmp_path, seven, held, says):
    with pytest.raises(TrajectoryError, match=says) as caught:
        sdss.read(written(tmp_path / "t.json", held), seven)
    assert "\n" not in str(caught.value)
    assert "t.json" in str(caught.value)


def test_what_is_no_mapping_is_refused(tmp_path, seven):
    for text in ("[1, 2]", "{", "a: [", "\x00"):
        (tmp_path / "t.json").write_text(text)
        with pytest.raises(TrajectoryError, match=r"t\.json: (is neither|holds no)"):
            sdss.read(tmp_path / "t.json", seven)
        assert not sdss.accepts(tmp_path / "t.json", text.encode())


def test_the_command_proves_what_it_writes(tmp_path, seven, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    by_hand(seven, {"R0C2": [(0, 0, 180), (5, 30, 150)]}).write("good.fits")
    assert run(["export", "good.fits", "--to", "sdss", "-o", "t.json", "--delay", "2", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["facts"]["delay"] == 2.0
    assert said["executed"]["summary"].startswith("safe")
    a, b = (np.array(TOUCHING["R0C3"][axis]) for axis in ("alpha", "beta"))
    knots = {"R0C3": [(t - 1, x, y) for (x, t), (y, _) in zip(a, b, strict=True)]}
    knots["R0C2"] = [(0, 0, 180), (1, 10, 168.571429), (14, 10, 20)]
    by_hand(seven, knots).write("bad.fits")
    assert run(["export", "bad.fits", "--to", "sdss", "-o", "u.json"]) == 1
    assert "u.json: not written: what the motors would do is not safe" in capsys.readouterr().err
    assert not (tmp_path / "u.json").exists()
    assert run(["export", "good.fits", "--to", "ecsv", "-o", "k.ecsv", "--delay", "2"]) == 2
    assert "--delay: 'ecsv' has no such option" in capsys.readouterr().err
    assert run(["export", "good.fits", "--to", "lamost", "-o", "k"]) == 2
    assert "no export 'lamost'; there are ecsv, motions, sdss" in capsys.readouterr().err


def test_a_real_array_is_written_by_number(tmp_path, calibration):
    """Case: two targets, robots 16 and 481; everyone who can move is in the file."""
    plane = fp.FocalPlane.load(calibration)
    goal = np.full((plane.n, 2), np.nan)
    for id_, angles in (("R+7C7", (100, 90)), ("R+7C10", (200, 60))):
        goal[plane.index[id_]] = np.radians(angles)
    plan = fp.planners.GreedyFold().plan(fp.Problem(plane, plane.folded, goal, 0.8))
    sdss.write(plan, tmp_path / "t.json")
    sent = json.loads((tmp_path / "t.json").read_text())["trajectory"]
    assert len(sent) == 500
    assert (sent["16"]["alpha"][-1][0], sent["481"]["beta"][-1][0]) == pytest.approx((100, 60), abs=1e-3)
    assert {points[0][1] for path in sent.values() for points in path.values()} == {1.0}
