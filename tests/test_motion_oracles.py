"""Bounds and sweeps of moving arms: sound by dense sampling, and as sharp as derived, with the compiler off."""

import itertools

import numpy as np
import pytest
import shapely

from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.four_bar import FourBar
from fiberplan.kernels.arms import frame
from fiberplan.kernels.even_motion import constant_speed_bound, vertex_speed_along
from fiberplan.kernels.four_bar import SINGULAR, largest_acceleration, rates
from fiberplan.kernels.sweep import swept_clear
from fiberplan.tolerances import ROUNDING
from references import four_bar_plane, geometry, make_plane, placed, sampled_clearance
from test_clearance_oracles import mixed_plane

CAPSULE = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0)
LINKS = ("base", "alpha", "beta", "rocker")


def test_speeds_of_points_on_every_link():
    h, rng = 1e-5, np.random.default_rng(0)
    for seed in range(10):
        plane = mixed_plane(rng) if seed % 2 else four_bar_plane(rng)
        i, q, speed, turn = int(rng.integers(plane.n)), rng.uniform(-4, 4, 2), rng.uniform(-2, 2, 2), rng.uniform(0, 6)
        at, n = frame(plane.arms, i, *q), np.array([np.cos(turn), np.sin(turn)])
        for body in plane.bodies:
            before, now, after = placed(plane, i, body, q + np.array([[-h], [0.0], [h]]) * speed)
            for k, (x, y) in enumerate(now):
                found = vertex_speed_along(at, rates(plane.arms, i, at, *speed), LINKS.index(body.link), x, y, *n)
                assert found == pytest.approx((after[k] - before[k]) @ n / (2 * h), abs=1e-4)


def convex_bodies(plane, arm, angles):
    """(points (3, k, 2) at three moments, radius, category, meets, closed) of an arm whose bodies are all convex."""
    if arm >= plane.n:
        o = plane.obstacles[arm - plane.n]
        return [(np.tile(o.points, (3, 1, 1)), o.radius, o.category, o.meets, o.closed)]
    return [
        (placed(plane, arm, b, angles), float(np.broadcast_to(b.radius, plane.n)[arm]), b.category, b.meets, b.closed)
        for b in plane.bodies
    ]


def bound_by_derivation(plane, i, q_i, v_i, j, q_j, v_j, h):
    """The second-order bound as its module describes it, with axes of shapely and speeds by differences."""
    d = 1e-4
    moments = np.array([[-d], [0.0], [d]])
    bend = sum(
        largest_acceleration(plane.arms, k, frame(plane.arms, k, *q), *v, h)
        for k, q, v in ((i, q_i, v_i), (j, q_j, v_j))
    )
    bend *= h * h / 2
    now, bound = np.inf, np.inf
    ours, theirs = convex_bodies(plane, i, q_i + moments * v_i), convex_bodies(plane, j, q_j + moments * v_j)
    for (a, r, mine, met, shut), (b, s, other, also, close) in itertools.product(ours, theirs):
        if not (met is None or also is None or other in met or mine in also):
            continue
        line = shapely.shortest_line(geometry(a[1:2], shut)[0], geometry(b[1:2], close)[0])
        now = min(now, line.length - r - s)
        if line.length == 0 or bend == np.inf:
            bound = min(bound, -r - s)
            continue
        n = np.diff(shapely.get_coordinates(line), axis=0)[0] / line.length
        ends = [
            ((b[1] + e * h * (b[2] - b[0]) / (2 * d)) @ n).min() - ((a[1] + e * h * (a[2] - a[0]) / (2 * d)) @ n).max()
            for e in (-1, 1)
        ]
        bound = min(bound, max(-r - s, min(ends) - bend - r - s))
    return now, bound - ROUNDING


def test_second_order_bound_is_sound_and_as_sharp_as_derived():
    rng, kinds = np.random.default_rng(1), []
    for seed in range(40):
        plane = mixed_plane(rng)
        if seed % 4 == 0:
            plane = four_bar_plane(rng)
            plane = plane.replace(bodies=(plane.bodies[0], plane.bodies[3]))  # the convex ones
        i, j = 0, int(rng.integers(1, plane.n + len(plane.obstacles)))
        if seed % 2:
            i, j = j, i
        q, v, h = rng.uniform(-4, 4, (2, 2)), rng.uniform(-2, 2, (2, 2)), rng.choice([0.02, 0.1, 0.3])
        for k, arm in enumerate((i, j)):
            if arm >= plane.n:
                q[k] = v[k] = 0.0
        frames = [frame(plane.arms, arm, *q[k]) for k, arm in enumerate((i, j))]
        now, bound = constant_speed_bound(plane.arms, i, frames[0], *v[0], j, frames[1], *v[1], h)
        moments = np.linspace(-h, h, 41)[:, None]
        seen = sampled_clearance(plane, i, j, q[0] + moments * v[0], q[1] + moments * v[1])
        assert now == pytest.approx(seen[20], abs=1e-9)
        assert bound <= seen.min() + 1e-12
        expected = bound_by_derivation(plane, i, q[0], v[0], j, q[1], v[1], h)
        assert (now, bound) == pytest.approx(expected, abs=1e-6)
        kinds.append((now > 0) + 2 * (bound > 0))
    assert {0, 1, 3} <= set(kinds)


def test_outlines_that_are_far_now_and_nearest_soon():
    """The tips turn fast, the hubs hardly move; which outlines are looked at must not depend on now alone."""
    rng, others = np.random.default_rng(4), 0
    hub = Body(np.array([[-2.0, -2.0], [3.0, 0.0], [-1.0, 2.0]]), 0.2, "alpha", closed=True)
    tip = Body(np.array([[20.0, 0.0], [24.0, 1.0], [23.0, -1.0]]), 0.3, "beta", closed=True)
    plane = make_plane([[0, 0], [20, 0]], [hub, tip], length=2.0)
    for _ in range(150):
        q, v, h = rng.uniform(-4, 4, (2, 2)), rng.uniform(-3, 3, (2, 2)), rng.choice([0.05, 0.2, 0.5])
        frames = [frame(plane.arms, k, *q[k]) for k in (0, 1)]
        now, bound = constant_speed_bound(plane.arms, 0, frames[0], *v[0], 1, frames[1], *v[1], h)
        moments = np.linspace(-h, h, 41)[:, None]
        angles = [q[k] + moments * v[k] for k in (0, 1)]
        seen = sampled_clearance(plane, 0, 1, *angles)
        assert now == pytest.approx(seen[20], abs=1e-9)
        assert bound <= seen.min() + 1e-12
        pairs = [
            shapely.distance(*(geometry(placed(plane, k, body, angles[k]), True) for k, body in enumerate(two))).round(
                6
            )
            for two in itertools.product((hub, tip), repeat=2)
        ]
        nearest = np.argmin(pairs, axis=0)
        others += bool(nearest[20] != nearest[int(np.argmin(seen))])
    assert others > 10


def test_outlines_of_four_bar_arms_in_their_zone_of_avoidance():
    """The slider is far shorter than allowed, so that the probe turns faster than any bound of motion says."""
    root = Body(np.array([[-2.0, -2.0], [3.0, 0.0], [-1.0, 2.0]]), 0.2, closed=True)
    tip = Body(np.array([[40.0, 0.0], [44.0, 1.0], [43.0, -1.0]]), 0.3, closed=True)
    two = np.ones(2)
    bar = FourBar(spacing=15 * two, rocker=10 * two, shortest=18 * two, longest=40 * two, orientation=[0.0, np.pi])
    plane = make_plane([[0, 0], [60, 0]], [root, tip], length=10.0, kinematics=bar, folded=np.full((2, 2), 3.1))
    q, v, h = np.array([[-0.22, 0.54], [-0.87, -0.61]]), np.array([[-0.85, -1.62], [-1.27, -2.91]]), 0.01
    assert (bar.sliders(plane.length, q, plane.zero) > SINGULAR).all()
    frames = [frame(plane.arms, k, *q[k]) for k in (0, 1)]
    _, bound = constant_speed_bound(plane.arms, 0, frames[0], *v[0], 1, frames[1], *v[1], h)
    moments = np.linspace(-h, h, 41)[:, None]
    assert -0.1 < bound <= sampled_clearance(plane, 0, 1, *(q[k] + moments * v[k] for k in (0, 1))).min()


def test_bound_of_unknown_or_touching_or_unmet():
    plane = make_plane([[0, 0], [25, 0]], [CAPSULE], [Obstacle("post", [[0.0, 40.0]], 0.5)], length=0.0)
    known, unknown = frame(plane.arms, 0, 0.0, 0.0), frame(plane.arms, 1, np.nan, 0.0)
    now, bound = constant_speed_bound(plane.arms, 0, known, 0.1, 0.1, 1, unknown, 0.1, 0.1, 0.1)
    assert np.isnan(now)
    assert bound == -2.0 - ROUNDING
    across = frame(plane.arms, 1, np.pi, 0.0)
    now, bound = constant_speed_bound(plane.arms, 0, known, 0.0, 0.0, 1, across, 0.0, 0.0, 0.1)
    assert (now, bound) == pytest.approx((3.0, 3.0 - ROUNDING), abs=1e-12)
    apart = make_plane([[0, 0], [1, 0]], [Body(CAPSULE.points, 1.0, meets=())])
    assert constant_speed_bound(apart.arms, 0, known, 0.0, 0.0, 1, across, 0.0, 0.0, 0.1) == (np.inf, np.inf)


def test_bound_touches_the_truth_to_second_order():
    """Of a tip that passes a post: a tenth of the time leaves a hundredth of the loss."""
    plane = make_plane([0, 0], [Body(np.array([[10.0, 0.0]]), 1.0)], [Obstacle("post", [[18.0, 0.0]], 1.0)])
    for h in (0.1, 0.01, 0.001):
        at = frame(plane.arms, 0, 0.2, 0.1)
        now, bound = constant_speed_bound(plane.arms, 0, at, 1.0, 0.5, 1, frame(plane.arms, 1, 0.0, 0.0), 0.0, 0.0, h)
        moments = np.linspace(-h, h, 101)[:, None] * [1.0, 0.5] + [0.2, 0.1]
        smallest = sampled_clearance(plane, 0, 1, moments, np.zeros((101, 2))).min()
        turning = 20.0**2 / (2.0 * (now + 2.0))  # of the line between the two, at up to 20 mm/s
        assert smallest - (5.0 + 10.0 * 1.5**2 + turning) * h * h <= bound <= smallest
        assert now > smallest


# --- sweeps --------------------------------------------------------------------------------------------------------


def swept(plane, start, step, j=1, start_j=(0.0, 0.0), step_j=(0.0, 0.0), limit=0.0, shown=0.0, landing=0.0):
    return swept_clear(plane.arms, 0, *start, *step, j, *start_j, *step_j, limit, shown, landing)


def test_sweep_against_sampling():
    rng, answers = np.random.default_rng(2), []
    for _ in range(60):
        plane = mixed_plane(rng) if rng.random() < 0.6 else make_plane(rng.uniform(-12, 12, (2, 2)), [CAPSULE])
        j = int(rng.integers(1, plane.n + len(plane.obstacles)))
        start, step = rng.uniform(-4, 4, (2, 2)), rng.normal(0, rng.choice([0.02, 0.3, 1.0]), (2, 2))
        if j >= plane.n:
            start[1] = step[1] = 0.0
        along, limit = np.linspace(0, 1, 300)[:, None], rng.uniform(0, 1)
        gaps = sampled_clearance(plane, 0, j, start[0] + along * step[0], start[1] + along * step[1])
        if not np.isfinite(gaps.min()):
            continue
        found = swept(plane, start[0], step[0], j, start[1], step[1], limit)
        assert not found or gaps.min() >= limit
        assert found or gaps.min() < limit + 0.02 * np.abs(step).max() + 1e-3
        answers.append(found)
        shown = rng.uniform(0, 1)
        if swept(plane, start[0], step[0], j, start[1], step[1], limit, shown):
            assert gaps[along[:, 0] >= shown].min() >= limit
        else:
            assert not found
    assert 0.2 < np.mean(answers) < 0.8


def test_who_lands_nearer_than_the_landing_has_to_come_no_nearer():
    """Of two that keep well clear on their way: only where they begin and end decides."""
    rng, answers = np.random.default_rng(7), []
    while len(answers) < 16:
        plane = make_plane(rng.uniform(-14, 14, (2, 2)), [CAPSULE])
        start, step, landing = rng.uniform(-4, 4, (2, 2)), rng.normal(0, 0.3, (2, 2)), rng.uniform(1, 6)
        along = np.linspace(0, 1, 60)[:, None]
        gaps = sampled_clearance(plane, 0, 1, start[0] + along * step[0], start[1] + along * step[1])
        if gaps.min() < 0.3 or gaps[-1] > 0.2 + landing:
            continue
        answers.append(swept(plane, start[0], step[0], 1, start[1], step[1], 0.2, landing=landing))
        assert answers[-1] == (gaps[-1] >= gaps[0])
    assert set(answers) == {True, False}


def test_sweep_is_decided_within_a_ten_thousandth_and_by_few_looks(monkeypatch):
    """Past a post with 1e-4 to spare, and without; a piece that is shown is followed by longer ones."""
    for spare, clear in ((1e-4, True), (-1e-6, False)):
        post = Obstacle("post", [[0.0, 12.0 + spare]], 1.0)
        plane = make_plane([0, 0], [CAPSULE], [post], length=0.0)
        for turn in (0.1, -0.1):
            assert swept(plane, (np.pi / 2 - turn / 2, 0.0), (turn, 0.0)) == clear
    for spare, clear in ((1e-3, True), (1e-6, False)):  # what is not shown in 128 pieces counts as contact
        post = Obstacle("post", [[0.0, 12.0 + spare]], 1.0)
        plane = make_plane([0, 0], [CAPSULE], [post], length=0.0)
        assert swept(plane, (np.pi / 2 - 0.47, 0.0), (1.0, 0.0)) == clear
    looks = []
    real = swept_clear.__globals__["constant_speed_bound"]
    monkeypatch.setitem(
        swept_clear.__globals__, "constant_speed_bound", lambda *given: looks.append(given[-1]) or real(*given)
    )
    post = Obstacle("post", [[0.0, 14.0]], 1.0)
    plane = make_plane([0, 0], [CAPSULE], [post], length=0.0)
    assert swept(plane, (0.0, 0.0), (1.5, 0.0))
    assert len(looks) <= 12
    assert looks[0] == pytest.approx(0.5)
    assert max(looks[-3:]) > min(looks)


def test_known_parts_ends_and_landings():
    plane = make_plane([0, 0], [CAPSULE], [Obstacle("post", [[0.0, 9.0]], 0.1)], length=0.0)
    through = (np.pi / 2 - 1.0, 0.0), (2.0, 0.0)
    assert not swept(plane, *through)
    assert not swept(plane, *through, shown=0.4)
    assert swept(plane, *through, shown=0.7)
    assert not swept(plane, (np.pi / 2 - 1.0, 0.0), (1.0, 0.0), shown=1.0)  # the end is always looked at
    assert swept(plane, (np.pi / 2 - 1.0, 0.0), (0.1, 0.0), shown=1.0)
    wall = make_plane([0, 0], [CAPSULE], [Obstacle("wall", np.array([[-20.0, -4.0], [20.0, -4.0]]), 0.0)], length=0.0)
    near = -np.arcsin(0.29)  # the tip is then 0.1 mm from the wall
    assert swept(wall, (0.0, 0.0), (near, 0.0), landing=0.05)
    assert not swept(wall, (0.0, 0.0), (near, 0.0), landing=0.15)
    assert not swept(wall, (0.0, 0.0), (near, 0.0), limit=0.06, landing=0.05)
    assert swept(wall, (near - 0.005, 0.0), (0.005, 0.0), landing=0.15)
    facing = make_plane([[0, 0], [14, 0]], [CAPSULE], length=0.0)
    up = (np.pi / 2, 0.0)
    assert swept(facing, up, (-3.0, 0.0), 1, up, (-3.0, 0.0))  # side by side, like wipers
    assert not swept(facing, up, (-3.0, 0.0), 1, (-np.pi / 2, 0.0), (-3.0, 0.0))
    assert not swept(facing, up, (-np.pi, 0.0), 1, up, (0.0, 0.0), limit=2.1)  # past one that stands
    assert swept(facing, (1.0, 0.5), (0.0, 0.3), 1, (1.0, 0.5), (0.0, 0.3), limit=2.0)
    assert swept(facing, (1.0, 0.5), (0.0, -0.3), 1, (1.0, 0.5), (0.0, -0.3), landing=0.1)
    assert not swept(facing, (0.0, 0.0), (np.nan, 0.0))
