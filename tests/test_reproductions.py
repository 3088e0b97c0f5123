"""Published experiments run again: the rows, and the loops behind them on scenes small enough to reason about."""

import json

import numpy as np
import pytest

from fiberplan.certificates import verify
from fiberplan.cli.app import run as command
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory
from fiberplan.reproductions import sayres2021
from fiberplan.reproductions.rows import Row, mean, share, value
from fiberplan.reproductions.sayres2021 import figures, published, relief, tables, trials
from fiberplan.reproductions.sayres2021.relief import relieve, replace_until_folded
from fiberplan.reproductions.sayres2021.rules import CERTIFIED, LITERAL, RULES, SAMPLED
from fiberplan.reproductions.sayres2021.trials import Trial, forward, sweep, turned
from fiberplan.scenes.uniform import uniform_field

STEP = np.radians(1.0)
CROWDED = 3.0  #: buffer at which small arrays deadlock too [mm]


@pytest.fixture(scope="module")
def plane():
    return FocalPlane.hexagonal(4, 22.4)


@pytest.fixture(scope="module")
def deadlocked(plane):
    """A field that deadlocks, and its neighbourhood."""
    margin = published.margin(CROWDED)
    near = Neighbourhood.of(plane, margin)
    for seed in range(100):
        field = uniform_field(plane, seed, margin)
        if len(CERTIFIED.walk(plane, field, margin, STEP, near).stuck):
            return field, near
    pytest.fail("no field deadlocks")


def relieved(plane, deadlocked, seed):
    field, near = deadlocked
    rng = np.random.default_rng(seed)
    return replace_until_folded(plane, field, published.margin(CROWDED), STEP, CERTIFIED, near, rng)


def test_replacements_end_a_deadlock(plane, deadlocked):
    field, near = deadlocked
    margin = published.margin(CROWDED)
    stuck = CERTIFIED.walk(plane, field, margin, STEP, near).stuck
    result = relieved(plane, deadlocked, 0)
    assert result.replaced[0] in stuck
    changed = np.flatnonzero(np.any(result.angles != field, axis=1))
    assert set(changed) == set(result.replaced)
    assert result.lost == len(changed) / plane.n
    assert result.trial.complete
    assert result.trial.proven
    assert not len(CERTIFIED.walk(plane, result.angles, margin, STEP, near).stuck)


def test_replacements_repeat_by_seed(plane, deadlocked):
    again = [relieved(plane, deadlocked, seed) for seed in (3, 3)]
    assert again[0].replaced == again[1].replaced
    assert np.array_equal(again[0].angles, again[1].angles)


def test_nothing_is_replaced_in_a_field_that_folds(plane):
    near = Neighbourhood.of(plane, 0.0)
    field = plane.folded + np.array([0.3, -0.2])
    result = replace_until_folded(plane, field, 0.0, STEP, CERTIFIED, near, np.random.default_rng(0))
    assert result.replaced == ()
    assert result.trial.complete


def test_a_literal_noop_deadlocks_where_skipping_it_does_not(plane):
    chance = {}
    for rule in (LITERAL, SAMPLED):
        trials = sweep(plane, [2.0], STEP, 40)[rule, 2.0]
        chance[rule] = np.mean([not trial.complete for trial in trials])
    assert chance[LITERAL] > chance[SAMPLED]


def test_certified_motions_have_no_contact_and_sampled_ones_do(plane):
    results = sweep(plane, [CROWDED], np.radians(6.0), 20)
    assert all(trial.proven and trial.overlap == 0.0 for trial in results[CERTIFIED, CROWDED])
    assert any(trial.overlap > 0.0 for trial in results[SAMPLED, CROWDED])


def test_a_wider_buffer_deadlocks_more(plane):
    results = sweep(plane, [1.5, CROWDED], STEP, 10)
    for rule in RULES:
        narrow, wide = ([trial.folded for trial in results[rule, buffer]] for buffer in (1.5, CROWDED))
        assert np.mean(wide) < np.mean(narrow)


def test_forward_greedy_fails_where_folding_works(plane):
    arrived = forward(plane, CERTIFIED, STEP, 5)
    folded = [trial.folded for trial in sweep(plane, [1.5], STEP, 5)[CERTIFIED, 1.5]]
    assert np.mean(arrived) < 0.8 < np.mean(folded)


def test_sampled_rules_keep_the_margin_alone(plane):
    near = Neighbourhood.of(plane, 1.0)
    field = uniform_field(plane, 0, 1.0)
    assert SAMPLED.walk(plane, field, 1.0, STEP, near).rules.limit == 1.0
    assert CERTIFIED.walk(plane, field, 1.0, STEP, near).rules.limit > 1.0


def test_fold_time_is_loops_times_step_over_speed(plane):
    walker = CERTIFIED.walk(plane, uniform_field(plane, 1), 0.0, STEP, Neighbourhood.of(plane, 0.0))
    trial = Trial.of(plane, walker, 0.0)
    assert trial.fold_time == pytest.approx(walker.loops * STEP / np.radians(30.0), rel=1e-8)
    assert trial.proven == verify(plane, walker.trajectory()).ok


def test_turns_are_counted_per_positioner():
    motion = Trajectory(
        np.array([0, 3, 4]), np.array([0.0, 1.0, 2.0, 0.0]), np.array([[0.0, 0.0], [1.0, 0.5], [0.0, 0.5], [9.0, 9.0]])
    )
    assert turned(motion).tolist() == [2.5, 0.0]


def test_rows():
    assert value("q", None, None, 0) == Row(quantity="q", paper=None, ours=None, spread=None, n=0)
    assert mean("q", 2.0, [1.0, 3.0]) == Row(quantity="q", paper=2.0, ours=2.0, spread=pytest.approx(np.sqrt(2)), n=2)
    assert mean("q", None, [])["ours"] is None
    assert share("q", "all", [True, False])["ours"] == 0.5


def test_from_field_to_field_takes_both_folds():
    assert tables.target_to_target([12.0, 13.0, 14.0]) == [25.0, 27.0]


def test_relief_regimes_are_pooled(plane):
    reliefs = relieve(plane, [1.5, CROWDED], STEP, 2)
    assert len(tables.pool(reliefs, SAMPLED, "below")) == len(tables.pool(reliefs, SAMPLED, "above")) == 2


@pytest.mark.small
def test_sayres2021_on_three(drawn, tmp_path, monkeypatch):
    """Every experiment at coarse steps: one field deadlocks where moves are swept, the other where no-ops are taken."""
    three, steps = FocalPlane.hexagonal(1, 22.4).subset([0, 1, 3]), np.radians([10.0, 5.0]).tolist()

    class Three(FocalPlane):
        load = staticmethod(lambda name: three)

    monkeypatch.setattr(sayres2021, "FocalPlane", Three)
    for name, few in (("BUFFERS", [1.5, CROWDED]), ("RELIEF_BUFFERS", [CROWDED]), ("FINE_BUFFERS", [1.5])):
        monkeypatch.setattr(sayres2021, name, few)
    for name, step in (("STEP", steps[0]), ("FINE_STEP", steps[1]), ("TIMED_STEPS", steps[:1]), ("PATH_STEPS", steps)):
        monkeypatch.setattr(sayres2021, name, step)
    for module in (trials, relief):
        monkeypatch.setattr(module, "uniform_field", lambda plane, k, *rest: uniform_field(plane, (65, 83)[k], *rest))

    rows = sayres2021.run(2, tmp_path)
    ours = {row["quantity"]: row["ours"] for row in rows}
    assert len(ours) == len(rows)
    assert set(drawn) == set(sayres2021.FIGURES)
    for figure in (4, 7, 10, 11, 12, 14, 15, 16):
        assert any(quantity.startswith(f"Fig. {figure}: ") for quantity in ours)
        assert drawn[f"fig{figure}.png"][0].get_title(loc="left").startswith(f"Fig. {figure}: ")
    shown = {bars.get_label(): bars.lines[0].get_ydata().tolist() for bars in drawn["fig12.png"][0].containers}
    assert shown == {"literal": [1.0, 0.5], "sampled": [1.0, 1.0], "certified": [1.0, pytest.approx(2 / 3)]}
    for rule, folded, stuck in ((LITERAL, 0.5, 0.5), (SAMPLED, 1.0, 0.0), (CERTIFIED, (1 / 3 + 1.0) / 2, 0.5)):
        wide, above = f"buffer 3.00 mm, {rule.name}", f"buffers above 2.25 mm, {rule.name}"
        assert ours[f"Fig. 12: share folded, buffer 1.50 mm, {rule.name}"] == 1.0
        assert ours[f"Fig. 12: share folded, {wide}"] == pytest.approx(folded)
        assert ours[f"Fig. 14: deadlock chance at 10 deg, {wide}"] == stuck
        assert ours[f"Fig. 14: deadlock chance at 5 deg, buffer 1.50 mm, {rule.name}"] == 0.0
        assert ours[f"Fig. 15: share of trials that need any, {above}"] == stuck
        assert ours[f"Fig. 15: share of trials resolved, {above}"] == 1.0
        assert (ours[f"Fig. 15: replacements in a deadlocked trial, median, {above}"] is None) == (stuck == 0.0)
        once, after = (
            ours[f"Fig. 16: {way} after replacements, {wide} [s]"] for way in ("fold time", "target to target")
        )
        assert after == pytest.approx(2.0 * once)  # of two fields: there is one move, which takes both folds
    assert ours["motions with a contact at 10 deg, certified"] == 0.0
    assert ours["motions proven safe at 10 deg, certified"] == 1.0
    assert ours["Fig. 10: share of fibers never 1 mm apart between 10 deg and 5 deg"] < 1.0


@pytest.mark.slow
def test_sayres2021(tmp_path, capsys, monkeypatch):
    """At two buffers of ten, with 0.3 deg as the finer step, and points farther apart where fibers are counted."""
    for name, few in (("BUFFERS", [1.5, 3.0]), ("RELIEF_BUFFERS", [1.5, 3.0]), ("FINE_STEP", np.radians(0.3))):
        monkeypatch.setattr(sayres2021, name, few)
    for module in (tables, figures):
        monkeypatch.setattr(module, "COVERAGE_STEP", 1.0)
    assert command(["reproduce", "sayres2021", "--trials", "2", "--json", "-o", str(tmp_path)]) == 0
    rows = json.loads(capsys.readouterr().out)
    ours = {row["quantity"]: row["ours"] for row in rows}
    assert len(ours) == len(rows)
    for row in rows:
        assert set(row) == {"quantity", "paper", "ours", "spread", "n"}
        assert (row["ours"] is None) == (row["n"] == 0)
    for figure in (10, 11, 12, 14, 15, 16):
        assert any(quantity.startswith(f"Fig. {figure}: ") for quantity in ours)
        assert (tmp_path / f"fig{figure}.png").stat().st_size > 10_000
    for step in ("1 deg", "0.3 deg"):
        assert ours[f"motions with a contact at {step}, certified"] == 0.0
        assert ours[f"motions proven safe at {step}, certified"] == 1.0
    for rule in RULES:
        narrow, wide = (ours[f"Fig. 12: share folded, buffer {b} mm, {rule.name}"] for b in ("1.50", "3.00"))
        assert 0.9 < wide < narrow <= 1.0
        assert ours[f"Fig. 14: deadlock chance at 1 deg, buffer 3.00 mm, {rule.name}"] == 1.0
        assert 11.0 < ours[f"Fig. 16: fold time after replacements, buffer 1.50 mm, {rule.name} [s]"] < 16.0
        assert ours[f"forward greedy: share that arrives, {rule.name}"] < 0.8

    monkeypatch.setattr(sayres2021, "run", lambda trials, folder: rows)
    assert command(["reproduce", "sayres2021", "--trials", "2"]) == 0
    out = capsys.readouterr().out
    assert "13 +- 1" in out
    assert "literal: moves are tested where they end" in out
