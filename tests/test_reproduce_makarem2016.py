"""Makarem2016 run again: its rows hold what is claimed of them, and lack of data is said."""

import json
from functools import partial

import numpy as np
import pytest

from fiberplan.cli.app import run as command
from fiberplan.focal_plane import FocalPlane
from fiberplan.planners import EllipticNavigationFunction
from fiberplan.reproductions import makarem2016
from fiberplan.reproductions.makarem2016 import arrays, conflict, moons, runs
from test_moons_reader import field, paf, write
from test_moons_reader import rows as targets_of_two


def by_quantity(rows):
    rows = list(rows)
    found = {row["quantity"]: row for row in rows}
    assert len(found) == len(rows)
    return found


def test_the_five_positioner_conflict():
    scene = conflict.five()
    rows = by_quantity(conflict.rows(scene))
    assert rows["five positioners: arrived"]["ours"] == 5
    assert rows["five positioners: contacts"]["ours"] == 0
    assert rows["five positioners: it leaves it by [mm]"]["ours"] > 10.0
    assert rows["five positioners: and is back at the end, off by [mm]"]["ours"] < 1e-3
    assert 0.0 < scene.came < scene.when < scene.plan.makespan
    k = int(np.argmin(np.abs(scene.times - scene.when)))
    assert scene.away[k, scene.who] == pytest.approx(scene.farthest)


def test_the_smaller_zone_goes_first():
    first, flipped = conflict.two_arms(2)
    assert first["n"] == 2 * 4
    assert first["ours"] == 1.0
    assert flipped["n"] == 4
    assert flipped["ours"] == 1.0


def test_most_of_1025_arrive_and_more_with_relief():
    rows = by_quantity(arrays.own_rows(arrays.on_its_own_array(1)))
    for kind in ("uniform", "clustered"):
        asked = rows[f"assigned of 1025, {kind} targets"]["ours"]
        alone, relief = (rows[f"arrived of 1025, {kind} targets, {mode}"]["ours"] for mode in ("alone", "relief"))
        assert 0.8 * asked < alone < relief < asked
        assert all(rows[f"contacts in all runs, {kind} targets, {mode}"]["ours"] == 0 for mode in ("alone", "relief"))


def test_what_sayres2021_says(monkeypatch):
    monkeypatch.setattr(arrays, "BUFFERS", (1.5,))
    rows = by_quantity(arrays.sayres_rows(arrays.on_sayres2021(1)))
    where = "sayres2021, buffer 1.5 mm"
    assert 0.25 < rows[f"share deadlocked, alone, {where}"]["ours"] < 0.5
    assert 0.8 < rows[f"share arrived, relief, {where}"]["ours"] < 0.95
    assert rows[f"share arrived in reverse, alone, {where}"]["ours"] > 0.97
    assert rows[f"contacts in all runs, {where}"]["ours"] == 0


def test_moons_cases_stand_beside_what_was_published(shared_data, monkeypatch):
    monkeypatch.setenv("FIBERPLAN_DATA", str(shared_data))
    monkeypatch.setattr(moons, "SIZES", (10, 30))
    rows = by_quantity(moons.rows(moons.cases()))
    assert rows["MOONS 30, targets 1, alone: arrived"]["paper"] == 20
    assert rows["MOONS 30, targets 1, relief: arrived"]["paper"] == 27
    assert rows["MOONS 10, targets 3, relief: arrived"]["ours"] == 10
    assert rows["MOONS 30: contacts in all runs"]["ours"] == 0
    assert rows["MOONS 30, relief: longest time to compute [s]"]["paper"] == 5.82
    assert len(rows) == 2 * 6 + 2 * 5


def test_command_skips_what_it_has_no_data_for(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("FIBERPLAN_DATA", str(tmp_path / "nowhere"))
    for name in ("own_rows", "sayres_rows"):
        monkeypatch.setattr(arrays, name, lambda runs: [])
    small = {(kind, mode): [] for kind in ("uniform", "clustered") for mode in ("alone", "relief")}
    monkeypatch.setattr(arrays, "on_its_own_array", lambda trials: small)
    monkeypatch.setattr(arrays, "on_sayres2021", lambda trials: {})
    figures = tmp_path / "figures"
    assert command(["reproduce", "makarem2016", "--trials", "1", "--json", "-o", str(figures)]) == 0
    rows = json.loads(capsys.readouterr().out)
    (skipped,) = [row for row in rows if "MOONS" in row["quantity"]]
    assert "skipped" in skipped["quantity"]
    assert (skipped["ours"], skipped["n"]) == (None, 0)
    assert all(set(row) == {"quantity", "paper", "ours", "spread", "n"} for row in rows)
    made = {path.name for path in figures.iterdir()}
    assert made == {"arrivals.png", "conflict.png", "distances.png", "index.html"}
    assert "alone" in makarem2016.LEGEND


@pytest.fixture
def coarse(monkeypatch):
    """Steps of a quarter of a second."""
    monkeypatch.setattr(runs, "EllipticNavigationFunction", partial(EllipticNavigationFunction, dt=0.25))


@pytest.fixture
def three(monkeypatch):
    """Of every array, three positioners next to each other."""
    few = conflict.neighbours(3)

    class Three(FocalPlane):
        load = staticmethod(lambda name: few)
        hexagonal = staticmethod(lambda rings, pitch: few)

    monkeypatch.setattr(arrays, "FocalPlane", Three)


@pytest.fixture
def case_of_moons(tmp_path, monkeypatch):
    """Three made-up positioners and targets for two of them, with what would have been published."""
    monkeypatch.setenv("FIBERPLAN_DATA", str(tmp_path))
    monkeypatch.setattr(moons, "SIZES", (3,))
    monkeypatch.setattr(moons, "FIELDS", (1,))
    folder = tmp_path / "moons" / "3"
    folder.mkdir(parents=True)
    write(folder, paf())
    field(folder, targets_of_two())
    lines = ["config,n_positioners,dnf_seconds,dnf_fsm_seconds,dnf_arrived,dnf_fsm_arrived", "1,2,0.02,0.048,1,2"]
    write(folder.parent, lines, "published_results.csv")


@pytest.mark.small
@pytest.mark.usefixtures("coarse", "three", "case_of_moons")
def test_every_experiment_on_few(drawn, tmp_path):
    rows = by_quantity(makarem2016.run(1, tmp_path))
    ours = {quantity: row["ours"] for quantity, row in rows.items()}
    for mode in ("alone", "relief"):
        for kind in ("uniform", "clustered"):
            assert ours[f"arrived of 1025, {kind} targets, {mode}"] == 3
            assert ours[f"contacts in all runs, {kind} targets, {mode}"] == 0
        for buffer in ("1.5", "2"):
            assert ours[f"share arrived in reverse, {mode}, sayres2021, buffer {buffer} mm"] == 1.0
        assert rows[f"MOONS 3, targets 1, {mode}: arrived"]["n"] == 2
        assert ours[f"MOONS 3, targets 1, {mode}: arrived"] == 2
    assert rows["MOONS 3, targets 1, alone: arrived"]["paper"] == 1
    assert rows["MOONS 3, relief: longest time to compute [s]"]["paper"] == 0.048
    assert ours["MOONS 3: contacts in all runs"] == 0
    assert ours["five positioners: arrived"] == 5
    assert ours["five positioners: it leaves it by [mm]"] > 10.0
    assert ours["five positioners: and is back at the end, off by [mm]"] < 1e-3
    assert set(drawn) == set(makarem2016.FIGURES)
    first, *_, last = drawn["conflict.png"]
    assert len(first.collections) == len(last.collections) > 0
    (ax,) = drawn["moons.png"]
    shown = {line.get_label(): line.get_ydata().tolist() for line in ax.lines}
    assert shown == {"published, alone": [0.5], "ours, alone": [1.0], "published, relief": [1.0], "ours, relief": [1.0]}


@pytest.mark.small
def test_two_arms_that_need_not_care_count_for_nothing(monkeypatch):
    monkeypatch.setattr(conflict, "EllipticNavigationFunction", partial(EllipticNavigationFunction, dt=0.5))
    monkeypatch.setattr(conflict, "uniform_field", lambda plane, seed: plane.folded + 0.01)
    assert [(row["ours"], row["n"]) for row in conflict.two_arms(1)] == [(None, 0), (None, 0)]
