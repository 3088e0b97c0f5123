"""Which geometry a proof is about: the same digest for the same arms, another for anything that a proof looks at."""

import dataclasses

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.focal_plane.bodies import Body
from fiberplan.focal_plane.geometry import geometry_of
from fiberplan.io.plan_file import read_certificate
from fiberplan.motion import Trajectory
from references import four_bar_plane

PLANE = fp.FocalPlane.hexagonal(1, 22.4).replace(obstacles=(fp.Obstacle("F1", [[11.0, 13.0]], 1.0),))
ARM = PLANE.bodies[0]


def moved(name, by=1e-12):
    values = getattr(PLANE, name).copy()
    values.flat[-1] += by
    return PLANE.replace(**{name: values})


@pytest.mark.parametrize(
    "other",
    [
        *map(moved, ("base", "length", "zero", "upper", "max_speed")),
        moved("lower", -1e-12),
        PLANE.replace(bodies=(dataclasses.replace(ARM, radius=1.25),)),
        PLANE.replace(bodies=(dataclasses.replace(ARM, closed=True),)),
        PLANE.replace(bodies=(dataclasses.replace(ARM, meets=None),)),
        PLANE.replace(bodies=(dataclasses.replace(ARM, points=ARM.points * 1.01),)),
        PLANE.replace(bodies=(ARM, Body(np.zeros((1, 2)), 1.0, "alpha"))),
        PLANE.replace(obstacles=()),
        PLANE.replace(obstacles=(fp.Obstacle("F1", [[11.0, 13.0]], 1.1),)),
        PLANE.replace(ids=tuple(reversed(PLANE.ids))),
    ],
)
def test_what_a_proof_looks_at_changes_the_digest(other):
    assert geometry_of(other).digest != geometry_of(PLANE).digest


def test_what_it_does_not_look_at_changes_nothing(tmp_path):
    other = PLANE.replace(name="another", notes=("a note",), online=np.zeros(PLANE.n, bool), pair_margin=2.0)
    assert geometry_of(other).digest == geometry_of(PLANE).digest
    minus = PLANE.replace(zero=np.full((PLANE.n, 2), -0.0))
    assert geometry_of(minus).digest == geometry_of(PLANE).digest
    for number, plane in enumerate((PLANE, four_bar_plane(np.random.default_rng(0)))):
        plane.write(tmp_path / f"{number}.fits")
        again = fp.FocalPlane.load(tmp_path / f"{number}.fits")
        assert geometry_of(again).digest == geometry_of(plane).digest


def test_a_four_bar_arm_is_told_by_its_own_lengths():
    plane = four_bar_plane(np.random.default_rng(0))
    other = plane.replace(kinematics=dataclasses.replace(plane.kinematics, rocker=plane.kinematics.rocker + 1e-9))
    assert geometry_of(other).digest != geometry_of(plane).digest


def test_the_certificate_says_so_also_in_a_file(tmp_path, small_plan):
    certificate = fp.verify(PLANE, Trajectory.at_rest(PLANE.folded))
    said = certificate.geometry
    assert (said.positioners, said.obstacles, said.radii) == (7, 1, (("arm", 1.5, 1.5),))
    assert str(said) == f"hexagonal: 7 positioners, arm of radius 1.5 mm, 1 obstacle; digest {said.digest[:12]}"
    small_plan.write(tmp_path / "plan.fits")
    assert read_certificate(tmp_path / "plan.fits").geometry == small_plan.certificate.geometry


def test_no_bodies_is_said():
    bare = PLANE.replace(bodies=(), obstacles=())
    assert "no bodies" in str(geometry_of(bare))
