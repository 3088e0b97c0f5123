"""Why a plan is as it is: in the library and on the command line; the page's part is in test_page."""

import dataclasses
import json

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.errors import PlanError
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.io.plan_tables import _bound
from fiberplan.plan import Bound, Outcome, Plan
from fiberplan.plan.bounds import proven_bounds
from fiberplan.plan.diagnosis import diagnose, reversals
from fiberplan.problem import Dropped
from references import motion_of

pytestmark = pytest.mark.small

IDS = ("R-1C1", "R-1C2", "R0C1", "R0C2", "R0C3", "R+1C1", "R+1C2")
LOST, GIVEN_UP, PROVEN, OFFLINE, UNREACHED = 0, 1, 2, 3, 4


def a_plan(**changes):
    """Seven positioners, lost in every way that there is but for the last two, of which one turns back twice."""
    plane = fp.FocalPlane.hexagonal(1, 40.0).replace(obstacles=(Obstacle("F1", [[0.0, 60.0]], 1.0),))
    online = np.ones(7, bool)
    online[OFFLINE] = False
    plane = plane.replace(online=online)
    start = plane.folded
    goal = start + np.radians([[30.0, -30.0]])
    goal[UNREACHED] = np.nan
    dropped = {LOST: Dropped("its goal touches a camera", (-1,)), UNREACHED: Dropped("out of reach: too far")}
    problem = fp.Problem(
        plane, start, goal, priority=np.array([1, 5.5, 2, 3, 1, 1, 1.0]), conflicts="drop", dropped=dropped
    )
    a, b = goal[5]
    motion = motion_of(
        [(0.0, *start[0])],
        [(0.0, *start[1]), (2.0, 0.3, np.pi)],
        [(0.0, *start[2])],
        [(0.0, *start[3])],
        [(0.0, *start[4])],
        [(0.0, *start[5]), (1.0, 0.4, np.pi), (2.0, 0.2, np.pi), (3.0, 0.2, np.pi), (5.0, a, b), (9.0, a, b)],
        [(0.0, *start[6]), (3.5, *goal[6])],
    )
    outcomes = [Outcome.ARRIVED] * 7
    outcomes[LOST] = outcomes[UNREACHED] = Outcome.DROPPED
    outcomes[GIVEN_UP], outcomes[PROVEN], outcomes[OFFLINE] = Outcome.DEADLOCKED, Outcome.INFEASIBLE, Outcome.OFFLINE
    blockers = {GIVEN_UP: (6, -1), PROVEN: (3,)}
    notes, bounds = ("a note",), (Bound("pair", 12.0, (1, 2)), Bound("obstacle", 7.25, (3,)))
    return Plan(problem, motion, tuple(outcomes), "none", blockers=blockers, notes=notes, bounds=bounds, **changes)


@pytest.fixture
def plan():
    return a_plan()


def served():
    """Everybody arrives."""
    plane = fp.FocalPlane.hexagonal(1, 40.0)
    goal = plane.folded + np.radians([[30.0, -30.0]])
    motion = fp.Trajectory.from_samples([0.0, 2.0], np.stack([plane.folded, goal]))
    return Plan(fp.Problem(plane, plane.folded, goal), motion, (Outcome.ARRIVED,) * 7, "none")


def test_every_loss_has_a_cause_and_who_is_in_the_way(plan):
    found = {loss.positioner: loss for loss in diagnose(plan).losses}
    assert sorted(found) == [LOST, GIVEN_UP, PROVEN, OFFLINE, UNREACHED]
    assert [loss.id for loss in found.values()] == [IDS[i] for i in found]
    assert [loss.outcome for loss in found.values()] == [plan.outcomes[i] for i in found]
    assert found[LOST].cause == "its goal touches a camera"
    assert found[LOST].blockers == (-1,)
    assert found[LOST].names == ("obstacle F1",)
    assert (
        found[GIVEN_UP].cause == "stuck or given up, without proof that it had to be; it ends elsewhere, out of the way"
    )
    assert found[GIVEN_UP].names == ("R+1C2", "obstacle F1")
    assert found[GIVEN_UP].priority == 5.5
    assert found[PROVEN].cause == "proven unable to reach its goal"
    assert found[PROVEN].names == (IDS[OFFLINE],)
    assert found[OFFLINE].cause == "cannot move"
    assert found[OFFLINE].names == ()


def test_distance_left_is_that_of_the_fiber(plan):
    plane, problem = plan.problem.plane, plan.problem
    found = {loss.positioner: loss.distance for loss in diagnose(plan).losses}
    for i in (LOST, GIVEN_UP, PROVEN, OFFLINE):
        end, target = plane.fibers(plan.trajectory.at(99.0))[i], plane.fibers(problem.requested)[i]
        assert found[i] == pytest.approx(np.hypot(*(end - target)))
        assert found[i] > 1.0
    assert np.isnan(found[UNREACHED])


def test_one_that_stays_is_said_to(plan):
    outcomes = list(plan.outcomes)
    outcomes[PROVEN] = Outcome.DEADLOCKED
    stuck = Plan(plan.problem, plan.trajectory, tuple(outcomes), "none")
    (loss,) = [loss for loss in diagnose(stuck).losses if loss.positioner == PROVEN]
    assert loss.cause.endswith("it ends where it starts")


def test_a_goal_dropped_while_planning_has_a_cause(plan):
    outcomes = list(plan.outcomes)
    outcomes[PROVEN] = Outcome.DROPPED
    (loss,) = [
        x for x in diagnose(Plan(plan.problem, plan.trajectory, tuple(outcomes), "none")).losses if x.id == "R0C1"
    ]
    assert loss.cause == "its goal touched one that had to stay at its start"


def test_blockers_that_are_not_there_go_by_number(plan):
    blockers = {GIVEN_UP: (7, -2)}
    odd = Plan(plan.problem, plan.trajectory, plan.outcomes, "none", blockers=blockers)
    assert diagnose(odd).losses[1].names == ("positioner 7", "obstacle 1")


def test_an_offline_positioner_at_its_target_is_no_loss():
    plane = fp.FocalPlane.hexagonal(1, 40.0).replace(online=np.arange(7) > 0)
    problem = fp.Problem(plane, plane.folded, plane.folded)
    outcomes = (Outcome.OFFLINE, *(Outcome.ARRIVED,) * 6)
    assert diagnose(Plan(problem, fp.Trajectory.at_rest(plane.folded), outcomes, "none")).losses == ()


def test_what_set_the_makespan(plan):
    found = diagnose(plan)
    assert found.makespan == plan.makespan == 9.0
    assert [(slow.id, slow.stops) for slow in found.slowest] == [("R+1C1", 5.0), ("R+1C2", 3.5), ("R-1C2", 2.0)]
    assert found.slowest[0].needed == pytest.approx(1.0)  # 30 deg at 30 deg/s
    assert found.slowest[2].needed == pytest.approx(0.3 / np.radians(30.0))
    assert found.bound_by.id == "R+1C1"
    assert found.bound_by.needed == pytest.approx(found.lower_bound) == 1.0
    assert found.pair_bounds == (
        "pair bound: R-1C2 and R0C1 need 12.0 s even alone (an estimate on a lattice, no proof)",
        "obstacle bound: R0C2 needs 7.2 s past what never moves (an estimate on a lattice, no proof)",
    )


def test_what_is_proven_of_bounds(tmp_path, capsys):
    """Arms of which none is near another: of what a planner says of two, only what joints need is so."""
    plan = dataclasses.replace(served(), bounds=(Bound("pair", 1.9, (0, 1)), Bound("obstacle", 1.5, (2,), proven=True)))
    (bound,) = proven_bounds(plan)
    assert (bound.kind, bound.positioners, bound.proven) == ("pair", (0, 1), True)
    assert bound.seconds == pytest.approx(1.0)
    assert diagnose(plan).pair_bounds == tuple(each.said(plan.problem.plane) for each in plan.bounds)
    assert diagnose(plan, prove=True).pair_bounds[-1] == "pair bound: R-1C1 and R-1C2 need 1.0 s even alone (proven)"
    plan.write(tmp_path / "plan.fits")
    assert run(["diagnose", str(tmp_path / "plan.fits"), "--prove"]) == 0
    assert "pair bound: R-1C1 and R-1C2 need 1.0 s even alone (proven)" in capsys.readouterr().out


@pytest.mark.parametrize(
    "wrong", [("pair", 1.0, (7,)), ("pair", 1.0, (-1,)), ("pair", 1.0, ()), ("pair", -1.0, (0,)), ("moon", 1.0, (0,))]
)
def test_bounds_that_make_no_sense(wrong):
    with pytest.raises(PlanError, match="bound"):
        dataclasses.replace(served(), bounds=(Bound(*wrong),))


def test_bounds_are_kept_in_the_file(plan, tmp_path):
    plan.write(tmp_path / "plan.fits")
    assert Plan.read(tmp_path / "plan.fits").bounds == plan.bounds


def test_the_bound_is_that_of_the_quickest_configuration():
    base = served().problem
    goal = base.plane.folded + np.radians([[30.0, -30.0]])
    goal[2] = base.plane.folded[2] + np.radians([200.0, -30.0])
    others = np.full((7, 1, 2), np.nan)
    others[2, 0] = base.plane.folded[2] + np.radians([60.0, -30.0])
    problem = fp.Problem(base.plane, base.start, goal, alternatives=others)
    end = goal.copy()
    end[2] = others[2, 0]
    motion = fp.Trajectory.from_samples([0.0, 2.0], np.stack([base.start, end]))
    found = diagnose(Plan(problem, motion, (Outcome.ARRIVED,) * 7, "none"))
    assert found.bound_by.id == "R0C1"
    assert found.bound_by.needed == pytest.approx(found.lower_bound) == 2.0


def test_reversals():
    motion = motion_of(
        [(0, 0, 0), (1, 1, 1), (2, 1, 2), (3, 2, 1), (4, 2, 1), (5, 3, 2)],  # alpha rests, beta turns back twice
        [(0, 0, 0), (1, 1, -1), (2, 0, -2), (3, 1, -3)],
        [(0, 0, 0)],
        [(0, 5, 5), (1, 4, 4)],  # the step to it from another positioner's knots is none
        [(0, 0, 0), (1, 1, 0), (2, 1 - 1e-12, 0), (3, 2, 0)],  # rounding is no turn
    )
    np.testing.assert_array_equal(reversals(motion), [[0, 2], [2, 0], [0, 0], [0, 0], [0, 0]])


def test_reversals_are_over_those_that_move(plan):
    found = diagnose(plan)
    assert (found.alpha.median, found.alpha.most, found.alpha.positioner) == (0.0, 2, 5)
    assert (found.beta.median, found.beta.most, found.beta.positioner) == (0.0, 0, None)


def test_a_plan_without_motion_or_targets():
    plane = fp.FocalPlane.hexagonal(1, 40.0)
    problem = fp.Problem(plane, plane.folded, np.full((7, 2), np.nan))
    found = diagnose(Plan(problem, fp.Trajectory.at_rest(plane.folded), (Outcome.NO_TARGET,) * 7, "none"))
    assert found.losses == found.slowest == found.pair_bounds == ()
    assert found.bound_by is None
    assert found.alpha.most == 0


def test_command_names_losses_and_exits_1(plan, tmp_path, capsys):
    plan.write(tmp_path / "plan.fits")
    assert run(["diagnose", str(tmp_path / "plan.fits")]) == 1
    out = capsys.readouterr().out.splitlines()
    assert out[0] == str(plan)
    assert out[1].startswith("lost R-1C1: dropped, its goal touches a camera; priority 1; ")
    assert out[1].endswith(" mm from its target; in the way: obstacle F1")
    assert out[2].endswith("; in the way: R+1C2, obstacle F1")
    assert "priority 5.5" in out[2]
    assert out[4].startswith("lost R0C2: offline, cannot move; ")
    assert out[5] == "lost R0C3: dropped, out of reach: too far; priority 1"
    assert "slowest joints: R+1C1 needs 1.000 s, and stops at 5.000 s" in out
    assert (
        "last to stop: R+1C1 at 5.000 s (needs 1.000 s), R+1C2 at 3.500 s (needs 1.000 s), "
        "R-1C2 at 2.000 s (needs 0.573 s)"
    ) in out
    assert plan.bounds[0].said(plan.problem.plane) in out
    assert "reversals of alpha: median 0, at most 2 (R+1C1)" in out
    assert "reversals of beta: median 0, at most 0" in out


def test_command_speaks_json(plan, tmp_path, capsys):
    plan.write(tmp_path / "plan.fits")
    assert run(["diagnose", str(tmp_path / "plan.fits"), "--json"]) == 1
    out, err = capsys.readouterr()
    assert err == ""
    said = json.loads(out)
    assert [loss["id"] for loss in said["losses"]] == [IDS[i] for i in (0, 1, 2, 3, 4)]
    assert said["losses"][1]["blockers"] == [6, -1]
    assert said["losses"][1]["names"] == ["R+1C2", "obstacle F1"]
    assert said["losses"][1]["outcome"] == "DEADLOCKED"
    assert said["losses"][4]["distance"] is None
    assert said["makespan"] == 9.0
    assert said["alpha"] == {"median": 0.0, "most": 2, "positioner": 5}
    assert said["faults"] == []


def test_command_says_that_there_is_nothing_to_prove(tmp_path, capsys):
    served().write(tmp_path / "plan.fits")
    for asked in ([], ["--prove"]):
        assert run(["diagnose", str(tmp_path / "plan.fits"), *asked]) == 0
        assert ("there is nothing to prove" in capsys.readouterr().out) == bool(asked)


def test_command_exits_0_when_all_arrive(tmp_path, capsys):
    served().write(tmp_path / "plan.fits")
    assert run(["diagnose", str(tmp_path / "plan.fits")]) == 0
    out = capsys.readouterr().out
    assert "lost" not in out
    assert "slowest joints: R-1C1 needs 1.000 s, and stops at 2.000 s" in out


def test_command_exits_1_when_a_claim_is_wrong(tmp_path, capsys):
    plan = served()
    wrong = Plan(plan.problem, fp.Trajectory.at_rest(plan.problem.start), plan.outcomes, "none")
    wrong.write(tmp_path / "plan.fits")
    assert run(["diagnose", str(tmp_path / "plan.fits")]) == 1
    assert "positioner 'R-1C1' is said to arrive but ends" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("content", "words"), [(None, "no such file"), (b"SIMPLE nonsense", "")], ids=["missing", "not a plan"]
)
def test_bad_input_is_one_line_and_exits_2(tmp_path, capsys, content, words):
    path = tmp_path / "plan.fits"
    if content is not None:
        path.write_bytes(content)
    for options in ([], ["--json"]):
        assert run(["diagnose", str(path), *options]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        (line,) = err.splitlines()
        assert line.startswith(f"fiberplan: error: {path}")
        assert words in line.lower()


def test_bounds_of_earlier_files_are_read():
    """Kinds were causes once, and obstacles what is fixed."""
    earlier = {"positioners": [3], "seconds": 7.25, "cause": "fixed", "proven": False}
    assert _bound(earlier) == Bound("obstacle", 7.25, (3,))
    assert _bound(earlier | {"cause": "pair"}).kind == "pair"
