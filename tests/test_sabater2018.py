"""The reproduction's parts on few plans; what it measures is in its rows."""

import numpy as np
import pytest

from fiberplan.focal_plane import FocalPlane
from fiberplan.reproductions.sabater2018 import FIRST_SEED, figures, published, tables
from fiberplan.reproductions.sabater2018.case import detailed
from fiberplan.reproductions.sabater2018.trials import PAPER, REPLANNING, fields, run
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
