"""Contacts of many motions, and clearances part by part, against dense sampling, with the compiler off."""

import itertools

import numpy as np
import pytest

from fiberplan.certificates.over_time import clearance_over_time
from fiberplan.certificates.safety import CAP, TOLERANCE
from fiberplan.certificates.touching import Touching
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane.bodies import Body, Obstacle
from references import clearance_over_time as sampled_over_time
from references import first_below, make_plane, motion_of, smallest_over_time

TIP = Body(np.array([[10.0, 0.0]]), 1.0)


def crowd(rng):
    """Three arms and two posts, and a motion of all arms."""
    posts = [Obstacle(name, rng.uniform(-15, 15, (1, 2)), 1.0) for name in ("post", "pole")]
    plane = make_plane(rng.uniform(-13, 13, (3, 2)), [Body(np.array([[2.0, 0.0], [10.0, 0.0]]), 1.0)], posts)
    return plane, motion_of(
        *(
            np.column_stack([[0.0, 1.0, 2.0], rng.uniform(-3, 3, 2) + rng.normal(0, 0.5, (3, 2)).cumsum(axis=0)])
            for _ in range(3)
        )
    )


def public(k):
    return k if k < 3 else 2 - k


def test_contacts_are_those_of_sampling():
    rng, touched = np.random.default_rng(0), 0
    for _ in range(3):
        plane, motion = crowd(rng)
        found = Touching(plane, 0.4).contacts(motion)
        assert list(found) == sorted(found, key=lambda contact: (contact.time, contact.pair))
        contacts = {contact.pair: contact for contact in found}
        for i, j in itertools.combinations(range(5), 2):
            smallest, _ = smallest_over_time(plane, motion, i, j, 300)
            name = public(i), public(j)
            assert (name in contacts) == (smallest < 0.4 and i < 3)
            if name in contacts:
                touched += 1
                expected = first_below(plane, motion, i, j, 0.4, 300)
                assert contacts[name].time == pytest.approx(expected, abs=2e-3)
                assert smallest - 1e-4 <= contacts[name].clearance <= smallest + 0.01 + 1e-6
    assert touched > 2


def test_two_of_which_neither_moves_do_not_touch():
    """A joint that turns and comes back moves; who may come near by full stretch only is looked at."""
    plane = make_plane([[0, 0], [33.0, 0], [0, 60.0]], [TIP], [Obstacle("post", [[16.0, 0.0]], 1.0)])
    rest = [(0, 0.0, 0.0)], [(0, np.pi, 0.0)], [(0, 0.0, 0.0)]
    assert Touching(plane, 1.1).contacts(motion_of(*rest)) == ()
    assert Touching(plane).margin == 0.0
    for turn, margin, pairs in (
        ([0.3, 0.0], 1.1, {(0, 1), (0, -1)}), ([0.0, 0.3], 1.0 + 5e-7, {(0, 1), (0, -1)}),
        ([0.3, 0.0], 1.0 - 1e-5, {(0, -1)}),
    ):  # fmt: skip
        motion = motion_of([(0, 0.0, 0.0), (1, *turn), (2, 0.0, 0.0)], *rest[1:])
        assert {contact.pair for contact in Touching(plane, margin).contacts(motion)} == pairs
    with pytest.raises(TrajectoryError, match="2 positioners, the focal plane 3"):
        Touching(plane).contacts(motion_of(*rest[:2]))
    with pytest.raises(TrajectoryError):
        Touching(plane, -0.1)


def test_bounds_hold_in_every_part_of_a_motion():
    rng, times = np.random.default_rng(1), np.array([0.0, 0.4, 1.3, 2.0])
    for online in ([True, True, True], [False, True, False]):
        plane, motion = crowd(rng)
        plane, errors = plane.replace(online=np.array(online)), np.array([0.1, 0.2, 0.0])
        found = clearance_over_time(plane, motion, times, 0.4, errors)
        assert (found.times == times).all()
        pairs = [tuple(pair) for pair in found.pairs.tolist()]
        assert found.clearance.shape == (3, len(pairs))
        moves = [*online, False, False]
        for i, j in itertools.combinations(range(5), 2):
            if not (moves[i] or moves[j]):
                assert (public(i), public(j)) not in pairs
                continue
            off = errors[i] + (errors[j] if j < 3 else 0.0)
            for part, (begin, end) in enumerate(itertools.pairwise(times)):
                seen = sampled_over_time(plane, motion, i, j, np.linspace(begin, end, 1500)).min() - off
                if (public(i), public(j)) not in pairs:
                    assert seen >= 0.4
                    continue
                low = found.clearance[part, pairs.index((public(i), public(j)))]
                assert low <= seen + 1e-9
                assert low >= min(seen, 0.4 + CAP) - TOLERANCE - 0.01
        some = clearance_over_time(plane, motion, times, 0.4, errors, pairs=found.pairs[[-1, 0]])
        assert (some.pairs == found.pairs[[-1, 0]]).all()
        assert (some.clearance == found.clearance[:, [-1, 0]]).all()


def test_parts_hold_all_pairs_that_may_come_within_the_margin():
    plane = make_plane([[0, 0], [33.0, 0]], [TIP], [Obstacle("post", [[0.0, -18.5]], 1.0)])
    motion = motion_of([(0, 1.0, 0.0), (1, 1.5, 0.0)], [(0, 1.0, 0.0)])
    for margin, error, pairs in (
        (1.0 + 5e-7, 0.0, [[0, 1]]), (1.0 - 1e-5, 0.0, []), (0.5, np.array([0.25 + 1e-6, 0.0]), [[0, 1]]),
        (0.5, 0.24, []), (1.6, 0.0, [[0, 1], [0, -1]]),
    ):  # fmt: skip
        assert clearance_over_time(plane, motion, [0.0, 1.0], margin, error).pairs.tolist() == pairs
    assert clearance_over_time(plane, motion, [0.0, 1.0]).pairs.tolist() == []
    with pytest.raises(TrajectoryError, match="2 positioners, the focal plane 1"):
        clearance_over_time(plane.subset(np.array([0])), motion, [0.0, 1.0])
