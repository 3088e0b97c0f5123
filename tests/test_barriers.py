"""Two positioners that keep each other from their goals: proofs in the space of all their joints, and paths."""

import numpy as np
import pytest
from scipy.ndimage import label

import fiberplan as fp
from fiberplan.certificates.replay import Claims
from fiberplan.certificates.replay_infeasible import unfounded
from fiberplan.certificates.unreachable import decided
from fiberplan.certificates.whole_replay import replay
from fiberplan.io.plan_file import plan_bytes

START = np.radians([[30.0, 0.0], [0.0, 0.0]])
GOAL = np.radians([[-30.0, 0.0], [0.0, 0.0]])  # on the other side of the second arm


def facing(distance=32.0, first=31.0, second=90.0):
    """Two stiff arms of 22.4 mm that point towards each other, and how far they turn to both sides [deg]."""
    plane = fp.FocalPlane.hexagonal(1, 22.4).subset([0, 1])
    upper = np.radians([[first, 0.01], [second, 0.01]])
    return plane.replace(
        base=np.array([[0.0, 0.0], [distance, 0.0]]),
        zero=np.array([[0.0, 0.0], [np.pi, 0.0]]),
        lower=upper * [-1.0, 0.0],
        upper=upper,
        folded=np.zeros((2, 2)),
    )


def test_two_that_would_have_to_pass_through_each_other_cannot():
    for i in (0, 1):
        assert decided(facing(), [i], {i: GOAL[i]}, START, 0.5)[0] is not None, "alone it can"
        assert decided(facing(), [0, 1], {i: GOAL[i]}, START, 0.5)[0] is not None, "if the other makes way it can"
    path, barrier = decided(facing(), [0, 1], dict(enumerate(GOAL)), START, 0.5)
    assert path is None
    assert barrier.positioners == (0, 1)
    assert decided(facing(distance=60.0), [0, 1], dict(enumerate(GOAL)), START, 0.5)[0] is not None


def test_who_cannot_make_way_shuts_the_other_off():
    """The second arm turns by 20 deg only, and is in the way wherever it is."""
    path, barrier = decided(facing(second=20.0), [0, 1], {0: GOAL[0]}, START, 0.5)
    assert path is None
    assert barrier.goals == {0: tuple(GOAL[0])}


def test_paths_are_proven_by_verify():
    plane = facing()
    path, _ = decided(plane, [0, 1], {0: GOAL[0]}, START, 0.5)
    times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path, axis=0)).max(axis=1) + 1e-3)])
    slow = plane.replace(max_speed=np.full((2, 2), 2.0))
    proof = fp.verify(slow, fp.Trajectory.from_samples(times, path.reshape(-1, 2, 2)), 0.5 - 1e-6)
    assert proof.ok, proof


@pytest.mark.parametrize("seed", range(4))
def test_as_a_grid_of_both_turns_says(seed):
    """Stiff arms: their joint space has two dimensions that matter, and a fine grid of it can be labelled."""
    rng = np.random.default_rng(seed)
    plane = facing(rng.uniform(25.0, 44.0), *rng.uniform(20.0, 90.0, 2))
    pair = np.array([[0, 1]])
    turns = np.linspace(plane.lower[:, 0], plane.upper[:, 0], 120).T
    gap = np.array([[plane.clearance(np.array([[a, 0.0], [b, 0.0]]), pair)[0] for b in turns[1]] for a in turns[0]])
    for margin in (0.0, 1.5, 3.0, 4.0):
        free = np.argwhere(gap > margin + 0.8)
        (a, b), (c, d) = free[rng.integers(len(free), size=2)]
        start, goal = (np.array([[turns[0, x], 0.0], [turns[1, y], 0.0]]) for x, y in ((a, b), (c, d)))
        wide, narrow = label(gap > margin - 1.5)[0], label(gap > margin + 0.5)[0]
        path, barrier = decided(plane, [0, 1], dict(enumerate(goal)), start, margin)
        assert (path is None) != (barrier is None)
        assert barrier is None or narrow[a, b] != narrow[c, d]
        assert path is None or wide[a, b] == wide[c, d]


@pytest.fixture(scope="module")
def plan():
    """Direct's plan of the exchange."""
    return fp.planners.Direct().plan(fp.Problem(facing(), START, GOAL, 0.5, priority=[2.0, 1.0]))


def test_direct_names_such_a_loss_proven_and_the_file_is_replayed(plan):
    assert plan.outcomes == (fp.Outcome.ARRIVED, fp.Outcome.INFEASIBLE)
    assert any("not both" in note for note in plan.notes)
    claims = Claims(plan_bytes(plan))
    done = replay(claims, jobs=1)
    assert done.faults == ()
    assert not any("without a proof" in note for note in done.notes)


def test_it_is_no_proof_if_the_other_does_not_arrive_or_may_go_elsewhere(plan):
    claims = Claims(plan_bytes(plan))
    assert list(unfounded(claims, "it", 1)) == []
    problem = claims.problem.copy()
    claims.problem = problem
    problem["outcome"][0] = b"DROPPED"
    assert list(unfounded(claims, "it", 1)) == ["it is said to be unable to reach its goal, and is not shown to be"]
    problem["outcome"][0], problem["goal_alpha"][0] = b"ARRIVED", 0.1
    assert list(unfounded(claims, "it", 1)) == ["it is said to be unable to reach its goal, and is not shown to be"]
