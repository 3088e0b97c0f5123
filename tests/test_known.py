"""A proof that takes over what another one says: the same findings, and only what moves otherwise is looked at."""

import dataclasses

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates import safety
from fiberplan.motion import Trajectory

MARGIN = 0.3


@pytest.fixture(scope="module")
def plane():
    post = fp.Obstacle("post", [[11.0, 4.0]], 1.0)
    return fp.FocalPlane.hexagonal(2, 22.4).replace(obstacles=(post,))


def turned(plane, at, who=None, by=0.0):
    """Everybody turns alpha by as much, and beta out and back; one of them turns out `by` more."""
    knots = np.tile(plane.folded[:, None], (1, 3, 1))
    knots[:, 1:, 0] += at
    knots[:, 1, 1] -= 1.2
    if who is not None:
        knots[who, 1, 1] -= by
    return Trajectory.from_samples(np.array([0.0, 3.0, 6.0]), knots.swapaxes(0, 1))


@pytest.fixture
def asked(monkeypatch):
    """The pairs that are looked at, call by call."""
    calls, judge = [], safety.judge

    def noting(arms, path, pairs, *rest):
        calls.append({tuple(pair) for pair in pairs.tolist()})
        return judge(arms, path, pairs, *rest)

    monkeypatch.setattr(safety, "judge", noting)
    return calls


def the_same(one, other):
    """Whether two proofs find the same."""
    return (
        np.array_equal(one.clearance, other.clearance)
        and np.array_equal(one.obstacle_clearance, other.obstacle_clearance)
        and (one.contacts, one.undecided, one.violations) == (other.contacts, other.undecided, other.violations)
    )


@pytest.mark.parametrize("jitter", [0.0, 0.05])
def test_only_those_who_move_otherwise_are_looked_at(plane, asked, jitter):
    before = fp.verify(plane, turned(plane, 0.3), MARGIN, jitter)
    assert before.ok
    for who, by in ((0, 0.2), (7, 0.5), (9, 1.8), (9, -0.4)):
        motion = turned(plane, 0.3, who, by)
        afresh = fp.verify(plane, motion, MARGIN, jitter)
        asked.clear()
        assert the_same(fp.verify(plane, motion, MARGIN, jitter, known=before), afresh)
        assert asked[0] == {tuple(pair) for pair in plane.arm_pairs_within(MARGIN).tolist() if who in pair}
    assert not afresh.contacts
    assert fp.verify(plane, turned(plane, 0.3, 9, 1.8), MARGIN, jitter, known=before).contacts


def test_pairs_in_contact_are_looked_at_again_and_found_again(plane, asked):
    touching = turned(plane, 0.3, 9, 1.8)
    before = fp.verify(plane, touching, MARGIN)
    asked.clear()
    again = fp.verify(plane, touching, MARGIN, known=before)
    assert the_same(again, before)
    assert asked[0] == {tuple(map(plane.arm, contact.pair)) for contact in before.contacts}


def test_a_longer_motion_of_somebody_else_changes_nothing(plane, asked):
    short, late = turned(plane, 0.3), turned(plane, 0.3)
    own = slice(*late.offsets[4:6])
    times = np.array(late.times)
    times[own] = [0.0, 5.0, 9.0]
    late = Trajectory(late.offsets, times, late.angles)
    before = fp.verify(plane, short, MARGIN)
    asked.clear()
    again, afresh = (fp.verify(plane, late, MARGIN, known=known) for known in (before, None))
    assert len(asked[0]) < len(asked[1]) / 3
    assert again.ok
    assert afresh.ok
    near = [np.minimum(proof.clearance, MARGIN + safety.CAP) for proof in (again, afresh)]  # beyond, bounds are loose
    np.testing.assert_allclose(*near, atol=2 * safety.TOLERANCE)


def test_a_knot_more_is_another_motion(plane, asked):
    motion = turned(plane, 0.3)
    before = fp.verify(plane, motion, MARGIN)
    knots = [motion.knots(i) for i in range(plane.n)]
    knots[3] = (np.insert(knots[3][0], 1, 1.0), np.insert(knots[3][1], 1, knots[3][1][0], axis=0))
    offsets = np.cumsum([0, *(len(times) for times, _ in knots)])
    other = Trajectory(offsets, *(np.concatenate([each[k] for each in knots]) for k in (0, 1)))
    asked.clear()
    fp.verify(plane, other, MARGIN, known=before)
    assert {arm for pair in asked[0] for arm in pair} == {3} | {
        arm for pair in plane.arm_pairs_within(MARGIN).tolist() if 3 in pair for arm in pair
    }
    assert all(3 in pair for pair in asked[0])


def test_what_is_asked_otherwise_is_not_taken_over(plane, asked):
    motion = turned(plane, 0.3)
    before = fp.verify(plane, motion, MARGIN)
    thicker = plane.thicker(np.append(np.zeros(plane.n - 1), 0.1))
    moved = plane.replace(obstacles=(fp.Obstacle("post", [[11.0, 4.1]], 1.0),))
    record = dataclasses.replace(before, subject=None)
    for other, known, settings in (
        (plane, before, {"margin": 0.2}),
        (plane, before, {"margin": MARGIN, "jitter": 0.01}),
        (thicker, before, {"margin": MARGIN}),
        (moved, before, {"margin": MARGIN}),
        (plane, record, {"margin": MARGIN}),
    ):
        asked.clear()
        fp.verify(other, motion, **settings, known=known)
        fp.verify(other, motion, **settings)
        assert asked[0] == asked[1]
    asked.clear()
    fp.verify(plane, motion, MARGIN, position_error=np.append(0.01, np.zeros(plane.n - 1)), known=before)
    assert asked[0] == {pair for pair in asked[0] if 0 in pair} != set()
