"""Bounds over intervals, least clearances and first crossings against dense sampling, with the compiler off."""

import numpy as np
import pytest

from fiberplan.certificates import bisection
from fiberplan.certificates.bisection import closest, first_crossing, interval_bound, judge, more_looks, too_short
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels.arms import frame
from fiberplan.kernels.even_motion import constant_speed_bound
from references import (
    clearance_over_time,
    first_below,
    four_bar_plane,
    make_plane,
    motion_of,
    sampled,
    smallest_over_time,
)
from test_path_oracles import as_path

CAPSULE = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0)
LATE = motion_of([(1e16, 2.0, 0.0), (1e16 + 64, 1.0, 0.0)])  #: where neighbouring times are two seconds apart


def stack():
    """Room for intervals, with what an earlier pair may have left."""
    return np.full(256, 77.0), np.full(256, 55.0)


def scene(rng, count=4):
    """Two arms and a post, and a motion of few knots that begins late and ends early for one."""
    plane = make_plane(rng.uniform(-11, 11, (2, 2)), [CAPSULE], [Obstacle("post", rng.uniform(-9, 9, (1, 2)), 1.0)])
    knots = []
    for _ in range(2):
        times = np.sort(rng.uniform(0.5, 5.5, count))
        knots.append(np.column_stack([times, rng.uniform(-3, 3, 2) + rng.normal(0, 0.4, (count, 2)).cumsum(axis=0)]))
    knots[0][0, 0], knots[0][-1, 0] = 0.0, 6.0
    motion = motion_of(*knots)
    return plane, motion, as_path(plane, motion)


def interval(rng):
    """A scene, two of its arms or one and the post, and an interval of time."""
    plane, motion, path = scene(rng)
    i, j = (0, 1) if rng.random() < 0.6 else (int(rng.integers(2)), 2)
    if rng.random() < 0.5:
        i, j = j, i
    t0 = rng.uniform(0, 6)
    return plane, motion, path, i, j, t0, min(6.0, t0 + rng.choice([0.01, 0.3, 2.0]))


def split_of(path, i, j, t0, t1):
    """Where an interval is to be split, the knot nearest its middle or the middle, and its knots."""
    middle = 0.5 * (t0 + t1)
    knots = np.concatenate([path.knots["time"][path.offsets[k] : path.offsets[k + 1]] for k in (i, j) if k < 2])
    inside = knots[(knots > t0) & (knots < t1)]
    return inside[np.argmin(np.abs(inside - middle))] if len(inside) else middle, inside


def fastest(path, arm, t0, t1):
    """Largest speed of an arm in the stretches that [t0, t1] touches [mm/s]."""
    if arm >= len(path.offsets) - 1:
        return 0.0
    own = path.knots[path.offsets[arm] : path.offsets[arm + 1]]
    touched = (own["time"] <= t1) & (np.append(own["time"][1:], np.inf) > t0)
    return own["speed"][touched].max(initial=0.0)


def travelled(path, arm, t):
    own = path.knots[path.offsets[arm] : path.offsets[arm + 1]] if arm < len(path.offsets) - 1 else None
    return 0.0 if own is None else np.interp(t, own["time"], own["travelled"])


def test_bounds_over_intervals():
    """The time is that of the knot nearest the middle, or the middle; the bound is the better one of the two orders."""
    rng, kinds = np.random.default_rng(0), []
    for _ in range(40):
        plane, motion, path, i, j, t0, t1 = interval(rng)
        jitter, error = rng.choice([0.0, 0.1]), rng.choice([0.0, 0.25])
        t, now, bound = interval_bound(plane.arms, path, i, j, t0, t1, jitter, error)
        at, inside = split_of(path, i, j, t0, t1)
        kinds.append(min(len(inside), 2))
        assert t == at
        pads = [
            error + jitter * sum(fastest(path, k, a - jitter, b + jitter) for k in (i, j))
            for a, b in ((t, t), (t0, t1))
        ]
        clear = clearance_over_time(plane, motion, i, j, np.array([t]))[0]
        assert now == pytest.approx(clear - pads[0], abs=1e-9)
        lost = max(sum(abs(travelled(path, k, e) - travelled(path, k, t)) for k in (i, j)) for e in (t0, t1))
        expected = clear - lost - 1e-9
        if not len(inside):
            both = []
            for k in (i, j):
                q = sampled(motion, k, np.array([t - 1e-6, t, t + 1e-6]))
                both += [frame(plane.arms, k, *q[1]), *((q[2] - q[0]) / 2e-6)]
            expected = max(expected, constant_speed_bound(plane.arms, i, *both[:3], j, *both[3:], (t1 - t0) / 2)[1])
        assert bound == pytest.approx(expected - pads[1], abs=1e-6)
        assert bound <= clearance_over_time(plane, motion, i, j, np.linspace(t0, t1, 60)).min() - error + 1e-9
    assert set(kinds) == {0, 1, 2}


def test_intervals_that_end_in_rounding():
    plane, _, path = scene(np.random.default_rng(1))
    t0 = 3.0
    t1 = np.nextafter(t0, 9)
    t, now, bound = interval_bound(plane.arms, path, 0, 1, t0, t1, 0.0, 0.0)
    assert t == t0
    assert now - 1e-7 < bound < now
    t, _, _ = interval_bound(plane.arms, path, 0, 1, np.nextafter(t0, 0), t0, 0.0, 0.0)
    assert t < t0


def test_a_middle_that_is_rounded():
    """The middle of [2, 8] past 1e16 s is 4: what comes after it lasts twice as long as what comes before."""
    plane = make_plane([0, 0], [Body(np.array([[10.0, 0.0]]), 1.0)], [Obstacle("post", [[20.0, 0.0]], 1.0)], length=0.0)
    path = as_path(plane, LATE)
    t, now, bound = interval_bound(plane.arms, path, 0, 1, 1e16 + 2, 1e16 + 8, 0.0, 0.0)
    assert t == 1e16 + 4
    end = clearance_over_time(plane, LATE, 0, 1, np.array([1e16 + 8]))[0]
    assert end - 0.1 < bound < end < now


def test_jitter_reaches_what_rounding_would_hide():
    """Past 1e16 s a moment 0.3 s earlier is the same number: a fast stretch that has just ended counts all the same."""
    plane = make_plane([0, 0], [Body(np.array([[10.0, 0.0]]), 1.0)], [Obstacle("post", [[30.0, 0.0]], 1.0)], length=0.0)
    path = as_path(plane, motion_of([(1e16, 0.0, 0.0), (1e16 + 64, 3.2, 0.0), (1e16 + 128, 3.2, 0.0)]))
    _, now, bound = interval_bound(plane.arms, path, 0, 1, 1e16 + 80, 1e16 + 90, 0.3, 0.0)
    assert now - 1e-6 < bound < now
    _, now, bound = interval_bound(plane.arms, path, 0, 1, 1e16 + 64, 1e16 + 72, 0.3, 0.0)
    assert now - bound == pytest.approx(0.3 * 10 * 3.2 / 64, abs=1e-6)


def test_unknown_speeds_are_neither_safe_nor_in_contact():
    """In its zone of avoidance an arm's travel is infinite: what is seen is only less the error, nothing is proven."""
    plane = four_bar_plane(np.random.default_rng(3), n=2, shortest=(5.0, 9.0), longest=(24.0, 35.0))
    motion = motion_of([(0.0, *plane.folded[0]), (5.0, *(plane.folded[0] + 3.0))], [(0.0, *plane.folded[1])])
    path = as_path(plane, motion)
    assert path.knots["travelled"][1] == np.inf
    for jitter in (0.0, 0.1):
        t, now, bound = interval_bound(plane.arms, path, 0, 2, 1.0, 4.0, jitter, 0.25)
        assert now == pytest.approx(clearance_over_time(plane, motion, 0, 2, np.array([t]))[0] - 0.25, abs=1e-9)
        assert bound < now
    assert interval_bound(plane.arms, path, 0, 2, 1.0, 4.0, 0.1, 0.25)[2] == -np.inf


def test_least_clearance_is_enclosed():
    rng, below, answers = np.random.default_rng(2), 0, []
    for k in range(4):
        plane, motion, path = scene(rng)
        i, j = (0, 1) if k % 3 else (1, 2)
        smallest, _ = smallest_over_time(plane, motion, i, j, 400)
        margin, error, cap = 0.3, 0.1 * (k % 2), np.inf
        low, high, when = closest(plane.arms, path, i, j, margin, 0.0, error, 0.05, cap, *stack())
        assert low <= smallest - error + 1e-9
        assert smallest - error - 1e-4 <= high <= low + 0.05 + 3e-9
        assert high == pytest.approx(clearance_over_time(plane, motion, i, j, np.array([when]))[0] - error, abs=1e-9)
        margin = smallest - error - 1e-3  # near the margin no tolerance is left
        assert closest(plane.arms, path, i, j, margin, 0.0, error, 0.05, cap, *stack())[0] >= margin
        margin = smallest - error + 1e-3
        if smallest > -2.0:
            assert first_crossing(plane.arms, path, i, j, margin, 0.0, error, 6.0, *stack()) <= 6.0
        row = judge(plane.arms, path, np.array([[i, j]]), np.array([error, 0.0, 0.0]), 0.3, 0.0, 0.05, 2.3)[0]
        crossing = first_below(plane, motion, i, j, 0.3 + error * (i == 0), 500)
        assert np.isnan(row[2]) == (crossing is None)
        if crossing is not None:
            below += 1
            assert row[2] == pytest.approx(crossing, abs=2e-3)
        else:
            assert row[0] >= 0.3
            if smallest < 2.0:
                assert row[1] - row[0] <= 0.05 + 3e-9
        answers.append(row)
    assert 0 < below < 4


def test_first_crossing_is_the_first_of_several():
    plane = make_plane([0, 0], [Body(np.array([[10.0, 0.0]]), 1.0)], [Obstacle("post", [[0.0, 16.0]], 1.0)])
    motion = motion_of([(0, 0.5, 0), (2, 2.5, 0), (4, 0.5, 0), (6, 2.5, 0), (8, 0.3, 0)])
    path = as_path(plane, motion)
    expected = first_below(plane, motion, 0, 1, 0.2, 900)
    for known in (7.0, 5.2, 1.2):
        found = first_crossing(plane.arms, path, 0, 1, 0.2, 0.0, 0.0, known, *stack())
        assert found == pytest.approx(expected, abs=1e-4)
        assert found <= expected
    high, when = closest(plane.arms, path, 0, 1, 0.2, 0.0, 0.0, 0.01, 2.0, *stack())[1:]
    assert high == pytest.approx(-1.0, abs=0.011)
    assert abs(np.interp(when, motion.times, motion.angles[:, 0]) - np.pi / 2) < 0.02
    tiny = np.empty(1), np.empty(1)
    assert closest(plane.arms, path, 0, 1, 0.2, 0.0, 0.0, 0.01, 2.0, *tiny)[0] == -np.inf
    assert first_crossing(plane.arms, path, 0, 1, 0.2, 0.0, 0.0, 7.0, *tiny) == 0.0
    assert closest(plane.arms, path, 0, 1, 0.2, 0.0, np.nan, 0.01, 2.0, *stack())[0] == -np.inf
    assert first_crossing(plane.arms, path, 0, 1, -9.0, 0.0, 0.0, 7.5, *stack()) == 7.5


def test_near_the_margin_bounds_are_as_sharp_as_rounding_lets_them_be():
    """A tip passes 2 mm from a post: whenever it does, all but 2.5 nanometres of them are proven in millionths."""
    plane = make_plane([0, 0], [Body(np.array([[10.0, 0.0]]), 1.0)], [Obstacle("post", [[0.0, 19.0]], 1.0)])
    for begin in np.linspace(0.3, 0.7, 12):
        path = as_path(plane, motion_of([(0, begin, 0), (2, 2.5, 0)]))
        low, high, _ = closest(plane.arms, path, 0, 1, 2.0 - 2.6e-9, 0.0, 0.0, 0.01, 3.0, *stack())
        assert 2.0 - 2.6e-9 <= low <= 2.0 - 1e-9 < high
        assert closest(plane.arms, path, 0, 1, 2.0 - 0.9e-9, 0.0, 0.0, 0.01, 3.0, *stack())[0] < 2.0 - 0.9e-9


def test_a_pair_that_takes_too_long_is_undecided(monkeypatch):
    """However many looks it needs: with one fewer nothing is proven, and the first crossing is what was known."""
    plane = make_plane([0, 0], [Body(np.array([[10.0, 0.0]]), 1.0)], [Obstacle("post", [[0.0, 19.0]], 1.0)])
    path, looks = as_path(plane, motion_of([(0, 0.5, 0), (2, 2.5, 0)])), []
    real = bisection.interval_bound
    monkeypatch.setattr(bisection, "interval_bound", lambda *given: looks.append(given) or real(*given))
    whole = closest(plane.arms, path, 0, 1, 1.9, 0.0, 0.0, 0.01, 3.0, *stack())
    needed = len(looks)
    assert 5 < needed < 60
    for most, answer in ((needed + 1, whole), (needed, (-np.inf, *whole[1:]))):
        monkeypatch.setattr(bisection, "_MOST_LOOKS", (most, 0))
        assert closest(plane.arms, path, 0, 1, 1.9, 0.0, 0.0, 0.01, 3.0, *stack()) == answer
    monkeypatch.setattr(bisection, "_MOST_LOOKS", (1, 0))
    assert first_crossing(plane.arms, path, 0, 1, 2.1, 0.0, 0.0, 1.1, *stack()) == 1.1


def test_jitter_costs_speed():
    """A tip at 15 mm/s passes 2 mm from a post: late or early by 0.05 s, 0.75 mm of it are lost."""
    plane = make_plane([0, 0], [Body(np.array([[10.0, 0.0]]), 1.0)], [Obstacle("post", [[0.0, 19.0]], 1.0)])
    path = as_path(plane, motion_of([(0, 0.5, 0), (2, 2.5, 0)]))
    pairs, errors = np.array([[0, 1]]), np.array([0.25, 0.5])
    low, high, when = judge(plane.arms, path, pairs, errors, 0.2, 0.05, 0.01, 2.0)[0]
    assert low == pytest.approx(2.0 - 0.75 - 0.75, abs=0.0101)
    assert low <= 0.5 <= high + 1e-9
    assert np.isnan(when)
    assert judge(plane.arms, path, pairs, errors, 0.51, 0.05, 0.01, 2.0)[0, 2] < 1.2


def test_pairs_are_judged_one_after_the_other():
    rng = np.random.default_rng(4)
    plane, _, path = scene(rng)
    pairs = np.array([[0, 1], [1, 2], [0, 2], [1, 0]])
    together = judge(plane.arms, path, pairs, np.zeros(3), 0.3, 0.0, 0.05, 2.3)
    for row, pair in zip(together, pairs, strict=True):
        np.testing.assert_array_equal(row, judge(plane.arms, path, pair[None], np.zeros(3), 0.3, 0.0, 0.05, 2.3)[0])


def test_when_to_stop():
    assert too_short(1.0, 1.0, 2.0, 0.0)
    assert too_short(1.0, 2.0, 2.0, 0.0)
    assert not too_short(1.0, 1.5, 2.0, 0.0)
    assert too_short(1.0, 1.0 + 4e-7, 1.0 + 9e-7, 1.0)
    assert not too_short(1.0, 1.0 + 1e-6, 1.0 + 2e-6, 1.0)
    assert not too_short(1.0, 1.0 + 4e-7, 1.0 + 9e-7, 0.5)
    _, _, path = scene(np.random.default_rng(0), count=4)
    assert [more_looks(path, *pair) for pair in ((0, 1), (0, 2), (2, 1), (2, 3))] == [50_800, 50_400, 50_400, 50_000]
