"""Who may home at the same time: scenes by hand, and every set driven at random speeds past `verify`."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates import verify
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.motion import Trajectory
from fiberplan.scenes.decisive import row
from fiberplan.scenes.uniform import uniform_field

pytestmark = pytest.mark.small

UP = np.radians([90.0, 180.0])  #: across the row, beta at its stop: such an arm reaches 9.1 mm up and down


def standing(pitch, lower, upper, **others):
    plane = row(2, pitch)
    joints = {"lower": np.radians([[lower, 0.0]] * 2), "upper": np.radians([[upper, 180.0]] * 2)}
    return plane.replace(folded=np.tile(UP, (2, 1)), **joints, **others)


def listed(sets):
    return [one.tolist() for one in sets]


def test_robots_far_apart_home_together():
    groups = fp.homing_groups(row(2, 100.0), np.radians([[10.0, 20.0], [200.0, 90.0]]))
    assert listed(groups) == [[0, 1], [0, 1]]
    assert listed(groups.beta) == listed(groups.alpha) == [[0, 1]]
    assert groups.at_least == (1, 1)
    assert str(groups) == "1 sets of betas (at least 1), 0 unable; 1 sets of alphas (at least 1), 0 unable"


@pytest.mark.large
def test_alphas_whose_sweeps_meet_home_one_after_the_other():
    """Sweeps of 9.1 mm meet at 17 mm; past one that stands across there are 6.4 mm to spare. It homes to stand so."""
    plane = standing(17.0, 90.0, 450.0)
    groups = fp.homing_groups(plane, np.tile(UP, (2, 1)))
    assert listed(groups.beta) == [[0, 1]]
    assert listed(groups.alpha) == [[0], [1]]
    assert groups.at_least[0] == 2
    apart = fp.homing_groups(standing(18.3, 90.0, 450.0), np.tile(UP, (2, 1)))
    assert listed(apart.alpha) == [[0, 1]]
    assert listed(fp.homing_groups(standing(18.3, 90.0, 450.0), np.tile(UP, (2, 1)), 0.2).alpha) == [[0], [1]]


def test_who_would_sweep_one_that_has_homed_is_named():
    """The first stands along the row once its alpha is at 0: 9.1 + 9.1 mm are more than 17."""
    plane = standing(17.0, 0.0, 300.0)
    groups = fp.homing_groups(plane, np.tile(UP, (2, 1)))
    assert listed(groups.alpha) == [[0]]
    assert groups.unable_alpha.tolist() == [1]
    assert groups.unable_beta.tolist() == []


def test_a_post_in_the_way_of_a_beta():
    """Beta from 90 to 180 deg sweeps the tip of the first arm past (7.4 + 10.6, 10.6)."""
    state = np.radians([[0.0, 0.0], [0.0, 180.0]])
    post = Obstacle("post", np.array([[7.4 + 10.6, 10.6]]), 1.0)
    plane = row(2, 100.0).replace(obstacles=(post,))
    groups = fp.homing_groups(plane, state)
    assert listed(groups.beta) == [[1]]
    assert groups.unable_beta.tolist() == [0]
    assert groups.unable_alpha.tolist() == [0]


def test_offline_robots_neither_home_nor_are_named():
    plane = row(2, 100.0)
    state = fp.State(plane.folded, np.array([True, False]))
    groups = fp.homing_groups(plane, state)
    assert listed(groups) == [[0], [0]]
    assert len(groups.unable_beta) == len(groups.unable_alpha) == 0


@pytest.mark.large
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_sets_are_safe_at_any_speed(seed):
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    state = uniform_field(plane, seed, 0.3)
    groups = fp.homing_groups(plane, state, 0.2)
    assert len(groups.beta) >= groups.at_least[1]
    assert sum(map(len, groups.beta)) + len(groups.unable_beta) == plane.n
    assert len({i for one in groups.beta for i in one}) == sum(map(len, groups.beta)) > plane.n // 2
    rng, stands = np.random.default_rng(seed), state
    for one in groups.beta:
        end = stands.copy()
        end[one, 1] = np.pi
        for _ in range(5):
            seconds = rng.uniform(10.0, 60.0, plane.n)
            n = plane.n
            motion = Trajectory.from_knots(
                np.tile(np.arange(n), 2), np.append(np.zeros(n), seconds), np.concatenate([stands, end]), n
            )
            assert verify(plane, motion, 0.2).contacts == ()
        stands = end
    for one in groups.alpha:
        for _ in range(5):
            angles = np.stack([stands] * 3)
            angles[1:, one, 0] = rng.uniform(plane.lower[one, 0], plane.upper[one, 0], (2, len(one)))
            assert verify(plane, Trajectory.from_samples([0.0, 40.0, 80.0], angles), 0.2).contacts == ()
        stands = stands.copy()
        stands[one, 0] = plane.lower[one, 0]


def test_what_cannot_be_asked_is_refused():
    plane = row(2)
    with pytest.raises(ProblemError, match="a state of 3 positioners for 2"):
        fp.homing_groups(plane, np.zeros((3, 2)))
    with pytest.raises(ProblemError, match="margin must be a length"):
        fp.homing_groups(plane, plane.folded, -1.0)
    with pytest.raises(ProblemError, match="arms of two links, not the four-bar arms"):
        fp.homing_groups(fp.FocalPlane.load("miradas"), np.zeros((12, 2)))
