"""What a replay is made of: distances, halving, joints, places and speeds, and who could meet; without a plan."""

from fractions import Fraction
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from flint import acb, arb

from fiberplan.certificates import replay as replayed
from fiberplan.certificates.replay_outcomes import _upper, label
from replay_arms import PLACE, convex, geometry, scene, shape
from test_depth_oracles import reference

pytestmark = pytest.mark.small
KNOTS = np.array([[1.0, 0.4, -0.5], [3.0, 1.0, -0.5], [4.0, 0.7, 0.25]])
FOUR_BAR = [[3.0, 2.5, 0.0, 99.0, 0.2], [4.0, 2.0, 0.0, 99.0, -0.4]]  # spacing, rocker, range of the slider, lean


def number(ball):
    return complex(ball)


def moving(bars=False):
    """Two positioners that move by `KNOTS`, their bodies on each link, and a bar that stands."""
    bodies = [shape(0, [0j, 1.0], 0.1), shape(1, [0.0, 7.0 + 0.5j], 0.2), shape(2, [0.5j, 5.0, 3.0 - 1j], 0.3, True)]
    claims = scene([bodies, bodies], [shape(0, [-5 - 9j, 30 - 9j], 0.4)])
    claims.knots, claims.error = [KNOTS, KNOTS * [1.0, 1.2, 0.7]], np.array([0.05, 0.02, 0.0])
    claims.bar = np.array(FOUR_BAR) if bars else claims.bar
    return claims


def places(claims, arm, t):
    """(origin, direction) of each link of a positioner, of four-bar arms then (J3 to J4,)."""
    alpha, beta = (np.interp(t, claims.knots[arm][:, 0], claims.knots[arm][:, k]) for k in (1, 2))
    x, y, length, zero, other = PLACE[arm]
    base = x + 1j * y
    if not claims.bar.size:
        crank = np.exp(1j * (alpha + zero))
        return [(base, 1.0), (base, crank), (base + length * crank, np.exp(1j * (alpha + zero + beta + other)))]
    spacing, rocker, _, _, lean = FOUR_BAR[arm]
    elbow, pivot = base + length * np.exp(1j * (alpha + zero + lean)), base + spacing * np.exp(1j * lean)
    third = np.exp(1j * (np.pi + lean - other - beta))
    slide = pivot + rocker * third - elbow
    links = [(base, 1.0), (base, (elbow - base) / length), (elbow, slide / abs(slide)), (pivot, third)]
    return [*links, (slide,)]


@pytest.mark.parametrize("speeds", [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (-2.0, 0.5), (0.0, 0.0)])
def test_all_that_is_seen_over_an_interval_holds_what_is_seen_at_each_moment_of_it(speeds):
    claims = moving()
    claims.knots[0] = np.array([[0.0, 0.25, -0.5], [4.0, 0.25 + 4 * speeds[0], -0.5 + 4 * speeds[1]]])
    _, over = claims.seen(0, 2.0, 0.5)
    for t in (1.5, 1.75, 2.0, 2.5):
        now, _ = claims.seen(0, t, 0.0)
        for whole, part in zip(over, now, strict=True):
            assert all(a.overlaps(b) for a, b in zip(whole, part, strict=True))
            assert all(a.contains(type(b)(b.mid())) for a, b in zip(whole, part, strict=True) if a.rad() > 1e-9)


def test_distance_from_a_convex_part():
    rng = np.random.default_rng(8)
    points = rng.uniform(-8, 8, (60, 2)) @ (1, 1j)
    for k in (1, 2, 3, 4, 5):
        for turn in (1, -1):
            part = convex(rng, k)[::turn]
            own = [geometry(part).distance(shapely.Point(z.real, z.imag)) for z in points]
            np.testing.assert_allclose(replayed.away(points, part), own, atol=1e-9)
    twice = np.array([0, 4, 4 + 0j])  # a point told twice is no side
    assert replayed.away(np.array([2 + 3j, 8 - 3j]), twice) == pytest.approx([3.0, 5.0])


def test_an_outline_winds_around_what_is_within_it():
    rng = np.random.default_rng(8)
    star = [r * np.exp(1j * np.pi * k / 4) for k, r in enumerate([6, 2] * 4)]
    inside = []
    for z in rng.uniform(-6, 6, (60, 2)) @ (1, 1j):
        for outline in (star, star[::-1]):
            winds = replayed.winds([acb(w.real, w.imag) for w in outline], acb(z.real, z.imag))
            assert winds == geometry(np.array(outline)).contains(shapely.Point(z.real, z.imag))
            inside.append(winds)
    assert 0.1 < np.mean(inside) < 0.9


def test_halving_covers_all_that_is_not_shown():
    shown = {"a": [], "b": []}

    def look(m, h, todo):
        for name in todo:
            if h <= (0.3 if name == "a" else 0.1):
                shown[name].append((m, h))
        return [name for name in todo if h > (0.3 if name == "a" else 0.1)], []

    assert replayed.everywhere(1.0, 2.0, ["a", "b"], look)
    for name, count in (("a", 2), ("b", 8)):
        spans = sorted(shown[name])
        assert len(spans) == count
        ends = [1.0 + k / count for k in range(count + 1)]
        for (m, h), a, b in zip(spans, ends[:-1], ends[1:], strict=True):
            assert m == (a + b) / 2
            needed = max(Fraction(m) - Fraction(a), Fraction(b) - Fraction(m))
            assert needed < Fraction(h) < needed * (1 + Fraction(1, 10**14))


def test_halving_ends_with_what_is_false_or_cannot_be_halved_or_is_too_much():
    looks = []

    def by(width):
        return lambda m, h, todo: looks.append(m) or (todo if 2 * h > width * 1.001 else [], [])

    assert replayed.everywhere(0.0, 1.0, [0], by(2.0**-13))
    assert len(looks) == 2**14 - 1
    looks.clear()
    assert not replayed.everywhere(0.0, 1.0, [0], by(2.0**-14))
    assert len(looks) == 20_000
    assert not replayed.everywhere(0.0, 1.0, [0], lambda m, h, todo: ([], todo))
    looks.clear()
    for a, b in ((1.0, 1.0), (1.0, float(np.nextafter(1.0, 2.0)))):
        assert not replayed.everywhere(a, b, [0], by(0.0))
        assert replayed.everywhere(a, b, [0], by(9.0))
    assert set(looks) == {1.0}


def test_joints_are_straight_between_knots_and_stand_outside():
    claims = moving()
    for t in (0.0, 1.0, 1.5, 2.9, 3.0, 3.25, 4.0, 7.0):
        alpha, beta, va, vb = map(float, claims.joints(0, t))
        assert (alpha, beta) == pytest.approx([np.interp(t, KNOTS[:, 0], KNOTS[:, k]) for k in (1, 2)])
        assert (va, vb) == pytest.approx((0.3, 0.0) if 1 <= t < 3 else (-0.3, 0.75) if 3 <= t < 4 else (0.0, 0.0))
    assert [*map(float, claims.joints(2, 5.0))] == [0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("bars", [False, True])
def test_links_and_vertices_against_complex_numbers_and_finite_differences(bars):
    claims, step = moving(bars), 1e-5
    for arm in (0, 1):
        for m, h in ((1.5, 0.4), (2.2, 0.7), (3.5, 0.45), (3.2, 0.0)):
            now, over = claims.seen(arm, m, h)
            for own, link in zip(places(claims, arm, m), now, strict=True):
                assert [number(link[k]) for k in (0, 2)[: len(own)]] == pytest.approx([*own])
            for t in np.linspace(m - h, m + h, 7).clip(m - h + step, m + h - step) if h else [m]:
                before, after = (places(claims, arm, t + way * step) for way in (-1, 1))
                for a, b, link, still in zip(before, after, over, now, strict=True):
                    speed = (b[0] - a[0]) / (2 * step)
                    assert abs(number(still[1]) - speed) < 1e-7 or h
                    assert abs((link[1] - acb(speed.real, speed.imag)).real).lower() < 1e-7
                    assert abs((link[1] - acb(speed.real, speed.imag)).imag).lower() < 1e-7
                    if len(a) > 1:
                        turn = np.angle(b[1] / a[1]) / (2 * step)
                        assert abs(float(still[3]) - turn) < 1e-7 or h
                        assert abs(link[3] - arb(turn)).lower() < 1e-7
            for body, found in zip(claims.arms[arm], claims.vertices(arm, m, h), strict=True):
                for z, (at, speed) in zip(body.points, found, strict=True):
                    origin, turn = places(claims, arm, m)[body.link]
                    assert number(at) == pytest.approx(origin + turn * z)
                    before, after = (places(claims, arm, m + way * step)[body.link] for way in (-1, 1))
                    moved = (after[0] + after[1] * z - before[0] - before[1] * z) / (2 * step)
                    assert abs(speed - acb(moved.real, moved.imag)).lower() < 1e-7
                    assert h or abs(number(speed) - moved) < 1e-7
    assert claims.links(2, arb(0), arb(0), arb(0), arb(0)) == [(acb(0), acb(0), acb(1), arb(0))]


def test_pairs_are_those_within_reach_of_which_one_can_move():
    rng = np.random.default_rng(8)
    square = np.array([-2 - 2j, 2 - 2j, 2 + 2j, -2 + 2j])
    ell = np.array([-20 - 20j, 20 - 20j, 20 - 19j, -19 - 19j, -19 + 20j, -20 + 20j])
    far = shape(0, square + 24, 1.0, True)
    hollow = shape(0, ell, 0.5)
    parts = tuple((k, (k + 1) % 6) for k in range(6))
    hollow = hollow._replace(parts=parts, hollow=True)
    for _ in range(40):
        claims = scene([[]] * 3, [far, hollow])
        claims.base, claims.reach = rng.uniform(-40, 40, (3, 2)) @ (1, 1j), rng.uniform(5, 25, 3)
        claims.online = rng.random(3) < 0.6
        apart = np.abs(claims.base[:, None] - claims.base)
        near = [
            (i, k)
            for i in range(3)
            for k in range(i + 1, 3)
            if (claims.online[i] or claims.online[k]) and apart[i, k] <= claims.reach[i] + claims.reach[k]
        ]
        for j, body in ((3, far), (4, hollow)):
            solid = geometry(body.points)
            gaps = [solid.distance(shapely.Point(z.real, z.imag)) for z in claims.base]
            near += [(i, j) for i in range(3) if claims.online[i] and gaps[i] <= claims.reach[i] + body.radius]
        assert [*claims.pairs()] == near


def test_parts_are_apart_by_more_than_room_and_level():
    at = [[[arb(9)], [arb(1), arb(3), arb(2)]], [[arb(0)], [arb(7), arb(6), arb(8)]]]
    for room, level, said in ((1.0, 1.9, True), (1.0, 2.1, False), (1.0, 2.0, False), (-1.0, 3.9, True)):
        assert replayed.apart(at, arb(level), 1, (0, 1, 2), 1, (0, 1, 2), arb(room)) is said
    assert replayed.apart(at, arb(2.5), 1, (0, 2), 1, (0, 1), arb(1.4))
    assert replayed.apart(at, arb(2.5), 1, (0, 1), 1, (0, 2), arb(1.4))
    assert not replayed.apart(at, arb(2.5), 1, (0, 1), 1, (0, 1), arb(1.4))


def test_a_bound_of_the_clearance_is_that_in_the_middle_and_how_fast_vertices_move():
    claims, signs = moving(), []
    claims.place[1, :2] = 9.0, 1.0
    for arm in (1, 2):
        for m in np.linspace(1.1, 3.9, 9):
            least = np.inf
            now = [places(claims, 0, m), places(claims, 1, m) if arm == 1 else [(0.0, 1.0)]]
            if arm == 1:
                now[1] = [(z[0] + 9 + 1j - PLACE[1][0] - 1j * PLACE[1][1], z[1]) for z in now[1]]
            for one, other in product(claims.arms[0], claims.arms[arm]):
                a, b = (own[s.link][0] + own[s.link][1] * s.points for own, s in zip(now, (one, other), strict=True))
                gap = reference(*(np.stack([z.real, z.imag], axis=1) for z in (a, b)))
                least = min(least, gap - one.radius - other.radius - claims.error[0] - claims.error[arm])
            found = _upper(claims, 0, arm, m, 0.0)
            assert found == pytest.approx(least + 1e-9, abs=1e-10)
            signs.append(found < 0)
            fast = [max(float(abs(v).upper()) for s in claims.vertices(k, m, 0.05) for _, v in s) for k in (0, arm)]
            assert _upper(claims, 0, arm, m, 0.05) == pytest.approx(found + 0.05 * sum(fast), abs=1e-10)
    assert 0 < np.mean(signs) < 1


def test_obstacles_are_told_by_their_own_names():
    obstacles = np.array([(b"wall", 0), (b"wall", 0), (b"post", 1)], [("name", "S4"), ("obstacle", int)])
    claims = SimpleNamespace(n=2, table={"positioner": np.array([b"A", b"B"])}, tables={"OBSTACLES": obstacles})
    told = [label(claims, arm) for arm in range(4)]
    assert told == ["positioner 'A'", "positioner 'B'", "obstacle 'wall'", "obstacle 'post'"]
