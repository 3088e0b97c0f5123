"""Boxes of joints, and how they are halved, against shapely's distances and arcs, with the compiler off."""

import itertools

import numpy as np
import pytest

from fiberplan.certificates.any_speed import FLOOR, _worst, clear_at_any_speed, contacts_at_any_speed
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels import boxes as boxes_module
from fiberplan.kernels.boxes import _clear, clear_boxes
from fiberplan.tolerances import ROUNDING
from references import make_plane, sampled_clearance

pytestmark = pytest.mark.small  # every case of each

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
            shown = _clear(plane.arms, *pair, gap - alone.sum() - ROUNDING + off, box[None].copy())
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


def halved(plane, pair, box, margin, at_least, lost, upper_first=False):
    """All of a box is shown by halving it, always across the joint that alone moves its arm most.

    Args:
        at_least: what moves less than this in all is given up [mm].
        lost: how much of the clearance is not there within, by what each joint moves and both arms do [mm].

    Returns:
        (clearance [mm] at which it was given up, inf if it was shown; boxes looked at; most that there were at a time)
    """
    waiting, looks, room = [box], 0, 1
    while waiting:
        box, looks = waiting.pop(), looks + 1
        gap, (alone, both) = nearest(plane, pair, box.mean(axis=-1)[None])[0], moves(plane, pair, box)
        if gap - lost(alone, both) >= margin:
            continue
        if gap < margin or both < at_least:
            return gap, looks, room
        widest = np.unravel_index(alone.argmax(), (2, 2))
        halves = box.copy(), box.copy()  # the lower and the upper
        halves[0][(*widest, 1)] = halves[1][(*widest, 0)] = box[widest].mean()
        waiting += halves if upper_first else halves[::-1]
        room = max(room, len(waiting))
    return np.inf, looks, room


def cases(share):
    """Boxes of which a first look shows too little, and a margin: the clearance in the middle, less a part of that."""
    for k, (rng, plane) in enumerate(planes(10, 2)):
        pair = PAIRS[k % 4]
        box = box_of(rng, pair, 0.25)
        alone, _ = moves(plane, pair, box)
        yield plane, pair, box, nearest(plane, pair, box.mean(axis=-1)[None])[0] - share * alone.sum()


def padded(box, room):
    """A stack of so many boxes, of which the first is this one."""
    return np.concatenate([box[None], np.full((room - 1, 2, 2, 2), 77.0)])


@pytest.mark.parametrize("share", [0.8])
def test_boxes_are_halved_across_the_joint_that_moves_most(share, monkeypatch):
    """As many looks and as much room are needed as for the halving in words, and what is shown is so."""
    rng, seen = np.random.default_rng(5), set()
    for plane, pair, box, margin in cases(share):
        given_up, looks, room = halved(plane, pair, box, margin, 0.0, lambda alone, _: alone.sum() + ROUNDING)
        shown = given_up == np.inf
        seen |= {shown} if looks > 3 else set()
        for most, left, answer in ((looks + 1, room, shown), (looks, room, False), (looks + 1, room - 1, False)):
            monkeypatch.setattr(boxes_module, "_MOST", most)
            if left:
                assert _clear(plane.arms, *pair, margin, padded(box, left)) == answer, (pair, looks)
        if shown:
            at = box[..., 0] + rng.uniform(0, 1, (300, 2, 2)) * (box[..., 1] - box[..., 0])
            assert nearest(plane, pair, at).min() >= margin
    assert True in seen


@pytest.mark.parametrize("share", [0.8])
def test_at_any_speed_boxes_are_halved_likewise(share):
    errors, seen = np.array([0.2, 0.1, 0.0]), set()
    for plane, pair, box, nearly in cases(share):
        for floor in (0.0, 0.8):
            off = errors[pair].sum()
            given_up, looks, room = halved(
                plane, pair, box, nearly + ROUNDING, floor, lambda _, both: both, upper_first=True
            )
            seen |= {given_up == np.inf} if looks > 3 else set()
            space = np.full((room, 8), 77.0)
            (found,) = _worst(plane.arms, pair[None], box.reshape(1, 8), errors, nearly - off, floor, space)
            assert found == pytest.approx((float(given_up == np.inf), given_up - off), abs=1e-9)
            if room > 1 and given_up == np.inf:
                (found,) = _worst(plane.arms, pair[None], box.reshape(1, 8), errors, nearly - off, floor, space[1:])
                assert found[0] == 0.0
    assert seen == {True, False}


def test_arms_have_boxes_of_their_own_as_first_and_as_second():
    """Three arms, six boxes: each pair is looked at in its own two."""
    plane = make_plane([[0, 0], [30.0, 0], [15.0, 26.0]], [Body(np.array([[0.0, 0.0], [9.0, 0.0]]), 1.0)])
    rng = np.random.default_rng(6)
    middle = rng.uniform(-3, 3, (6, 2))
    boxes = np.stack([middle - 0.02, middle + 0.03], axis=-1)
    pairs, answers = np.array(list(itertools.permutations(range(3), 2))), set()
    for margin in (4.0, 10.0, 16.0, 22.0):
        expected = []
        for i, j in pairs:
            both = boxes[[i, 3 + j]]
            expected.append(halved(plane, (i, j), both, margin, 0.0, lambda a, _: a.sum() + ROUNDING)[0] == np.inf)
        assert clear_boxes(plane.arms, pairs, boxes, 3, margin).tolist() == expected
        answers |= set(expected)
    assert answers == {True, False}


def test_a_box_of_which_nothing_moves_is_not_halved():
    """Equality is not shown, however often one looks."""
    plane = make_plane([[0, 0], [33.0, 0]], [Body(np.array([[10.0, 0.0]]), 1.0)])
    box = np.array([[[0.0, 0.0], [0.0, 0.0]], [[np.pi, np.pi], [0.0, 0.0]]])
    assert _clear(plane.arms, 0, 1, 1.0 - 1e-8, padded(box, 9))
    assert not _clear(plane.arms, 0, 1, 1.0 - 1e-10, padded(box, 9))
    assert not _clear(plane.arms, 0, 1, np.nan, padded(box, 9))


def test_whoever_is_nearer_than_the_margin_by_half_a_nanometre_is_looked_at():
    """Two that stretch out towards each other: the pair list holds who would come so near by full reach only."""
    plane = make_plane([[0, 0], [33.0, 0]], [Body(np.array([[10.0, 0.0]]), 1.0)])
    at = np.array([[0.0, 0.0], [np.pi, 0.0]])
    for margin, count in ((1.0 + 5e-7, 1), (1.0 - 1e-5, 0)):
        assert len(contacts_at_any_speed(plane, at, at, margin, np.zeros(2))) == count


def test_boxes_in_which_nothing_moves_by_five_micrometres_are_not_halved():
    """A tip turns past a post: boxes of 9 micrometres are halved, of which one is clear with 5.5 to spare, not 4."""
    assert FLOOR == 0.005
    plane = make_plane([0, 0], [Body(np.array([[10.0, 0.0]]), 1.0)], [Obstacle("post", [[19.0, 0.0]], 1.0)])
    turn = np.array([[[0.009 * 2**6 / 15, 0.0], [0.0, 0.0]]])
    for spare, clear in ((5.5e-3, True), (4e-3, False)):
        found, gap = clear_at_any_speed(plane, np.array([[0, 1]]), -turn, turn, 2.0 - spare, np.zeros(1))
        assert found.tolist() == [clear]
        assert gap[0] == (np.inf if clear else pytest.approx(2.0, abs=1e-3))
