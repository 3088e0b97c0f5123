import numpy as np
import pytest

from fiberplan.errors import TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.problem import Problem
from fiberplan.scenes.clustered import _thomas_process, clustered_targets


@pytest.mark.parametrize("seed", [0, 1])
def test_almost_everyone_has_a_target_that_can_be_kept(seed):
    plane = FocalPlane.load("sdss")
    targets = clustered_targets(plane, seed, 0.8)
    assert len(targets) > 0.98 * plane.n
    assert not targets.solve(plane).unreachable
    problem = Problem.from_targets(plane, targets, margin=0.8, conflicts="drop")
    assert len(problem.dropped) < 0.04 * plane.n
    assert len(np.unique(targets.priority)) == 3


def test_same_seed_same_field():
    plane = FocalPlane.hexagonal(4, 22.4)
    a, b, c = (clustered_targets(plane, seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(a.x, b.x)
    assert not np.array_equal(a.x, c.x)


def test_no_target_is_given_twice():
    targets = clustered_targets(FocalPlane.hexagonal(6, 22.4), 5)
    assert len(set(zip(targets.x, targets.y, strict=True))) == len(targets)


@pytest.mark.small
def test_targets_crowd():
    points = _thomas_process(FocalPlane.hexagonal(6, 22.4), np.random.default_rng(5))
    inside = points[np.abs(points).max(axis=1) < 90]
    counts, *_ = np.histogram2d(*inside.T, bins=9, range=[[-90, 90]] * 2)
    assert counts.var() > 2 * counts.mean()  # of equal size in a uniform field


@pytest.mark.small
def test_offline_positioners_get_no_target():
    plane = FocalPlane.hexagonal(2, 22.4)
    online = np.ones(plane.n, bool)
    online[[0, 9]] = False
    targets = clustered_targets(plane.replace(online=online), 1)
    assert not {plane.ids[0], plane.ids[9]} & set(targets.positioner)
    with pytest.raises(TargetError, match="there are no targets"):
        clustered_targets(plane.replace(online=np.zeros(plane.n, bool)), 1)
