"""`fiberplan simulate`: files of every kind executed with faults, what touches, and a start for the next plan."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates.touching import Touching
from fiberplan.cli.app import run
from fiberplan.errors import ProblemError, TrajectoryError
from fiberplan.hardware import sdss
from fiberplan.scenes.uniform import uniform_field
from problems import ARM, SEVEN_PLACES

SEVEN = 'format = 1\nname = "seven"\n' + SEVEN_PLACES + re.sub("speed = .*", "speed = 12", ARM)
PASSING = {  # R0C3 passes through where R0C2 came from, once that has left
    "R0C2": {"alpha": [[0.0, 1.0], [90.0, 9.0]], "beta": [[90.0, 1.0], [90.0, 9.0]]},
    "R0C3": {"alpha": [[0.0, 1.0], [0.0, 9.0], [150.0, 22.0]], "beta": [[180.0, 1.0], [180.0, 22.0], [30.0, 35.0]]},
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "seven.toml").write_text(SEVEN)
    (tmp_path / "pass.json").write_text(json.dumps({"trajectory": PASSING}))
    plane = fp.FocalPlane.load("seven.toml")
    state = fp.State(np.where(np.array(plane.ids)[:, None] == "R0C2", np.radians([0.0, 90.0]), plane.folded))
    state.write("before.ecsv", plane)
    return tmp_path


def told(capsys, code, *arguments):
    assert run(["simulate", "seven.toml", *map(str, arguments)]) == code
    out, err = capsys.readouterr()
    return err if code == 2 else out


@pytest.mark.small
def test_what_touches_is_told_with_its_time(folder, capsys):
    said = told(capsys, 0, "pass.json", "--state", "before.ecsv")
    assert said.startswith("pass.json (sdss), 35.000 s, nothing goes wrong\nnothing touches\n")
    assert "proven, whatever clocks and joints do within this: safe" in said
    said = told(capsys, 1, "pass.json", "--state", "before.ecsv", "--absent", "R0C2")
    assert "never start: R0C2\ntouch: R0C2 and R0C3 at " in said
    assert "but for who stalls or never starts: safe" in said
    said = json.loads(told(capsys, 1, "pass.json", "--state", "before.ecsv", "--stall", "R0C2@2", "--json"))
    (contact,) = said["touching"]["0"]
    assert contact["pair"] == ["R0C2", "R0C3"]
    assert 22.0 < contact["time"] <= 35.0
    assert said["cannot_move"] == ["R0C2"]


def test_an_abort_leaves_a_start_for_the_next_plan(folder, capsys):
    options = ("--state", "before.ecsv", "--abort", 5, "--absent", "R0C3", "-o", "after.ecsv")
    assert "wrote after.ecsv, a start for the next plan" in told(capsys, 0, "pass.json", *options)
    plane = fp.FocalPlane.load("seven.toml")
    state = fp.State.read("after.ecsv", plane)
    np.testing.assert_allclose(np.degrees(state.angles[plane.index["R0C2"]]), [45.0, 90.0], atol=1e-9)
    assert [plane.ids[i] for i in np.flatnonzero(~state.online)] == ["R0C3"]
    (folder / "next.csv").write_text("positioner,alpha,beta\nR0C2,100,90\n")
    assert run(["plan", "seven.toml", "next.csv", "--start", "after.ecsv", "--margin", "0.8"]) == 0
    assert "1 of 1 arrived in 4.6 s" in capsys.readouterr().out


@pytest.mark.small
def test_who_is_unknown_stays_so(folder, capsys):
    """Nobody says where the five stand that the file leaves out; the two are where their paths end."""
    told(capsys, 0, "pass.json", "-o", "after.ecsv")
    plane = fp.FocalPlane.load("seven.toml")
    state = fp.State.read("after.ecsv", plane)
    assert state.unknown.tolist() == [id_ not in PASSING for id_ in plane.ids]


def test_many_runs_say_which_failure_is_dangerous(folder, capsys):
    options = ("pass.json", "--state", "before.ecsv", "--any-stall", 1, "--runs", 40)
    said = told(capsys, 1, *options)
    count, first = re.search(r"something touches in (\d+) of 40 runs; --seed (\d+) is the first", said).groups()
    assert 2 < int(count) < 38
    assert f"touch: R0C2 and R0C3 in {count} runs" in said
    assert "touch: R0C2 and R0C3 at " in told(capsys, 1, *options[:-2], "--seed", first)
    assert told(capsys, 1, *options) == said
    said = told(capsys, 0, "pass.json", "--state", "before.ecsv", "--latency", 0.1, "--tracking", 0.2, "--runs", 40)
    assert "nothing touches in 40 runs, seeds 0 to 39" in said


@pytest.mark.small
def test_two_runs_of_which_all_or_none_touch(folder, capsys):
    options = ("pass.json", "--state", "before.ecsv", "--runs", 2, "--seed", 5)
    said = told(capsys, 1, *options, "--absent", "R0C2")
    assert "something touches in 2 of 2 runs; --seed 5 is the first of them" in said
    assert "touch: R0C2 and R0C3 in 2 runs" in said
    assert "nothing touches in 2 runs, seeds 5 to 6" in told(capsys, 0, *options)
    assert "--stall R0C2@soon: expected ID@S" in told(capsys, 2, *options, "--stall", "R0C2@soon")


def test_our_own_table_is_executed_too(folder, capsys):
    plane = fp.FocalPlane.load("seven.toml")
    problem = fp.Problem(plane, uniform_field(plane, 1, 0.8), uniform_field(plane, 2, 0.8), 0.8)
    plan = fp.planners.GreedyFold().plan(problem)
    fp.io.EXPORTS["ecsv"](plan, "m.ecsv")
    sdss.write(plan, "m.json")
    for name, kind in (("m.ecsv", "table"), ("m.json", "sdss")):
        said = told(capsys, 0, name, "--margin", 0.7, "-o", "after.ecsv")
        assert said.startswith(f"{name} ({kind})")
        after = fp.State.read("after.ecsv", plane)
        np.testing.assert_allclose(after.angles, plan.trajectory.end, atol=2e-5)
        assert not after.unknown.any()


@pytest.mark.small
def test_who_rests_is_known_and_who_cannot_move_stays_so(folder, capsys):
    """A table says where robots stand that do not move in it, and its meta data who cannot."""
    lines = ["# %ECSV 1.0", "# ---", "# datatype:", "# - {name: positioner, datatype: string}"]
    lines += [f"# - {{name: {name}, datatype: float64}}" for name in ("time", "alpha", "beta")]
    lines += ["# meta: {offline: [R0C3, R+1C1], unknown: [R+1C1]}", "positioner time alpha beta"]
    lines += ["R0C2 0 0 180", "R0C2 2 10 180", "R0C3 0 40 150", "R+1C1 0 0 180", "R+1C2 0 20 170"]
    Path("m.ecsv").write_text("\n".join(lines) + "\n")
    told(capsys, 0, "m.ecsv", "-o", "after.ecsv")
    plane = fp.FocalPlane.load("seven.toml")
    after = fp.State.read("after.ecsv", plane)
    moves, stays, guessed, rests = (plane.names[id_] for id_ in ("R0C2", "R0C3", "R+1C1", "R+1C2"))
    assert (after.online[moves], after.online[stays], after.online[guessed], after.online[rests]) == (1, 0, 0, 1)
    np.testing.assert_allclose(np.degrees(after.angles[[stays, rests]]), [[40, 150], [20, 170]])
    assert after.unknown[[moves, stays, guessed, rests]].tolist() == [False, False, True, False]


@pytest.mark.small
@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--stall", "R0C2"), "--stall R0C2: expected ID@S"),
        (("--stall", "R9C9@3"), "--stall R9C9@3: seven has no positioner 'R9C9'"),
        (("--absent", "R0C2,R9C9"), "--absent: seven has no positioner 'R9C9'"),
        (("--drift", 1), "simulate: drift 1 makes no sense"),
        (("--state", "none.csv"), "none.csv"),
    ],
)
def test_bad_options_are_one_line_and_nothing_is_written(folder, capsys, options, says):
    said = told(capsys, 2, "pass.json", *options, "-o", "after.ecsv")
    assert says in said
    assert len(said.splitlines()) == 1
    assert not (folder / "after.ecsv").exists()


def test_touching_finds_what_verify_finds():
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    rng, found, touching = np.random.default_rng(0), 0, Touching(plane, 0.3)
    for _ in range(40):
        knots = plane.folded[:, None] + np.cumsum(rng.normal(0.0, 1.0, (7, 3, 2)), axis=1)
        motion = fp.Trajectory(np.arange(8) * 3, np.tile([0.0, 2.0, 5.0], 7), knots.reshape(-1, 2))
        proof = fp.verify(plane, motion, 0.3)
        assert touching.contacts(motion) == (*proof.contacts, *proof.undecided)
        found += len(proof.contacts)
    assert found > 20
    assert touching.contacts(fp.Trajectory.at_rest(plane.folded)) == ()
    with pytest.raises(TrajectoryError, match="the motion has 6 positioners, the focal plane 7"):
        touching.contacts(fp.Trajectory.at_rest(plane.folded[:6]))


@pytest.mark.small
def test_a_state_of_another_plane_is_not_written(tmp_path):
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    with pytest.raises(ProblemError, match="the state has 6 positioners, the focal plane 7"):
        fp.State(plane.folded[:6]).write(tmp_path / "s.ecsv", plane)
    assert not list(tmp_path.iterdir())
