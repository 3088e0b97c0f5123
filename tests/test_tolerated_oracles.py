"""What a motion tolerates, and which guesses it needs, against plain arithmetic, with the compiler off."""

import numpy as np

from fiberplan.certificates import tolerated as module
from fiberplan.certificates.guesses import needed_guesses
from fiberplan.certificates.reactions import Stall
from fiberplan.certificates.tolerated import Subject, tolerated
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.motion import Trajectory
from references import make_plane, motion_of

TIP = Body(np.array([[10.0, 0.0]]), 1.0)


def shares(online, pairs, clearance):
    """(arm, other, by how much both may be off) of pairs of which one can move, both ways; obstacles are not off."""
    for (i, j), gap in zip(pairs.tolist(), clearance, strict=True):
        if online[i] or (j >= 0 and online[j]):
            share = max(gap, 0.0) / (2.0 if j >= 0 else 1.0)
            yield i, j, share
            if j >= 0:
                yield j, i, share


def test_room_is_that_beside_the_nearest(monkeypatch):
    rng = np.random.default_rng(0)
    posts = [Obstacle(f"post {k}", rng.uniform(-9, 9, (1, 2)), 1.0) for k in range(2)]
    for trial in range(12):
        online = rng.random(6) < 0.7
        plane = make_plane(rng.uniform(-50, 50, (6, 2)), [TIP], posts, online=online)
        every = np.array([(i, j) for i in range(6) for j in (-1, -2, *range(i + 1, 6))])
        pairs = every[rng.permutation(len(every))[: 9 * (trial > 0)]]
        clearance = rng.choice([-0.3, 0.2, 0.4, 0.9, 1.7, 2.5, 3.9, 4.1], len(pairs))
        seconds, jitter = rng.uniform(0.1, 0.5), rng.choice([0.0, 0.1, 0.3])
        monkeypatch.setattr(module, "reaction", lambda *given, late=seconds: Stall(late, 1.5, 2, 3))
        subject = Subject(plane, Trajectory.at_rest(np.zeros((6, 2))), np.zeros(6))
        found = tolerated(subject, jitter, pairs, clearance, 2.0)
        room, critical = np.full(6, 1.0), np.full(6, -3)
        for i, j, share in sorted(shares(online, pairs, clearance), key=lambda one: (one[2], one[1])):
            if share < room[i]:
                room[i], critical[i] = share, j
        np.testing.assert_array_equal(found.room, room)
        np.testing.assert_array_equal(found.critical, critical)
        assert found.position_error == room.min()
        left = max(0.0, seconds - 2 * jitter)
        assert (found.jitter, found.reaction) == (left / 2, Stall(left, 1.5, 2, 3))


def test_reactions_are_asked_for_with_the_errors_that_are_allowed(monkeypatch):
    """At no margin: what both may be off by is taken from what is there."""
    plane, motion = make_plane([[0, 0], [12.0, 0]], [TIP], length=0.0), motion_of([(0, 0, 0)], [(0, 2, 0)])
    asked = []
    monkeypatch.setattr(module, "reaction", lambda *given: asked.append(given) or Stall(np.inf, np.nan, -1, -1))
    subject = Subject(plane, motion, np.array([0.25, 0.5]))
    found = tolerated(subject, 0.1, np.array([[0, 1]]), np.array([0.5]), 2.0)
    assert found.jitter == np.inf
    ((where, what, errors),) = asked
    assert where is plane
    assert what is motion
    assert errors.tolist() == [0.25, 0.5]


def test_a_guess_is_needed_where_a_tip_comes_near_the_disc_of_the_unknown():
    """Tips 15 mm from their bases and 1 mm wide: an arm sweeps a disc of 16 mm, wherever it stands."""
    base = np.array([[0.0, 0.0], [40.0, 0.0], [0.0, 36.0], [-60.0, 0.0]])
    post = Obstacle("post", [[-30.0, -30.0]], 1.0)
    plane = make_plane(base, [TIP], [post], online=np.array([True, False, False, False]))
    who = np.array([2, 1, 3])
    for begin, end in ((0.4, 1.2),):
        motion = motion_of([(0, begin, 0.0), (1, end, 0.0)], *([(0, 3.0, 0.0)],) * 3)
        t = np.linspace(begin, end, 2000)
        tip = 15.0 * np.stack([np.cos(t), np.sin(t)], axis=1)
        for margin, error in ((4.5, 0.0), (7.0, np.array([1.5, 9.0, 9.0, 9.0]))):
            gaps = np.linalg.norm(tip[:, None] - base[who], axis=2) - 1.0 - 16.0 - np.broadcast_to(error, 4)[0]
            near = gaps.min(axis=0) < margin
            assert (np.abs(gaps.min(axis=0) - margin) > 0.05).all()
            assert needed_guesses(plane, motion, margin, who, error).tolist() == near.tolist(), (begin, margin)


def test_who_only_comes_apart_from_a_guess_still_needs_it():
    plane = make_plane([[0, 0], [36.0, 0]], [TIP], online=np.array([True, False]))
    away = motion_of([(0, 0.1, 0.0), (1, 1.5, 0.0)], [(0, 3.0, 0.0)])
    for margin, needed in ((5.0, True), (3.9, False)):
        assert needed_guesses(plane, away, margin, np.array([1])).tolist() == [needed]
    assert needed_guesses(plane, away, 5.0, np.array([], int)).shape == (0,)
