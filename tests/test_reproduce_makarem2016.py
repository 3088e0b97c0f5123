"""Makarem2016 run again: its rows hold what is claimed of them, and lack of data is said."""

import json

import numpy as np
import pytest

from fiberplan.cli.app import run as command
from fiberplan.reproductions import makarem2016
from fiberplan.reproductions.makarem2016 import arrays, conflict, moons


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
    assert {path.name for path in figures.iterdir()} == {"arrivals.png", "conflict.png", "distances.png"}
    assert "alone" in makarem2016.LEGEND
