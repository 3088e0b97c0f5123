"""Bounds over boxes of joints against turns of points as complex numbers, and shapely, with the compiler off."""

import itertools

import numpy as np
import pytest
import shapely

from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels.arms import frame
from fiberplan.kernels.box_bounds import _crossing, _of_pieces, _reached, _spread, box_bounds, nearest_points
from fiberplan.kernels.depth import signed_gap
from fiberplan.tolerances import ROUNDING
from references import make_plane

TRIANGLE = np.array([[2.0, -1.0], [9.0, -2.0], [8.0, 2.0]])
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
BODIES = (
    Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0, category="low", meets=("low",)),
    Body(TRIANGLE, 0.3, closed=True, category="low", meets=("low",)),
    Body(np.array([[0.0, 0.0], [7.0, 1.0]]), 0.5, link="alpha", category="low", meets=("low",)),
    Body(SQUARE * 4.0, 0.0, closed=True, category="high", meets=("high",)),
    Body(np.array([[1.0, 2.0]]), 0.7, link="base", category="low", meets=("low",)),
)
POSTS = (Obstacle("post", np.array([[3.0, 4.0]]), 1.0, category="low", meets=("low",)),)


def spreads(link, frame_, at, half, n):
    """(k, 5) of `at` (k,): how far along n, across it, off these and in all, beta's part, from turns and arcs."""
    base, elbow = complex(*frame_[:2]), complex(*frame_[2:4])
    by_alpha, by_beta = (link > 0) * 1j * (at - base), (link == 2) * 1j * (at - elbow)  # per radian
    turned = np.stack([by_alpha, by_beta]) * np.conj(n)
    along, across = (np.array(half) @ np.abs(part) for part in (turned.real, turned.imag))
    rigid = abs(elbow - base) if link == 2 else np.abs(by_alpha)
    bent = (half[0] ** 2 * rigid + (half[0] + half[1]) ** 2 * np.abs(by_beta)) / 2
    beta = np.abs(by_beta) * half[1]
    return np.stack([along, across, bent, beta + (np.abs(by_alpha) + beta) * half[0], beta], axis=-1)


def corners(arms, p, frame_):
    """(link, points (k,) of a piece) in the focal plane, as complex numbers."""
    piece = arms.piece[p]
    own = arms.vertices[piece.first : piece.last] @ np.array([1, 1j])
    origin, turn = ((0, 1), (0, complex(*frame_[4:6])), (2, complex(*frame_[6:8])))[piece.link]
    return piece.link, complex(*frame_[origin : origin + 2]) + turn * own


def reach(arms, p, frame_, half, n):
    """How far a piece may come along n, the longest way of its points, way and beta's part of that which does."""
    link, at = corners(arms, p, frame_)
    along, _, bent, whole, beta = spreads(link, frame_, at, half, n).T
    far = (np.conj(n) * at).real + np.minimum(along + bent, whole)
    return far.max(), whole.max(), whole[far.argmax()], beta[far.argmax()]


def of_two(arms, p, frame_i, half_i, q, frame_j, half_j, room):
    """What `_of_pieces` should say."""
    gap, *n = signed_gap(arms, frame_i, p, frame_j, q)
    n = complex(*n)
    far, most_i, way_i, beta_i = reach(arms, p, frame_i, half_i, n)
    near, most_j, way_j, beta_j = reach(arms, q, frame_j, half_j, -n)
    low, high = -far - near if gap > 0 else -np.inf, gap + most_i + most_j
    if gap >= room:
        return gap, low, high, way_i - beta_i, beta_i, way_j - beta_j, beta_j
    px, py, qx, qy = nearest_points(arms, frame_i, p, frame_j, q)
    at = np.array([complex(px, py), complex(qx, qy)])
    apart = abs(at[1] - at[0])
    n = (at[1] - at[0]) / apart if apart else n
    i = spreads(arms.piece[p].link, frame_i, at[:1], half_i, n)[0]
    j = spreads(arms.piece[q].link, frame_j, at[1:], half_j, n)[0]
    bent = np.hypot(apart + i[0] + j[0], i[1] + j[1]) + i[2] + j[2]
    high = min(high, bent, apart + i[3] + j[3])
    return gap, low, high, i[3] - i[4], i[4], j[3] - j[4], j[4]


def scenes(count, seed=0):
    """Two arms, or an arm and a post, that overlap or are apart: arms, and of each of both number, frame and half."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        plane = make_plane(rng.uniform(-7, 7, (2, 2)), BODIES, POSTS)
        pair = ((0, 1), (1, 0), (0, 2), (2, 1))[k % 4]
        ends = []
        for arm in pair:
            half = 10.0 ** rng.uniform(-3, 0.2) * rng.uniform(0, 1, 2) if arm < 2 else np.zeros(2)
            ends.append((arm, frame(plane.arms, arm, *(rng.uniform(-3, 3, 2) if arm < 2 else (0.0, 0.0))), half))
        yield rng, plane.arms, *ends


def test_points_spread_as_turns_say():
    held = 0
    for rng, _, (_, frame_, half), _ in scenes(24):
        for link in range(3):
            x, n = complex(*rng.uniform(-15, 15, 2)), np.exp(1j * rng.uniform(-3, 3))
            got = _spread(frame_, link, x.real, x.imag, *half, n.real, n.imag)
            assert got == pytest.approx(spreads(link, frame_, np.array([x]), half, n)[0], abs=1e-9)
            turn = half[:, None] * rng.uniform(-1, 1, (2, 40))
            turn[:, ::2] = half[:, None] * np.sign(turn[:, ::2])
            base, elbow = complex(*frame_[:2]), complex(*frame_[2:4])
            first = np.exp(1j * turn[0] * (link > 0))
            after = base + first * (elbow - base + np.exp(1j * turn[1] * (link == 2)) * (x - elbow))
            moved = (after - x) * np.conj(n)
            along, across, bent, whole, _ = got
            assert (np.abs(moved.real) <= along + bent + 1e-9).all()
            assert (np.abs(moved.imag) <= across + bent + 1e-9).all()
            assert (np.abs(moved) <= whole + 1e-9).all()
            held += whole > 0 and np.abs(moved).max() > 0.8 * whole
    assert held > 10


def test_pieces_reach_as_their_points_do():
    for rng, arms, *ends in scenes(16, 1):
        for arm, frame_, half in ends:
            for p in range(arms.arm[arm].first_piece, arms.arm[arm].last_piece):
                n = np.exp(1j * rng.uniform(-3, 3))
                expected = reach(arms, p, frame_, half, n)
                assert _reached(arms, frame_, p, *half, n.real, n.imag) == pytest.approx(expected, abs=1e-9)


def test_segments_cross_where_shapely_says():
    rng = np.random.default_rng(0)
    ends = [rng.uniform(-3, 3, (4, 2)) for _ in range(120)]
    ends.append(np.array([[0.0, 0.0], [2.0, 2.0], [0.0, 0.0], [1.0, 5.0]]))
    crossed = 0
    for a, b, c, d in ends:
        s = _crossing(*a, *b, *c, *d)
        at = shapely.intersection(shapely.LineString([a, b]), shapely.LineString([c, d]))
        assert np.isnan(s) == at.is_empty
        if not at.is_empty:
            crossed += 1
            assert a + s * (b - a) == pytest.approx(np.array([at.x, at.y]), abs=1e-9)
    assert 20 < crossed < 100
    assert np.isnan(_crossing(*np.array([0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 2.0])))


def outline(arms, p, frame_):
    """Shapely's outline of a piece."""
    at = corners(arms, p, frame_)[1]
    points = np.stack([at.real, at.imag], axis=1)
    return shapely.LinearRing(points) if len(at) > 2 else shapely.LineString(points if len(at) > 1 else points[[0, 0]])


def pieces_of(arms, *ends):
    """All pairs of pieces of two arms, with frames and half-widths."""
    (i, frame_i, half_i), (j, frame_j, half_j) = ends
    for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
        for q in range(arms.arm[j].first_piece, arms.arm[j].last_piece):
            yield p, frame_i, half_i, q, frame_j, half_j


def within(size, at):
    """A square of 8 mm and a bar within it, or a smaller square, about `at`; nothing turns by default."""
    bar = Body(SQUARE * size + at, 0.0, closed=True)
    plane = make_plane([[0.0, 0.0], [0.0, 0.0]], [Body(SQUARE * 4.0, 0.0, closed=True), bar], length=5.0)
    frames = [frame(plane.arms, arm, 0.3, 0.2) for arm in (0, 1)]
    return plane.arms, frames


def test_nearest_points_are_those_of_the_outlines():
    inside = crossing = 0
    for _, arms, *ends in scenes(20, 2):
        for p, frame_i, _, q, frame_j, _ in pieces_of(arms, *ends):
            px, py, qx, qy = nearest_points(arms, frame_i, p, frame_j, q)
            a, b = outline(arms, p, frame_i), outline(arms, q, frame_j)
            assert np.hypot(qx - px, qy - py) == pytest.approx(a.distance(b), abs=1e-9)
            assert a.distance(shapely.Point(px, py)) < 1e-9
            assert b.distance(shapely.Point(qx, qy)) < 1e-9
            crossing += a.distance(b) == 0
            inside += a.distance(b) > 0 and signed_gap(arms, frame_i, p, frame_j, q)[0] < 0
    assert crossing > 10
    assert inside > 2


def test_pieces_are_bounded_as_derived():
    rng = np.random.default_rng(4)
    for _, arms, *ends in scenes(20, 3):
        for p, frame_i, half_i, q, frame_j, half_j in pieces_of(arms, *ends):
            for room in (0.0, rng.uniform(0, 20), 1e3):
                got = _of_pieces(arms, frame_i, p, *half_i, frame_j, q, *half_j, room)
                assert got == pytest.approx(of_two(arms, p, frame_i, half_i, q, frame_j, half_j, room), abs=1e-9)


def test_what_is_inside_comes_out_another_way_than_its_outline_is_near():
    """A flat bar 0.4 mm from the left of a square comes out at the bottom: the outlines' way counts for its points."""
    arms, frames = within(np.array([1.5, 0.1]), np.array([-2.1, -2.5]))
    p, q = arms.arm[0].first_piece, arms.arm[1].first_piece + 1
    gap, nx, ny = signed_gap(arms, frames[0], p, frames[1], q)
    px, py, qx, qy = nearest_points(arms, frames[0], p, frames[1], q)
    assert np.hypot(qx - px, qy - py) == pytest.approx(0.4)
    assert gap == pytest.approx(-1.6)
    assert abs(nx * (qx - px) + ny * (qy - py)) < 1e-9
    for half_i, half_j in itertools.product(np.array([[0.0, 0.0], [0.0, 1e-3], [1e-2, 2e-3]]), repeat=2):
        got = _of_pieces(arms, frames[0], p, *half_i, frames[1], q, *half_j, 0.0)
        assert got == pytest.approx(of_two(arms, p, frames[0], half_i, q, frames[1], half_j, 0.0), abs=1e-12)


def farthest(arms, i, half):
    """How far any body point of an arm of two links gets: about the elbow, then about the base."""
    arm = arms.arm[i]
    return max(arm.length * half[0] + arm.reach_beta * half.sum(), arm.reach_alpha * half[0])


def about(arms, p, frame_):
    """Centre of the circle about a piece, in the focal plane."""
    piece = arms.piece[p]
    origin, turn = ((0, 1), (0, complex(*frame_[4:6])), (2, complex(*frame_[6:8])))[piece.link]
    return complex(*frame_[origin : origin + 2]) + turn * complex(piece.u, piece.v)


def of_arms(arms, ends, margin, shut):
    """What `box_bounds` should say."""
    moved = sum(farthest(arms, i, half) for i, _, half in ends) + margin
    now = low = high = nearest = np.inf
    ways = np.zeros(4)
    for p, frame_i, half_i, q, frame_j, half_j in pieces_of(arms, *ends):
        a, b = arms.piece[p], arms.piece[q]
        radii = a.radius + b.radius
        far = abs(about(arms, p, frame_i) - about(arms, q, frame_j)) > moved + radii + a.extent + b.extent
        if not (a.category & b.meets or b.category & a.meets) or far:
            continue
        gap, below, above, *turned = of_two(arms, p, frame_i, half_i, q, frame_j, half_j, margin + radii)
        low, high, now = min(low, below - radii - ROUNDING), min(high, above - radii + ROUNDING), min(now, gap - radii)
        if below - radii - ROUNDING < margin and gap - radii < nearest:
            nearest, ways = gap - radii, turned
        if high < shut:
            break
    return now, low, high, *ways


def bounds(arms, ends, margin, shut):
    """What it does say."""
    return box_bounds(arms, *(x for i, frame_, half in ends for x in (i, frame_, *half)), margin, shut)


def test_arms_are_bounded_as_their_pieces():
    rng, looked = np.random.default_rng(6), 0
    for _, arms, *ends in scenes(24, 5):
        for margin, shut in ((0.0, -50.0), (rng.uniform(0, 9), rng.uniform(-5, 9)), (40.0, 15.0), (40.0, -50.0)):
            got = bounds(arms, ends, margin, shut)
            assert got == pytest.approx(of_arms(arms, ends, margin, shut), abs=1e-10)
            looked += got[0] < np.inf
    assert 48 < looked < 96


def test_pieces_whose_circles_stay_apart_are_left_out():
    rng = np.random.default_rng(7)
    for body in (*BODIES[:3], BODIES[4]):
        for k in range(4):
            plane = make_plane([[0.0, 0.0], rng.uniform(35, 45, 2) * (1, -1)[k % 2]], [body])
            arms, half = plane.arms, rng.uniform(0, 0.1, (2, 2))
            ends = [(i, frame(arms, i, *rng.uniform(-3, 3, 2)), half[i]) for i in (0, 1)]
            apart = abs(about(arms, 0, ends[0][1]) - about(arms, 1, ends[1][1])) - sum(
                arms.piece[i].extent + arms.piece[i].radius + farthest(arms, i, half[i]) for i in (0, 1)
            )
            assert bounds(arms, ends, apart - 1e-9, -50.0) == (np.inf, np.inf, np.inf, 0.0, 0.0, 0.0, 0.0)
            assert bounds(arms, ends, apart + 1e-9, -50.0)[0] < np.inf


def test_of_arms_at_no_place_nothing_is_known():
    arms = make_plane([[0.0, 0.0], [12.0, 0.0]], BODIES[:1]).arms
    here, nowhere = frame(arms, 0, 0.1, 0.2), frame(arms, 1, np.nan, 0.0)
    none = np.zeros(2)
    assert bounds(arms, [(0, here, none), (1, nowhere, none)], 5.0, -50.0)[1] == -np.inf
