"""Which boxes and which pairs a replay looks at when it asks for contact all over a box of joint space."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from fiberplan.certificates import replay_contact as contact
from fiberplan.certificates.replay_contact import Barrier
from replay_arms import scene, shape

pytestmark = pytest.mark.small


@pytest.mark.parametrize("at_end", [False, True])
def test_every_pair_that_can_prove_it_is_looked_at_once(monkeypatch, at_end):
    """Who turns, who never moves, and at the end who has a goal to be at; all others may be anywhere."""
    claims = scene([[]] * 3, [shape(0, [0j])] * 2)
    claims.place = np.concatenate([claims.place, claims.place])
    claims.n, claims.arms = 6, [*[[]] * 6, *claims.arms[3:]]
    claims.base = np.array([0, 10, 20, 30, 10j, 40.0j])
    claims.reach = np.array([25.0, 15.0, 20.0, 4.0, 20.0, 15.0])  # the first and the last just reach each other
    claims.online = np.array([True, True, True, False, True, False])
    claims.knots = [np.array([[0.0, 0.1 * k, 0.2 * k], [1.0, 9.0, 9.0]]) for k in range(6)]
    barrier = Barrier([2, 0, 4], {0: (7.0, 7.0), 1: (0.5, 0.6)}, "")
    low, middle, high = [0.1, 0.2, 0.3, 0.4, 0.1, 0.3], [0.2, 0.7, 0.3, 0.8, 0.3, 0.4], [0.7, 0.9, 1.0, 0.8, 0.4, 0.7]
    made, looked = {}, []

    class Seen:
        def __init__(self, _, arm, joints, half):
            assert arm not in made or made[arm] == (joints, half)
            self.arm, made[arm] = arm, (joints, half)

    monkeypatch.setattr(contact, "_Arm", Seen)
    monkeypatch.setattr(contact, "_meets", lambda _, one, other: looked.append((one.arm, other.arm)))
    assert not contact._touches(claims, barrier, low, middle, high, at_end)
    expected = {(0, 2), (0, 4), (2, 4), (0, 5), (2, 3), (4, 5)} | {(i, j) for i in (0, 2, 4) for j in (6, 7)}
    expected |= {(0, 1), (2, 1), (4, 1)} if at_end else set()
    assert sorted(looked) == sorted(expected)
    still = {3: [0.1 * 3, 0.2 * 3], 5: [0.5, 1.0], 6: [0.0, 0.0], 7: [0.0, 0.0]} | ({1: [0.5, 0.6]} if at_end else {})
    assert made == {k: made[k] for k in barrier.turns} | {k: (q, [0.0, 0.0]) for k, q in still.items()}
    for arm, own in ((2, slice(0, 2)), (0, slice(2, 4)), (4, slice(4, 6))):
        assert made[arm][0] == middle[own]
        for a, m, b, half in zip(low[own], middle[own], high[own], made[arm][1], strict=True):
            needed = max(Fraction(m) - Fraction(a), Fraction(b) - Fraction(m))
            assert needed < Fraction(half) < needed * Fraction(1 + 1e-14)
    monkeypatch.setattr(contact, "_meets", lambda _, one, other: other.arm == 7)
    assert contact._touches(claims, barrier, low, middle, high, at_end)


def test_boxes_are_halved_until_all_is_shown(monkeypatch):
    """Along the longest side each; the boxes that are shown are the whole of it."""
    shown = []

    def small(claims, barrier, low, middle, high, at_end):
        assert (claims, barrier, at_end) == ("claims", "barrier", True)
        assert middle == [(a + b) / 2 for a, b in zip(low, high, strict=True)]
        sides = np.subtract(high, low)
        assert sides.max() / sides.min() <= 2
        if sides.max() > 0.3:
            return False
        shown.append((low, high))
        return True

    monkeypatch.setattr(contact, "_touches", small)
    assert contact.is_blocked("claims", "barrier", [0.0, 1.0, -1.0], [1.0, 2.0, 0.0], True)
    assert len(shown) == 64
    covered = {tuple(low) for low, _ in shown}
    assert covered == set(product((0.0, 0.25, 0.5, 0.75), (1.0, 1.25, 1.5, 1.75), (-1.0, -0.75, -0.5, -0.25)))
    assert all((np.subtract(high, low) == 0.25).all() for low, high in shown)


def test_halving_ends_at_floats_and_at_a_count(monkeypatch):
    looks = []

    def by_width(width):
        looks.clear()
        monkeypatch.setattr(contact, "_touches", lambda *box: looks.append(box) or box[4][0] - box[2][0] <= width)
        return contact.is_blocked(None, None, [0.0], [1.0], False)

    assert by_width(1.0)
    assert len(looks) == 1
    assert by_width(1 / 1024)
    assert not by_width(1 / 2048)
    assert len(looks) == 4000
    looks.clear()
    monkeypatch.setattr(contact, "_touches", lambda *box: looks.append(box))
    assert not contact.is_blocked(None, None, [1.0], [np.nextafter(1.0, 2.0)], False)
    assert len(looks) == 1
