"""A joint way out for a few, straightening, and places to rest."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.greedy_fold.walker import Walker
from fiberplan.planners.shared.clusters import clusters
from fiberplan.planners.shared.rrt_connect import _nearest, joint_path
from fiberplan.planners.shared.straighten import straighten
from fiberplan.problem.resting import place_the_rest
from fiberplan.scenes.decisive import row
from fiberplan.scenes.uniform import uniform_field

DEG = np.pi / 180.0


def two():
    """Two positioners side by side."""
    plane = row(2)
    return plane, np.array([0, 1])


def as_motion(plane, angles, members, path):
    """The members' path as a motion of everyone."""
    times, way = path
    samples = np.repeat(angles[None], len(times), axis=0)
    samples[:, members] = way
    return fp.Trajectory.from_samples(times * (1 + 1e-9), samples)


@pytest.mark.small
@pytest.mark.parametrize("seed", range(3))
def test_two_arms_exchange_sides(seed):
    """One has to make room for the other: an even move of both together goes right through."""
    plane, members = two()
    angles = np.array([[281.0, 115.0], [218.0, 35.0]]) * DEG
    goal = np.array([[135.0, 169.0], [29.0, 39.0]]) * DEG
    near = Neighbourhood.of(plane, 0.3)
    path, _ = joint_path(plane, near, members, angles, goal, 0.3, seed, most=5000)
    assert path is not None
    np.testing.assert_array_equal(path[1][0], angles[members])
    np.testing.assert_array_equal(path[1][-1], goal)
    motion = as_motion(plane, angles, members, path)
    assert fp.verify(plane, motion, 0.3).ok
    assert not fp.verify(plane, as_motion(plane, angles, members, (path[0][[0, -1]], path[1][[0, -1]])), 0.3).ok


@pytest.mark.small
def test_a_tree_grows_from_the_node_that_is_nearest_in_time():
    """By the joint that takes longest; of equal nodes from the first."""
    rng = np.random.default_rng(0)
    nodes, slowness = rng.integers(-4, 5, (60, 4)).astype(float), np.array([1.0, 0.5, 2.0, 0.25])
    for count in range(1, len(nodes) + 1):
        goal = rng.integers(-4, 5, 4).astype(float)
        times = (np.abs(nodes[:count] - goal) * slowness).max(axis=1)
        assert _nearest(nodes, count, goal, slowness) == times.argmin()


def test_no_way_is_said_and_blamed():
    """A held arm in the way is named by the blame count."""
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    angles = plane.folded.copy()
    angles[3] = np.radians([0.0, 60.0])
    angles[6] = np.radians([215.0, 40.0])
    near = Neighbourhood.of(plane, 0.0)
    path, blame = joint_path(plane, near, np.array([3]), angles, np.radians([[60.0, 0.0]]), 0.0, 0, most=200)
    assert path is None  # the goal lies on arm 6
    assert blame.argmax() == 6


@pytest.mark.small
def test_from_a_place_to_itself_is_no_motion():
    plane, members = two()
    angles = np.array([[281.0, 115.0], [218.0, 35.0]]) * DEG
    path, _ = joint_path(plane, Neighbourhood.of(plane, 0.0), members, angles, angles, 0.0, 0)
    assert path[0].tolist() == [0.0]


def test_same_seed_same_path():
    plane, members = two()
    angles = np.array([[281.0, 115.0], [218.0, 35.0]]) * DEG
    near = Neighbourhood.of(plane, 0.0)
    goal = np.array([[135.0, 169.0], [29.0, 39.0]]) * DEG
    runs = [joint_path(plane, near, members, angles, goal, 0.0, 5, most=5000)[0] for _ in range(2)]
    np.testing.assert_array_equal(runs[0][1], runs[1][1])


@pytest.mark.parametrize("margin", [0.0, 1.0, 2.5])
def test_straightening_keeps_ends_duration_and_safety(margin):
    plane = fp.FocalPlane.hexagonal(5, 22.4)
    walker = Walker(plane, uniform_field(plane, 3, margin), margin, 0.5 * DEG, plane.online)
    walker.run(700 * DEG)
    winding = walker.trajectory()
    even = straighten(plane, winding, margin)
    assert len(even.times) < 0.7 * len(winding.times)
    assert even.duration == winding.duration
    np.testing.assert_array_equal(even.start, winding.start)
    np.testing.assert_array_equal(even.end, winding.end)
    assert fp.verify(plane, even, margin).ok


def test_straightening_never_cuts_through():
    """Shortest in joint space would sweep through a neighbour: the way round is kept."""
    plane, members = two()
    angles = np.array([[281.0, 115.0], [218.0, 35.0]]) * DEG
    goal = np.array([[135.0, 169.0], [29.0, 39.0]]) * DEG
    near = Neighbourhood.of(plane, 0.0)
    path, _ = joint_path(plane, near, members, angles, goal, 0.0, 1, most=5000)
    even = straighten(plane, as_motion(plane, angles, members, path), 0.0)
    assert fp.verify(plane, even).ok
    assert len(even.times) > 2 * plane.n


def test_places_to_rest_are_clear():
    plane = fp.FocalPlane.hexagonal(3, 22.4)
    near = Neighbourhood.of(plane, 1.0)
    known = uniform_field(plane, 1, 1.0).copy()
    known[::2] = np.nan
    end, nowhere = place_the_rest(plane, known, plane.folded, near, 1.0)
    assert not len(nowhere)
    assert plane.clearance(end).min() >= 1.0
    kept = ~np.isnan(known[:, 0])
    np.testing.assert_array_equal(end[kept], known[kept])
    folded = np.all(end == plane.folded, axis=1)
    assert folded.sum() > 0.4 * (~kept).sum()


def test_clusters_are_the_connected_parts():
    plane = fp.FocalPlane.hexagonal(6, 22.4)
    near = Neighbourhood.of(plane, 0.0)
    row = [plane.index[f"R0C{c}"] for c in (1, 2, 3, 9, 10)]
    assert clusters(near, row) == [sorted(row[:3]), sorted(row[3:])]
