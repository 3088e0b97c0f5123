"""How soon the first contact is after one stops dead, and what else a motion tolerates, against dense sampling."""

import dataclasses
import pickle

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates import verify
from fiberplan.certificates.reactions import RESOLUTION, reaction, stalls
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.motion import Trajectory
from fiberplan.scenes import decisive
from references import make_plane, motion_of, sampled_clearance

TIP = Body(np.array([[10.0, 0.0]]), 1.0)
BAR = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 0.5)


def tips(gap, *knots, **changes):
    """Two tips 10 mm from their bases, whose bases are so much farther apart than the tips are wide."""
    return make_plane([[0, 0], [2.0 + gap, 0]], [TIP], length=0.0, max_speed=1e3, **changes), motion_of(*knots)


def sampled_stall(plane, motion, i, j, count=60):
    """Least delay on a grid after which arm j touches arm i, which has stopped, and the moment; inf if it does not."""
    end = motion.duration
    t0, s = (grid.ravel() for grid in np.meshgrid(np.linspace(0, end, count), np.linspace(0, end, count)))
    clear = sampled_clearance(plane, i, j, motion.sampled(t0)[i], motion.sampled(t0 + s)[j])
    return np.where(clear <= 0, s, np.inf).min()


def test_who_follows_touches_who_stops():
    """Both tips at 10 mm/s along x, the second 3 mm behind: 1 mm is free, which takes a tenth of a second."""
    plane, motion = tips(1.0, [(0, 1.27, 0), (0.6, 1.87, 0)], [(0, 1.27, 0), (0.6, 1.87, 0)])
    found = stalls(plane, motion)
    exact = 2.0 * np.arcsin(0.05)
    for stall in (found.soonest, reaction(plane, motion)):
        assert exact - RESOLUTION <= stall.seconds <= exact
        assert (stall.positioner, stall.other) == (0, 1)
    assert found.seconds[1] == np.inf


@pytest.mark.small
def test_nobody_is_touched_where_paths_are_apart_and_who_rests_is_no_stall():
    plane, motion = tips(0.5, [(0, 1.57, 0), (1, 3.0, 0)], [(0, 1.57, 0), (1, 0.1, 0)])
    assert reaction(plane, motion).seconds == np.inf
    assert verify(plane, motion).tolerates.jitter == np.inf
    behind = [(0, 2.0, 0), (2, 2.0, 0), (3, 1.57, 0)]  # leaves late, where the other stands after its turn
    plane, motion = tips(0.5, behind, [(0, 1.0, 0), (1, 1.57, 0)])
    assert reaction(plane, motion).seconds == np.inf


def test_bounds_hold_for_motions_of_all_kinds():
    rng, touched = np.random.default_rng(3), 0
    for _ in range(50):
        plane = make_plane([[0, 0], [rng.uniform(24, 28), 0]], [BAR], max_speed=1e3)
        times = np.cumsum(rng.uniform(0.1, 1.0, (2, 4)), axis=1) - 0.1
        angles = np.cumsum(rng.normal(0.0, 0.4, (2, 4, 2)), axis=1) + [[[0.0, 0.0]], [[np.pi, 0.0]]]
        motion = motion_of(*([(t, *q) for t, q in zip(times[k], angles[k], strict=True)] for k in (0, 1)))
        if not verify(plane, motion).ok:
            continue
        found = stalls(plane, motion)
        for i, j in ((0, 1), (1, 0)):
            seen = sampled_stall(plane, motion, i, j)
            assert found.seconds[i] <= seen
            if np.isfinite(seen):
                assert seen - found.seconds[i] <= 2.0 * motion.duration / 59 + RESOLUTION
                touched += 1
    assert touched >= 4


@pytest.fixture(scope="module")
def crossing():
    """Three arms in a row that pass each other at margin 0.3, planned."""
    asked = decisive.exchange()
    return fp.planners.Direct().plan(fp.Problem(asked.plane, asked.start, asked.goal, 0.3))


def test_what_is_tolerated_is_proven_and_not_much_more_is(crossing):
    plane, motion, found = crossing.problem.plane, crossing.trajectory, crossing.certificate.tolerates
    assert found.reaction.seconds == 2.0 * found.jitter > 0
    assert verify(plane, motion, jitter=0.99 * found.jitter).ok
    assert not verify(plane, motion, jitter=1.02 * found.jitter + RESOLUTION).ok
    assert verify(plane, motion, position_error=0.999 * found.position_error).ok
    assert not verify(plane, motion, position_error=found.position_error + 0.01).ok
    assert found.critical.tolist() == [1, 0]
    allowed = verify(plane, motion, jitter=0.5 * found.jitter).tolerates
    assert allowed.jitter == pytest.approx(0.5 * found.jitter)
    stall = found.reaction
    for late, touches in ((0.98, False), (1.02, True)):
        angles = motion.at(stall.moment).copy()
        angles[stall.other] = motion.at(stall.moment + late * stall.seconds + touches * 2 * RESOLUTION)[stall.other]
        assert (plane.clearance(angles)[0] <= 0) == touches


def test_stopping_everything_at_once_is_safe_at_any_instant(crossing):
    """Everyone stands where it was at the moment, which is where the proof has looked."""
    plane, motion = crossing.problem.plane, crossing.trajectory
    for stop in np.random.default_rng(5).uniform(0.0, motion.duration, 20):
        assert verify(plane, motion.between(0.0, stop), crossing.problem.margin).ok
        assert verify(plane, Trajectory.at_rest(motion.at(stop)), crossing.problem.margin).ok


@pytest.mark.small
def test_obstacles_are_not_off_and_records_know_no_motion():
    post = Obstacle("post", np.array([[12.2, 0.0]]), 0.5)
    plane = make_plane([0, 0], [TIP], [post], length=0.0, max_speed=1e3)
    proof = verify(plane, motion_of([(0, -1.0, 0), (1, 0.0, 0)]), 0.5)
    assert proof.tolerates.position_error == pytest.approx(2.2 - 1.5, abs=0.011)
    assert proof.tolerates.critical.tolist() == [-1]
    again = pickle.loads(pickle.dumps(proof))
    assert again.tolerates.position_error == proof.tolerates.position_error
    with pytest.raises(TrajectoryError, match="record"):
        _ = dataclasses.replace(proof, subject=None).tolerates


@pytest.mark.small
def test_who_is_alone_tolerates_as_much_as_was_looked_at():
    plane = make_plane([[0, 0], [100, 0]], [TIP], length=0.0, max_speed=1e3)
    found = verify(plane, motion_of([(0, -1.0, 0), (1, 0.0, 0)], [(0, 0.0, 0)])).tolerates
    assert found.position_error == 1.0  # half of what CAP looks beyond the margin
    assert found.critical.tolist() == [-1, -1]
