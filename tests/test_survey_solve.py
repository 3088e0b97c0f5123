"""The best set against brute force, level by level; what local search and the integer program must keep."""

import dataclasses

import numpy as np
import pytest

from fiberplan.arrays import read_only
from fiberplan.survey import Catalogue
from fiberplan.survey.choices import Choices
from fiberplan.survey.cliques import cliques
from fiberplan.survey.conflicts import touching_options
from fiberplan.survey.levels import Levels
from fiberplan.survey.local_search import local_search
from fiberplan.survey.options import options_of
from fiberplan.survey.quotas import Quotas, regions_of
from fiberplan.survey.solve import solve
from fiberplan.survey.standing import standing
from problems import hexagon
from test_survey_conflicts import scattered

pytestmark = pytest.mark.small


def choices_of(catalogue, margin=1.0, required=None, regions=1, plane=None):
    plane = plane or hexagon(1)
    there = standing(plane, None, None, margin, None)
    table = touching_options(there, options_of(plane, catalogue, plane.online))
    quotas = Quotas.of(plane, required, regions)
    group = quotas.group(catalogue, table.options.positioner, table.options.target)
    weight = Levels.of(there, catalogue, table.options, group).weight
    return Choices.of(table, plane.n, len(catalogue), weight, group, quotas.need)


def excludes(choices, a, b):
    return (choices.place[a] == choices.place[b]).any() or b in choices.touched(a)


def allowed(choices, chosen):
    chosen = list(map(int, chosen))
    apart = not any(excludes(choices, a, b) for k, a in enumerate(chosen) for b in chosen[:k])
    groups = np.bincount(choices.group[chosen][choices.group[chosen] >= 0], minlength=len(choices.need))
    return apart and (groups <= choices.need).all()


def best_by_brute_force(choices):
    """Weights of the best allowed set but for motion, by trying every option of every positioner in turn."""
    n, best = int(choices.robot.max()) + 1, [(0,) * (choices.weight.shape[1] - 1)]

    def extend(i, chosen):
        if i == n:
            if allowed(choices, chosen):
                best[0] = max(best[0], tuple(choices.weight[chosen, :-1].sum(axis=0).tolist()))
            return
        extend(i + 1, chosen)
        for v in choices.at(i).tolist():
            if not any(excludes(choices, v, u) for u in chosen):
                extend(i + 1, [*chosen, v])

    extend(0, [])
    return best[0]


def catalogue_of(seed, count=8, **more):
    rng = np.random.default_rng(seed)
    return scattered(hexagon(1), count, seed, priority=rng.integers(1, 6, count).astype(float), **more)


CASES = {
    "priorities": lambda seed: choices_of(catalogue_of(seed)),
    "tiers": lambda seed: choices_of(catalogue_of(seed, tier=np.arange(8) % 3)),
    "required": lambda seed: choices_of(catalogue_of(seed, category=("sky", "", "", "") * 2), required={"sky": 2}),
    "regions": lambda seed: choices_of(catalogue_of(seed, category=("sky", "") * 4), required={"sky": 3}, regions=2),
}


@pytest.mark.large
@pytest.mark.parametrize("case", CASES)
def test_the_best_set_is_found_and_proven(case):
    for seed in range(3):
        choices = CASES[case](seed)
        best = best_by_brute_force(choices)
        exact, searched = (solve(choices, solver, 0, None) for solver in ("milp", "heuristic"))
        assert tuple(exact.totals[:-1]) == tuple(exact.bounds[:-1]) == best
        for solved in (exact, searched):
            assert allowed(choices, solved.chosen)
            assert tuple(choices.weight[solved.chosen].sum(axis=0)) == tuple(solved.totals)
            assert tuple(solved.bounds[:-1]) >= best >= tuple(solved.totals[:-1])


def test_what_was_ruled_out_is_not_taken():
    choices = choices_of(catalogue_of(1))
    first = solve(choices, "milp", 0, None).chosen
    ruled = choices.without(np.array([first[:2], first[[-1, -1]]]))
    again = solve(ruled, "milp", 0, None)
    assert first[-1] not in again.chosen
    assert not set(first[:2]) <= set(again.chosen)
    assert allowed(ruled, again.chosen)
    assert tuple(again.totals[:-1]) == best_by_brute_force(ruled) <= tuple(choices.weight[first, :-1].sum(axis=0))


def test_each_clique_is_one_and_all_exclusions_are_in_some():
    choices = choices_of(catalogue_of(2, 12))
    matrix, m = cliques(choices), len(choices.place)
    covered = set()
    for row in range(matrix.shape[0]):
        members = matrix.indices[matrix.indptr[row] : matrix.indptr[row + 1]].tolist()
        pairs = {(a, b) for a in members for b in members if a < b}
        assert all(excludes(choices, a, b) for a, b in pairs)
        others = [v for v in range(m) if v not in members]
        assert not any(all(excludes(choices, v, u) for u in members) for v in others)  # none fits in besides
        covered |= pairs
    assert covered == {(a, b) for b in range(m) for a in range(b) if excludes(choices, a, b)}


@pytest.mark.large
def test_short_motion_breaks_ties_and_only_ties():
    plane = hexagon(2)
    choices = choices_of(scattered(plane, 150), plane=plane)
    blind = choices._replace(weight=read_only(choices.weight[:, :1], np.int64))
    value = local_search(blind, 3_000, 0)
    short = local_search(choices, 3_000, 0, begin=value)
    worth, cost = choices.weight[short].sum(axis=0)
    assert worth >= choices.weight[value, 0].sum()
    assert cost > choices.weight[value, 1].sum()
    assert (local_search(choices, 3_000, 0, begin=value) == short).all()


def test_priorities_with_digits_are_summed_exactly():
    catalogue = dataclasses.replace(catalogue_of(3), priority=np.linspace(0.1, 0.8, 8))
    solved = solve(choices_of(catalogue), "milp", 0, None)
    tenths = solve(choices_of(dataclasses.replace(catalogue, priority=np.arange(1.0, 9.0))), "milp", 0, None)
    assert solved.totals[0] == tenths.totals[0]


def test_regions_have_equally_many_positioners():
    plane = hexagon(3)
    assert set(np.bincount(regions_of(plane, 5)).tolist()) <= {7, 8}
    assert Quotas.of(plane, {"sky": 7, "standard": 1}, 5).need.tolist() == [2, 2, 1, 1, 1, 1, 0, 0, 0, 0]


def test_nothing_to_choose_from():
    choices = choices_of(Catalogue([500.0], [0.0]))
    assert not len(solve(choices, "milp", 0, None).chosen)
