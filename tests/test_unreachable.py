"""Proofs that there is no way: found where a pocket is closed, never where a way exists."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates import proven_excluded, proven_unreachable
from fiberplan.certificates.unreachable import decided
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.focal_plane.neighbours import Neighbourhood, clearances_around
from fiberplan.scenes.uniform import uniform_field

DEG = np.pi / 180.0


def walled(gap):
    """A stiff arm between two posts; `gap` [mm] more than it needs is left beside the second."""
    plane = fp.FocalPlane.hexagonal(0, 22.4, lower=(-5.0, 0.0), upper=(1.7, 0.01), folded=(0.0, 0.0))
    far = 22.4 + 3.0 + gap  # the tip passes behind a post that is so far away
    return plane.replace(obstacles=(Obstacle("near", [[0.0, 15.0]], 1.5), Obstacle("far", [[0.0, -far]], 1.5)))


@pytest.mark.parametrize(("gap", "closed"), [(-1.0, True), (-0.2, True), (0.2, False), (5.0, False)])
def test_a_pocket_is_closed_or_not(gap, closed):
    plane = walled(gap)
    start, goal = np.radians([[45.0, 0.0]]), np.radians([-225.0, 0.0])  # past the far post, clockwise
    assert proven_unreachable(plane, 0, start, goal, 0.0) == closed
    assert not proven_unreachable(plane, 0, start, np.radians([30.0, 0.0]), 0.0)
    assert proven_unreachable(plane, 0, start, goal, max(gap, 0.0) + 0.5)


def test_an_offline_arm_can_bar_the_way_and_one_that_moves_cannot():
    plane = fp.FocalPlane.hexagonal(1, 22.4, lower=(0.0, 0.0), upper=(2 * np.pi, 0.01), folded=(0.0, 0.0))
    middle, right, left = 3, 4, 2
    start = np.array(plane.folded)
    start[middle], start[right], start[left] = np.radians([[45.0, 0.0], [180.0, 0.0], [0.0, 0.0]])
    goal = np.radians([300.0, 0.0])
    online = np.ones(plane.n, bool)
    assert not proven_unreachable(plane.replace(online=online), middle, start, goal, 0.0)
    online[[right, left]] = False
    assert proven_unreachable(plane.replace(online=online), middle, start, goal, 0.0)
    online[left] = True
    assert not proven_unreachable(plane.replace(online=online), middle, start, np.radians([120.0, 0.0]), 0.0)


@pytest.mark.parametrize("seed", range(6))
def test_no_proof_against_a_way_that_exists(seed):
    """Random walks past offline arms: wherever they come to can be reached."""
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    online = np.zeros(plane.n, bool)
    online[3] = True
    start = np.array(uniform_field(plane, seed, 0.2))
    plane = plane.replace(online=online)
    near = Neighbourhood.of(plane, 0.2)
    rng = np.random.default_rng(seed)
    q = start[3].copy()
    for _ in range(400):
        to = np.clip(q + rng.normal(0.0, 2.0 * DEG, 2), plane.lower[3], plane.upper[3])
        between = q + np.linspace(0.0, 1.0, 20)[:, None] * (to - q)
        if clearances_around(plane.arms, near, plane.with_obstacles(start), 3, between).min() >= 0.2:
            q = to
    assert not proven_unreachable(plane, 3, start, q, 0.2)


def test_ranges_without_ends_prove_nothing():
    plane = walled(-1.0)
    wide = plane.replace(lower=np.array([[-np.inf, 0.0]]), upper=np.array([[np.inf, 0.01]]))
    assert not proven_unreachable(wide, 0, np.radians([[45.0, 0.0]]), np.radians([-225.0, 0.0]), 0.0)


def test_proven_goals_are_far_fewer_than_open_ones():
    """Among random goals and extended offline arms some are barred, and what is proven is so at every larger margin."""
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    rng = np.random.default_rng(4)
    online = rng.random(plane.n) > 0.5
    start = np.array(uniform_field(plane, 3, 0.5))
    plane = plane.replace(online=online)
    proven = 0
    for i in np.flatnonzero(online):
        for goal in plane.kinematics.random(plane, rng, np.full(6, i)):
            if proven_unreachable(plane, i, start, goal, 0.0):
                proven += 1
                assert proven_unreachable(plane, i, start, goal, 0.4)
    assert proven > 0


POCKET = np.radians([[125.94963968, 97.54481611], [23.33698225, 19.40880168]])  # a start, and a goal beside a fiducial


def test_passages_too_narrow_by_micrometres_are_found_closed():
    """An SDSS-V arm beside a fiducial passes where the margin leaves it hundredths of a millimetre."""
    sdss = fp.FocalPlane.load("sdss")
    plane = sdss.subset([sdss.index_of("R-1C19")])
    start, goal = POCKET
    closed = [margin for margin in (0.9, 0.95, 0.99, 1.0) if proven_unreachable(plane, 0, start[None], goal, margin)]
    assert closed == [0.99, 1.0]
    plan = fp.planners.Direct().plan(fp.Problem(plane, start[None], goal[None], 0.95))
    assert plan.faults() == []
    assert len(plan.having(fp.Outcome.ARRIVED)) == 1


def test_whether_another_arm_finds_a_place_past_those_that_never_move_is_always_decided():
    """Also where the box that it starts in may hold one, and a clear box beside it does."""
    plane, found = fp.FocalPlane.hexagonal(1, 22.4), []
    for seed in range(20):
        start = np.array(uniform_field(plane, seed, 0.5))
        goal = np.random.default_rng(seed).uniform(plane.lower, plane.upper)
        for i, j in ((3, 0), (3, 4), (0, 3), (2, 3)):
            alone = plane.replace(online=np.isin(np.arange(plane.n), [i, j]))
            path, barrier = decided(alone, [j], {i: goal[i]}, start, 0.5)
            found.append(path is not None)
            assert (path is None) == (barrier is not None)
    assert sum(found) > 40


def test_a_goal_that_leaves_another_arm_no_place_is_proven_lost():
    """A stiff arm that turns by 20 deg, and random goals of its neighbour: as dense samples of its turn say."""
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    upper = np.array(plane.upper)
    upper[3] = np.radians([20.0, 0.01])
    plane = plane.replace(upper=upper, lower=np.zeros((7, 2)), folded=np.zeros((7, 2)))
    start, rng, found = np.zeros((7, 2)), np.random.default_rng(5), []
    turned = np.stack([np.radians(np.linspace(0.0, 20.0, 400)), np.zeros(400)], axis=1)
    pair = plane.arm_pairs_within(0.5).tolist().index([3, 4])
    for goal in plane.kinematics.random(plane, rng, np.full(80, 4)):
        poses = np.repeat(start[None], 400, axis=0)
        poses[:, 3], poses[:, 4] = turned, goal
        best = max(plane.clearance(pose)[pair] for pose in poses)
        if abs(best - 0.5) > 0.02:
            assert proven_excluded(plane, 4, goal, 3, start, 0.5) == (best < 0.5)
            found.append(best < 0.5)
    assert 10 < sum(found) < len(found) - 10
    assert not proven_excluded(plane, 5, np.zeros(2), 3, start, 0.5)
