"""Relief beside the others' folding: nobody stays stuck, the fold takes no longer, and all of it is proven."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners import GreedyFold
from fiberplan.planners.greedy_fold.deadlock import Fold, stuck_groups
from fiberplan.planners.greedy_fold.timed_relief import TimedRelief
from fiberplan.planners.greedy_fold.timed_search import path_in_time
from fiberplan.planners.greedy_fold.walker import Walker
from fiberplan.scenes.uniform import uniform_field

MARGIN = 1.0  # mm: a buffer of 2.0
DEG = np.pi / 180.0
STEP = 9 * DEG


def parked(alpha, beta, rings=3):
    plane = fp.FocalPlane.hexagonal(rings, 22.4)
    return plane.replace(folded=np.tile([alpha * DEG, beta * DEG], (plane.n, 1)))


def walked(plane, seed):
    near = Neighbourhood.of(plane, MARGIN)
    start = uniform_field(plane, seed, MARGIN)
    walker = Walker(plane, start, MARGIN, 1 * DEG, plane.online, patience=20 * DEG, neighbourhood=near)
    walker.run(700 * DEG)
    return near, Fold(walker.trajectory(), walker.stuck, walker.blockers)


@pytest.mark.parametrize("seed", [0, 11, 16, 38])
def test_the_stuck_fold_beside_the_others(seed):
    plane = parked(10.0, 170.0)
    near, walk = walked(plane, seed)
    assert len(walk.stuck)
    relieved = TimedRelief(plane, near, MARGIN, plane.online, walk).relieved()
    assert not len(relieved.stuck)
    assert not relieved.blockers
    np.testing.assert_array_equal(relieved.trajectory.start, walk.trajectory.start)
    np.testing.assert_array_equal(relieved.trajectory.end, plane.folded)
    assert relieved.trajectory.duration < 1.1 * walk.trajectory.duration
    assert fp.verify(plane, relieved.trajectory, MARGIN).ok


@pytest.mark.parametrize("seed", [22, 48])
def test_all_fold_where_alphas_would_turn_both_ways(seed):
    """Not even another order frees some of those that are parked in the middle; by way of (0, 180) all fold."""
    plane = parked(90.0, 180.0)
    near, walk = walked(plane, seed)
    assert len(TimedRelief(plane, near, MARGIN, plane.online, walk).relieved().stuck)
    problem = fp.Problem(plane, uniform_field(plane, seed, MARGIN), plane.folded, MARGIN)
    plan = GreedyFold(step=1 * DEG).plan(problem)
    assert not len(plan.lost)
    assert plan.faults() == []


def test_a_detour_never_moves_who_is_offline():
    plane = parked(90.0, 180.0)
    start = uniform_field(plane, 22, MARGIN)
    online = np.ones(plane.n, bool)
    online[31] = False  # one of the two that the walk leaves stuck
    plane = plane.replace(online=online)
    plan = GreedyFold(step=1 * DEG).plan(fp.Problem(plane, start, plane.folded, MARGIN, conflicts="drop"))
    assert plan.faults() == []
    np.testing.assert_array_equal(plan.trajectory.end[~online], start[~online])


@pytest.mark.small
def test_alone_the_path_takes_what_the_joints_ask_for():
    plane = parked(10.0, 170.0, rings=0)
    path, _ = path_in_time(plane, 0, np.array([323.0, 12.5]) * DEG, [], MARGIN, 30.0, STEP)
    times, angles = path
    assert times[-1] == pytest.approx(np.ceil(313.0 / 9.0) * 0.3, rel=1e-6)  # whole steps of 0.3 s
    np.testing.assert_array_equal(angles[0], np.array([323.0, 12.5]) * DEG)
    np.testing.assert_array_equal(angles[-1], plane.folded[0])
    assert fp.verify(plane, fp.Trajectory.from_knots(np.zeros(len(times), int), times, angles, 1)).ok


@pytest.mark.small
def test_a_path_waits_for_one_that_passes():
    """A neighbour lies across until 1 s and turns away until 7 s, longer than the path alone would take."""
    plane = parked(0.0, 180.0, rings=1)
    across = np.array([0.0, 0.0]) * DEG  # stretched over the folded place of 1
    base = plane.base
    left = int(np.flatnonzero((base[:, 0] < -1.0) & (np.abs(base[:, 1]) < 1e-6))[0])
    middle = int(np.flatnonzero(np.hypot(*base.T) < 1e-6)[0])
    others = [(left, np.array([0.0, 1.0, 7.1]), np.array([across, across, plane.folded[left]]))]
    start = np.array([90.0, 60.0]) * DEG
    path, refusals = path_in_time(plane, middle, start, others, 0.0, 30.0, STEP)
    assert refusals[0] > 0
    assert path[0][-1] > 4.2
    owner = np.repeat([0, 1], [len(path[0]), 3])
    motion = fp.Trajectory.from_knots(
        owner, np.concatenate([path[0], others[0][1]]), np.concatenate([path[1], others[0][2]]), 2
    )
    assert fp.verify(plane.subset(np.array([middle, left])), motion).ok


def test_without_a_path_who_refused_is_named():
    """A neighbour that never leaves the folded place of 0."""
    plane = parked(0.0, 180.0, rings=1)
    left = int(np.flatnonzero((plane.base[:, 0] < -1.0) & (np.abs(plane.base[:, 1]) < 1e-6))[0])
    middle = int(np.flatnonzero(np.hypot(*plane.base.T) < 1e-6)[0])
    others = [(left, np.zeros(1), np.zeros((1, 2)))]
    path, refusals = path_in_time(plane, middle, np.array([90.0, 60.0]) * DEG, others, 0.0, 30.0, STEP)
    assert path is None
    assert refusals[0] > 0


@pytest.mark.small
def test_groups_are_linked_through_those_that_can_make_room():
    nowhere = fp.Trajectory.at_rest(np.zeros((6, 2)))
    fold = Fold(nowhere, np.array([0, 1, 4]), {0: 2, 1: 2, 4: 5, 3: 0})  # 3 is not stuck
    assert stuck_groups(fold, np.array([True] * 5 + [False])) == [[0, 1, 2], [4]]
    assert stuck_groups(fold, np.ones(6, bool)) == [[0, 1, 2], [4, 5]]
    assert stuck_groups(Fold(nowhere, np.array([0]), {0: 7}), np.ones(6, bool)) == [[0]]  # an obstacle
