"""What commands tell programs, and how much they tell people."""

import json
import math

import numpy as np
import pytest
from astropy import units
from astropy.table import QTable

import fiberplan as fp
from fiberplan.cli.answers import plain
from fiberplan.cli.app import run
from fiberplan.cli.report import LISTED, cautions, folded, lost_targets, say_plan
from fiberplan.plan.closest import closest_pairs
from fiberplan.plan.summary import headline

pytestmark = pytest.mark.small

PLAN = {
    "summary", "instrument", "planner", "seed", "makespan", "lower_bound", "interrupted", "outcomes", "losses",
    "displaced", "left_out",
    "certificate", "faults", "notes", "unknown",
}  # fmt: skip
CERTIFICATE = {
    "ok", "summary", "margin", "jitter", "position_error", "pairs", "smallest_clearance", "contacts", "undecided",
    "resting", "zones", "violations", "opening", "assumptions", "geometry", "tolerates",
}  # fmt: skip
LOSS = {"positioner", "id", "outcome", "cause", "priority", "blockers", "names", "distance"}
DIAGNOSIS = {"losses", "makespan", "lower_bound", "bound_by", "slowest", "pair_bounds", "alpha", "beta", "faults"} | {
    "assumptions",
    "unknown",
}
DIAGNOSIS |= {"displaced", "left_out"}
ROW = {"name", "reference", "about"}
SETTING = {"key", "type", "choices", "optional", "unit", "default", "help"}


@pytest.fixture
def folder(tmp_path, monkeypatch, small_plan, small_plane):
    """A working folder with a plan, an instrument and a table of targets."""
    monkeypatch.chdir(tmp_path)
    small_plan.write("plan.fits")
    small_plane.write("plane.fits")
    x, y = small_plane.fibers(small_plane.folded + np.array([0.3, -0.2])).T
    QTable({"positioner": list(small_plane.ids), "x": x * units.mm, "y": y * units.mm}).write("field.ecsv")
    return tmp_path


def told(capsys, *arguments, code=0):
    """The JSON on stdout, strictly read."""
    assert run([*arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


def test_plan(folder, capsys):
    options = ["--planner", "greedy-fold", "--set", "step=2", "-o", "new.fits"]
    said = told(capsys, "plan", "plane.fits", "field.ecsv", *options)
    assert set(said) == PLAN | {"settings", "written"}
    assert set(said["certificate"]) == CERTIFICATE
    assert said["outcomes"] == dict.fromkeys((o.name for o in fp.Outcome), 0) | {"ARRIVED": 7}
    assert said["settings"] == {"step": 2.0, "max_travel": 700.0, "skip_noops": True, "relief": "joint"}
    assert said["written"] == ["new.fits"]
    assert said["certificate"]["ok"] is True
    geometry = said["certificate"]["geometry"]
    assert geometry["name"] == fp.FocalPlane.load("plane.fits").name
    assert geometry["radii"] == [["arm", 1.5, 1.5]]
    assert run(["verify", "new.fits"]) == 0
    assert f"digest {geometry['digest'][:12]}; margin" in capsys.readouterr().out
    assert said["makespan"] == fp.Plan.read("new.fits").makespan
    assert any("margin is 0 mm" in note for note in said["notes"])


@pytest.mark.large
def test_verify(folder, capsys):
    said = told(capsys, "verify", "plan.fits")
    assert set(said) == {"ok", "certificate", "faults", "notes", "unknown"}
    assert set(said["certificate"]) == CERTIFICATE
    said = told(capsys, "verify", "plan.fits", "--margin", "5", code=1)
    assert said["ok"] is False
    contact = said["certificate"]["contacts"][0]
    assert set(contact) == {"pair", "time", "clearance"}
    assert all(label.startswith(("R", "obstacle")) for label in contact["pair"])


def test_diagnose(folder, capsys):
    said = told(capsys, "diagnose", "plan.fits", code=1)
    assert set(said) == DIAGNOSIS
    assert all(set(loss) == LOSS for loss in said["losses"])
    assert said["losses"][0]["outcome"] == "DROPPED"


def test_what_was_written(folder, capsys):
    assert told(capsys, "show", "plan.fits") == {"written": ["plan.html"]}
    said = told(capsys, "export", "plan.fits", "--to", "ecsv", "-o", "knots.ecsv")
    assert said == {"format": "ecsv", "written": ["knots.ecsv"]}


def test_planners(capsys):
    said = told(capsys, "planners")
    assert [row["name"] for row in said] == list(fp.planners.PLANNERS)
    assert all(set(row) == ROW and row["about"] for row in said)
    for name in fp.planners.PLANNERS:
        said = told(capsys, "planners", name)
        assert set(said) == ROW | {"settings"}
        assert all(set(setting) == SETTING for setting in said["settings"])
    steps = {setting["key"]: setting for setting in told(capsys, "planners", "greedy-fold")["settings"]}
    assert (steps["step"]["default"], steps["step"]["unit"], steps["step"]["type"]) == (0.1, "deg", "float")
    assert steps["relief"]["choices"] == ["joint", "reverse", "replace", "none"]


def test_planners_for_people(capsys):
    assert run(["planners"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in fp.planners.PLANNERS)
    assert "Makarem2014, section 3" in out
    assert run(["planners", "prioritized-roadmap"]) == 0
    out = capsys.readouterr().out
    assert "cells of the roadmap over the two joint ranges" in out
    assert " 8x6 " in out
    assert run(["planners", "dirct"]) == 2
    assert "did you mean 'direct'?" in capsys.readouterr().err


def test_instruments(capsys, folder):
    said = told(capsys, "instruments")
    assert {"name", "positioners", "about"} == set(said[0])
    assert "sdss" in {row["name"] for row in said}
    said = told(capsys, "instruments", "plane.fits")
    listed = {"name", "positioners", "online", "bodies", "facts", "ids", "base", "notes", "assumptions", "cautions"}
    assert set(said) == listed
    assert (said["positioners"], said["online"], len(said["ids"])) == (7, 7, 7)
    assert said["base"][said["ids"].index("R0C2")] == [0.0, 0.0]
    assert said["facts"]["alpha range"].endswith(" deg")


def test_reproduce_lists_papers(capsys):
    assert "sayres2021" in told(capsys, "reproduce")


@pytest.mark.large
def test_warmup(capsys):
    assert told(capsys, "warmup")["seconds"] > 0


@pytest.mark.slow
def test_demo(capsys, tmp_path):
    said = told(capsys, "demo", "-o", str(tmp_path))
    assert set(said) == PLAN | {"folded", "written"}


@pytest.mark.parametrize(
    "arguments",
    [
        ["plan", "plane.fits", "none.ecsv"],
        ["plan", "plane.fits", "field.ecsv", "--set", "trun=6"],
        ["verify", "none.fits"],
        ["diagnose", "none.fits"],
        ["show", "none.fits"],
        ["export", "none.fits", "--to", "ecsv", "-o", "knots.ecsv"],
        ["instruments", "none"],
        ["planners", "none"],
        ["reproduce", "none"],
        ["demo", "-o", "plan.fits"],
    ],
)
def test_an_error_is_no_json(folder, capsys, arguments):
    assert run([*arguments, "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1


def test_plain_values():
    given = {"a": (math.nan, np.inf, 1.5), 2: np.array([1, 2]), "o": fp.Outcome.ARRIVED, "n": np.float64("nan")}
    assert plain(given) == {"a": [None, None, 1.5], "2": [1, 2], "o": "ARRIVED", "n": None}
    assert plain([np.bool_(True), np.int64(3), None, "x"]) == [True, 3, None, "x"]


def stuck(count):
    """A plan in which so many of nineteen are stuck, of priorities 1 to `count`."""
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    goal = np.full((19, 2), np.nan)
    goal[:count] = plane.folded[:count] + np.array([0.3, -0.2])
    problem = fp.Problem(plane, plane.folded, goal, 0.1, np.arange(1.0, 20.0))
    outcomes = (fp.Outcome.DEADLOCKED,) * count + (fp.Outcome.NO_TARGET,) * (19 - count)
    return fp.Plan(problem, fp.Trajectory.at_rest(plane.folded), outcomes, "none", blockers={0: (1,)})


def test_many_losses_are_summed_up():
    plan = stuck(14)
    assert dict(headline(plan))["losses"] == "14: stuck or given up, without proof that it had to be"
    *listed, last = folded(lost_targets(plan), "losses", verbose=False)
    ids = [plan.problem.plane.ids[i] for i in range(13, -1, -1)]  # by priority, the highest first
    assert [line.split(":")[0] for line in listed] == [f"lost {id}" for id in ids[:LISTED]]
    assert last == f"and {14 - LISTED} more losses: --verbose tells them all, as does --json"
    assert [line.split(":")[0] for line in folded(lost_targets(plan), "losses", verbose=True)] == [
        f"lost {id}" for id in ids
    ]


def test_headline_is_one_line_a_fact(small_plan):
    facts = dict(headline(small_plan))
    assert list(facts) == ["arrived", "losses", "makespan", "closest pair", "reaction", "assumptions"]
    assert facts["arrived"] == "4 of 6"
    assert facts["losses"] == "2: 1 out of reach; 1 cannot move"
    assert facts["makespan"].startswith("1.0 s: 1.75 x the kinematic bound (0.6 s: ")
    assert facts["makespan"].endswith("; proven within 74.6 % of the optimum")
    (closest,) = closest_pairs(small_plan)
    assert facts["closest pair"].startswith(
        " and ".join(closest.names) + f": {np.floor(closest.clearance * 1e3) / 1e3}"
    )
    assert facts["closest pair"].endswith("mm, proven; margin 0.1 mm")
    assert facts["assumptions"] == "none"


def test_lists_are_folded_unless_all_is_wanted(folder, capsys, monkeypatch):
    """Five of nine notes, and these cut short; with --verbose all and whole."""
    said = [f"{k} " + "long " * 60 for k in range(9)]
    problem = fp.Problem(fp.FocalPlane.load("plane.fits"), *(2 * [fp.FocalPlane.load("plane.fits").folded]), 0.5)
    plan = fp.Plan(problem, fp.Trajectory.at_rest(problem.start), (fp.Outcome.ARRIVED,) * problem.n, "none")
    for verbose in (False, True):
        say_plan(plan, ["first"], [], said, [], verbose)
        out = capsys.readouterr().out.splitlines()
        notes = [line for line in out if line.startswith("note: ")]
        assert len(notes) == (9 if verbose else LISTED)
        assert all(line.endswith("...") != verbose for line in notes)
        assert out[0] == "first"
        assert out[-1] == "nothing written: -o FILE keeps the plan"
        assert out.index(notes[0]) > out.index(str(plan.certificate)) > out.index("arrived       7 of 7")
    assert "and 4 more notes: --verbose tells them all, as does --json" not in out


def test_causes_that_differ_in_numbers_only_are_one(folder, small_plane, capsys):
    x, y = small_plane.fibers(small_plane.folded + np.array([0.3, -0.2])).T
    x[:3] += 100.0, 200.0, 300.0
    QTable({"positioner": list(small_plane.ids), "x": x * units.mm, "y": y * units.mm}).write("far.ecsv")
    assert run(["plan", "plane.fits", "far.ecsv", "--conflicts", "drop"]) == 1
    out = capsys.readouterr().out.splitlines()
    assert [line for line in out if line.startswith("losses")] == ["losses        3: out of reach"]
    assert sum(line.startswith("lost R") for line in out) == 3


def test_few_losses_are_listed():
    plan = stuck(1)
    (line,) = lost_targets(plan)
    assert line.endswith(f"; in the way: {plan.problem.plane.ids[1]}")
    assert len(list(folded(lost_targets(stuck(LISTED)), "losses", verbose=False))) == LISTED


def test_what_a_proof_does_not_cover_is_said(folder, capsys, small_plane):
    bare = small_plane.replace(bodies=())
    assert list(cautions(small_plane, 0.8)) == []
    (zero,) = cautions(small_plane, 0.0)
    assert "the margin is 0 mm" in zero
    (nothing,) = cautions(bare, 0.8)
    assert "no bodies: nothing can touch" in nothing
    problem = fp.Problem(bare, bare.folded, bare.folded, 0.8)
    fp.Plan(problem, fp.Trajectory.at_rest(bare.folded), (fp.Outcome.ARRIVED,) * 7, "none").write("bare.fits")
    assert run(["verify", "bare.fits"]) == 0
    assert "note: hexagonal has no bodies: nothing can touch" in capsys.readouterr().out
