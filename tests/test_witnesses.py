"""Axes as data against their definition: along each, what it is said to part is apart, by plain numpy."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates.witnesses import witnesses
from fiberplan.focal_plane.bodies import Body, Obstacle
from references import make_plane, motion_of, placed, sampled

CAPSULE = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0)
MARGIN = 0.2


def scene(rng):
    """Two arms and a post whose motion keeps the margin, with knots at times of their own."""
    while True:
        post = Obstacle("post", rng.uniform(-20, 20, (1, 2)), 1.0)
        plane = make_plane(rng.uniform(-13, 13, (2, 2)), [CAPSULE], [post])
        knots = []
        for _ in range(2):
            times = np.sort(rng.uniform(0.5, 5.5, 4))
            knots.append(np.column_stack([times, rng.uniform(-3, 3, 2) + rng.normal(0, 0.3, (4, 2)).cumsum(axis=0)]))
        motion = motion_of(*knots)
        if not fp.verify(plane, motion, MARGIN).contacts:
            return plane, motion


def points(plane, motion, arm, times):
    """Vertices (t, k, 2) of an arm or obstacle at `times`."""
    if arm >= plane.n:
        return np.broadcast_to(plane.obstacles[arm - plane.n].points, (len(times), 1, 2))
    return placed(plane, arm, CAPSULE, sampled(motion, arm, times))


def ends(motion, i, arm):
    """First and last knot of a pair."""
    own = [motion.knots(k)[0] for k in (i, arm) if k < motion.n]
    return min(times[0] for times in own), max(times[-1] for times in own)


@pytest.mark.small
def test_rows_part_the_pair_and_cover_its_motion():
    rng, rows_seen = np.random.default_rng(1), 0
    for _ in range(3):
        plane, motion = scene(rng)
        made = witnesses(plane, motion, MARGIN, np.array([0.05, 0.0]))
        for pair in plane.arm_pairs_within(MARGIN):
            i, arm = (int(k) for k in pair)
            rows = np.flatnonzero((made.pairs == [i, plane.public(arm)]).all(axis=1))
            begin, end = ends(motion, i, arm)
            assert made.begin[rows[0]] == begin
            assert made.end[rows[-1]] == end
            np.testing.assert_array_equal(made.begin[rows[1:]], made.end[rows[:-1]])
            for k in rows:
                times = np.linspace(made.begin[k], made.end[k], 200)
                n = np.array([np.cos(made.axis[k]), np.sin(made.axis[k])])
                first, second = (points(plane, motion, who, times) @ n for who in (i, arm))
                room = 2.0 + MARGIN + 0.05 * (i == 0)
                assert (second.min(axis=1) - first.max(axis=1) - room).min() >= -1e-9
            rows_seen += len(rows)
    assert rows_seen > 4


@pytest.mark.small
def test_a_pair_that_touches_is_left_out_from_there():
    plane = make_plane([0, 0], [Body(np.array([[10.0, 0.0]]), 1.0)], [Obstacle("post", [[0.0, 16.0]], 1.0)])
    motion = motion_of([(0, 0.0, 0), (4, np.pi, 0)])  # meets the post at 2 s
    made = witnesses(plane, motion, MARGIN, np.zeros(1))
    (contact,) = fp.verify(plane, motion, MARGIN).contacts
    assert made.end.max() == pytest.approx(contact.time, abs=1e-3)
    assert made.end.max() <= contact.time
    still = witnesses(plane.replace(online=np.zeros(1, bool)), motion, MARGIN, np.zeros(1))
    assert len(still.axis) == 0
