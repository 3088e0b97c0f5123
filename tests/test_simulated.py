"""A simulated controller: each fault does what it says, and nobody touches where the proof with allowances says so."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates import verify
from fiberplan.certificates.touching import Touching
from fiberplan.errors import TrajectoryError
from fiberplan.hardware.simulated import Faults, proof_within, simulated, state_after
from fiberplan.motion import Executed
from fiberplan.planners import GreedyFold
from fiberplan.scenes.uniform import uniform_field
from references import motion_of

pytestmark = pytest.mark.small

TWO = motion_of([(0.0, 0.0, 0.0), (2.0, 1.0, 0.0)], [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (3.0, 0.0, 1.0)])


def test_without_faults_the_motion_is_what_was_told():
    made = simulated(TWO, Faults())
    np.testing.assert_array_equal(made.times, TWO.times)
    np.testing.assert_array_equal(made.angles, TWO.angles)


def test_robots_start_late_by_clocks_of_their_own():
    faults = Faults(latency=0.5, drift=0.01)
    ends = np.array([simulated(TWO, faults, seed).times[[2, -1]] for seed in range(200)])
    late = ends - [2.0, 3.0]
    assert late.min() > -0.03
    assert late.max() <= faults.jitter(3.0)
    assert late.max() > 0.45
    np.testing.assert_array_equal(simulated(TWO, faults, 7).times, simulated(TWO, faults, 7).times)


def test_joints_are_off_and_stop_at_whole_steps():
    made = simulated(TWO, Faults(tracking=0.02, step=0.03), 1)
    off = made.end - TWO.end
    assert 0 < np.abs(off).max() <= 0.02 + 0.015
    np.testing.assert_allclose(made.angles / 0.03, np.rint(made.angles / 0.03), atol=1e-9)
    assert made.at(1.0)[1, 1] == 0.0  # who rests does not tremble


def test_stalls_absences_and_aborts_stop_robots():
    made = simulated(TWO, Faults(stalls={0: 1.0}, absent=(1,)))
    np.testing.assert_allclose(made.end, [[0.5, 0.0], [0.0, 0.0]])
    made = simulated(TWO, Faults(abort=2.0))
    np.testing.assert_allclose(made.end, [[1.0, 0.0], [0.0, 0.5]])
    assert made.duration == 2.0


@pytest.mark.large
def test_the_next_plan_starts_from_what_is_left():
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    start, goal = uniform_field(plane, 0), uniform_field(plane, 1)
    plan = GreedyFold().plan(fp.Problem(plane, start, goal))
    faults = Faults(stalls={3: 0.4 * plan.makespan})
    state = state_after(plane, simulated(plan.trajectory, faults), faults)
    assert state.online.tolist() == [True] * 3 + [False] + [True] * 3
    assert "R0C0" in state.notes[0] or plane.ids[3] in state.notes[0]
    after = GreedyFold().plan(fp.Problem(plane, state, goal, conflicts="drop", near_start="open"))
    assert after.faults() == []
    assert after.outcomes[3] is fp.Outcome.OFFLINE


@pytest.mark.large
def test_no_contact_where_the_proof_allows_for_the_faults():
    """A thousand runs of motions that are proven with these clocks and errors, and the same runs with twice both."""
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    start, goal = uniform_field(plane, 4, 1.0), uniform_field(plane, 5, 1.0)
    plan = GreedyFold().plan(fp.Problem(plane, start, goal, 1.0))
    faults = Faults(latency=0.005, drift=1e-4, tracking=0.005, step=0.002)
    assert proof_within(plane, Executed.exactly(plan.trajectory), faults).contacts == ()
    touching = Touching(plane)
    for seed in range(1000):
        assert touching.contacts(simulated(plan.trajectory, faults, seed)) == ()
    near = verify(plane, plan.trajectory).smallest
    worse = Faults(latency=2.0, drift=0.2)
    touched = [verify(plane, simulated(plan.trajectory, worse, seed), near).contacts for seed in range(20)]
    assert any(touched)
    contact = next(found[0] for found in touched if found)
    assert contact.time > 0


@pytest.mark.parametrize(
    ("faults", "complaint"),
    [
        ({"latency": -1.0}, "latency -1 makes no sense"),
        ({"drift": 1.0}, "drift 1 makes no sense"),
        ({"tracking": np.nan}, "tracking nan makes no sense"),
        ({"any_stall": -1}, "fewer than no robots"),
        ({"abort": -1.0}, "at 0 s or later"),
        ({"stalls": {0: -2.0}}, "at 0 s or later"),
    ],
)
def test_senseless_faults_are_refused(faults, complaint):
    with pytest.raises(TrajectoryError, match=complaint):
        Faults(**faults)


def test_who_stalls_is_drawn_of_those_that_turn():
    """Of three, the last rests; seeds choose who and when, and what is asked beyond who is there is left out."""
    three = motion_of([(0.0, 0.0, 0.0), (2.0, 1.0, 0.0)], [(0.0, 0.0, 0.0), (3.0, 0.0, 1.0)], [(0.0, 0.0, 0.0)])
    drawn = [Faults(any_stall=1).drawn(three, seed) for seed in range(30)]
    assert {i for each in drawn for i in each.stalls} == {0, 1}
    assert len({when for each in drawn for when in each.stalls.values()}) == 30
    both = Faults(stalls={1: 1.0}, any_absent=2).drawn(three, 0)
    assert (dict(both.stalls), both.absent) == ({1: 1.0}, (0,))
    assert simulated(three, Faults(any_absent=2)).duration == 0.0


def test_faults_of_robots_that_are_not_there_are_refused():
    with pytest.raises(TrajectoryError, match="there is no positioner 2 among 2"):
        simulated(TWO, Faults(absent=(2,)))
