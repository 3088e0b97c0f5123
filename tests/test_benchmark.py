"""The benchmark's scenes are seeded, valid and decisive, and its table says what a plan is worth."""

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import label

import fiberplan as fp
import planners as table
import scenes
import settings
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.neighbours import Neighbourhood, clearances_around
from fiberplan.kernels.clearance import clearances
from fiberplan.plan import Plan
from fiberplan.scenes import decisive
from runs import reversals, run, summary
from scenes import SCENES, sdss, small

NOWHERE = Path("nowhere")
QUICK = [s for s in SCENES.values() if s.quick]


@pytest.fixture(autouse=True)
def _no_calibration(monkeypatch):
    monkeypatch.setattr(table, "calibrated", lambda loops: 1.0)


def straight(problem):
    """Everybody at constant speed from start to goal, as if alone."""
    goal = np.where(np.isnan(problem.goal), problem.start, problem.goal)
    time = 1.001 * float((np.abs(goal - problem.start) / problem.plane.max_speed).max())
    return fp.Trajectory.from_samples(np.array([0.0, time]), np.stack([problem.start, goal]))


@dataclass(frozen=True)
class Straight:
    """Goes straight to the goal, whoever is in the way."""

    name = "straight"

    def plan(self, problem):
        outcomes = (fp.Outcome.ARRIVED,) * problem.n
        return Plan(problem, straight(problem), outcomes, self.name)


@dataclass(frozen=True)
class Broken:
    """Raises what a bug raises, or what a planner says of a problem that is not for it."""

    error: type[Exception] = IndexError

    def plan(self, problem):
        raise self.error("of no use\nin two lines")


# scenes


def test_names_are_unique_and_told():
    assert len(SCENES) == sum(len(module.SCENES) for module in scenes.MODULES)
    assert all(scene.summary.endswith(".") for scene in SCENES.values())


@pytest.mark.parametrize("scene", QUICK, ids=lambda s: s.name)
def test_a_seed_is_a_problem(scene):
    one, again = (scene.make(0, NOWHERE) for _ in range(2))
    np.testing.assert_array_equal(one.start, again.start)
    np.testing.assert_array_equal(one.goal, again.goal)
    if not scene.finite:
        assert not np.array_equal(one.goal, scene.make(1, NOWHERE).goal, equal_nan=True)


@pytest.mark.parametrize("scene", small.SCENES, ids=lambda s: s.name)
def test_small_scenes_are_decisive(scene):
    problem = scene.make(0, NOWHERE)
    assert fp.verify(problem.plane, straight(problem), problem.margin).contacts


def test_pinwheel_has_no_first():
    """Whoever goes first ends in another's way: no order of one after the other does it."""
    problem = decisive.pinwheel()
    for i in range(3):
        first = problem.start.copy()
        first[i] = problem.goal[i]
        assert problem.plane.clearance(first).min() < 0


def test_aside_has_to_leave_its_target():
    """With the first arm at rest the second cannot get there, on a grid of 1 deg that ignores what is between."""
    problem = decisive.aside()
    np.testing.assert_array_equal(problem.start[0], problem.goal[0])
    poses = np.radians(np.stack(np.mgrid[0:361, 0:181], axis=-1).reshape(-1, 2).astype(float))
    near = Neighbourhood.of(problem.plane, 0.0)
    gaps = clearances_around(problem.plane.arms, near, problem.start, 1, poses).reshape(361, 181)
    regions, _ = label(gaps >= 0, structure=np.ones((3, 3)))
    ends = [tuple(np.rint(np.degrees(q)).astype(int)) for q in (problem.start[1], problem.goal[1])]
    assert regions[ends[0]] > 0
    assert regions[ends[1]] > 0
    assert regions[ends[0]] != regions[ends[1]]


@pytest.mark.parametrize(
    ("name", "fields", "margin"), [("1.5", 20, 0.0), ("2.0", 20, 1.0), ("2.5", 50, 2.0), ("3.0", 50, 3.0)]
)
def test_fields_of_547(name, fields, margin):
    scene = SCENES[f"547-{name}"]
    problem, following = scene.make(0, NOWHERE), scene.make(1, NOWHERE)
    assert (scene.fields, problem.margin, problem.n) == (fields, margin, 547)
    assert problem.has_goal.all()
    everything = [problem.start, problem.goal, following.start, following.goal]
    assert len({q.tobytes() for q in everything}) == 4
    assert all(problem.plane.clearance(q).min() >= margin for q in everything)


def test_from_folded():
    problem = SCENES["547-from-folded"].make(3, NOWHERE)
    np.testing.assert_array_equal(problem.start, problem.plane.folded)
    assert problem.margin == 1.0


def test_arms_like_desi():
    problem = SCENES["desi-like-4921"].make(0, NOWHERE)
    plane = problem.plane
    assert plane.n == 4921
    assert np.linalg.norm(plane.base[1] - plane.base[0]) == pytest.approx(10.4)
    np.testing.assert_array_equal(plane.length, 3.0)
    np.testing.assert_array_equal(plane.fiber, np.tile([3.0, 0.0], (4921, 1)))
    assert [body.radius for body in plane.bodies] == [1.0]
    assert {f"desi-like-{n}" for n in (4921, 19441, 99919)} <= set(SCENES)


def test_real_design_with_offline_arms(shared_data):
    folded = SCENES["sdss-offline-folded"].make(0, shared_data)
    assert folded.n == 500
    off = ~folded.plane.online
    assert off.sum() == 10
    np.testing.assert_array_equal(folded.start[off], folded.plane.folded[off])
    extended = [SCENES["sdss-offline-extended"].make(seed, shared_data) for seed in (0, 1)]
    for problem in extended:
        stuck = ~problem.plane.online
        assert stuck.sum() == 10
        assert np.all(problem.start[stuck, 1] <= np.radians(90.0))
    assert not np.array_equal(extended[0].plane.online, extended[1].plane.online)
    for problem in (folded, *extended):
        for gone in problem.dropped.values():
            assert any(j >= 0 and not problem.plane.online[j] for j in gone.blockers)


def test_the_margin_of_the_design_is_kept(shared_data):
    """Nothing of the design itself touches at its margin."""
    goal = sdss.design(shared_data).solve(sdss.array(shared_data)).goal
    plane = sdss.array(shared_data)
    pairs = plane.arm_pairs_within(sdss.MARGIN)
    gaps = clearances(plane.arms, plane.with_obstacles(goal), pairs)
    assert np.nanmin(gaps) > sdss.MARGIN


def test_cases_of_moons(shared_data):
    problem = SCENES["moons-250"].make(1, shared_data)
    np.testing.assert_array_equal(problem.start, problem.plane.folded)
    given = np.loadtxt(shared_data / "moons/250/targets_2.txt")
    assert problem.n == len(given)
    assert problem.has_goal.sum() + len(problem.dropped) == (given[:, 2] < 1e5).sum()


# one run


def test_a_run_says_what_the_plan_says():
    problem = decisive.exchange()
    planner = fp.planners.GreedyFold(**settings.settings("greedy-fold", problem.plane))
    done, plan = run(7, problem, planner), planner.plan(problem)
    assert (done.seed, done.targets, done.arrived, done.faults) == (7, 2, 2, ())
    assert done.certified
    assert done.ratio == plan.makespan / plan.lower_bound
    assert done.knots == len(plan.trajectory.times) / 2
    assert done.clearance == plan.certificate.smallest
    assert done.cpu > 0


def test_an_unsafe_plan_is_not_certified():
    done = run(0, decisive.exchange(), Straight())
    assert not done.certified
    assert "contacts" in done.faults[0]
    assert summary([done])["certified"] == "1 not"


def test_a_crash_is_not_a_refusal():
    problem = decisive.exchange()
    crashed, refused = run(0, problem, Broken()), run(1, problem, Broken(ProblemError))
    assert crashed.crashed.startswith("IndexError: of no use (test_benchmark.py, line ")
    assert refused.refused.startswith("of no use")
    row = summary([crashed, refused])
    assert row["certified"] == "1 crashed, 1 refused"
    assert row["CPU [s]"] is None


def test_losses_are_counted_apart():
    """Two goals of three that touch: one is dropped, and it is neither planner's nor proof's."""
    plane = decisive.few(np.array([[0.0, 0.0], [22.4, 0.0], [80.0, 0.0]]))
    goal = np.radians([[0.0, 0.0], [180.0, 0.0], [0.0, 90.0]])
    problem = fp.Problem(plane, plane.folded, goal, priority=np.array([1.0, 2.0, 1.0]), conflicts="drop")
    done = run(0, problem, fp.planners.GreedyFold(step=0.02))
    assert (done.targets, done.arrived, done.dropped, done.infeasible, done.deadlocked) == (3, 2, 1, 0, 0)
    assert done.lost == {"P0": "DROPPED, blocked by P1"}


def test_arms_that_cannot_move_do_not_count_for_clearance():
    plane = decisive.few(np.array([[0.0, 0.0], [22.4, 0.0], [44.8, 0.0]]))
    plane = plane.replace(online=np.array([False, False, True]))
    start = np.radians([[0.0, 0.0], [180.0, 0.0], [0.0, 180.0]])  # the first two lie across each other
    done = run(0, fp.Problem(plane, start, start), fp.planners.GreedyFold(step=0.02))
    assert done.certified
    assert done.clearance > 0


def test_worst_and_median():
    done = run(0, decisive.aside(), fp.planners.GreedyFold(step=0.02))
    runs = [replace(done, makespan=ratio * done.bound, cpu=ratio, need=done.bound) for ratio in (1.0, 5.0, 2.0)]
    runs[1] = replace(runs[1], need=2.5 * done.bound, hub=True)
    row = summary(runs)
    assert (row["over need"], row["worst need"], row["hub"]) == pytest.approx((2.0, 2.0, 1))
    assert (row["over bound"], row["worst"]) == pytest.approx((2.0, 5.0))
    assert (row["CPU [s]"], row["worst CPU"], row["fields"]) == (2.0, 5.0, 3)


def test_reversals():
    alpha = np.array([0.0, 1.0, 0.5, 0.5, 0.2, 0.9])  # forth, back, rest, back, forth
    angles = np.stack([np.stack([alpha, np.zeros(6)], axis=1), np.zeros((6, 2))], axis=1)
    assert reversals(fp.Trajectory.from_samples(np.arange(6.0), angles)) == 2 / 4


# the table


def test_table(capsys, tmp_path):
    file = tmp_path / "table.json"
    asked = ["--quick", "--scene", "exchange", "--scene", "off*", "--planner", "greedy-fold", "--json", str(file)]
    assert table.main([*asked, "--data", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = [line.split() for line in lines if "greedy-fold" in line]
    assert [row[:3] for row in rows] == [["exchange", "greedy-fold", "1"], ["offline-across", "greedy-fold", "2"]]
    assert all(row[-1] == "yes" for row in rows)
    report = json.loads(file.read_text())
    assert [len(row["runs"]) for row in report["rows"]] == [1, 2]
    assert report["rows"][0]["summary"]["arrived"] == 2


def test_every_planner_gets_a_row(capsys, tmp_path, monkeypatch):
    """A planner that joins is in the table at once; an unsafe plan and a crash end it with 1, by scene and seed."""
    monkeypatch.setattr(table, "PLANNERS", {"broken": Broken, "straight": Straight})
    assert table.main(["--scene", "exchange", "--data", str(tmp_path)]) == 1
    out = capsys.readouterr().out
    assert "exchange, broken, seed 0: crashed: IndexError" in out
    assert "exchange, straight, seed 0: not certified: not safe: 1 contacts" in out


def test_scenes_too_large_for_a_planner(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(table, "PLANNERS", {"straight": Straight})
    monkeypatch.setitem(settings.LARGEST, "straight", 2)
    assert table.main(["--scene", "pinwheel", "--data", str(tmp_path)]) == 0
    assert "pinwheel, straight: skipped, 3 positioners" in capsys.readouterr().out


def test_no_real_data(capsys, tmp_path):
    asked = [word for scene in sdss.SCENES for word in ("--scene", scene.name)]
    assert table.main([*asked, "--planner", "greedy-fold", "--data", str(tmp_path)]) == 0
    skipped = [line for line in capsys.readouterr().out.splitlines() if "skipped" in line]
    assert len(skipped) == len(sdss.SCENES)
    assert all(str(tmp_path / sdss.DESIGN) in line for line in skipped)


def test_scenes_with_few_fields(capsys, tmp_path):
    assert table.main(["--scene", "aside", "--seed", "3", "--planner", "greedy-fold", "--data", str(tmp_path)]) == 0
    assert "aside: skipped, it has fields 0 to 0 only" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scene", "nothing"], "no scene 'nothing'"),
        (["--planner", "nobody"], "no planner 'nobody'"),
        (["--fields", "0"], "whole number of 1 or more, got '0'"),
        (["--seed", "-1"], "whole number of 0 or more, got '-1'"),
        (["--scene", "aside", "--json", "no/such/folder.json"], "no/such/folder.json: cannot be written"),
    ],
)
def test_bad_options(arguments, said, capsys):
    with pytest.raises(SystemExit) as left:
        table.main(arguments)
    assert left.value.code == 2
    assert said in capsys.readouterr().err


def test_the_document_names_what_there_is():
    """Its columns are those of a row, and its example of a planned field runs as it stands."""
    text = (Path(__file__).parents[1] / "docs/benchmark.md").read_text()
    described = re.findall(r"^\| ([a-zA-Z \[\],]+?) \|", text.split("## Reading")[1].split("##")[0], flags=re.MULTILINE)
    names = [name for cell in described[1:] for name in cell.split(", ")]
    assert names == list(summary([]))
    assert set(re.findall(r'SCENES\["([^"]+)"\]', text)) <= set(SCENES)
    assert set(re.findall(r"--scene ([^ \"]+)", text)) <= {"547-*", *SCENES}
