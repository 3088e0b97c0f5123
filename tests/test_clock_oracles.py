"""Clocks that are off: boxes of moments against numpy's interpolation and closed forms, with the compiler off."""

import numpy as np
import pytest

from fiberplan.certificates import clocks
from fiberplan.certificates.clocks import at_any_moments, box_bound, judge_clocks, travel
from fiberplan.focal_plane.bodies import Body
from fiberplan.tolerances import ROUNDING
from references import four_bar_plane, make_plane, motion_of, sampled, sampled_clearance
from test_path_oracles import as_path

pytestmark = pytest.mark.small  # every case of each

TIP = Body(np.array([[10.0, 0.0]]), 1.0)
PAIR = np.array([[0, 1]])


def side_by_side(gap, *knots):
    """Two tips 10 mm from their bases, so far apart at rest, each on a path of its own."""
    plane, motion = make_plane([[0, 0], [2.0 + gap, 0]], [TIP], length=0.0, max_speed=1e3), motion_of(*knots)
    return plane, motion, as_path(plane, motion)


def behind(gap, seconds=0.6):
    """Both at 10 mm/s along x, the first behind: clocks that are off by tau take 20 sin tau."""
    return side_by_side(gap, *([(0, 1.27, 0), (seconds, 1.87, 0)],) * 2)


def travelled(path, arm, t):
    own = path.knots[path.offsets[arm] : path.offsets[arm + 1]]
    return np.interp(t, own["time"], own["travelled"])


def farthest(path, arm, low, middle, high):
    return max(
        travelled(path, arm, middle) - travelled(path, arm, low),
        travelled(path, arm, high) - travelled(path, arm, middle),
    )


def scene(rng):
    plane = make_plane([[0, 0], rng.uniform(8, 20, 2)], [Body(rng.uniform(-2, 10, (2, 2)), 0.5)])
    times, angles = np.cumsum(rng.uniform(0.2, 1.0, (2, 4)), axis=1), np.cumsum(rng.normal(0, 0.5, (2, 4, 2)), axis=1)
    motion = motion_of(*[np.column_stack([t, a]) for t, a in zip(times, angles, strict=True)])
    return plane, motion, as_path(plane, motion)


def test_an_arm_gets_no_farther_than_its_way_in_the_longer_half():
    rng = np.random.default_rng(0)
    for _ in range(30):
        _, motion, path = scene(rng)
        low, middle, high = np.sort(rng.uniform(-0.5, motion.duration + 0.5, 3))
        assert travel(path, 0, low, middle, high) == pytest.approx(farthest(path, 0, low, middle, high), abs=1e-9)
    assert travel(path, 2, low, middle, high) == 0.0  # an obstacle
    late = 2.0**20  # where moments are rounded: nothing is lost of how far a fast arm may be by then
    _, _, path = side_by_side(1.0, [(late, 0.0, 0.0), (late + 1, 3e4, 0.0)], [(0, 0.0, 0.0)])
    more = travel(path, 0, late + 0.25, late + 0.5, late + 0.75) - 3e5 / 4
    assert more == pytest.approx(3e5 * 2.0**-50 * (2 * late + 1), rel=0.2)
    assert travel(path, 0, late + 0.25, late + 0.5, late + 0.5) - 3e5 / 4 == pytest.approx(more, rel=0.2)


def test_bounds_over_boxes_of_moments():
    rng = np.random.default_rng(1)
    for _ in range(20):
        plane, motion, path = scene(rng)
        c, d = np.sort(rng.uniform(0, motion.duration, 2)), np.sort(rng.uniform(-0.3, 0.3, 2))
        now, bound = box_bound(plane.arms, path, 0, 1, *c, *d, 0.15)
        at = [np.array([c.mean() + d.mean()]), np.array([c.mean() - d.mean()])]
        gap = sampled_clearance(plane, 0, 1, *(sampled(motion, k, t) for k, t in enumerate(at)))[0]
        assert now == pytest.approx(gap - 0.15, abs=1e-9)
        lost = farthest(path, 0, c[0] + d[0], *at[0], c[1] + d[1]) + farthest(path, 1, c[0] - d[1], *at[1], c[1] - d[0])
        assert bound == pytest.approx(now - lost - ROUNDING, abs=1e-10)
        t, s = rng.uniform(*c, 100), rng.uniform(*d, 100)
        seen = sampled_clearance(plane, 0, 1, sampled(motion, 0, t + s), sampled(motion, 1, t - s))
        assert bound <= seen.min() - 0.15
    plane = four_bar_plane(np.random.default_rng(3), n=2, shortest=(5.0, 9.0), longest=(24.0, 35.0))
    path = as_path(plane, motion_of([(0.0, *plane.folded[0]), (5.0, *(plane.folded[0] + 3.0))], [(0, 0, 0)]))
    assert box_bound(plane.arms, path, 0, 2, 1.0, 4.0, -0.1, 0.1, 0.0)[1] == -np.inf


def looked_at(monkeypatch):
    """Boxes (c0, c1, d0, d1) that are looked at from now on, and the bound of each."""
    seen, real = {}, clocks.box_bound

    def spy(arms, path, i, j, *box_and_error):
        found = real(arms, path, i, j, *box_and_error)
        seen[box_and_error[:4]] = found
        return found

    monkeypatch.setattr(clocks, "box_bound", spy)
    return seen


@pytest.mark.parametrize(("margin", "tolerance", "cap"), [(0.2, 0.05, np.inf)])
def test_boxes_are_halved_until_the_least_clearance_is_enclosed(margin, tolerance, cap, monkeypatch):
    """Every box is either halved across its longer side, or bounded well enough; so the least bound is proven."""
    seen, errors, tau = looked_at(monkeypatch), np.array([0.04, 0.06]), 0.02
    plane, motion, path = behind(1.2)
    ((low, high),) = judge_clocks(plane.arms, path, PAIR, errors, margin, tau, tolerance, cap)
    exact = 1.2 - 20 * np.sin(tau) - 0.1  # 0.70003
    assert low <= exact <= high + 1e-12 or low >= min(cap, high - tolerance)
    assert (low >= margin) == (exact >= margin)
    assert high - low <= tolerance + 3e-9 or low >= cap or low >= margin > high - tolerance
    assert next(iter(seen)) == (-tau, motion.duration + tau, -tau, tau)
    leaves = []
    for (c0, c1, d0, d1), (now, bound) in seen.items():
        c, d = (c0 + c1) / 2, (d0 + d1) / 2
        halves = [(c0, c, d0, d1), (c, c1, d0, d1)] if c1 - c0 > d1 - d0 else [(c0, c1, d0, d), (c0, c1, d, d1)]
        assert {half in seen for half in halves} == {halves[0] in seen}
        if halves[0] not in seen:
            leaves.append(bound)
        assert now >= high
    assert min(leaves) == low
    assert min(now for now, _ in seen.values()) == high
    looks = len(seen)
    args = (plane.arms, path, 0, 1, margin, tau, 0.1, tolerance, cap)
    assert clocks._closest(*args, looks + 1, np.full((40, 4), 7.0)) == (low, high)
    assert clocks._closest(*args, looks, np.full((40, 4), 7.0)) == (-np.inf, high)
    room = next(k for k in range(1, 40) if clocks._closest(*args, looks + 1, np.full((k, 4), 7.0))[0] == low)
    whole = 2 * tau * (motion.duration + 2 * tau)
    deepest = max(round(np.log2(whole / ((c1 - c0) * (d1 - d0)))) for c0, c1, d0, d1 in seen)
    assert room <= deepest + 1


def test_near_the_margin_no_tolerance_is_left():
    plane, _, path = behind(1.2)
    exact = 1.2 - 20 * np.sin(0.02)
    for spare in (2e-2, -2e-2):
        ((low, high),) = judge_clocks(plane.arms, path, PAIR, np.zeros(2), exact - spare, 0.02, 0.5, 3.0)
        assert (low >= exact - spare) == (spare > 0)
        assert low <= exact <= high
    assert judge_clocks(plane.arms, path, PAIR, np.array([np.nan, 0.0]), 0.1, 0.02, 0.01, 3.0)[0, 0] == -np.inf


def test_pairs_are_judged_one_after_the_other():
    rng = np.random.default_rng(4)
    plane, _, path = scene(rng)
    both, errors = np.array([[0, 1], [1, 0]]), np.array([0.1, 0.2])
    found = judge_clocks(plane.arms, path, both, errors, 0.3, 0.05, 0.2, 1.0)
    for row, pair in zip(found, both, strict=True):
        np.testing.assert_array_equal(row, judge_clocks(plane.arms, path, pair[None], errors, 0.3, 0.05, 0.2, 1.0)[0])


def test_paths_apart_at_any_two_moments(monkeypatch):
    """Who follows another within 4 s is met if either stands; who turns away from it is not, whenever."""
    for (plane, motion, path), apart in (
        (behind(0.6, 4.0), False),
        (side_by_side(0.9, [(0, 1.57, 0), (4, 2.2, 0)], [(0, 1.57, 0), (4, 0.9, 0)]), True),
    ):
        t = np.linspace(0, 4, 60)
        first, second = (x.ravel() for x in np.meshgrid(t, t))
        least = sampled_clearance(plane, 0, 1, sampled(motion, 0, first), sampled(motion, 1, second)).min()
        errors = np.array([0.1, 0.05])
        assert (least >= 0.6 + errors.sum()) == apart
        assert at_any_moments(plane.arms, path, PAIR, errors, 0.6, 3000).tolist() == [apart]
        seen = looked_at(monkeypatch)
        assert at_any_moments(plane.arms, path, PAIR, errors, 0.6, 3000).tolist() == [apart]
        if apart:
            for looks, answer in ((len(seen) + 1, True), (len(seen), False)):
                assert at_any_moments(plane.arms, path, PAIR, errors, 0.6, looks).tolist() == [answer]
        monkeypatch.undo()
        assert not at_any_moments(plane.arms, path, PAIR, np.array([0.1, 0.25]), 0.6, 3000)[0]
        assert not at_any_moments(plane.arms, path, PAIR, np.array([0.25, 0.1]), 0.6, 3000)[0]
