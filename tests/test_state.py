"""States: where everyone stands, who can move, and how well that is known."""

import numpy as np
import pytest
from astropy import units as u

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.errors import ProblemError
from fiberplan.problem import State
from fiberplan.scenes.uniform import uniform_field
from problems import hexagon


@pytest.mark.small
def test_defaults():
    plane = hexagon(1)
    state = State.folded(plane)
    assert state.online.all()
    assert not state.unknown.any()
    assert not state.position_error.any()
    assert np.array_equal(state.angles, plane.folded)
    assert repr(state) == "<State of 7 positioners, 7 online, 0 unknown>"


@pytest.mark.small
@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"angles": np.zeros((3, 3))}, "shape"),
        ({"angles": [[0.0, np.nan]]}, "finite"),
        ({"online": [True]}, "online"),
        ({"unknown": [True, False]}, "unknown"),
        ({"online": ["no"] * 7}, "online cannot be taken as numbers \\(true, false, 1 or 0 is wanted\\)"),
        ({"online": [1.0] * 6 + [np.nan]}, "true, false, 1 or 0 is wanted"),
        ({"online": [True] * 6 + [None]}, "true, false, 1 or 0 is wanted"),
        ({"angles": hexagon(1).folded + 1j}, "complex"),
        ({"position_error": [0.0] * 6}, "position_error"),
        ({"position_error": [0, 0, 0, -0.1, 0, 0, 0]}, "-0.1 mm"),
        ({"position_error": [0, 0, 0, np.nan, 0, 0, 0]}, "nan mm"),
    ],
)
def test_refused(changes, match):
    with pytest.raises(ProblemError, match=match):
        State(**({"angles": hexagon(1).folded} | changes))


@pytest.mark.small
def test_state_of_another_array():
    with pytest.raises(ProblemError, match="7 positioners for 19"):
        fp.Problem(hexagon(2), State.folded(hexagon(1)), np.full((19, 2), np.nan))


def test_who_cannot_move_stays():
    plane = hexagon(2)
    state = State.folded(plane).without(plane, [3], "motor")
    assert state.notes == (f"offline, motor: {plane.ids[3]}",)
    problem = fp.Problem(plane, state, uniform_field(plane, 1, 0.2), 0.2, conflicts="drop")
    assert not problem.plane.online[3]
    assert not problem.has_goal[3]
    plan = fp.planners.Direct().plan(problem)
    assert plan.certificate.ok
    assert plan.outcomes[3] is fp.Outcome.OFFLINE
    assert np.array_equal(plan.end.angles[3], plane.folded[3])
    assert state.notes[0] in plan.notes


def test_no_range_binds_who_cannot_move(tmp_path):
    """An arm that is out of order, recorded 1 deg beyond its range, stands there; one that moves may not begin so."""
    plane = hexagon(1)
    beyond = plane.folded.copy()
    beyond[3, 1] = plane.upper[3, 1] + np.radians(1.0)
    free = np.full((plane.n, 2), np.nan)
    with pytest.raises(ProblemError, match="beta 181 deg is outside"):
        fp.Problem(plane, State(beyond), free, near_start="open")
    problem = fp.Problem(plane, State(beyond).without(plane, [3], "motor"), uniform_field(plane, 1, 0.2), 0.2)
    assert not problem.needs_opening
    plan = fp.planners.GreedyFold().plan(problem)
    assert plan.certificate.ok
    plan.write(tmp_path / "p.fits")
    assert fp.Plan.read(tmp_path / "p.fits").certificate.ok
    assert run(["replay", str(tmp_path / "p.fits")]) == 0


def test_who_was_offline_stays_offline():
    plane = hexagon(1)
    online = np.ones(plane.n, bool)
    online[2] = False
    plane = plane.replace(online=online)
    everyone_online = State(plane.folded, np.ones(plane.n, bool))
    assert not fp.Problem(plane, everyone_online, np.full((plane.n, 2), np.nan)).plane.online[2]


def test_position_error_makes_room():
    """An arm that may be 0.3 mm off: its neighbours keep so much more from where it is said to be."""
    plane = hexagon(2)
    error = np.zeros(plane.n)
    error[5] = 0.3
    state = State(plane.folded, position_error=error)
    problem = fp.Problem(plane, state, uniform_field(plane, 4, 0.5), 0.2, conflicts="drop")
    plan = fp.planners.Direct().plan(problem)
    assert plan.certificate.ok
    assert plan.certificate.position_error == pytest.approx(0.3, abs=1e-6)
    plain = fp.verify(problem.plane, plan.trajectory, 0.2)
    of_it = (plain.pairs == 5).any(axis=1)
    assert plain.clearance[of_it].min() >= 0.5 - 1e-6


def test_unknown_ones_are_guessed_clear_of_all_others_and_said():
    """Nobody knows where two arms are: where they would touch a known one they cannot be."""
    plane = hexagon(1)
    start = uniform_field(plane, 2, 0.5)
    unknown = np.zeros(plane.n, bool)
    unknown[[0, 1]] = True
    angles = start.copy()
    middle = int(np.argmin(np.linalg.norm(plane.base, axis=1)))
    angles[0] = np.nan_to_num(start[0])
    state = State(angles, online=~unknown, unknown=unknown)
    problem = fp.Problem(plane, state, np.full((plane.n, 2), np.nan), 0.2)
    assert middle not in (0, 1)
    assert problem.assumptions
    assert any(plane.ids[0] in said for said in problem.assumptions)
    plan = fp.planners.Direct().plan(problem)
    assert plan.certificate.ok
    assert set(problem.assumptions) <= set(plan.certificate.assumptions)


@pytest.fixture(scope="module")
def plan():
    plane = hexagon(2)
    problem = fp.Problem(plane, plane.folded, uniform_field(plane, 8, 0.3), 0.3)
    return fp.planners.Direct().plan(problem)


class TestStateOfAPlan:
    def test_end(self, plan):
        assert np.array_equal(plan.end.angles, plan.trajectory.end)

    @pytest.mark.parametrize("part", [0.0, 0.2, 0.5, 0.77, 1.0])
    def test_planned_on_from_where_it_was_stopped(self, plan, part):
        """A stop at any moment: the rest is planned from there, and the arms' places agree with the motion."""
        plane, t = plan.problem.plane, part * plan.makespan
        state = plan.state_at(t)
        assert np.allclose(state.angles, plan.trajectory.sampled([t])[:, 0], atol=1e-12)
        onward = fp.planners.Direct().plan(fp.Problem(plane, state, plan.problem.goal, 0.3, near_start="open"))
        assert onward.certificate.ok
        assert len(onward.having(fp.Outcome.ARRIVED)) == plane.n

    def test_times_outside_the_motion(self, plan):
        assert np.array_equal(plan.state_at(0.0).angles, plan.problem.start)
        half = 0.5 * plan.makespan
        for state in (plan.state_at(half * 1e3 * u.ms), State.read(plan, plan.problem.plane, at=half * 1e3 * u.ms)):
            np.testing.assert_allclose(state.angles, plan.state_at(half).angles, rtol=0, atol=1e-9)
        with pytest.raises(ProblemError, match="the moment of a state must be one number \\[s\\], got '2'"):
            State.read(plan, plan.problem.plane, at="2")
        assert np.array_equal(plan.state_at(plan.makespan + 100.0).angles, plan.trajectory.end)
