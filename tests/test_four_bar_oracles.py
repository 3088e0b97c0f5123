"""Four-bar arms against complex numbers and dense sampling, with the compiler off."""

import numpy as np
import pytest

from fiberplan.kernels.arms import acceleration, frame
from fiberplan.kernels.four_bar import largest_acceleration, leaves_range, rates, slide, slider
from fiberplan.tolerances import ZONE
from references import four_bar_joints, four_bar_plane, placed, varied_plane
from test_arm_oracles import far


def scenes(count=5):
    for seed in range(count):
        rng = np.random.default_rng(seed)
        yield rng, four_bar_plane(rng)


def as_complex(*values):
    return [complex(*values[k : k + 2]) for k in range(0, len(values), 2)]


def test_slide_and_rates_are_derivatives():
    h = 1e-4
    for rng, plane in scenes():
        for _ in range(6):
            i, q, speed = int(rng.integers(plane.n)), rng.uniform(-7, 7, 2), rng.uniform(-2, 2, 2)
            at = frame(plane.arms, i, *q)
            r, u, a = as_complex(*slide(plane.arms, i, at, *speed))
            _, j2, j3, j4 = four_bar_joints(plane, i, q + np.array([[-h], [0.0], [h]]) * speed)
            before, now, after = j4 - j3
            assert r == pytest.approx(now, abs=1e-12)
            assert u == pytest.approx((after - before) / (2 * h), abs=1e-5)
            assert a == pytest.approx((after - 2 * now + before) / h**2, abs=1e-4)
            first, second, third = rates(plane.arms, i, at, *speed)
            assert first == speed[0]
            assert second == pytest.approx(np.angle(after / before) / (2 * h), rel=1e-4, abs=1e-5)
            assert third == pytest.approx(np.angle((j4 - j2)[2] / (j4 - j2)[0]) / (2 * h), abs=1e-6)
            assert slider(plane.arms, i, *q) == pytest.approx(abs(now), abs=1e-12)
    plane = varied_plane(np.random.default_rng(0))
    assert slider(plane.arms, 0, 1.0, 2.0) == np.inf
    assert rates(plane.arms, 0, frame(plane.arms, 0, 1.0, 2.0), 0.5, 0.25) == (0.5, 0.75, -0.25)


def acceleration_of(plane, i, q, va, vb, h):
    """The bound of design/four-bar.md, from joints as complex numbers."""
    if va == vb == 0:
        return 0.0
    bar, (j1, j2, j3, j4) = plane.kinematics, four_bar_joints(plane, i, q[None])
    swing, rock = plane.length[i] * va**2, bar.rocker[i] * vb**2
    jerk = plane.length[i] * abs(va) ** 3 + bar.rocker[i] * abs(vb) ** 3
    p, e = j4[0] - j2, j3[0] - j1
    bent = min(swing + rock, abs(-p * vb**2 + e * va**2) + h * jerk)
    speed = min(plane.length[i] * abs(va) + bar.rocker[i] * abs(vb), abs(-1j * p * vb - 1j * e * va) + h * bent)
    shortest = abs(j4[0] - j3[0]) - h * speed
    if shortest < 1.0:  # mm of slider, below which nothing is bounded
        return np.inf
    reach = far(plane, i, "beta")
    probe = swing + reach * (bent / shortest + 2 / np.sqrt(3) * (speed / shortest) ** 2)
    return max(probe, far(plane, i, "alpha") * va**2, far(plane, i, "rocker") * vb**2)


def test_acceleration_is_the_bound_derived_and_holds():
    finite = []
    for rng, plane in scenes(8):
        for _ in range(8):
            i, q = int(rng.integers(plane.n)), rng.uniform(-7, 7, 2)
            speed, h = rng.uniform(-2, 2, 2) * rng.choice([0, 1, 1, 1], 2), rng.choice([0.01, 0.1, 1.0])
            found = largest_acceleration(plane.arms, i, frame(plane.arms, i, *q), *speed, h)
            assert found == pytest.approx(acceleration_of(plane, i, q, *speed, h), rel=1e-9)
            finite.append(np.isfinite(found))
            if np.isfinite(found):
                d = 1e-4
                moments = np.linspace(-h + d, h - d, 9)
                for body in plane.bodies:
                    tracks = [placed(plane, i, body, q + (moments + s)[:, None] * speed) for s in (-d, 0.0, d)]
                    seen = np.linalg.norm(tracks[0] - 2 * tracks[1] + tracks[2], axis=2).max() / d**2
                    assert seen <= found * (1 + 1e-6) + 1e-3
    assert 0.4 < np.mean(finite) < 1.0
    plane = varied_plane(np.random.default_rng(0))
    at = frame(plane.arms, 1, 1.0, 2.0)
    assert largest_acceleration(plane.arms, 1, at, 0.3, 0.4, 0.1) == acceleration(plane.arms, 1, 0.3, 0.4)


def test_who_stands_in_a_singular_place_has_no_acceleration():
    """Where the slider has no length, found by complex numbers, next to nothing is known of an arm that moves."""
    found = 0
    for _, plane in scenes(8):
        for i in range(plane.n):
            bar, a = plane.kinematics, plane.length[i]
            d, b = bar.spacing[i], bar.rocker[i]
            if not abs(a - b) < d < a + b:
                continue
            turn = np.arccos((a**2 + d**2 - b**2) / (2 * a * d))
            q = np.array([turn, -np.angle((d - a * np.exp(1j * turn)) / b)]) - plane.zero[i]
            at = frame(plane.arms, i, *q)
            assert slider(plane.arms, i, *q) < 1e-9
            assert largest_acceleration(plane.arms, i, at, 0.0, 0.0, 0.1) == 0.0
            for speed in ((1e-3, 0.0), (0.0, 1e-3)):
                assert largest_acceleration(plane.arms, i, at, *speed, 0.1) == np.inf
            found += 1
    assert found > 2


def test_range_is_left_where_sampling_says_so():
    left = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        plane = four_bar_plane(rng, shortest=(5.0, 9.0), longest=(24.0, 35.0))
        i, bar = int(rng.integers(plane.n)), plane.kinematics
        for size in (0.2, 1.0, 3.0):
            start, step = plane.folded[i], rng.normal(0, size, 2)
            part, length = leaves_range(plane.arms, i, *start, *step)
            _, _, j3, j4 = four_bar_joints(plane, i, start + np.linspace(0, 1, 20_001)[:, None] * step)
            lengths = np.abs(j4 - j3)
            outside = (lengths < bar.shortest[i] - 1.1 * ZONE) | (lengths > bar.longest[i] + 1.1 * ZONE)
            assert np.isnan(part) != outside.any()
            left.append(outside.any())
            if outside.any():
                first = np.argmax(outside) / 20_000
                assert first - 1e-4 <= part <= first + 1e-4
                assert length == pytest.approx(lengths[np.argmax(outside)], abs=0.05)
                assert length < bar.shortest[i] - 0.9 * ZONE or length > bar.longest[i] + 0.9 * ZONE
            else:
                assert length == np.inf
    assert 0.2 < np.mean(left) < 0.9
    two_links = varied_plane(np.random.default_rng(0))
    assert np.isnan(leaves_range(two_links.arms, 0, 0.0, 0.0, 1.0, 1.0)[0])


def test_limits_are_kept_to_a_ten_millionth():
    """A range that ends just beyond the shortest, or the longest, slider of a move is kept; just within, it is left."""
    for rng, plane in scenes(4):
        step = rng.normal(0, 0.4, 2)
        _, _, j3, j4 = four_bar_joints(plane, 0, plane.folded[0] + np.linspace(0, 1, 40_001)[:, None] * step)
        lengths = np.abs(j4 - j3)
        for end, name, sign in ((lengths.min(), "shortest", -1), (lengths.max(), "longest", 1)):
            for beyond in (1e-7, -1e-7):
                bar = plane.arms.bar.copy()
                bar["shortest"], bar["longest"] = 0.0, 1e3
                bar[name] = end + sign * (beyond - ZONE)
                part, _ = leaves_range(plane.arms._replace(bar=bar), 0, *plane.folded[0], *step)
                assert np.isnan(part) == (beyond > 0)
