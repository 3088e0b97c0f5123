"""Contact all over boxes, as a replay shows it, against shapely, dense sampling and formulas of its own."""

from itertools import product

import numpy as np
import pytest
import shapely
from flint import acb, arb

from fiberplan.certificates import replay_contact as contact
from replay_arms import PLACE, convex, geometry, place_of, scene, shape
from test_depth_oracles import reference

pytestmark = pytest.mark.small
GENERAL, STRETCHED = (0.4, 1.9), (-0.7, 0.0)  # joints of an arm, bent and straight


def outline(part):
    return geometry(part).exterior if len(part) > 2 else geometry(part)


def parts_in_pairs(rng):
    """Convex parts of one to five vertices, apart, crossing, and within each other."""
    for k, m in product((1, 2, 3, 5), repeat=2):
        for far, size in ((2.0, 4.0), (5.0, 3.0), (9.0, 3.0), (0.3, 1.0)):
            yield convex(rng, k), convex(rng, m, size, far * np.exp(1j * rng.uniform(0, 6.3)))


def test_the_nearest_of_two_segments_is_among_its_candidates():
    rng = np.random.default_rng(5)
    grid, crossing = np.linspace(0, 1, 2001), 0
    for _ in range(40):
        a, b, c, d = rng.normal(0, 3, 4) + 1j * rng.normal(0, 3, 4)
        found = list(contact._candidates(a, b, c, d))
        on_first, on_second = a + grid * (b - a), c + grid * (d - c)
        feet = (
            (0.0, grid[np.abs(on_second - a).argmin()]),
            (1.0, grid[np.abs(on_second - b).argmin()]),
            (grid[np.abs(on_first - c).argmin()], 0.0),
            (grid[np.abs(on_first - d).argmin()], 1.0),
        )
        assert np.allclose(found[:4], feet, rtol=0, atol=2.6e-4)
        s, t = np.linalg.solve(np.array([b - a, c - d]).view(float).reshape(2, 2).T, np.array([c - a]).view(float))
        meet = 0 <= s <= 1 and 0 <= t <= 1
        crossing += meet
        assert len(found) == 4 + meet
        assert not meet or found[4] == pytest.approx((s, t))
    assert 5 < crossing < 35


def test_segments_that_end_on_each_other_cross_there():
    a, b = 0j, 4 + 0j
    for c, d, where in (
        (1 + 0j, 1 + 2j, (0.25, 0.0)),
        (1 - 2j, 1 + 0j, (0.25, 1.0)),
        (0j, 2j, (0.0, 0.0)),
        (4 - 1j, 4 + 1j, (1.0, 0.5)),
    ):
        assert list(contact._candidates(a, b, c, d))[4] == pytest.approx(where)
    for c, d in (
        (5 - 1j, 5 + 1j),
        (-1 - 1j, -1 + 1j),
        (1 + 1j, 1 + 2j),
        (1 - 2j, 1 - 1j),
        (1j, 4 + 1j),
        (9 + 0j, 9 + 0j),
    ):
        assert len(list(contact._candidates(a, b, c, d))) == 4
    assert list(contact._candidates(1j, 1j, 2 + 0j, 2 + 0j)) == [(0.0, 0.0), (1.0, 0.0), (0.0, 0.0), (0.0, 1.0)]


def test_the_nearest_points_are_weights_of_vertices():
    apart = []
    for part, other in parts_in_pairs(np.random.default_rng(5)):
        weights, others = contact._nearest(part, other)
        for own, of in ((weights, part), (others, other)):
            assert own.shape == of.shape
            assert (own >= 0).all()
            assert own.sum() == pytest.approx(1.0)
        gap = abs(weights @ part - others @ other)
        assert gap == pytest.approx(shapely.distance(outline(part), outline(other)), abs=1e-12)
        apart.append(gap > 0.01)
    assert 0.2 < np.mean(apart) < 0.95


def test_depth_is_that_of_the_hull_of_differences_less_rounding():
    depths = []
    for part, other in parts_in_pairs(np.random.default_rng(5)):
        signed = reference(*(np.stack([own.real, own.imag], axis=1) for own in (part, other)))
        depth = contact._depth(part, other)
        assert depth == pytest.approx(max(0.0, -signed - 1e-9), abs=1e-10)
        depths.append(depth > 0)
    assert 0.1 < np.mean(depths) < 0.9
    square = np.array([0, 4, 4 + 4j, 4j])
    assert contact._depth(square[[0, 0, 1, 2, 3]], np.array([1 + 2j])) == pytest.approx(1.0)
    assert contact._depth(square, square + 4 - 0.5e-9) == 0.0
    assert contact._depth(square[:1], square[:1]) == 0.0


@pytest.mark.parametrize("link", [0, 1, 2])
@pytest.mark.parametrize("joints", [GENERAL, STRETCHED])
def test_no_point_leaves_its_bounds_and_they_are_tight(link, joints):
    for half in ((0.02, 0.03), (0.3, 0.2), (0.25, 0.0), (0.0, 0.4)):
        for z in (5.0, 2.0 + 1.5j) if joints == GENERAL else (5.0,):
            claims = scene([[shape(link, [1.0, z])]])
            arm = contact._Arm(claims, 0, list(joints), list(half))
            x = arm.at(link, acb(z.real, z.imag))
            assert complex(x) == pytest.approx(place_of(link, z, *joints), abs=1e-12)
            assert arm.floats[0] == pytest.approx(np.array([place_of(link, w, *joints) for w in (1.0, z)]), abs=1e-12)
            by_alpha, by_beta, bent, far = arm.moved(link, x)
            step = 1e-6
            for k, by in enumerate((by_alpha, by_beta)):
                up, down = ([q + way * step * (k == m) for m, q in enumerate(joints)] for way in (1, -1))
                slope = (place_of(link, z, *up) - place_of(link, z, *down)) / (2 * step)
                assert complex(by) == pytest.approx(slope * half[k], abs=1e-7)
            da, db = np.meshgrid(*(np.linspace(-h, h, 41) for h in half))
            now = place_of(link, z, joints[0] + da, joints[1] + db)
            straight = [complex(by) / h if h else 0 for by, h in zip((by_alpha, by_beta), half, strict=True)]
            missed = np.abs(now - complex(x) - straight[0] * da - straight[1] * db).max()
            moved = np.abs(now - complex(x)).max()
            assert missed <= float(bent) + 1e-12
            assert moved <= float(far) + 1e-12
            if joints == STRETCHED or link < 2:  # all is in line, where nothing is lost but what is of higher order
                assert missed >= 0.97 * float(bent)
                assert moved >= (0.9 if min(half) else 0.99) * float(far)
            reach, near = abs(complex(x) - claims.base[0]), abs(z) if link == 2 else 0.0
            if link:
                assert float(far) == pytest.approx(half[0] * (reach + near * half[1]) + near * half[1])
            both = 8.0 * half[0] ** 2 + near * sum(half) ** 2
            assert float(bent) == pytest.approx((0, reach * half[0] ** 2, both)[link] / 2)
            least, most = sorted(float(arm.moved(link, arm.places[0][k])[3]) for k in (0, 1))
            assert float(arm.farthest(0, link, (0, 1))) == most
            assert least < most or link == 0 or (link == 1 and half[0] == 0)


def test_points_stay_near_as_far_as_first_order_and_arcs_show():
    rng = np.random.default_rng(5)
    for far_first in (False, True):
        for apart in (0j, 3 + 4j, -2 + 0.5j):
            ways = rng.normal(0, 0.2, 4) + 1j * rng.normal(0, 0.2, 4)
            bent, far = (0.02, 0.03), (50.0, 60.0) if not far_first else (0.01, 0.015)
            turned = ways * (np.conj(apart) / abs(apart) if apart else 1)
            first = np.hypot(abs(apart) + np.abs(turned.real).sum(), np.abs(turned.imag).sum()) + sum(bent)
            bound = min(first, abs(apart) + sum(far))
            assert (bound == first) != far_first
            signs = np.array(list(product((-1, 1), repeat=4)))
            assert far_first or np.abs(apart + signs @ ways).max() + sum(bent) <= bound
            one, other = (
                (*(acb(w.real, w.imag) for w in ways[own]), arb(bent[k]), arb(far[k]))
                for k, own in enumerate((slice(0, 2), slice(2, 4)))
            )
            for room, said in ((bound * (1 + 1e-9), True), (bound * (1 - 1e-9), False)):
                assert contact._stay_near(one, other, acb(apart.real, apart.imag), arb(room)) is said


@pytest.mark.parametrize("filled", [False, True])
def test_who_stands_meets_up_to_the_margin_and_both_radii(filled):
    """Less what is set aside; a bar between the two is 5 mm long, so that its ends are farther than its middle."""
    bar = [-20 + 9j, 30 + 9j, 30 + 12j, -20 + 12j][: 4 if filled else 2]
    for link, z in ((1, 7.0), (2, 5.0 + 1.0j)):
        for points in ([z], [z, z - 0.5]):
            ends = np.array([place_of(link, w, *GENERAL) for w in points])
            gap = 9.0 - ends.imag.max()
            assert gap > 2
            for off, said in ((2e-9, True), (-2e-9, False)):
                radius = gap - 0.5 - 0.3 + 1e-6 + off
                claims = scene([[shape(link, points, 0.3)]], [shape(0, bar, radius, filled)])
                arms = [contact._Arm(claims, k, list(GENERAL), [0.0, 0.0]) for k in (0, 1)]
                assert contact._meets(claims, *arms) is said
                assert contact._meets(claims, arms[1], arms[0]) is said


def test_overlaps_are_shown_by_their_depth():
    """A point 10 mm out in a square of 10 mm: it comes to the side when it has moved by 5 mm."""
    middle = place_of(1, 10.0, *GENERAL)
    square = [middle + 5 * w for w in (-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j)]
    triangle = [middle + 10 * np.exp(2j * np.pi * k / 3) for k in range(3)]  # its sides are 5 mm from the middle
    for solid in (square, triangle):
        for off, said in ((-2e-10, True), (1e-8, False), (-2e-9, True)):
            half = (5.0 - 1e-9 + 0.5 - 1e-6) / 10.0 + off
            claims = scene([[shape(1, [10.0])]], [shape(0, solid, 0.0, True)])
            arms = [contact._Arm(claims, k, list(GENERAL), [half, 0.0]) for k in (0, 1)]
            assert contact._meets(claims, *arms) is said
            assert contact._meets(claims, *arms[::-1]) is said


def test_bars_that_cross_are_shown_by_their_depth():
    """Of two bars of 6 mm that cross at right angles in the middle of each, the way out is 3 mm along either."""
    middle, along = place_of(1, 10.0, *GENERAL), np.exp(1j * (GENERAL[0] + PLACE[0][3]))
    across = [middle - 3j * along, middle + 3j * along]
    vertex = 13.0  # the farther end of the moving bar
    for off, said in ((-1e-9, True), (1e-9, False)):
        half = (3.0 - 1e-9 + 0.5 - 1e-6) / vertex + off
        claims = scene([[shape(1, [7.0, 13.0])]], [shape(0, across)])
        arms = [contact._Arm(claims, k, list(GENERAL), [half, 0.0]) for k in (0, 1)]
        assert contact._meets(claims, *arms) is said
    claims = scene([[shape(1, [7.0, 13.0])], [shape(0, across)]])
    for share, said in ((0.4999, True), (0.5001, False)):  # both turn, the other about its own base
        whole = 3.0 - 1e-9 + 0.5 - 1e-6
        z = (np.array(across) - claims.base[1]) * np.exp(-0.1j)
        claims.arms[1] = [shape(1, z)]
        arms = [
            contact._Arm(claims, 0, list(GENERAL), [share * whole / vertex, 0.0]),
            contact._Arm(claims, 1, [0.0, 0.0], [share * whole / np.abs(z).max(), 0.0]),
        ]
        assert contact._meets(claims, *arms) is said


def test_what_is_said_to_meet_is_nearer_than_the_margin_everywhere():
    rng = np.random.default_rng(5)
    met = 0
    for _ in range(60):
        joints, half = rng.uniform(-3, 3, 2), rng.uniform(0, 0.08, 2)
        z = np.array([1.0, 6.0 + rng.uniform(-1, 1) * 1j])
        at = place_of(2, z[1], *joints)
        solid = convex(
            rng, int(rng.integers(1, 5)), rng.uniform(0.2, 2.0), at + rng.normal(0, 0.7) + 1j * rng.normal(0, 0.7)
        )
        claims = scene([[shape(2, z, 0.2)]], [shape(0, solid, 0.1, len(solid) > 2)], margin=1.0)
        if contact._meets(claims, contact._Arm(claims, 0, [*joints], [*half]), contact._Arm(claims, 1, [0, 0], [0, 0])):
            met += 1
            for da, db in product(*(np.linspace(-h, h, 5) for h in half)):
                bar = geometry(place_of(2, z, joints[0] + da, joints[1] + db))
                assert bar.distance(geometry(solid)) < 1.0 + 0.3 - 1e-6
    assert 10 < met < 55
