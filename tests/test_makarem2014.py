"""Makarem2014 run again: its rows, its scenes, and the failures that are kept."""

import json
from itertools import pairwise

import numpy as np
import pytest

from fiberplan.cli.app import run as command
from fiberplan.plan import Outcome
from fiberplan.planners.navigation_function import NavigationFunction
from fiberplan.reproductions import makarem2014
from fiberplan.reproductions.makarem2014 import scenes, tables
from fiberplan.reproductions.makarem2014.conflict import CLOSE, MADE_WAY, Conflict, find_conflict
from fiberplan.reproductions.makarem2014.few_bits import quantized
from fiberplan.reproductions.makarem2014.rules import LIMITED, LITERAL, REPAIRED, RULES
from fiberplan.reproductions.makarem2014.trials import Runs, Trial, converged_at, run_clustered, run_uniform


@pytest.fixture(scope="module")
def runs():
    return run_uniform([2, 5], 3)


def test_the_rules_differ_as_they_should(runs):
    share = {rule: np.mean([t.converged for t in runs.trials[rule, 5]]) for rule in RULES}
    assert share[REPAIRED] == 1.0
    assert share[LIMITED] < 0.8 < share[LITERAL] <= 1.0
    for trials in runs.trials.values():
        assert all(trial.proven and trial.contacts == 0 for trial in trials)
    assert all(0.0 < trial.motion_time < 4.0 for trial in runs.trials[REPAIRED, 5])


def test_failures_are_kept_so_that_they_can_be_made_again(runs):
    failure = next(f for f in runs.failures if f.rule == LIMITED.name and f.rings == 5)
    plan = LIMITED.plan(scenes.uniform(scenes.array(failure.rings), failure.seed))
    assert tuple(plan.problem.plane.ids[i] for i in plan.lost) == failure.positioners
    assert not [f for f in runs.failures if f.rule == REPAIRED.name]


def test_a_field_that_the_repaired_field_alone_does_not_solve():
    """Two that stay in each other's way for good: the last resort brings them home."""
    problem = scenes.uniform(scenes.array(15), 49)
    plan = NavigationFunction().plan(problem)
    assert plan.faults() == []
    assert len(plan.lost) == 0


def test_convergence_is_that_of_fibers():
    problem = scenes.uniform(scenes.array(1), 3)
    plan = REPAIRED.plan(problem)
    when = converged_at(plan)
    assert np.all(when <= plan.makespan)
    goals = problem.plane.fibers(problem.goal)
    for i, t in enumerate(when):
        away = np.hypot(*(problem.plane.fibers(plan.trajectory.at(t))[i] - goals[i]))
        assert away <= 0.1
    assert Trial.of(plan, 0.5).motion_time == pytest.approx(when.max())


def test_clustered_fields_are_chained():
    problems = scenes.clustered(scenes.array(2), 3)
    for before, after in pairwise(problems):
        asked = before.has_goal
        np.testing.assert_allclose(before.goal[asked], after.start[asked])
    runs = run_clustered(2, 2)
    assert all(trial.proven for trials in runs.trials.values() for trial in trials)
    assert all(trial.arrived == 1.0 for trial in runs.trials[REPAIRED, 2])


def test_spacing_decides_for_the_printed_field():
    near, far = run_uniform([4], 4, rules=(LITERAL,)), run_uniform([4], 4, 2.0, rules=(LITERAL,))
    rows = list(tables.spacing(near, far, 4.0))
    assert rows[0]["ours"] > rows[1]["ours"]


@pytest.mark.small
def test_fig7_is_a_conflict_of_three_in_which_one_makes_room():
    conflict = Conflict.of(scenes.FIG7_SEED)
    assert set(conflict.plan.outcomes) == {Outcome.ARRIVED}
    assert conflict.detours.max() > MADE_WAY
    assert np.sum(conflict.closest < CLOSE) >= 2
    assert conflict.closest.min() >= 2.0
    assert find_conflict(scenes.FIG7_SEED) == scenes.FIG7_SEED
    limits = conflict.plan.problem.plane.max_speed[0]
    assert np.all(np.abs(conflict.speeds).max(axis=(0, 1)) <= limits * (1 + 1e-6))


def test_few_bits():
    (result,) = quantized(4, (4,), 1)
    assert result.proven
    assert result.on_target
    assert result.longer <= 1.1


def test_rows_and_figures(tmp_path):
    rows = makarem2014.run(1, tmp_path, rings=[1, 8, 9])
    ours = {row["quantity"]: row["ours"] for row in rows}
    assert len(ours) == len(rows)
    for figure in (5, 6, 7, 8):
        assert any(quantity.startswith(f"Fig. {figure}: ") for quantity in ours)
        assert (tmp_path / f"fig{figure}.png").stat().st_size > 10_000
    for field in ("uniform", "chained clustered"):
        assert ours[f"share of positioners that end exactly at their goals, {field} fields, repaired"] == 1.0
        for rule in RULES:
            assert ours[f"runs with a contact, {field} fields, {rule.name}"] == 0.0
    left = json.loads((tmp_path / "failures.json").read_text())
    assert {"field", "rings", "seed", "rule", "positioners"} == set(left[0])
    assert {item["rule"] for item in left} <= {LITERAL.name, LIMITED.name}


@pytest.mark.small
def test_every_experiment_on_seven_or_one(drawn, tmp_path, monkeypatch):
    """Of seven all converge under the printed field without joint limits, three within them, and all when repaired."""
    for name, least in (("CLUSTERED_RINGS", 0), ("SPACED_RINGS", 0), ("BITS", (4,)), ("RULES", ())):
        monkeypatch.setattr(makarem2014, name, least)  # there is nothing to compile
    rows = makarem2014.run(1, tmp_path, rings=[1])
    ours = {row["quantity"]: row["ours"] for row in rows}
    assert len(ours) == len(rows)
    for rule, converged in ((LITERAL, 1.0), (LIMITED, 3 / 7), (REPAIRED, 1.0)):
        assert ours[f"share of fibers that converge, uniform fields, {rule.name}"] == pytest.approx(converged)
        assert ours[f"runs that leave someone behind, uniform fields, {rule.name}"] == (converged < 1.0)
        assert ours[f"Fig. 6: motion time, N = 7, {rule.name} [s]"] > 0.0
        for field in ("uniform", "chained clustered"):
            assert ours[f"runs proven safe, {field} fields, {rule.name}"] == 1.0
    assert ours["Fig. 7: share of the three that converge"] == 1.0
    assert ours["Fig. 7: way that one leaves its target to make room [mm]"] > MADE_WAY
    assert ours["Fig. 7: smallest distance of two fiber ends [mm]"] >= 2.0
    assert ours["motions with all within the convergence distance, speeds in 4 bits, N = 1"] == 1.0
    (left,) = json.loads((tmp_path / "failures.json").read_text())
    assert (left["rule"], left["rings"], left["seed"], len(left["positioners"])) == (LIMITED.name, 1, 0, 4)
    assert set(drawn) == set(makarem2014.FIGURES)
    (ax,) = drawn["fig6.png"]
    shown = {bars.get_label(): bars.lines[0].get_ydata().tolist() for bars in ax.containers}
    assert shown == {rule.name: [ours[f"Fig. 6: motion time, N = 7, {rule.name} [s]"]] for rule in RULES}


@pytest.mark.small
def test_growth_of_computing_time_is_that_of_the_larger_fields():
    """Made-up times that grow as the square of the number, and one of a field too small to count."""
    sizes = {1: (7, 5.0), 9: (271, 2.71), 18: (1027, 10.27**2 / 2.71)}
    trials = {(LITERAL, rings): [Trial(n, cpu, 1.0, 1.0, 1.0, 0, True)] for rings, (n, cpu) in sizes.items()}
    rows = {row["quantity"]: row for row in tables.run_times(Runs(trials, ()))}
    row = rows["Fig. 5: computing time grows as N to the power of, literal"]
    assert row["ours"] == pytest.approx(2.0)
    assert (row["paper"], row["n"]) == (1.0, 2)


@pytest.mark.slow
def test_makarem2014(capsys, monkeypatch):
    monkeypatch.setattr(makarem2014, "RINGS", [1, 8, 18])
    assert command(["reproduce", "makarem2014", "--trials", "1", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    ours = {row["quantity"]: row["ours"] for row in rows}
    assert all(set(row) == {"quantity", "paper", "ours", "spread", "n"} for row in rows)
    assert 1.5 < ours["Fig. 6: motion time, N = 1027, repaired [s]"] < 4.0
