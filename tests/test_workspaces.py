"""Who reaches where, and what blocks one positioner: against areas and clearances that can be worked out."""

import numpy as np
import pytest

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.coverage import coverage
from fiberplan.focal_plane.joint_space import AVOIDED, FREE, joint_space

pytestmark = pytest.mark.small

FAR, NEAR = 22.4, 7.6  # [mm] the annulus of links of 7.4 and 15 mm


def two(apart):
    return FocalPlane.hexagonal(1, 22.4).subset([2, 3]).replace(base=[[0.0, 0.0], [apart, 0.0]])


def area(found, step):
    return (found.reached > 0).sum() * step**2


def test_one_covers_its_annulus():
    plane = FocalPlane.hexagonal(0, 22.4)
    found = coverage(plane, 0.25)
    assert found.reached.max() == 1
    assert area(found, 0.25) == pytest.approx(np.pi * (FAR**2 - NEAR**2), rel=0.01)
    assert found.shares().tolist() == [1.0]
    half = coverage(plane.replace(upper=[[np.pi, np.pi]], folded=[[0.0, np.pi]]), 0.25)
    assert 0.4 < area(half, 0.25) / area(found, 0.25) < 0.9


def test_two_share_a_lens():
    apart = 40.0
    found = coverage(two(apart), 0.25)
    lens = 2 * FAR**2 * np.arccos(apart / 2 / FAR) - apart / 2 * np.sqrt(4 * FAR**2 - apart**2)
    assert (found.reached == 2).sum() * 0.25**2 == pytest.approx(lens, rel=0.03)
    only = coverage(two(apart).replace(online=[True, False]), 0.25)
    assert only.reached.max() == 1


def test_nobody_reaches_what_is_forbidden_or_outside_the_field():
    plane = FocalPlane.hexagonal(0, 22.4)
    dot = coverage(plane.replace(forbidden=[[15.0, 0.0, 3.0]]), 0.25)
    assert area(coverage(plane, 0.25), 0.25) - area(dot, 0.25) == pytest.approx(np.pi * 9, rel=0.05)
    small = coverage(plane.replace(field_radius=10.0), 0.25)
    assert area(small, 0.25) == pytest.approx(np.pi * (100 - NEAR**2), rel=0.03)


@pytest.mark.parametrize("step", [0.0, -1.0, np.nan, 1e-6])
def test_steps_that_make_no_map(step):
    with pytest.raises(InstrumentError, match=r"a step of .* mm is none, or leaves more than"):
        coverage(FocalPlane.hexagonal(0, 22.4), step)
    with pytest.raises(InstrumentError, match="no fiber 'none'"):
        coverage(FocalPlane.hexagonal(0, 22.4), 1.0, "none")


def test_cells_are_blocked_by_who_is_too_near():
    plane, margin = two(22.4), 0.6
    angles = np.radians([[0.0, 180.0], [180.0, 30.0]])
    space = joint_space(plane, 0, angles, margin, cells=23)
    gaps = np.empty(space.clearance.shape)
    for a, alpha in enumerate(space.alpha):
        for b, beta in enumerate(space.beta):
            gaps[a, b] = plane.clearance(np.array([[alpha, beta], angles[1]]))[0]
    assert space.clearance == pytest.approx(gaps)
    assert np.array_equal(space.blocker, np.where(gaps < margin, 1, FREE))
    assert 0 < (space.blocker == 1).mean() < 0.5
    with pytest.raises(InstrumentError, match="a grid of 1 cells"):
        joint_space(plane, 0, angles, cells=1)


def test_zones_of_avoidance_are_marked():
    plane = FocalPlane.load("miradas")
    space = joint_space(plane, 3, plane.folded, cells=9)
    for a, alpha in enumerate(space.alpha):
        for b, beta in enumerate(space.beta):
            pose = plane.folded.copy()
            pose[3] = alpha, beta
            assert (space.blocker[a, b] == AVOIDED) == plane.in_avoidance(pose)[3]
    assert (space.blocker == AVOIDED).any()
