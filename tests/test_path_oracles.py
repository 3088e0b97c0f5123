"""Knots, states and speeds of a motion as the proof takes it, against numpy's interpolation, with the compiler off."""

import numpy as np
import pytest

from fiberplan.certificates.path import (
    KNOT,
    Motion,
    knot_near_middle,
    last_knot,
    measure,
    next_knot,
    rounding,
    state,
    top_speed,
    zone_entries,
)
from fiberplan.focal_plane.bodies import Body
from fiberplan.tolerances import ROUNDING
from references import four_bar_joints, four_bar_plane, make_plane, motion_of, sampled, varied_plane
from test_arm_oracles import bound_of_motion


def as_path(plane, motion):
    """The motion as kernels take it."""
    knots = np.zeros(len(motion.times), KNOT)
    knots["time"], knots["alpha"], knots["beta"] = motion.times, *motion.angles.T
    measure(plane.arms, motion.offsets, knots)
    return Motion(motion.offsets, knots, motion.duration)


def random_motion(rng, n, count=6, late=0.0):
    """Knots at random times, the last positioner's a single one."""
    knots = []
    for i in range(n):
        times = np.sort(rng.uniform(late, 9.0, count if i < n - 1 else 1))
        knots.append(np.column_stack([times, rng.uniform(-1, 1, (len(times), 2)).cumsum(axis=0)]))
    return motion_of(*knots)


def scenes():
    for seed in range(4):
        rng = np.random.default_rng(seed)
        plane = varied_plane(rng)
        motion = random_motion(rng, plane.n, late=float(seed % 2))
        yield rng, plane, motion, as_path(plane, motion)


def test_travelled_and_speed():
    for _, plane, motion, path in scenes():
        for i in range(plane.n):
            times, angles = motion.knots(i)
            steps = np.array([bound_of_motion(plane, i, *d) for d in np.diff(angles, axis=0)])
            own = path.knots[motion.offsets[i] : motion.offsets[i + 1]]
            np.testing.assert_allclose(own["travelled"], np.append(0.0, np.cumsum(steps)), rtol=1e-12)
            np.testing.assert_allclose(own["speed"], np.append(steps / np.diff(times), 0.0), rtol=1e-12)
            for k in range(len(steps)):  # rounded up, by next to nothing
                exact = own["travelled"][k] + steps[k]
                assert exact * (1 + 1e-16) < own["travelled"][k + 1] <= exact * (1 + 1e-15)


def test_state_is_interpolated():
    for rng, plane, motion, path in scenes():
        for t in [*rng.uniform(-1, 11, 25), *motion.times, 0.0]:
            for i in range(plane.n):
                own = path.knots[motion.offsets[i] : motion.offsets[i + 1]]
                alpha, beta, va, vb, far = state(path, i, t)
                np.testing.assert_allclose([[alpha, beta]], sampled(motion, i, np.array([t])), atol=1e-12)
                assert far == pytest.approx(np.interp(t, own["time"], own["travelled"]), abs=1e-11)
                k = np.searchsorted(own["time"], t, side="right") - 1
                assert last_knot(path, i, t) == motion.offsets[i] + max(k, 0)
                if 0 <= k < len(own) - 1:
                    dt = own["time"][k + 1] - own["time"][k]
                    expected = (own["alpha"][k + 1] - own["alpha"][k]) / dt, (own["beta"][k + 1] - own["beta"][k]) / dt
                    assert (va, vb) == pytest.approx(expected)
                else:
                    assert (va, vb) == (0.0, 0.0)
            assert state(path, plane.n, t) == (0.0, 0.0, 0.0, 0.0, 0.0)


def test_knots_between_and_top_speeds():
    found = set()
    for rng, plane, motion, path in scenes():
        for _ in range(40):
            t0, t1 = np.sort(rng.uniform(-1, 11, 2) if rng.random() < 0.7 else rng.choice(motion.times, 2))
            middle = 0.5 * (t0 + t1)
            for i in range(plane.n):
                own = path.knots[motion.offsets[i] : motion.offsets[i + 1]]
                inside = own["time"][(own["time"] > t0) & (own["time"] < t1)]
                near = knot_near_middle(path, i, t0, t1, middle)
                found.add(min(len(inside), 2))
                if len(inside):
                    assert near in inside
                    assert abs(near - middle) == np.abs(inside - middle).min()
                else:
                    assert np.isnan(near)
                touched = (own["time"] <= t1) & (np.append(own["time"][1:], np.inf) > t0)
                assert top_speed(path, i, t0, t1) == own["speed"][touched].max(initial=0.0)
                after = own["time"][own["time"] > t0]
                assert next_knot(path, i, t0) == after.min(initial=np.inf)
            assert next_knot(path, plane.n, t0) == np.inf
            assert np.isnan(knot_near_middle(path, plane.n, t0, t1, middle))
            assert top_speed(path, plane.n, t0, t1) == 0.0
    assert found == {0, 1, 2}


def test_rounding():
    """None in an instrument; of a light second's travel or of a position, some units in the last place of it."""
    plane = varied_plane(np.random.default_rng(0))
    path = as_path(plane, random_motion(np.random.default_rng(0), plane.n))
    assert (rounding(plane.arms, path.offsets, path.knots) == 0.0).all()
    body = Body(np.array([[10.0, 0.0]]), 1.0)
    turn, length = 2.0**-49, 2.0**-50
    for base, zero, knots in (
        ((3e9, -4e9), (0.0, 0.0), [(0.0, 0.0, 0.0)]),
        ((-4e9, 0.0), (0.0, 0.0), [(0.0, 0.0, 0.0)]),
        ((0.0, 0.0), (0.0, 0.0), [(0.0, -3e8, 0.0), (1.0, -3e8, 2e8)]),
        ((0.0, 0.0), (3e8, -2e8), [(0.0, 0.0, 0.0)]),
        ((0.0, 0.0), (0.0, 0.0), [(0.0, 0.0, 0.0), (1.0, 0.0, -5e8)]),
        ((0.0, 0.0), (0.0, 0.0), [(0.0, 1e9, 0.0)]),
    ):
        far = make_plane([base], [body], length=5.0, zero=np.array([zero]))
        path = as_path(far, motion_of(knots))
        largest = np.abs([row[1:] for row in knots]).max(axis=0)
        turned = turn * (largest.sum() + np.abs(zero).sum())
        size = 10.0 + np.abs(base).sum() + path.knots["travelled"].max()
        expected = 5.0 * turned + 10.0 * 2 * turned + length * size - 0.1 * ROUNDING
        assert rounding(far.arms, path.offsets, path.knots)[0] == pytest.approx(expected, rel=1e-6)
        assert expected > 0
    vertices = Body(np.array([[3e9, -4e9]]), 1.0)
    wide = make_plane([0, 0], [vertices], length=5.0)
    path = as_path(wide, motion_of([(0.0, 0.0, 0.0)]))
    assert rounding(wide.arms, path.offsets, path.knots)[0] == pytest.approx(length * 7e9 - 0.1 * ROUNDING)
    path = as_path(wide, motion_of([(0.0, np.finfo(float).max, np.finfo(float).max)]))
    assert rounding(wide.arms, path.offsets, path.knots)[0] == np.inf


def test_zones_of_avoidance():
    entered = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        plane = four_bar_plane(rng, shortest=(5.0, 9.0), longest=(24.0, 35.0))
        rows = [
            [(0.0, *plane.folded[i]), (2.0, *plane.folded[i]), (5.0, *(plane.folded[i] + rng.normal(0, 1, 2)))]
            for i in range(plane.n)
        ]
        motion = motion_of(*rows)
        path, bar = as_path(plane, motion), plane.kinematics
        entries = zone_entries(plane.arms, path.offsets, path.knots)
        for i, (time, length) in enumerate(entries):
            times = np.linspace(0, 5, 5001)
            _, _, j3, j4 = four_bar_joints(plane, i, sampled(motion, i, times))
            sliders = np.abs(j4 - j3)
            outside = (sliders < bar.shortest[i] - 1e-6) | (sliders > bar.longest[i] + 1e-6)
            own = path.knots[3 * i : 3 * i + 3]
            entered.append(outside.any())
            assert np.isnan(time) != outside.any()
            assert np.isfinite(own["travelled"]).tolist() == [True, True, not outside.any()]
            assert np.isfinite(own["speed"]).tolist() == [True, not outside.any(), True]
            if outside.any():
                assert time == pytest.approx(times[np.argmax(outside)], abs=2e-3)
                assert length == pytest.approx(sliders[np.argmax(outside)], abs=0.1)
                assert state(path, i, 1.0)[4] == 0.0 == state(path, i, 2.0)[4]
                assert state(path, i, 4.0)[4] == np.inf
    assert {True, False} == set(entered)


def test_who_stands_in_a_zone_does_not_move():
    plane = four_bar_plane(np.random.default_rng(0), n=1)
    bar = plane.arms.bar.copy()
    bar["longest"] = bar["shortest"] + 1e-3  # the slider is nowhere near
    plane_arms = plane.arms._replace(bar=bar)
    motion = motion_of([(0.0, *plane.folded[0]), (3.0, *plane.folded[0])])
    knots = np.zeros(2, KNOT)
    knots["time"], knots["alpha"], knots["beta"] = motion.times, *motion.angles.T
    measure(plane_arms, motion.offsets, knots)
    assert knots["travelled"].tolist() == knots["speed"].tolist() == [0.0, 0.0]
    assert zone_entries(plane_arms, motion.offsets, knots)[0, 0] < 1e-9
    for joint in ("alpha", "beta"):
        turned = knots.copy()
        turned[joint][1] += 0.1
        measure(plane_arms, motion.offsets, turned)
        assert turned["travelled"][1] == turned["speed"][0] == np.inf
