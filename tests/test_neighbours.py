import itertools

import astropy.units as u
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fiberplan.focal_plane.neighbours import Neighbourhood, clearance_around, touching
from fiberplan.kernels.clearance import clearance, clearances
from fiberplan.kernels.neighbours import box_pairs, neighbour_lists, neighbour_pairs, sort_into_cells
from references import brute_boxes, brute_pairs, varied_plane

WAYS = {
    "uniform": lambda rng, n: rng.uniform(0, 100, (n, 2)),
    "clustered": lambda rng, n: rng.normal(0, 3, (n, 2)) + rng.choice([-200.0, 0.0, 500.0], (n, 1)),
    "in a row": lambda rng, n: np.stack([rng.uniform(0, 300, n), np.zeros(n)], axis=1),
    "along a diagonal": lambda rng, n: np.repeat(rng.uniform(0, 300, (n, 1)), 2, axis=1),
    "sparse": lambda rng, n: rng.uniform(-1e6, 1e6, (n, 2)),
    "one far away": lambda rng, n: np.concatenate([rng.uniform(0, 50, (n - 1, 2)), [[1e7, -1e7]]]),
    "all in one place": lambda rng, n: np.full((n, 2), 7.5),
    "on a grid": lambda rng, n: rng.integers(0, 9, (n, 2)) * 10.0,
}


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.integers(0, 10**6), st.sampled_from(sorted(WAYS)), st.integers(1, 60), st.sampled_from([0.0, 1.0, 30.0]))
def test_same_as_brute_force(seed, way, n, gap):
    rng = np.random.default_rng(seed)
    position = WAYS[way](rng, n)
    reach = rng.uniform(0, rng.choice([0.1, 5, 60]), n)
    found = neighbour_pairs(position, reach, gap)
    assert found.dtype == np.int64
    np.testing.assert_array_equal(found, brute_pairs(position, reach, gap))


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.integers(0, 10**6), st.sampled_from(sorted(WAYS)), st.integers(1, 40), st.sampled_from([0.0, 1.0, 30.0]))
def test_boxes_same_as_brute_force(seed, way, n, gap):
    rng = np.random.default_rng(seed)
    position = WAYS[way](rng, n)
    reach = rng.uniform(0, rng.choice([0.1, 5, 60]), n)
    low = rng.choice(position, 12) + rng.normal(0, 20, (12, 2))
    box = np.concatenate([low, low + rng.uniform(0, 1, (12, 2)) * rng.choice([0.0, 5.0, 1e3, 1e8], (12, 1))], axis=1)
    found = box_pairs(position, reach, box, gap)
    np.testing.assert_array_equal(found, brute_boxes(position, reach, box, gap))


@pytest.mark.parametrize("far", [1e3, 1e9, 1e18, 1e300])
def test_boxes_far_off_and_boundless(far):
    position = np.array([[0.0, 0.0], [30.0, 10.0], [60.0, 0.0]])
    box = np.array([[far, far, 2 * far, 2 * far], [-far, -far, far, far], [-far, 9.0, far, 11.0], [-far] * 4])
    found = box_pairs(position, np.full(3, 5.0), box, 1.0)
    np.testing.assert_array_equal(found, [[0, 1], [1, 1], [2, 1], [1, 2]])


def test_none_and_one():
    nothing = np.empty((0, 2))
    assert neighbour_pairs(nothing, np.empty(0), 1.0).shape == (0, 2)
    assert neighbour_pairs(np.zeros((1, 2)), np.ones(1), 1.0).shape == (0, 2)
    assert box_pairs(nothing, np.empty(0), np.zeros((1, 4)), 1.0).shape == (0, 2)
    assert box_pairs(np.zeros((1, 2)), np.ones(1), np.empty((0, 4)), 1.0).shape == (0, 2)


def test_reaches_that_only_touch_are_no_pair():
    position = np.array([[0.0, 0.0], [4.0, 0.0]])
    assert len(neighbour_pairs(position, np.array([2.0, 2.0]), 0.0)) == 0
    assert len(neighbour_pairs(position, np.array([2.0, 2.0]), 1e-9)) == 1


@pytest.mark.parametrize("way", sorted(WAYS))
def test_memory_grows_with_the_number_only(way):
    n = 5000
    position = WAYS[way](np.random.default_rng(0), n)
    *_, columns, rows, first, member = sort_into_cells(position, 1e-3)
    assert columns * rows < 10 * n
    assert len(first) == columns * rows + 1
    np.testing.assert_array_equal(np.sort(member), np.arange(n))


def test_lists_hold_every_pair_twice():
    rng = np.random.default_rng(3)
    position = rng.uniform(0, 60, (40, 2))
    pairs = neighbour_pairs(position, np.full(40, 5.0), 0.0)
    offsets, near = neighbour_lists(45, pairs)
    assert offsets[-1] == 2 * len(pairs)
    for i in range(45):
        own = near[offsets[i] : offsets[i + 1]]
        expected = [(int(b if a == i else a), k) for k, (a, b) in enumerate(pairs) if i in (a, b)]
        assert [tuple(map(int, row)) for row in own] == expected


def test_focal_plane_pairs_leave_out_no_contact():
    """Whoever is not a pair cannot be within the gap, however the joints stand."""
    rng = np.random.default_rng(6)
    for seed in range(6):
        plane = varied_plane(np.random.default_rng(seed), n=5)
        plane = plane.replace(base=plane.base * 3.0)
        for gap in (0.0, 4.0):
            within = {tuple(p) for p in plane.arm_pairs_within(gap).tolist()}
            assert plane.arm_pairs_within(gap * u.mm) is plane.arm_pairs_within(gap)  # found once
            everyone = np.array(list(itertools.combinations(range(plane.n + len(plane.obstacles)), 2)))
            everyone = everyone[everyone[:, 0] < plane.n]
            for _ in range(40):
                angles = rng.uniform(-4, 4, (plane.n, 2))
                near = clearances(plane.arms, plane.with_obstacles(angles), everyone) <= gap
                assert {tuple(p) for p in everyone[near].tolist()} <= within


def test_neighbourhood_asks_everyone_near():
    plane = varied_plane(np.random.default_rng(1), n=4)
    near = Neighbourhood.of(plane, 0.5)
    rng = np.random.default_rng(2)
    for _ in range(30):
        angles = rng.uniform(-4, 4, (plane.n, 2))
        everyone = plane.with_obstacles(angles)
        for i in range(plane.n):
            others = [j for j in range(len(everyone)) if j != i]
            gaps = {j: clearance(plane.arms, i, *everyone[i], j, *everyone[j]) for j in others}
            found = clearance_around(plane.arms, near, everyone, i, *everyone[i])
            if min(gaps.values()) <= 0.5:
                assert found == min(gaps.values())
            blamed = touching(plane.arms, near, everyone, np.array([i]), 0.5)[0]
            assert (blamed >= 0) == (min(gaps.values()) < 0.5)
            assert blamed < 0 or gaps[blamed] < 0.5


def test_neighbourhood_of_unknown_angles_is_never_clear():
    """A row of two NaN is nowhere; half a row is a mistake and must not look clear, whatever else is near."""
    plane = varied_plane(np.random.default_rng(1), n=4, obstacles=False).replace(base=np.zeros((4, 2)))
    near = Neighbourhood.of(plane, 0.5)
    everyone = np.array([[0.0, 0.0], [0.0, np.nan], [1.0, 0.0], [2.0, 0.0]])
    assert np.isnan(clearance_around(plane.arms, near, everyone, 0, 0.0, 0.0))
    assert touching(plane.arms, near, everyone, np.array([0]), -99.0)[0] == 1
