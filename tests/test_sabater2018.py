"""The reproduction's parts on few plans; what it measures is in its rows."""

from dataclasses import replace

import numpy as np
import pytest

from fiberplan.focal_plane import FocalPlane
from fiberplan.reproductions import sabater2018
from fiberplan.reproductions.sabater2018 import FIRST_SEED, figures, published, tables
from fiberplan.reproductions.sabater2018.case import detailed
from fiberplan.reproductions.sabater2018.trials import CONTINUOUS, PAPER, REPLANNING, fields, run
from fiberplan.reproductions.sabater2018.variations import CHANGES, LENGTHS, varied


@pytest.fixture(scope="module")
def plane():
    return FocalPlane.load("miradas")


@pytest.fixture(scope="module")
def goals(plane):
    return fields(plane, range(FIRST_SEED, FIRST_SEED + 3))


def test_plans_from_park_and_chained(plane, goals):
    park, chained = run(plane, goals, PAPER, chained=False), run(plane, goals, REPLANNING, chained=True)
    assert (len(park), len(chained)) == (3, 2)
    for trial in park + chained:
        assert trial.proven
        assert trial.stops <= 1
        assert trial.solved == (not trial.losses)
    rows = list(tables.plans("from park", park, published.SOLVED_FROM_PARK, published.TIME_FROM_PARK))
    assert rows[0]["paper"] == 0.97
    assert rows[0]["ours"] == np.mean([trial.solved for trial in park])


def test_detailed_case_adds_up(plane, goals, tmp_path):
    case = detailed(plane, goals, PAPER)
    assert len(case.arms) == 12
    assert sum(arm.checks for arm in case.arms) == case.checks
    assert case.plan.makespan == 6.0 * max(arm.steps + arm.waits for arm in case.arms)
    assert all(arm.checks >= arm.unobstructed for arm in case.arms if arm.edges == 1)
    rows = {row["quantity"]: row for row in tables.case(case)}
    assert rows["detailed case: pair checks at 100 ms under way"]["paper"] == 75_684.0
    figures.snapshots(case.plan, tmp_path / "fig13.png")
    assert (tmp_path / "fig13.png").stat().st_size > 10_000


@pytest.mark.small
@pytest.mark.parametrize("which", LENGTHS)
@pytest.mark.parametrize("change", CHANGES)
def test_changed_lengths_still_make_arms(which, change, plane):
    """Park is clear and outside the zone of avoidance, tips stay where they were, and bodies end where links do."""
    other = varied(plane, which, change)
    changed = {"spacing": other.kinematics.spacing, "rocker": other.kinematics.rocker}
    changed |= {"length": other.length, "tip": other.fiber[:, 0]}
    before = {"spacing": 110.0, "rocker": 60.0, "length": 80.0, "tip": 260.0}
    for name, value in before.items():
        np.testing.assert_allclose(changed[name], value * (1 + change * (name == which)))
    np.testing.assert_allclose(other.fibers(other.folded), plane.fibers(plane.folded), atol=1e-9)
    assert other.clearance(other.folded).min() > 1.0
    probe, carriage, crank, rocker = other.bodies
    ends = (other.fiber[0, 0], other.kinematics.rocker[0], other.length[0], other.kinematics.rocker[0])
    assert [body.points[-1, 0] for body in (probe, carriage, crank, rocker)] == pytest.approx(ends)


@pytest.mark.small
def test_every_experiment_on_two(drawn, tmp_path, monkeypatch):
    """Two neighbours, roadmaps of few cells and edges, looks every three seconds."""
    few = FocalPlane.load("miradas").subset(np.arange(2))

    class Two(FocalPlane):
        load = staticmethod(lambda name: few)

    monkeypatch.setattr(sabater2018, "FocalPlane", Two)
    monkeypatch.setattr(sabater2018, "LENGTHS", {"tip": "d3tip"})
    monkeypatch.setattr(sabater2018, "CHANGES", (0.1,))
    for name, planner in (("PAPER", PAPER), ("REPLANNING", REPLANNING), ("CONTINUOUS", CONTINUOUS)):
        monkeypatch.setattr(sabater2018, name, replace(planner, grid=(2, 2), edges=4, collision_dt=3.0))
    rows = sabater2018.run(1, tmp_path)
    ours = {row["quantity"]: row["ours"] for row in rows}
    for what in ("from park, one pass", "chained, one pass", "from park, replanning", "chained, continuous"):
        assert ours[f"{what}: share solved in under 120 s"] == 1.0
        assert ours[f"{what}: share proven safe by verify"] == 1.0
        assert ours[f"{what}: most start-stops of any arm"] <= 1
        times = [ours[f"{what}: configuration time, {name} [s]"] for name in ("least", "median", "mean", "greatest")]
        assert len(set(times)) == 1  # of one plan
        assert times[0] % 6.0 == 0.0
    checks = [number for quantity, number in ours.items() if quantity.endswith(": pair checks")]
    assert len(checks) == 2
    assert sum(checks) == ours["detailed case: pair checks at 100 ms under way"]
    assert checks[0] == 0  # nobody goes before it
    assert ours["d3tip +10%: share proven safe by verify"] == 1.0
    assert set(drawn) == set(sabater2018.FIGURES)
    (bar,) = [bar for bar in drawn["fig11.png"][0].patches if bar.get_height() > 0]
    assert bar.get_height() == 1
    assert bar.get_x() <= ours["from park, one pass: configuration time, least [s]"] < bar.get_x() + bar.get_width()
