"""A few that block each other: joint paths by way of folded, and shortcuts that keep everybody clear."""

import time

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.direct import untangle
from fiberplan.planners.direct.contacts import find_contacts
from fiberplan.planners.direct.search import DirectSearch
from fiberplan.planners.direct.shortcuts import arrivals, hurried
from fiberplan.planners.direct.trim import as_trajectory
from fiberplan.planners.shared import threads
from fiberplan.planners.shared.threads import at_once
from fiberplan.scenes.decisive import pinwheel
from problems import field_to_field

DEG = np.radians(1.0)


def searching(problem, seed=0):
    near = Neighbourhood.of(problem.plane, problem.margin)
    search = DirectSearch(problem, near, problem.goal, 6 * DEG, None, seed)
    search.begin()
    return search


def contacts(search, path, limit):
    """How many pairs touch on a path."""
    touching = np.zeros(len(search.pairs), np.int64)
    lattice = search.lattice._replace(path=path)
    every = np.arange(len(touching))
    find_contacts(search.plane.arms, lattice, search.pairs, every, limit, path.shape[1] - 1, touching)
    return int((touching > 0).sum())


def test_clusters_that_share_a_member_wait_for_each_other():
    assert untangle.apart([[1, 2], [2, 3], [4, 5], [3, 6], [5, 7]]) == [[1, 2], [4, 5], [3, 6]]
    assert untangle.apart([[1, 2], [1, 2]]) == [[1, 2]]
    assert untangle.apart([]) == []


def test_what_is_done_at_once_comes_in_order_and_its_errors_come_out():
    assert at_once([lambda k=k: k for k in range(20)]) == list(range(20))
    assert at_once([]) == []
    with pytest.raises(ZeroDivisionError):
        at_once([lambda: 1, lambda: 1 // 0])


def test_what_has_not_begun_when_one_fails_never_does(monkeypatch):
    monkeypatch.setattr(threads, "cores", lambda: 2)
    begun = []

    def wait():
        begun.append(1)
        time.sleep(0.05)

    with pytest.raises(ZeroDivisionError):
        at_once([lambda: 1 // 0, *[wait] * 40])
    assert len(begun) < 10


def test_clusters_are_untangled_alike_by_any_number_of_threads(monkeypatch):
    paths = []
    for count in (1, 3):
        monkeypatch.setattr(threads, "cores", lambda count=count: count)
        search = searching(field_to_field(margin=1.5))
        clusters = [search.pairs[pair].tolist() for pair in search.in_contact]
        assert len(untangle.apart(clusters)) >= 5
        moved = search._untangle(search.in_contact, 2, search.most_steps)
        assert moved >= 10
        paths.append(search.lattice.path[:, : search.steps + 1].copy())
    np.testing.assert_array_equal(*paths)


def test_what_is_not_found_at_random_is_found_by_way_of_folded(monkeypatch):
    """The three of a pinwheel, with nobody drawing at random; shortcuts leave much less of the detour."""
    problem = pinwheel()
    monkeypatch.setattr(untangle, "joint_path", lambda *arguments: (None, None))
    search = searching(problem)
    steps = {}
    for tries in (0, 300):
        monkeypatch.setattr(untangle, "_SHORTCUTS", tries)
        ends, members = problem.goal, [0, 1, 2]
        path = untangle.untangled(
            problem.plane, search.pairs, search.lattice, members, ends, problem.margin, search.duration, 0
        )
        np.testing.assert_array_equal(path[0], problem.start)
        np.testing.assert_array_equal(path[-1], problem.goal)
        motion = as_trajectory(path.swapaxes(0, 1), search.duration)
        assert fp.verify(problem.plane, motion, problem.margin).ok
        steps[tries] = len(path) - 1
    assert steps[300] < 0.7 * steps[0]


@pytest.mark.parametrize("others", [0, 2])
def test_shortcuts_keep_clear_of_everybody_and_leave_the_others_alone(others):
    """Somebody who waits half way, after a detour, arrives as soon as joint speeds allow, alone or with others."""
    problem = field_to_field(1.0, rings=2)
    search = searching(problem)
    assert search.run(10_000, lambda: True)
    path = np.repeat(search.lattice.path[:, : search.steps + 1], 2, axis=1)  # everybody half as fast, and waiting
    before = path.copy()
    members = np.array([0, *search.near.around(0)[:others]])
    state, refused = np.array([3], np.uint64), np.zeros(len(path), np.int64)
    assert contacts(search, path, search.limit) == 0
    late = arrivals(path[members]).max()
    arrival = hurried(search.plane, search.near, path, members, search.limit, search.duration, 500, state, refused)
    assert arrival == arrivals(path[members]).max()
    assert arrival < 0.8 * late
    assert contacts(search, path, search.limit) == 0
    np.testing.assert_array_equal(path[:, [0, -1]], before[:, [0, -1]])
    rest = np.setdiff1d(np.arange(len(path)), members)
    np.testing.assert_array_equal(path[rest], before[rest])
    steps = np.abs(np.diff(path[: problem.n], axis=1))
    assert np.all(steps <= problem.plane.max_speed[:, None] * search.duration)
    assert refused[rest].sum() > 0


def test_arrivals():
    path = np.zeros((3, 5, 2))
    path[0, 2:, 1] = 1.0
    path[1, 4:, 0] = 1.0
    np.testing.assert_array_equal(arrivals(path), [2, 4, 0])
