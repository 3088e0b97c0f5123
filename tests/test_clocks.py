"""Clocks that are off: the clearance at all pairs of moments within their reach, against a dense grid of them."""

import numpy as np
import pytest

from fiberplan.certificates import verify
from fiberplan.certificates.clocks import at_any_moments, box_bound, judge_clocks
from fiberplan.certificates.path import as_motion
from fiberplan.focal_plane.bodies import Body
from references import make_plane, motion_of, sampled_clearance

TIP = Body(np.array([[10.0, 0.0]]), 1.0)


def side_by_side(gap, *knots):
    """Two tips 10 mm from their bases, so far apart at rest, each on a path of its own."""
    return make_plane([[0, 0], [2.0 + gap, 0]], [TIP], length=0.0, max_speed=1e3), motion_of(*knots)


def worst_of(plane, motion, jitter, count=400):
    """Smallest clearance at moments c + d and c - d, on a grid."""
    c, d = np.meshgrid(np.linspace(-jitter, motion.duration + jitter, count), np.linspace(-jitter, jitter, 21))
    at = [motion.sampled(moments.ravel())[k] for k, moments in enumerate((c + d, c - d))]
    return sampled_clearance(plane, 0, 1, *at).min()


APART = ([(0, 1.57, 0), (1, 3.0, 0)], [(0, 1.57, 0), (1, 0.1, 0)])
BEHIND = ([(0, 1.27, 0), (0.6, 1.87, 0)],) * 2
ALONG = ([(0, -0.3, 0), (0.6, 0.3, 0)], [(0, -0.3, 0), (0.6, 0.3, 0)])


@pytest.mark.small
@pytest.mark.parametrize(("knots", "lost"), [(APART, 0.0), pytest.param(ALONG, 0.09, marks=pytest.mark.large)])
def test_what_comes_apart_or_goes_along_loses_little(knots, lost):
    """At 10 mm/s a clock that is off by 0.05 s takes 0.5 mm of each, if it goes straight for the other."""
    plane, motion = side_by_side(0.6, *knots)
    proof = verify(plane, motion, 0.3, jitter=0.05)
    assert proof.ok
    assert 0.3 <= proof.smallest <= worst_of(plane, motion, 0.05) <= 0.6 - lost + 0.001
    assert not verify(plane, motion, 0.6 - lost + 0.01, jitter=0.05).ok


def test_one_behind_the_other_loses_all_of_it():
    """Both at 10 mm/s along x, where the tips are: 20 sin(tau) is lost between them."""
    plane, motion = side_by_side(1.2, *BEHIND)
    limit = float(np.arcsin(1.2 / 20.0))
    assert verify(plane, motion, jitter=limit - 1e-4).ok
    late = verify(plane, motion, jitter=limit + 1e-3)
    (contact,) = late.contacts
    assert -0.03 < contact.clearance < 0


@pytest.mark.small
@pytest.mark.parametrize(("knots", "clear"), [(APART, True), (BEHIND, False)])
def test_paths_that_are_apart_at_any_two_moments(knots, clear):
    """Who follows another is safe as timed, not if either is anywhere on its path."""
    plane, motion = side_by_side(0.6, *knots)
    path, pairs, errors = as_motion(plane.arms, motion), np.array([[0, 1]]), np.zeros(2)
    assert verify(plane, motion, 0.3).ok
    assert at_any_moments(plane.arms, path, pairs, errors, 0.3, 4000).tolist() == [clear]
    assert not at_any_moments(plane.arms, path, pairs, errors, 0.3, 0)[0]


def test_bounds_hold_for_boxes_and_motions_of_all_kinds():
    rng, pairs, errors = np.random.default_rng(1), np.array([[0, 1]]), np.array([0.1, 0.05])
    near = 0
    for _ in range(30):
        plane = make_plane([[0, 0], rng.uniform(8, 20, 2)], [Body(rng.uniform(-2, 10, (2, 2)), 0.5)], max_speed=1e3)
        times = np.cumsum(rng.uniform(0.1, 1.0, (2, 4)), axis=1)
        angles = np.cumsum(rng.normal(0.0, 0.5, (2, 4, 2)), axis=1)
        motion = motion_of(*[np.column_stack([t, a]).tolist() for t, a in zip(times, angles, strict=True)])
        path, jitter = as_motion(plane.arms, motion), float(rng.choice([0.01, 0.2]))
        seen = worst_of(plane, motion, jitter) - 0.15
        low, high = judge_clocks(plane.arms, path, pairs, errors, 0.2, jitter, 0.01, 5.0)[0]
        assert low <= high + 1e-12
        assert low <= seen + 1e-9
        assert high - low <= 0.0101 or low >= 5.0 - 0.01 or low == -np.inf
        near += 0 < low < 5.0
        box = np.sort(rng.uniform(0, motion.duration, 2)).tolist(), np.sort(rng.uniform(-jitter, jitter, 2)).tolist()
        _, bound = box_bound(plane.arms, path, 0, 1, *box[0], *box[1], 0.15)
        c, d = rng.uniform(*box[0], 200), rng.uniform(*box[1], 200)
        at = [motion.sampled(moments)[k] for k, moments in enumerate((c + d, c - d))]
        assert bound <= sampled_clearance(plane, 0, 1, *at).min() - 0.15 + 1e-9
    assert near > 5


def test_at_any_two_moments_against_all_of_them():
    """What is shown holds on a grid of moments of both; a pair that meets at some is never shown, nor without looks."""
    rng, pairs, errors = np.random.default_rng(2), np.array([[0, 1]]), np.array([0.1, 0.05])
    seen = {True: 0, False: 0}
    for _ in range(20):
        plane = make_plane([[0, 0], rng.uniform(4, 14, 2)], [Body(rng.uniform(-2, 10, (2, 2)), 0.5)], max_speed=1e3)
        angles = np.cumsum(rng.normal(0.0, 0.6, (2, 4, 2)), axis=1)
        motion = motion_of(*(np.column_stack([[0.0, 1.0, 1.5, 4.0], own]).tolist() for own in angles))
        path = as_motion(plane.arms, motion)
        (shown,) = at_any_moments(plane.arms, path, pairs, errors, 0.2, 4000)
        moments = np.linspace(0.0, 4.0, 40)
        first, second = (
            own.repeat(40, axis=0) if k == 0 else np.tile(own, (40, 1)) for k, own in enumerate(motion.sampled(moments))
        )
        worst = sampled_clearance(plane, 0, 1, first, second).min() - 0.15
        seen[bool(shown)] += 1
        assert not (shown and worst < 0.2)
        assert shown or worst < 0.7
        assert not at_any_moments(plane.arms, path, pairs, errors, 0.2, 0)[0]
    assert min(seen.values()) > 3
