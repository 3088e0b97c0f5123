"""Proven clearance in each part of a motion, against dense sampling; and parts of a motion."""

from itertools import pairwise

import numpy as np
import pytest

from fiberplan.certificates import clearance_over_time
from fiberplan.certificates.safety import CAP, TOLERANCE
from fiberplan.errors import TrajectoryError
from test_page import small_plan

pytestmark = pytest.mark.small


@pytest.fixture(scope="module")
def plan():
    return small_plan(touching=True)


@pytest.mark.large
def test_bounds_hold_between_the_edges_and_are_sharp(plan):
    plane, motion = plan.problem.plane, plan.trajectory
    times = np.linspace(0.0, plan.makespan, 9)
    found = clearance_over_time(plane, motion, times, plan.problem.margin)
    sampled = np.full(found.clearance.shape, np.inf)
    row = {tuple(pair): k for k, pair in enumerate(plane.pairs.tolist())}
    rows = [row[tuple(pair)] for pair in found.pairs.tolist() if pair[1] >= 0]
    for k, (begin, end) in enumerate(pairwise(times)):
        seen = np.array([plane.clearance(motion.at(t))[rows] for t in np.linspace(begin, end, 1500)])
        sampled[k, found.pairs[:, 1] >= 0] = seen.min(axis=0)
    two = found.pairs[:, 1] >= 0
    assert two.any()
    assert not two.all()  # the fiducial
    assert np.all(found.clearance[:, two] <= sampled[:, two] + 1e-9)
    near = sampled < plan.problem.margin + CAP
    assert near[:, two].any()
    assert np.all((found.clearance >= sampled - TOLERANCE - 0.02)[:, two][near[:, two]])


def test_some_pairs_alone(plan):
    plane, times = plan.problem.plane, np.linspace(0.0, plan.makespan, 4)
    every = clearance_over_time(plane, plan.trajectory, times, plan.problem.margin)
    some = clearance_over_time(plane, plan.trajectory, times, plan.problem.margin, pairs=every.pairs[[3, -1]])
    assert np.array_equal(some.pairs, every.pairs[[3, -1]])
    assert np.array_equal(some.clearance, every.clearance[:, [3, -1]])


def test_two_that_cannot_move_are_left_out(plan):
    plane = plan.problem.plane
    nobody = plane.replace(online=np.zeros(plane.n, bool))
    assert clearance_over_time(nobody, plan.trajectory, [0.0, 1.0]).clearance.shape == (1, 0)


def test_a_part_of_a_motion(plan):
    motion = plan.trajectory
    part = motion.between(0.3, 1.7)
    assert part.duration == pytest.approx(1.4)
    for t in np.linspace(0.0, 1.4, 7):
        assert part.at(t) == pytest.approx(motion.at(0.3 + t), abs=1e-12)
    late = motion.between(motion.duration + 1.0, motion.duration + 2.0)
    assert np.array_equal(late.start, late.end)


@pytest.mark.parametrize(("begin", "end"), [(1.0, 1.0), (-1.0, 1.0), (0.0, np.inf), (np.nan, 1.0)])
def test_no_part_of_a_motion(begin, end, plan):
    with pytest.raises(TrajectoryError, match="no motion lies between"):
        plan.trajectory.between(begin, end)
    with pytest.raises(TrajectoryError, match="the motion has 19 positioners"):
        clearance_over_time(plan.problem.plane.subset(np.arange(3)), plan.trajectory, [0.0, 1.0])
