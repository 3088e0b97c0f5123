"""Which goals to give up so that no two touch: the least weighted vertex cover of the graph of touching goals."""

from collections import defaultdict
from collections.abc import Iterable

import numpy as np

_SMALL = 20  # clusters up to this size are searched for the exact tie-break, larger ones go to a MILP solver


def least_loss(
    contacts: Iterable[tuple[int, int]], can_yield: np.ndarray, weight: np.ndarray
) -> dict[int, tuple[int, ...]]:
    """Goals of least total weight whose loss removes every contact -> the arms that each of them touches.

    Args:
        contacts: pairs of arms, of which at least one can yield.
        can_yield: (arms,) whether an arm has anything to lose; obstacles and what is held at rest have not.
        weight: (n,) of 0 or more, of those that can.
    """
    contacts = [(int(a), int(b)) for a, b in contacts]
    forced = {a if can_yield[a] else b for a, b in contacts if not (can_yield[a] and can_yield[b])}
    free = [(a, b) for a, b in contacts if a not in forced and b not in forced]
    lost = sorted(forced | least_cover(free, weight))
    return {i: tuple(b if a == i else a for a, b in contacts if i in (a, b)) for i in lost}


def least_cover(edges: Iterable[tuple[int, int]], weight: np.ndarray) -> set[int]:
    """Vertices of least total weight that touch every edge.

    Ties go to fewer vertices, then to lower numbers (in clusters of more than 20 vertices: any of
    those, but always the same).

    Args:
        edges: pairs of vertices.
        weight: (n,) of 0 or more.
    """
    edges = [(min(e), max(e)) for e in edges]
    if not edges:
        return set()
    vertices = sorted({v for e in edges for v in e})
    local = {v: k for k, v in enumerate(vertices)}
    rows, columns = np.array([[local[a], local[b]] for a, b in edges]).T
    from scipy.sparse import csr_array  # slow to import, as below
    from scipy.sparse.csgraph import connected_components

    graph = csr_array((np.ones(len(edges)), (rows, columns)), shape=(len(vertices), len(vertices)))
    _, label = connected_components(graph, directed=False)
    clusters: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for a, b in edges:
        clusters[label[local[a]]].append((a, b))
    cover: set[int] = set()
    for cluster in clusters.values():
        size = len({v for e in cluster for v in e})
        cover |= _exact_cover(cluster, weight) if size <= _SMALL else _milp_cover(cluster, weight)
    return cover


def _exact_cover(edges: list[tuple[int, int]], weight: np.ndarray) -> set[int]:
    """Least cover of one small cluster by branching on an uncovered edge: one end or the other must go."""
    best: list[tuple[float, int, list[int]]] = [(np.inf, 0, [])]

    def search(taken: frozenset[int], kept: frozenset[int]) -> None:
        rank = (sum(float(weight[v]) for v in sorted(taken)), len(taken), sorted(taken))
        if rank[:2] > best[0][:2]:
            return
        edge = next((e for e in edges if e[0] not in taken and e[1] not in taken), None)
        if edge is None:
            best[0] = min(best[0], rank)
            return
        a, b = edge
        if a not in kept:
            search(taken | {a}, kept)
        if b not in kept:
            search(taken | {b}, kept | {a})

    search(frozenset(), frozenset())
    return set(best[0][2])


def _milp_cover(edges: list[tuple[int, int]], weight: np.ndarray) -> set[int]:
    """Least cover of one large cluster: first the least weight, then the fewest vertices of that weight."""
    from scipy.optimize import Bounds, LinearConstraint, milp  # slow to import, and hardly ever needed
    from scipy.sparse import csr_array

    vertices = sorted({v for e in edges for v in e})
    local = {v: k for k, v in enumerate(vertices)}
    rows = np.repeat(np.arange(len(edges)), 2)
    columns = np.array([local[v] for e in edges for v in e])
    ends = csr_array((np.ones(2 * len(edges)), (rows, columns)), shape=(len(edges), len(vertices)))
    cost = weight[vertices] / max(float(weight[vertices].max()), np.finfo(float).tiny)
    every_edge = LinearConstraint(ends, 1)
    shared = {"integrality": np.ones(len(vertices)), "bounds": Bounds(0, 1), "options": {"mip_rel_gap": 0.0}}
    lightest = milp(cost, constraints=every_edge, **shared)
    no_heavier = LinearConstraint(cost, ub=lightest.fun + 1e-9 * len(vertices))
    fewest = milp(np.ones(len(vertices)), constraints=[every_edge, no_heavier], **shared)
    solution = fewest if fewest.success else lightest
    return {v for v, taken in zip(vertices, solution.x, strict=True) if taken > 0.5}
