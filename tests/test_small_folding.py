"""Whom the fold gives up, and how few arms get out of each other's way at its end: folds by hand."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan import Outcome
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.greedy_fold import joint_relief
from fiberplan.planners.greedy_fold import losses as losses_module
from fiberplan.planners.greedy_fold.deadlock import Fold
from fiberplan.planners.greedy_fold.joint_relief import JointRelief
from fiberplan.planners.greedy_fold.losses import _REPLACEMENTS, Losses
from fiberplan.planners.shared.rrt_connect import joint_path
from fiberplan.scenes.decisive import row

pytestmark = pytest.mark.small


def losses_of(start, goal, plane=None, **changes):
    problem = fp.Problem(plane or row(2), np.radians(start), np.radians(goal), **changes)
    return Losses(problem, Neighbourhood.of(problem.plane, problem.margin)), problem


def stuck(*who, blockers=None, given_up=()):
    return Fold(fp.Trajectory.at_rest(np.zeros((2, 2))), np.array(who, np.int64), blockers or {}, given_up)


def test_one_stuck_from_its_start_is_held_and_goals_that_touch_it_are_dropped():
    losses, problem = losses_of([[0.0, 0.0], [0.0, 90.0]], [[180.0, 90.0], [180.0, 0.0]])
    losses.give_up(stuck(0, blockers={0: 1}), stuck())
    end = losses.end()
    assert losses.movable.tolist() == [False, True]
    np.testing.assert_array_equal(end[0], problem.start[0])
    assert losses.outcomes(end) == (Outcome.DEADLOCKED, Outcome.DROPPED)
    assert losses.notes() == ["held at the start: P0"]


def test_one_stuck_from_its_goal_rests_and_is_held_the_next_time():
    losses, _ = losses_of([[90.0, 120.0], [90.0, 120.0]], [[0.0, 60.0], [20.0, 60.0]], priority=[2.0, 1.0])
    losses.give_up(stuck(), stuck(0, 1, blockers={1: 0}))
    assert losses.movable.all()
    assert losses.outcomes(losses.end()) == (Outcome.ARRIVED, Outcome.DEADLOCKED)  # of a cluster the least is given up
    losses.give_up(stuck(), stuck(1))
    assert losses.movable.tolist() == [True, False]


def test_whom_the_fold_gave_up_is_lost():
    losses, _ = losses_of([[90.0, 120.0], [90.0, 120.0]], [[0.0, 60.0], [20.0, 60.0]])
    losses.record(stuck(given_up=(1,), blockers={1: 0}))
    assert losses.outcomes(losses.end())[1] is Outcome.DEADLOCKED


def test_one_with_nowhere_to_rest_is_held():
    """Its ranges leave it one place, to which the other's goal comes too near."""
    plane = row(2)
    at = np.radians([[180.0, 90.0], [180.0, 20.0]])
    stiff = plane.replace(lower=np.stack([plane.lower[0], at[1]]), upper=np.stack([plane.upper[0], at[1]]), folded=at)
    losses, problem = losses_of([[180.0, 90.0], [180.0, 20.0]], [[0.0, 0.0], [np.nan, np.nan]], stiff)
    end = losses.end()
    assert losses.movable.tolist() == [True, False]
    np.testing.assert_array_equal(end[1], problem.start[1])
    assert losses.outcomes(end) == (Outcome.DROPPED, Outcome.NO_TARGET)


def test_targets_are_replaced_so_often_and_then_the_arm_is_held():
    rng = np.random.default_rng(0)
    losses, _ = losses_of([[90.0, 120.0], [90.0, 120.0]], [[0.0, 60.0], [20.0, 60.0]])
    for _ in range(_REPLACEMENTS):
        losses.replace_target(1, {1: 0}, rng)
        assert np.isfinite(losses.end()[1]).all()
    assert losses.movable.all()
    assert losses.notes() == ["sent to another, random target: P1"]
    losses.replace_target(1, {}, rng)
    assert losses.movable.tolist() == [True, False]
    assert losses.outcomes(losses.end())[1] is Outcome.DEADLOCKED


def test_without_a_clear_replacement_the_arm_is_held(monkeypatch):
    monkeypatch.setattr(losses_module, "_DRAWS", 0)
    losses, _ = losses_of([[90.0, 120.0], [90.0, 120.0]], [[0.0, 60.0], [20.0, 60.0]])
    losses.replace_target(0, {0: 1}, np.random.default_rng(0))
    assert losses.movable.tolist() == [False, True]
    assert losses.notes() == ["held at the start: P0"]


LEANS = np.radians([[80.0, 0.0], [60.0, 0.0]])  #: folded: up, and away from the other
ACROSS = np.radians([[-80.0, 0.0], [180.0, 0.0]])  #: where they are stuck; the second bars the first


def relieved(monkeypatch, expendable, most, at=ACROSS):
    """Two stiff arms that have stood still for a second; joint paths are found for so many at once."""

    def found(plane, near, members, *given):
        return joint_path(plane, near, members, *given) if len(members) <= most else (None, np.zeros(2, np.int64))

    monkeypatch.setattr(joint_relief, "joint_path", found)
    ranges = {"lower": np.radians([[-90.0, 0.0], [40.0, 0.0]]), "upper": np.radians([[140.0, 1.0], [270.0, 1.0]])}
    plane = row(2).replace(folded=LEANS, **ranges)
    walked = Fold(fp.Trajectory.from_samples([0.0, 1.0], np.stack([at, at])), np.array([0, 1]), {0: 1, 1: 0})
    fold = JointRelief(plane, Neighbourhood.of(plane, 0.0), 0.0, np.ones(2, bool), walked, expendable, 0).fold()
    assert fp.verify(plane, fold.trajectory).ok
    return fold


def test_of_two_the_lesser_is_folded_from_the_beginning(monkeypatch):
    fold = relieved(monkeypatch, np.array([5.0, 1.0]), most=1)
    assert fold.given_up == (1,)
    assert fold.blockers == {1: 0}
    assert fold.stuck.tolist() == []
    np.testing.assert_allclose(fold.trajectory.end, LEANS)
    np.testing.assert_array_equal(fold.trajectory.start, [ACROSS[0], LEANS[1]])


@pytest.mark.parametrize(("expendable", "most"), [(None, 1), (np.ones(2), 0)], ids=["nobody may be", "to no avail"])
def test_nobody_is_given_up_for_nothing(monkeypatch, expendable, most):
    fold = relieved(monkeypatch, expendable, most)
    assert fold.given_up == ()
    assert fold.stuck.tolist() == [0, 1]
    assert fold.blockers == {0: 1, 1: 0}
    np.testing.assert_array_equal(fold.trajectory.end, ACROSS)


def test_who_could_not_have_been_folded_all_along_is_not_given_up(monkeypatch):
    """The second lies across the place where the first is folded."""
    at = np.radians([[-80.0, 0.0], [150.0, 0.0]])
    fold = relieved(monkeypatch, np.array([1.0, 5.0]), most=1, at=at)
    assert fold.given_up == (1,)
