"""The first look at a box of joints against shapely's distances and arcs, with the compiler off."""

import numpy as np
import pytest

from fiberplan.certificates.any_speed import _worst, contacts_at_any_speed
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels.boxes import _clear
from fiberplan.tolerances import ROUNDING
from references import make_plane, sampled_clearance

PAIRS = np.array([[0, 1], [1, 0], [0, 2], [2, 1]])  # the third is a post


def planes(count, seed=0):
    """Two arms of different lengths, each of which reaches elsewhere with either link, and a post."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        bodies = [
            Body(np.array([[[0.0, 0.0], [9.0, 0.0]], [[0.0, 1.0], [4.0, 0.0]]]), 1.0),
            Body(np.array([[0.0, 0.0], [rng.uniform(4, 9), 1.0]]), 0.5, link="alpha"),
        ]
        post = [Obstacle("post", rng.uniform(-9, 9, (1, 2)), 1.0)]
        yield rng, make_plane(rng.uniform(-18, 18, (2, 2)), bodies, post, length=[5.0, 8.0])


def box_of(rng, pair, width):
    """(2, 2, 2) of arm, joint, from and to [rad]; of a post nothing."""
    half = width * rng.uniform(0, 1, (2, 2)) * (pair[:, None] < 2)
    middle = rng.uniform(-3, 3, (2, 2)) * (pair[:, None] < 2)
    return np.stack([middle - half, middle + half], axis=-1)


def nearest(plane, pair, at):
    """Clearances of a pair at angles (k, 2, 2)."""
    return sampled_clearance(plane, *pair, at[:, 0], at[:, 1])


def moves(plane, pair, box):
    """How far any body point can move from the middle of a box, by each joint alone (2, 2), and both arms' by all."""
    half = (box[..., 1] - box[..., 0]) / 2
    alone, both = np.zeros((2, 2)), 0.0
    for k in (0, 1):
        if pair[k] < 2:
            arm = plane.arms.arm[pair[k]]
            for joint, (a, b) in enumerate(half[k] * np.eye(2)):
                alone[k, joint] = max(arm.length * a + arm.reach_beta * (a + b), arm.reach_alpha * a)
            both += max(arm.length * half[k, 0] + arm.reach_beta * half[k].sum(), arm.reach_alpha * half[k, 0])
    return alone, both


def test_the_first_look_is_enough_where_nothing_moves_that_far():
    """To a tenth of what is given away for rounding: nothing more is lost."""
    errors = np.array([0.2, 0.1, 0.0])
    for k, (rng, plane) in enumerate(planes(12, 1)):
        pair = PAIRS[k % 4]
        box = box_of(rng, pair, 0.3)
        gap, (alone, both) = nearest(plane, pair, box.mean(axis=-1)[None])[0], moves(plane, pair, box)
        for off in (-1e-10, 1e-10):
            shown = _clear(plane.arms, *pair, box, gap - alone.sum() - ROUNDING + off, np.zeros((1, 2, 2, 2)))
            assert shown == (off < 0)
            margin = gap - both - ROUNDING - errors[pair].sum() + off
            found = _worst(plane.arms, pair[None], box.reshape(1, 8), errors, margin, 0.0, np.zeros((1, 8)))
            assert found[0, 0] == (off < 0)


def test_errors_of_both_count_among_those_that_come_near():
    """Tips that face each other 1 mm apart, each of which may be off."""
    plane = make_plane([[0, 0], [32.0 + 1.0, 0]], [Body(np.array([[10.0, 0.0]]), 1.0)])
    at = np.array([[0.0, 0.0], [np.pi, 0.0]])
    for off, near in (([0.4, 0.5], False), ([0.6, 0.5], True), ([0.0, 1.1], True), ([1.1, 0.0], True)):
        found = contacts_at_any_speed(plane, at, at, 0.0, np.array(off), 2.0)
        assert [(one.pair, one.time) for one in found] == [((0, 1), 2.0)] * near
        assert all(one.clearance == pytest.approx(1.0 - sum(off)) for one in found)
    assert contacts_at_any_speed(plane.replace(online=np.zeros(2, bool)), at, at, 2.0, np.zeros(2)) == ()
    turned = at + [[0.4, 0.0], [0.0, 0.0]]
    for begin, end in ((at + 0.0, turned), (turned, at)):
        assert len(contacts_at_any_speed(plane, begin, end, 1.01, np.zeros(2))) == 1
        assert contacts_at_any_speed(plane, begin, end, 0.9, np.zeros(2)) == ()
