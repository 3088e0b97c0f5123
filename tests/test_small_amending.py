"""Plans of two arms amended: who may be amended, to what, and what is left where that fails; by hand, in no time."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan import Outcome
from fiberplan.errors import PlanError, ProblemError, TargetError
from fiberplan.planners.amending import amend, mended, mending, one_goal, targets
from fiberplan.planners.amending.rerouting import Rerouted
from fiberplan.planners.amending.targets import amend_to
from fiberplan.problem import Targets
from fiberplan.scenes.decisive import row

pytestmark = pytest.mark.small
START = np.radians([[150.0, 120.0], [30.0, 120.0]])
GOAL = START + np.radians([[40.0, -30.0], [-20.0, 30.0]])
ELSEWHERE = np.radians([20.0, 100.0])  #: for the second, and clear of the first


def straight(online=(True, True), goal=GOAL, start=START, outcomes=(Outcome.ARRIVED,) * 2):
    """A plan of both, each turning evenly for eight seconds."""
    problem = fp.Problem(row(2).replace(online=np.array(online)), start, goal)
    end = np.where(np.isnan(goal), start, goal)
    return fp.Plan(problem, fp.Trajectory.from_samples([0.0, 8.0], np.stack([start, end])), outcomes, "by hand")


@pytest.fixture
def never(monkeypatch):
    """No path is ever found."""
    monkeypatch.setattr(one_goal, "reroute", lambda *_: Rerouted(None, (), (0,)))


@pytest.mark.parametrize(
    ("positioner", "goal", "words"),
    [
        ("Q9", ELSEWHERE, "no positioner 'Q9'"),
        (7, ELSEWHERE, "no positioner 7; they are counted from 0 to 1"),
        (True, ELSEWHERE, "named by its index or id, not by True"),
        (1, [0.3], "a goal is two angles, alpha and beta, got"),
        (1, "here", "a goal is two angles, alpha and beta, got 'here'"),
    ],
)
def test_bad_requests_are_one_line(positioner, goal, words):
    with pytest.raises(ProblemError, match=words):
        amend(straight(), positioner, goal)


def test_bad_times_and_offline_arms_are_one_line():
    with pytest.raises(ProblemError, match=r"longer must be a part of the makespan, 0 to 10, got -0\.1"):
        amend(straight(), 1, ELSEWHERE, longer=-0.1)
    goal = GOAL.copy()
    goal[1] = np.nan
    stands = straight((True, False), goal, outcomes=(Outcome.ARRIVED, Outcome.OFFLINE))
    with pytest.raises(ProblemError, match="positioner 'P1' is offline and cannot be sent anywhere"):
        amend(stands, 1, ELSEWHERE)


def test_without_a_target_and_to_the_same_one_it_moves_as_before():
    before = straight()
    for goal, outcome, words in (
        ([np.nan] * 2, Outcome.NO_TARGET, "no target any more"),
        (GOAL[1], Outcome.ARRIVED, "on its way to this goal already"),
    ):
        after = amend(before, 1, goal)
        assert after.outcomes == (Outcome.ARRIVED, outcome)
        assert words in after.notes[-1]
        np.testing.assert_array_equal(after.trajectory.angles, before.trajectory.angles)


@pytest.mark.usefixtures("never")
def test_without_a_path_it_moves_as_before_and_the_blocker_is_named():
    before = straight()
    after = amend(before, "P1", ELSEWHERE)
    assert after.outcomes == (Outcome.ARRIVED, Outcome.DEADLOCKED)
    assert after.blockers == {1: (0,)}
    np.testing.assert_array_equal(after.trajectory.angles, before.trajectory.angles)


def test_what_cannot_be_proven_is_not_taken(monkeypatch):
    """A path through the other arm is found on the patch."""
    through = np.stack([START, np.radians([[0.0, 0.0], [180.0, 0.0]]), np.stack([GOAL[0], ELSEWHERE])])
    unsafe = fp.Trajectory.from_samples([0.0, 6.0, 12.0], through)
    monkeypatch.setattr(one_goal, "reroute", lambda *_: Rerouted(unsafe, (0, 1), ()))
    before = straight()
    after = amend(before, 1, ELSEWHERE)
    assert after.outcomes == (Outcome.ARRIVED, Outcome.DEADLOCKED)
    assert after.certificate.ok
    assert "could be proven safe" in after.notes[-1]
    np.testing.assert_array_equal(after.trajectory.angles, before.trajectory.angles)


@pytest.mark.usefixtures("never")
def test_an_unsafe_plan_is_refused():
    start, goal = np.radians([[[0.0, 60.0], [90.0, 0.0]], [[0.0, 60.0], [270.0, 0.0]]])
    crossing = straight(start=start, goal=goal)
    assert not crossing.certificate.ok
    with pytest.raises(PlanError, match="a plan that is not safe cannot be amended; it is not safe: 1 contacts"):
        amend(crossing, 1, np.radians([170.0, 90.0]))


def test_of_two_configurations_the_first_that_works_is_taken(monkeypatch):
    """The first touches the other's goal; a target of which each does is refused, one without a path is lost."""
    start, goal = np.radians([[[300.0, 0.0], [30.0, 120.0]], [[360.0, 0.0], [30.0, 120.0]]])
    before = straight(goal=goal, start=start)
    touching, clear = np.radians([180.0, 0.0]), np.radians([40.0, 120.0])
    made = targets._first_that_works(before, 1, np.stack([touching, goal[1]]), 0.0)
    assert made.outcomes[1] is Outcome.ARRIVED
    with pytest.raises(ProblemError, match="positioner 'P0' and positioner 'P1' overlap"):
        targets._first_that_works(before, 1, touching[None], 0.0)
    monkeypatch.setattr(one_goal, "reroute", lambda *_: Rerouted(None, (), (0,)))
    lost = targets._first_that_works(before, 1, np.stack([clear, clear + 0.1]), 0.0)
    assert lost.outcomes[1] is Outcome.DEADLOCKED
    np.testing.assert_array_equal(lost.problem.goal[1], clear)


@pytest.mark.usefixtures("never")
def test_targets_are_solved_for_those_they_name():
    before = straight()
    at = before.problem.plane.fibers(np.stack([START[0], ELSEWHERE]))[1]
    after = amend_to(before, Targets(at[:1], at[1:], positioner=("P1",)))
    np.testing.assert_allclose(after.problem.plane.fibers(after.problem.goal)[1], at, atol=1e-6)
    with pytest.raises(TargetError, match=r"targets: its target in row 1 is 877\.600 mm from its base"):
        amend_to(before, Targets([900.0], [0.0], positioner=("P1",)))


def test_pairs_are_parted_once_by_whoever_can(monkeypatch):
    """Obstacles and arms without a target are not sent; a pair of whom one moves otherwise already is parted."""
    sent = []

    def found(plane, margin, motion, ends, i, longer, seed):
        sent.append(i)
        return Rerouted(motion, (i,), ())

    monkeypatch.setattr(mending, "reroute", found)
    goal = GOAL.copy()
    goal[1] = np.nan
    plan = straight(goal=goal, outcomes=(Outcome.ARRIVED, Outcome.NO_TARGET))
    room = np.full(2, 0.05)
    assert mended(plan, {(1, -1): 0.3}, room)[1] == 0
    assert sent == []
    made, parted = mended(plan, {(0, 1): 0.1, (0, -1): 0.2}, room, other=True)
    assert (parted, sent) == (2, [0])
    assert made.outcomes == plan.outcomes
    bars = fp.FocalPlane.load("miradas").subset(np.arange(2))
    rests = fp.Plan(
        fp.Problem(bars, bars.folded, bars.folded),
        fp.Trajectory.at_rest(bars.folded),
        (Outcome.ARRIVED,) * 2,
        "by hand",
    )
    assert mended(rests, {(0, 1): 0.1}, room) == (rests, 0)
