"""What `verify` says of motions of a few arms, against sampling and plain arithmetic, with the compiler off."""

import dataclasses
import itertools

import numpy as np
import pytest

from fiberplan.certificates import Certificate, Contact, verify
from fiberplan.certificates.violations import _worst
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.motion import Trajectory
from references import clearance_over_time, first_below, four_bar_plane, make_plane, motion_of, smallest_over_time

TIP = Body(np.array([[10.0, 0.0]]), 1.0)
DEG = np.pi / 180.0


def facing(gap, **others):
    """Two tips, 15 mm from their bases, so far apart at rest."""
    return make_plane([[0, 0], [32.0 + gap, 0]], [TIP], **others)


FACING = Trajectory.at_rest(np.array([[0.0, 0.0], [np.pi, 0.0]]))


def test_contacts_are_those_of_sampling():
    rng, touched = np.random.default_rng(0), 0
    for _ in range(5):
        plane = make_plane(
            rng.uniform(-13, 13, (3, 2)),
            [Body(np.array([[2.0, 0.0], [10.0, 0.0]]), 1.0)],
            [Obstacle("post", rng.uniform(-15, 15, (1, 2)), 1.0)],
            max_speed=99.0,
        )
        knots = [
            np.column_stack([[0.0, 1.0, 2.0], rng.uniform(-3, 3, 2) + rng.normal(0, 0.5, (3, 2)).cumsum(axis=0)])
            for _ in range(3)
        ]
        motion, margin = motion_of(*knots), 0.4
        found = verify(plane, motion, margin)
        contacts = {c.pair: c for c in found.contacts}
        proven = {tuple(p): c for p, c in zip(found.pairs.tolist(), found.clearance, strict=True)}
        proven |= {
            (i, -1 - k): c for (i, k), c in zip(found.obstacle_pairs.tolist(), found.obstacle_clearance, strict=True)
        }
        for i, j in itertools.combinations(range(4), 2):
            name = (i, j if j < 3 else -1)
            smallest, _ = smallest_over_time(plane, motion, i, j, 300)
            assert (name in contacts) == (smallest < margin)
            if name in contacts:
                touched += 1
                expected = first_below(plane, motion, i, j, margin, 300)
                assert contacts[name].time == pytest.approx(expected, abs=2e-3)
                assert smallest - 1e-4 <= contacts[name].clearance <= smallest + 0.01 + 1e-6
            if name in proven:
                assert proven[name] <= smallest + 1e-9
                assert proven[name] >= min(smallest, margin + 2.0) - 0.01 - 1e-6
            else:
                assert smallest >= margin
        assert found.ok == (not contacts)
        assert list(found.contacts) == sorted(found.contacts, key=lambda c: (c.time, c.pair))
        assert not any((found.undecided, found.violations, found.resting, found.zones, found.opening))
    assert touched > 2


def test_margins_and_errors_add_up():
    assert verify(facing(1.0), FACING, 0.99).ok
    assert not verify(facing(1.0), FACING, 1.01).ok
    assert verify(facing(1.0), FACING).ok
    assert not verify(facing(-0.1), FACING).ok
    assert verify(facing(1.0), FACING, position_error=0.49).ok
    assert not verify(facing(1.0), FACING, position_error=0.51).ok
    assert verify(facing(1.0), FACING, position_error=np.array([0.9, 0.05])).ok
    assert not verify(facing(1.0), FACING, position_error=np.array([0.9, 0.2])).ok
    post = facing(1.0, obstacles=[Obstacle("post", [[18.0, 0.0]], 0.9)])
    found = verify(
        post, Trajectory.at_rest(np.array([[0.0, 0.0], [0.0, 0.0]])), 0.5, position_error=np.array([0.7, 0.2])
    )
    assert [c.pair for c in found.contacts] == [(0, -1)]
    assert found.contacts[0].clearance == pytest.approx(0.4)
    assert found.obstacle_pairs.tolist() == [[0, 0], [1, 0]]
    assert found.obstacle_clearance[0] == pytest.approx(0.4, abs=1e-6)
    assert found.position_error == 0.7
    assert (found.margin, found.jitter) == (0.5, 0.0)
    away = motion_of([(0, 0.0, 0.0), (1, 1.0, 0.0)], [(0, np.pi, 0.0)])
    assert verify(facing(1.0, max_speed=2.0), away, jitter=0.5).ok  # clocks do not matter beside one that stands
    after = motion_of([(0, 0.6, 0.0), (1, 0.6, 0.0), (2, 0.0, 0.0)], [(0, np.pi, 0.0), (0.9, np.pi + 0.6, 0.0)])
    assert verify(facing(-0.1, max_speed=2.0), after, jitter=0.1).ok
    assert not verify(facing(-0.1, max_speed=2.0), after, jitter=1.0).ok


def test_pairs_are_those_that_clocks_and_errors_can_bring_near():
    """Tips 3 mm apart at full stretch, one of which turns at 15 mm/s: clocks that are off take from both."""
    plane, motion = facing(3.0), motion_of([(0, 0.0, 0.0), (1, 1.0, 0.0)], [(0, np.pi, 0.0)])
    for given, listed in (
        ({"jitter": 0.11}, True), ({"jitter": 0.09}, False), ({"margin": 3.1}, True), ({"margin": 2.9}, False),
        ({"position_error": 1.6}, True), ({"position_error": 1.4}, False),
        ({"margin": 1.0, "jitter": 0.03, "position_error": 0.6}, True),
        ({"margin": 1.0, "jitter": 0.03, "position_error": 0.5}, False),
    ):  # fmt: skip
        assert len(verify(plane, motion, **given).pairs) == listed


def test_far_from_the_origin_rounding_counts():
    """At 3,000 km units in the last place are half a micrometre: what is within a few of them is not safe."""
    for gap, safe in ((4e-6, False), (1e-3, True)):
        plane = facing(gap)
        assert verify(plane.replace(base=plane.base + 3e9), FACING).ok == safe
        assert verify(plane, FACING).ok


def test_refusals():
    for given in (
        {"margin": -1.0}, {"margin": np.nan}, {"jitter": -1.0}, {"jitter": np.inf}, {"position_error": -1.0},
        {"position_error": np.nan}, {"position_error": np.array([0.1, 0.1, 0.1])},
    ):  # fmt: skip
        with pytest.raises(TrajectoryError):
            verify(facing(1.0), FACING, **given)
    with pytest.raises(TrajectoryError, match="1 positioners, the focal plane 2"):
        verify(facing(1.0), Trajectory.at_rest(np.zeros((1, 2))))


def test_who_cannot_move_is_reported_only():
    online = np.array([False, False])
    found = verify(facing(-0.5).replace(online=online), FACING)
    assert found.ok
    assert [c.pair for c in found.resting] == [(0, 1)]
    assert not found.contacts
    for one in ([True, False], [False, True]):
        found = verify(facing(-0.5).replace(online=np.array(one)), FACING)
        assert not found.ok
        assert not found.resting
        assert [c.pair for c in found.contacts] == [(0, 1)]
    post = make_plane([0, 0], [TIP], [Obstacle("post", [[15.0, 0.0]], 1.0)], online=np.array([False]))
    assert [c.pair for c in verify(post, Trajectory.at_rest(np.zeros((1, 2)))).resting] == [(0, -1)]


def test_equality_is_undecided():
    found = verify(facing(0.0), FACING)
    assert not found.ok
    assert [c.pair for c in found.undecided] == [(0, 1)]
    assert str(found) == "not safe: 1 undecided pairs"


def test_opening_is_no_failure_if_asked_for():
    motion = motion_of([(0, 0.0, 0.0), (1, 1.0, 0.0)], [(0, np.pi, 0.0)])
    assert not verify(facing(-0.5), motion.reversed(), 0.3).ok
    found = verify(facing(-0.5), motion, 0.3, opening=True)
    assert found.ok
    ((pair, clearance, time),) = [(o.pair, o.clearance, o.time) for o in found.opening]
    assert pair == (0, 1)
    assert clearance == pytest.approx(-0.5, abs=1e-9)
    assert 0.0 < time < 0.5
    assert clearance_over_time(facing(-0.5), motion, 0, 1, np.array([time]))[0] >= 0.3 - 1e-9
    assert found.clearance[0] == pytest.approx(-0.5 - 1e-6, abs=1e-9)
    assert "; 1 begin nearer and only come apart" in str(found)
    assert not verify(facing(-0.5), motion.reversed(), 0.3, opening=True).ok
    assert verify(facing(-0.5).replace(online=np.array([False, False])), FACING, 0.3, opening=True).opening == ()
    post = make_plane([0, 0], [TIP], [Obstacle("post", [[16.5, 0.0]], 1.0)])
    away = verify(post, motion_of([(0, 0.0, 0.0), (1, 1.0, 0.0)]), opening=True)
    assert away.ok
    assert away.opening[0].pair == (0, -1)


def test_ranges_speeds_and_who_is_offline():
    plane = make_plane([0, 0], [TIP], lower=np.array([[-1.0, -2.0]]), upper=np.array([[1.0, 2.0]]), max_speed=0.5)

    def said(*knots, plane=plane, **others):
        return verify(plane, motion_of(knots), **others).violations

    assert said((0, 0, 0), (2, 1.0, -1.0)) == ()
    assert said((0, 0, 0), (4, 1.0 + 5e-10, -2.0 - 5e-10)) == ()
    (text,) = said((0, 0, 0), (4, 1.1, 0.0), (5, 1.2, 0.0), (6, 1.15, 0.0))
    assert text == "positioner 'P0': alpha 68.7549 deg at 5.000 s is outside -57.2958 to 57.2958 deg"
    (text,) = said((0, 0, 0), (6, 0.0, -2.1))
    assert text == "positioner 'P0': beta -120.321 deg at 6.000 s is outside -114.592 to 114.592 deg"
    (text,) = said((0, 0, 0), (1, 0.51, 0.0), (2, 0.0, 0.0), (4, 0.0, 0.6))
    assert text == f"positioner 'P0': alpha moves at {0.51 / DEG:.9g} deg/s from 0.000 s, limit {0.5 / DEG:.9g} deg/s"
    (text,) = said((0, 0, 0), (2, 0.5, 1.0), (3, 0.5, 0.4))
    assert text == f"positioner 'P0': beta moves at {0.6 / DEG:.9g} deg/s from 2.000 s, limit {0.5 / DEG:.9g} deg/s"
    offline = plane.replace(online=np.array([False]))
    assert said((0, 1.5, 0), (1, 1.5, 0), plane=offline) == ()
    (text,) = said((0, 0, 0), (1, 0, 0), (2, 0, 1e-9), plane=offline)
    assert text == "positioner 'P0' is offline but its beta moves from 1.000 s"
    assert "1 violations" in str(verify(plane, motion_of([(0, 0, 0), (1, 0.6, 0)])))


def test_joints_that_come_back_into_range():
    plane = make_plane([0, 0], [TIP], lower=np.array([[-1.0, -2.0]]), upper=np.array([[1.0, 2.0]]))

    def back(*alphas):
        return not verify(plane, motion_of([(k, a, 0.0) for k, a in enumerate(alphas)]), opening=True).violations

    assert back(1.005, 1.0, 0.5)
    assert back(1.005, 1.005, 1.002, 0.9)
    assert back(1.005, 1.004)  # not yet back, but no farther out
    assert back(-1.005, -0.5)
    assert not back(1.005, 1.006, 0.9)
    assert not back(1.005, 0.9, 1.005)
    assert not back(1.009, 0.9)  # more than half a degree
    assert not back(0.9, 1.005, 0.9)
    assert not verify(plane, motion_of([(0, 1.005, 0.0), (1, 0.5, 0.0)])).ok


def test_the_worst_of_each_joint():
    excess = np.array([[0.1, 0.0], [0.3, np.nan], [0.2, 0.5], [0.9, 0.0], [-1.0, 0.0]])
    owner = np.array([0, 0, 0, 1, 1])
    assert sorted(_worst(excess, 0.05, owner))[0] == (0, 1, 0)
    assert [(i, joint) for i, _, joint in _worst(excess, 0.05, owner)] == [(0, 0), (0, 1), (1, 0)]


def test_zones_of_avoidance_are_entered_by_time():
    plane = four_bar_plane(np.random.default_rng(1), n=3, shortest=(5.0, 9.0), longest=(24.0, 35.0))
    plane = plane.replace(bodies=(), max_speed=np.full((3, 2), 99.0))
    motion = motion_of(*[[(0.0, *q), (4.0, *(q + [3.0, 3.0]))] for q in plane.folded])
    found = verify(plane, motion)
    assert len(found.zones) > 1
    assert not found.ok
    assert [z.time for z in found.zones] == sorted(z.time for z in found.zones)
    assert f"{len(found.zones)} zones of avoidance entered" in str(found)
    assert "no bodies: nothing can touch" in found.assumptions
    first = found.zones[0]
    online = np.arange(3) != first.positioner
    assert first.positioner not in [z.positioner for z in verify(plane.replace(online=online), motion).zones]


def test_certificates_in_words():
    assert verify(facing(1.0), FACING).assumptions == ()
    upright = Trajectory.at_rest(np.array([[np.pi / 2, 0.0], [np.pi / 2, 0.0]]))
    safe = verify(facing(1.2345 - 30.0), upright, 1.2)
    assert str(safe) == "safe: smallest proven clearance 1.234 mm (margin 1.2 mm, 1 pairs)"
    assert repr(safe) == f"<Certificate: {safe}>"
    assert "nothing is within reach" in str(verify(facing(500.0), FACING))
    post = facing(1.0, obstacles=[Obstacle("post", [[15.0, 2.95]], 1.0)])
    assert verify(post, FACING, 0.9).smallest == pytest.approx(0.95, abs=1e-6)
    both = facing(-20.0, obstacles=[Obstacle("post", [[2.5, 15.0]], 1.0)])
    assert str(verify(both, upright, 0.4)).endswith("2 pairs)")
    contact = Contact((0, 1), 0.0, 0.0)
    plain = Certificate(0.0, 0.0, 0.0, np.empty((0, 2)), np.empty(0), np.empty((0, 2)), np.empty(0))
    assert plain.ok
    assert plain.smallest == np.inf
    for name, value in (("contacts", contact), ("undecided", contact), ("violations", "text"), ("zones", contact)):
        assert not dataclasses.replace(plain, **{name: (value,)}).ok
    assert dataclasses.replace(plain, resting=(contact,)).ok
