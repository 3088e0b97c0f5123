import itertools

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, milp

from fiberplan.problem.least_cover import least_cover

pytestmark = pytest.mark.small


def brute_cover(edges, weight):
    """Least weight, then fewest, then lowest numbers, over all subsets."""
    vertices = sorted({v for e in edges for v in e})
    subsets = itertools.chain.from_iterable(itertools.combinations(vertices, k) for k in range(len(vertices) + 1))
    covers = (s for s in subsets if all(a in s or b in s for a, b in edges))
    return set(min(covers, key=lambda s: (sum(weight[v] for v in s), len(s), s)))


def random_edges(rng, vertices, count):
    return [tuple(rng.choice(vertices, 2, replace=False).tolist()) for _ in range(count)]


def test_nothing_touches():
    assert least_cover([], np.ones(4)) == set()


@pytest.mark.parametrize("seed", range(60))
def test_agrees_with_brute_force_and_breaks_ties_the_same_way(seed):
    rng = np.random.default_rng(seed)
    edges = random_edges(rng, np.sort(rng.choice(50, 9, replace=False)), rng.integers(1, 16))
    weight = rng.choice([0.0, 1.0, 1.0, 2.0, 3.0], 50)
    assert least_cover(edges, weight) == brute_cover(edges, weight)


def test_ties_go_to_fewer_then_lower():
    assert least_cover([(3, 7)], np.ones(8)) == {3}
    assert least_cover([(7, 3)], np.ones(8)) == {3}
    assert least_cover([(0, 1), (0, 2)], np.array([2.0, 1.0, 1.0])) == {0}
    assert least_cover([(0, 1), (2, 1), (1, 2)], np.array([1.0, 9.0, 1.0])) == {0, 2}


def test_clusters_do_not_mix():
    edges = [(0, 1), (10, 11), (10, 12), (20, 21)]
    weight = np.ones(30)
    weight[0] = 5.0
    assert least_cover(edges, weight) == {1, 10, 20}


def ladder(rng, n):
    """One connected cluster of n vertices."""
    return [(k, k + 1) for k in range(n - 1)] + [e for e in random_edges(rng, n, n // 2) if abs(e[0] - e[1]) > 1]


def least_weight(edges, weight, n):
    """Least weight of any cover, by going through the vertices in order and trying both, with memory of the border."""
    later = {v: [max(e) for e in edges if min(e) == v] for v in range(n)}
    states = {frozenset(): 0.0}  # vertices that must be taken -> weight so far
    for v in range(n):
        after = {}
        for must, total in states.items():
            for rest, cost in ((must - {v}, total + weight[v]), *(() if v in must else ((must | {*later[v]}, total),))):
                after[rest] = min(after.get(rest, np.inf), cost)
        states = after
    return states[frozenset()]


def covers(taken, edges):
    return all(a in taken or b in taken for a, b in edges)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("scale", [1.0, 1e4])
def test_large_clusters_are_least_too(seed, scale):
    rng = np.random.default_rng(seed)
    edges = ladder(rng, 30)
    weight = scale + rng.integers(0, 9, 30)
    found = least_cover(edges, weight)
    assert covers(found, edges)
    assert weight[list(found)].sum() == pytest.approx(least_weight(edges, weight, 30), rel=1e-12)
    assert least_cover(edges, weight) == found


@pytest.mark.parametrize("scale", [1e-9, 1e-6, 1e9])
def test_priorities_of_any_scale(scale):
    """Only ratios of priorities matter."""
    edges = [(k, k + 1) for k in range(29)]
    weight = np.where(np.arange(30) % 3 == 0, 1.0, 2.0) * scale
    found = least_cover(edges, weight)
    assert covers(found, edges)
    assert weight[list(found)].sum() == pytest.approx(least_weight(edges, weight, 30), rel=1e-9)


def test_large_clusters_of_no_weight_lose_no_more_than_they_must():
    edges = [(k, k + 1) for k in range(29)]
    assert len(least_cover(edges, np.zeros(30))) == 15


def test_nearly_equal_priorities_in_large_clusters_are_not_rounded_off():
    """A solver that stops within 0.01 % of the least would lose more than it must."""
    rng, n = np.random.default_rng(2), 60
    edges = ladder(rng, n) + random_edges(rng, n, 60)
    weight = 1000.0 + 0.3 * rng.random(n)
    every_edge = LinearConstraint([np.isin(np.arange(n), e).astype(float) for e in edges], 1)
    exactly = {"mip_rel_gap": 0}
    least = milp(weight, integrality=np.ones(n), bounds=(0, 1), constraints=every_edge, options=exactly)
    assert weight[list(least_cover(edges, weight))].sum() <= least.fun + 1e-3
