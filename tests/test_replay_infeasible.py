"""Losses said to be proven are replayed from the file: closed regions hold, and every way out of them is noticed."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates.replay import Claims
from fiberplan.certificates.replay_infeasible import has_proof, unfounded
from fiberplan.certificates.unreachable import closed_region
from fiberplan.io.plan_file import plan_bytes
from test_unreachable import walled


@pytest.fixture(scope="module")
def pocket():
    """The claims of a plan of which the only goal is shut off by a post, 0.1 mm too near."""
    plane = walled(-0.1)
    problem = fp.Problem(plane, np.radians([[45.0, 0.0]]), np.radians([[-225.0, 0.0]]))
    plan = fp.planners.Direct().plan(problem)
    assert plan.outcomes == (fp.Outcome.INFEASIBLE,)
    return Claims(plan_bytes(plan))


def changed(claims, change):
    """What is found of the claims whose region has been changed."""
    table = claims.tables["CERTIFICATE_REGIONS"].copy()
    before = claims.tables
    claims.tables = before | {"CERTIFICATE_REGIONS": change(table)}
    try:
        return list(unfounded(claims, "it", 0)) if has_proof(claims, 0) else ["none"]
    finally:
        claims.tables = before


def test_a_closed_region_is_shown_to_be(pocket):
    assert has_proof(pocket, 0)
    assert list(unfounded(pocket, "it", 0)) == []


def test_a_box_less_is_a_way_out_and_no_box_is_no_proof(pocket):
    """Of the widest boxes, in which the arm is clear; of narrow ones at the edge not every one is needed."""
    table = pocket.tables["CERTIFICATE_REGIONS"]
    wide = table["high_alpha"] - table["low_alpha"]
    for k in np.flatnonzero(wide > 0.9 * wide.max())[::25]:
        faults = changed(pocket, lambda table, k=k: np.delete(table, k))
        assert "not shown to be closed" in faults[0] or "start is not in" in faults[0]
    assert changed(pocket, lambda table: table[:0]) == ["none"]


def test_boxes_that_are_shifted_turned_over_or_everything_prove_nothing(pocket):
    def shifted(table):
        table["high_alpha"] += 1e-3
        return table

    def turned_over(table):
        table["low_beta"], table["high_beta"] = table["high_beta"].copy(), table["low_beta"].copy()
        return table

    def everything(table):
        table = table[:1]
        for name, value in (("low_alpha", -9.0), ("high_alpha", 9.0), ("low_beta", -9.0), ("high_beta", 9.0)):
            table[name] = value
        return table

    def not_numbers(table):
        table["high_alpha"][0] = np.nan
        return table

    assert any("not shown to be closed" in fault for fault in changed(pocket, shifted))
    assert any("not shown" in fault for fault in changed(pocket, turned_over))
    assert changed(pocket, everything) == ["it is said to be unable to reach its goal, and is not shown to be"]
    assert any("not shown to be" in fault for fault in changed(pocket, not_numbers))


def test_regions_hold_the_start_and_never_the_goal():
    plane, start, goal = walled(-0.2), np.radians([[45.0, 0.0]]), np.radians([-225.0, 0.0])
    region = closed_region(plane, 0, start, goal, 0.0)
    low, high = region[:, :, 0], region[:, :, 1]
    assert ((low <= start[0]) & (start[0] <= high)).all(axis=1).any()
    assert not ((low <= goal) & (goal <= high)).all(axis=1).any()
    assert closed_region(walled(0.2), 0, start, goal, 0.0) is None


def test_speeds_prove_what_is_too_far_for_the_time():
    plane = walled(5.0)
    problem = fp.Problem(plane, np.radians([[45.0, 0.0]]), np.radians([[-225.0, 0.0]]))
    plan = fp.planners.Direct(max_time=1.0).plan(problem)
    assert plan.outcomes == (fp.Outcome.INFEASIBLE,)
    claims = Claims(plan_bytes(plan))
    assert has_proof(claims, 0)
    assert list(unfounded(claims, "it", 0)) == []
    claims.said["parameters"]["max_time"] = 100.0
    assert not has_proof(claims, 0)
