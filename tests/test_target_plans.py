import numpy as np
import pytest
from astropy.table import QTable

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.errors import InstrumentError, ProblemError, TargetError
from fiberplan.focal_plane.bodies import Body
from fiberplan.motion.moves import moves, start_stops
from fiberplan.problem import Targets
from fiberplan.problem.configuration_choice import clear_choice, clear_goals
from fiberplan.scenes.assigned import assignment_plan
from references import make_plane, motion_of


@pytest.fixture(scope="module")
def plane():
    return fp.FocalPlane.load("miradas")


@pytest.mark.parametrize("seed", range(5))
def test_plans_can_be_asked_for(seed, plane):
    """In the field, apart, reached by the arm's own angles, and nobody touches at the goals."""
    targets = assignment_plan(plane, seed, margin=1.0)
    points = np.stack([targets.x, targets.y], axis=1)
    assert len(targets) == 12
    assert np.all(np.hypot(*points.T) <= 125.0)
    apart = np.hypot(*(points[:, None] - points[None]).T)[np.triu_indices(12, 1)]
    assert apart.min() >= 25.0
    goal = targets.configuration(plane)
    np.testing.assert_allclose(plane.fibers(goal), points, atol=1e-6)
    fp.Problem(plane, plane.folded, goal, 1.0)  # refuses what touches or lies in a zone of avoidance
    again = assignment_plan(plane, seed, margin=1.0)
    np.testing.assert_array_equal(again.angles, targets.angles)


@pytest.mark.small
def test_fewer_targets_go_to_some_arms(plane):
    targets = assignment_plan(plane, 0, count=3, separation=80.0)
    assert len(set(targets.positioner)) == 3


@pytest.mark.small
@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"count": 13}, TargetError, "13 targets for 12 online arms: expected 1 to 12"),
        ({"separation": -1.0}, TargetError, "separation must be a length of 0 mm or more"),
        ({"separation": 200.0}, TargetError, "12 targets 200 mm apart do not fit into the field"),
    ],
)
def test_impossible_plans_are_refused(arguments, error, words, plane):
    with pytest.raises(error, match=words):
        assignment_plan(plane, 0, **arguments)
    with pytest.raises(InstrumentError, match="sayres2021: has no field radius"):
        assignment_plan(fp.FocalPlane.load("sayres2021"), 0)


def pointing_at_each_other():
    body = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 0.5)
    return make_plane([[0.0, 0.0], [15.0, 0.0]], (body,), length=0.0)


@pytest.mark.small
def test_choice_takes_the_first_that_keeps_apart():
    plane = pointing_at_each_other()
    towards, away = np.array([0.0, 0.0]), np.array([np.pi, 0.0])
    who = np.arange(2)
    choice, _ = clear_choice(plane, who, [np.stack([towards, away]), np.stack([away, towards])], 0.1)
    np.testing.assert_array_equal(choice, [towards, towards])  # of arm 1, `towards` points away from arm 0
    assert clear_choice(plane, who, [towards[None], away[None]], 0.1) == (None, (0, 1))
    goal = np.stack([towards, away])
    kept, pair = clear_goals(plane, goal, np.full((2, 1, 2), np.nan), 0.1)
    assert pair == (0, 1)
    np.testing.assert_array_equal(kept, goal)
    turned, pair = clear_goals(plane, goal, np.array([[[np.nan] * 2], [[0.0, 0.0]]]), 0.1)
    assert pair == ()
    np.testing.assert_array_equal(turned, [towards, [0.0, 0.0]])


@pytest.mark.small
def test_pairs_without_any_clear_goal_are_named(plane):
    """Two probes on targets 3 mm apart touch whatever the configurations."""
    targets = Targets([60.0, 60.0], [16.0, 19.0], ("A1", "A2"), source="field.ecsv")
    with pytest.raises(ProblemError, match=r"goal: positioners 'A1' and 'A2' touch in all configurations") as caught:
        fp.Problem.from_targets(plane, targets, margin=1.0)
    assert caught.value.positioners == (0, 1)
    dropped = fp.Problem.from_targets(plane, targets, margin=1.0, conflicts="drop")
    assert len(dropped.dropped) == 1


@pytest.mark.small
def test_moves_and_start_stops_of_a_motion_by_hand():
    """Go, wait, go on, turn back, on with the other joint, faster: five moves, so four start-stops."""
    motion = motion_of(
        [
            (0.0, 0.0, 0.0),
            (1.0, 0.0, 0.0),
            (2.0, 0.1, 0.0),
            (3.0, 0.2, 0.0),
            (4.0, 0.2, 0.0),
            (5.0, 0.3, 0.0),
            (6.0, 0.2, 0.0),
            (7.0, 0.2, 0.5),
            (8.0, 0.2, 1.1),
        ],
        [(0.0, 0.0, 0.0)],
    )
    listed = moves(motion)
    assert [(m.segment, m.start, m.duration) for m in listed] == [
        (1, 1.0, 2.0),
        (2, 4.0, 1.0),
        (3, 5.0, 1.0),
        (4, 6.0, 1.0),
        (5, 7.0, 1.0),
    ]
    assert listed[2].speed == pytest.approx((-0.1, 0.0))
    np.testing.assert_array_equal(start_stops(motion), [4, 0])


def test_command_line_from_targets_to_motions(plane, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    targets = assignment_plan(plane, 7, margin=1.0)
    QTable({"positioner": list(targets.positioner), "x": targets.x, "y": targets.y}).write("field.ecsv")
    options = [
        "--planner",
        "prioritized-roadmap",
        "--margin",
        "1",
        "--set",
        "garages=true",
        "--set",
        "grid=8x6",
        "-o",
        "plan.fits",
    ]
    assert run(["plan", "miradas", "field.ecsv", *options]) == 0
    assert run(["verify", "plan.fits"]) == 0
    assert run(["export", "plan.fits", "--to", "motions", "-o", "motions.ecsv"]) == 0
    table, plan = QTable.read("motions.ecsv"), fp.Plan.read("plan.fits")
    assert table.colnames == ["positioner", "segment", "start", "duration", "alpha_speed", "beta_speed", "stops"]
    assert max(table["stops"]) <= 1
    assert set(table["positioner"]) == set(plane.ids)
    assert max(table["start"] + table["duration"]).to_value("s") == pytest.approx(plan.makespan)
    turned = np.zeros((12, 2))
    for row in table:
        speeds = [row[f"{joint}_speed"].to_value("rad/s") for joint in ("alpha", "beta")]
        turned[plane.index[row["positioner"]]] += row["duration"].to_value("s") * np.array(speeds)
    np.testing.assert_allclose(plan.problem.start + turned, plan.trajectory.end, atol=1e-9)
    capsys.readouterr()
    assert run(["plan", "miradas", "field.ecsv", "--planner", "greedy-fold"]) == 2
    assert "planner greedy-fold cannot plan the four-bar arms of miradas" in capsys.readouterr().err
    slow = ["--set", "dt=300", "--set", "max_time=999"]
    assert run(["plan", "miradas", "field.ecsv", "--planner", "prioritized-roadmap", *slow]) == 2
    assert "is longer than the longest edge takes" in capsys.readouterr().err
