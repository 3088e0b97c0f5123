"""Executed motions: what joints and clocks may be off by goes into the proof."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane.drift import motion_bounds
from fiberplan.motion import Executed, Trajectory

pytestmark = pytest.mark.small


@pytest.fixture(scope="module")
def pair():
    """Two arms that pass each other, and their motion."""
    plane = fp.FocalPlane.hexagonal(1, 22.4).subset(np.array([0, 1]))
    angles = np.radians([[[0.0, 180.0], [180.0, 180.0]], [[0.0, 100.0], [180.0, 100.0]]])
    return plane, Trajectory.from_samples(np.array([0.0, 10.0]), angles)


def test_errors_take_what_arms_can_move(pair):
    """A joint error e costs l1 e + reach (e + e); a clock error tau the speed for tau: as jitter."""
    plane, motion = pair
    exact = fp.verify(plane, motion)
    error = np.array([[1e-3, 2e-3], [0.0, 0.0]])
    off = fp.verify(plane, Executed(motion, error, 0.0))
    assert off.position_error == pytest.approx(7.4 * 1e-3 + 15.0 * 3e-3)
    assert exact.smallest - off.smallest == pytest.approx(off.position_error, abs=0.011)  # bounds are within 0.01 mm
    late = fp.verify(plane, Executed(motion, 0 * error, 0.02))
    assert late.jitter == 0.02
    assert late.smallest == fp.verify(plane, motion, jitter=0.02).smallest


@pytest.mark.parametrize("sign", [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_bounds_hold_for_turns_of_either_sign(pair, sign):
    plane, motion = pair
    turn = np.array([[3e-3, 3e-3], [1e-3, 4e-3]])
    for at in (motion.start, motion.end):
        moved = np.linalg.norm(plane.fibers(at + turn * sign) - plane.fibers(at), axis=1)
        assert (moved <= motion_bounds(plane, turn * sign) + 1e-12).all()


def test_who_the_file_does_not_move_is_reported_at_rest(pair):
    """Two that stand overlapping and are not moved are no failure; if one is, they are."""
    plane, _ = pair
    standing = Trajectory.at_rest(np.radians([[0.0, 0.0], [180.0, 0.0]]))
    for online, resting in (([False, False], 1), ([True, False], 0)):
        proof = fp.verify(plane, Executed(standing, np.zeros((2, 2)), 0.0, online=np.array(online)))
        assert (len(proof.resting), len(proof.contacts)) == (resting, 1 - resting)


def test_assumptions_go_into_the_proof(pair):
    plane, motion = pair
    proof = fp.verify(plane, Executed(motion, np.zeros((2, 2)), 0.0, assumptions=("clocks start together",)))
    assert proof.assumptions[-1] == "clocks start together"


@pytest.mark.parametrize(("error", "clock"), [(np.zeros(2), 0.0), (-np.ones((2, 2)), 0.0), (np.zeros((2, 2)), np.nan)])
def test_errors_must_be_lengths_of_time_and_turn(pair, error, clock):
    with pytest.raises(TrajectoryError):
        Executed(pair[1], error, clock)
