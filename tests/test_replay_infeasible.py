"""Losses said to be proven are replayed from the file: barriers hold, and every way through them is noticed."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates.replay import BadFileError, Claims
from fiberplan.certificates.replay_infeasible import has_proof, unfounded
from fiberplan.certificates.whole_replay import replay
from fiberplan.io.plan_file import plan_bytes
from test_unreachable import walled

pytestmark = pytest.mark.small


@pytest.fixture(scope="module")
def pocket():
    """The claims of a plan of which the only goal is shut off by a post, 0.1 mm too near."""
    plane = walled(-0.1)
    problem = fp.Problem(plane, np.radians([[45.0, 0.0]]), np.radians([[-225.0, 0.0]]))
    plan = fp.planners.Direct().plan(problem)
    assert plan.outcomes == (fp.Outcome.INFEASIBLE,)
    return Claims(plan_bytes(plan))


def tree_of(claims):
    return b"".join(claims.tables["CERTIFICATE_TREES"]["boxes"].tolist()).decode()


def changed(claims, tree=None, members=None):
    """What is found of claims whose boxes, or whose statement of what they are, have been changed."""
    before = claims.tables
    text = (tree_of(claims) if tree is None else tree).encode()
    stated = np.array([(0, text)], [("barrier", "i8"), ("boxes", f"S{len(text) + 1}")])
    table = before["CERTIFICATE_BARRIERS"].copy()
    claims.tables = before | {"CERTIFICATE_TREES": stated, "CERTIFICATE_BARRIERS": (members or (lambda t: t))(table)}
    try:
        return list(unfounded(claims, "it", 0)) if has_proof(claims, 0) else ["none"]
    finally:
        claims.tables = before


def test_a_barrier_is_shown_to_be_closed_and_so_is_the_whole_file(pocket):
    assert has_proof(pocket, 0)
    assert list(unfounded(pocket, "it", 0)) == []
    done = replay(pocket, jobs=1)
    assert done.faults == ()
    assert not any("without a proof" in note for note in done.notes)


def test_of_every_box_something_is_noticed(pocket):
    """What may be come to is needed, or where it is not, all is closed without it; nothing blocked may be left out."""
    tree = tree_of(pocket)
    assert {"i", "b", "o"} <= set(tree)
    for k, mark in enumerate(tree):
        if mark == "b":
            assert "way out" in changed(pocket, tree[:k] + "o" + tree[k + 1 :])[0]
        if mark in "bo":
            faults = changed(pocket, tree[:k] + "i" + tree[k + 1 :])
            assert mark == "b" or "way out" in faults[0] or "goals may be" in faults[0]
        if mark == "i":
            faults = changed(pocket, tree[:k] + "o" + tree[k + 1 :])
            assert "way out" in faults[0] or "start is outside" in faults[0]
            faults = changed(pocket, tree[:k] + "b" + tree[k + 1 :])
            assert "nobody touches" in faults[0] or "start is outside" in faults[0]


def test_boxes_that_are_none_and_goals_that_are_others_prove_nothing(pocket):
    tree = tree_of(pocket)
    for wrong in (tree + "i", tree[:-1], "0" * 70 + "i" * 71, tree.replace("0", "2"), tree.replace("i", "x")):
        assert "no such boxes" in changed(pocket, wrong)[0]
    assert "goals may be" in changed(pocket, "i")[0]
    assert "start is outside" in changed(pocket, "o")[0]

    def elsewhere(table):
        table["goal_alpha"] += 0.01
        return table

    def nobody(table):
        table["positioner"] = 7
        return table

    def none_turns(table):
        table["turns"] = b"F"
        return table

    assert changed(pocket, members=elsewhere) == ["it is said to be unable to reach its goal, and is not shown to be"]
    assert "no such boxes" in changed(pocket, members=none_turns)[0]
    assert changed(pocket, members=lambda table: table[:0]) == ["none"]
    with pytest.raises(BadFileError, match="no such positioners"):
        changed(pocket, members=nobody)


def test_who_has_no_goal_is_not_proven_to_miss_it(pocket):
    """The goal is not kept, and nothing says that it was given up: no proof would have anything to exclude."""
    before, pocket.problem = pocket.problem, pocket.problem.copy()
    pocket.problem["goal_alpha"] = pocket.problem["goal_beta"] = np.nan
    try:
        told = ["it is said to be unable to reach its goal, and has none"]
        assert list(unfounded(pocket, "it", 0)) == told
        assert changed(pocket, members=lambda table: table[:0]) == told
    finally:
        pocket.problem = before


def test_far_from_the_origin_nothing_is_proven(pocket):
    """There floating point, of which a depth is made, is coarser than what a proof allows for it."""
    before = pocket.slack
    pocket.slack = 1e-6
    try:
        assert "larger than rounding" in changed(pocket)[0]
    finally:
        pocket.slack = before


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
    claims.said["parameters"]["max_time"] = 1.0
    claims.knots[0] = np.vstack([claims.knots[0], [1.1, *claims.knots[0][-1, 1:]]])
    assert not has_proof(claims, 0), "the plan itself takes longer"
