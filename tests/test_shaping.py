"""Few-bit speeds: what is sent, that it is safe, and how near it stays to the motion it was made from."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane.inverse_kinematics import solutions
from fiberplan.planners import GreedyFold, NavigationFunction
from fiberplan.scenes.uniform import uniform_field
from fiberplan.shaping import quantize
from fiberplan.shaping.levels import top_level, units


@pytest.fixture(scope="module")
def plane():
    whole = fp.FocalPlane.load("makarem2014")
    joints = {name: getattr(whole, name)[0] for name in ("lower", "upper", "folded", "max_speed")}
    return fp.FocalPlane.hexagonal(4, 10.0, (3.0, 3.0), bodies=whole.bodies, **joints)


@pytest.fixture(scope="module")
def plans(plane):
    fields = [uniform_field(plane, seed) for seed in range(4)]
    return [NavigationFunction().plan(fp.Problem(plane, *fields[k : k + 2])) for k in (0, 2)]


def test_four_bits_keep_a_field_certified_on_target_and_in_time(plane, plans):
    for plan in plans:
        motion, report = quantize(plan.trajectory, 4, plane=plane)
        assert fp.verify(plane, motion).ok
        assert report.final_error.max() <= 0.1
        assert motion.duration <= 1.1 * plan.makespan
        assert np.abs(report.levels).max() == top_level(4) == 7
        assert report.bits_per_positioner == 8 * len(report.levels)
        np.testing.assert_array_equal(motion.start, plan.trajectory.start)


def test_the_motion_is_what_the_levels_say(plane, plans):
    """Sent levels, units and tick alone give the motion: every speed is held for its tick."""
    motion, report = quantize(plans[0].trajectory, 4, plane=plane)
    turned = np.cumsum(report.levels, axis=0) * report.unit * report.tick
    for k in range(0, len(turned), 7):
        np.testing.assert_allclose(motion.at((k + 1) * report.tick), motion.start + turned[k], atol=1e-9)
        between = motion.start + turned[k] - 0.5 * report.levels[k] * report.unit * report.tick
        np.testing.assert_allclose(motion.at((k + 0.5) * report.tick), between, atol=1e-9)


def test_it_follows_the_motion_and_more_bits_follow_closer(plane, plans):
    errors = []
    for bits in (3, 4, 6, 8):
        motion, report = quantize(plans[0].trajectory, bits, plane=plane)
        errors.append(np.median(report.tracking_error))
        for t in np.linspace(0.0, motion.duration, 9):  # between ticks it is off by the turn of half a tick at most
            away = plane.fibers(motion.at(t)) - plane.fibers(plans[0].trajectory.at(t / report.stretch))
            assert np.hypot(*away.T).max() < report.tracking_error.max() + 0.3
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.1 * errors[0]


def test_most_end_exactly_at_their_goals(plane, plans):
    motion, report = quantize(plans[0].trajectory, 6, plane=plane)
    np.testing.assert_array_less(np.median(report.final_error), 1e-9)
    off = np.hypot(*(plane.fibers(motion.end) - plane.fibers(plans[0].trajectory.end)).T)
    np.testing.assert_allclose(off, report.final_error, atol=1e-12)


@pytest.mark.small
def test_units_put_start_and_goal_on_the_lattice_without_losing_speed():
    turn = np.array([[1.0, -2.0], [0.0, 0.0123]])
    speed = np.full((2, 2), 3.0)
    unit, top = units(turn, speed, 0.01, 4)
    count = turn / unit
    np.testing.assert_allclose(count[0], np.rint(count[0]), atol=1e-9)
    assert np.all(top * unit <= speed * 0.01 * (1 + 1e-12))
    assert np.all(top * unit >= 0.93 * speed * 0.01)
    assert unit[1, 0] == pytest.approx(0.03 / 7)


def test_rounding_does_not_cost_the_margin(plane):
    """One passes another 2 um clear of it. Levels nearest to the motion would touch; those that are taken do not."""
    here, there = (int(np.argmin(np.hypot(*(plane.base - at).T))) for at in ([0.0, 0.0], [10.0, 0.0]))
    start, end = plane.folded.copy(), plane.folded.copy()
    start[here], end[here] = (-0.9 + 1.0, 1.9), (0.5 + 1.0, 1.4)
    start[here, 0], end[here, 0] = start[here, 0] - 1.0 + np.pi, end[here, 0] - 1.0 + np.pi
    plane = plane.replace(base=plane.base * [-1.0, 1.0])  # so that alpha does not end in between
    way = fp.Trajectory.from_samples([0.0, 0.8], np.stack([start, end]))
    path = np.array([plane.fibers(way.at(t))[here] for t in np.linspace(0.0, 0.8, 2001)])
    along = path[1001] - path[999]
    normal = np.array([along[1], -along[0]]) / np.hypot(*along)
    base = plane.base[there]
    post = path[1000] + 2.002 * normal * np.sign(normal @ (base - path[1000]))
    assert 2.0 < np.hypot(*(path - post).T).min() < 2.0025
    found = solutions(plane, np.array([there]), post[None], plane.fiber[[there]], np.zeros(1))[0, 0]
    start[there] = end[there] = found
    motion = fp.Trajectory.from_samples([0.0, 0.8], np.stack([start, end]))
    assert fp.verify(plane, motion).ok
    slim = plane.replace(bodies=(fp.Body(np.array([[3.0, 0.0]]), 0.5),))
    heedless, _ = quantize(motion, 3, plane=slim)
    assert fp.verify(plane, heedless).contacts
    made, report = quantize(motion, 3, plane=plane)
    assert fp.verify(plane, made).ok
    assert report.final_error.max() < 1e-9


def test_other_bodies_and_margins():
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    plan = GreedyFold(step=np.radians(1.0)).plan(fp.Problem(plane, plane.folded, uniform_field(plane, 4, 0.5), 0.5))
    motion, report = quantize(plan.trajectory, 4, plane=plane, margin=0.5, tick=0.05)
    assert fp.verify(plane, motion, 0.5).ok
    assert report.final_error.max() < 0.1
    assert motion.duration < 1.1 * plan.makespan
    assert "4 bits a joint and tick" in str(report)


def test_offline_and_resting_positioners_receive_nothing(plane, plans):
    online = np.ones(plane.n, bool)
    online[5] = False
    still = plane.replace(online=online)
    start = uniform_field(plane, 0)
    problem = fp.Problem(still, start, uniform_field(still, 1, start=start))
    motion, report = quantize(NavigationFunction().plan(problem).trajectory, 4, plane=still)
    assert not report.levels[:, 5].any()
    assert fp.verify(still, motion).ok
    rest, nothing = quantize(fp.Trajectory.at_rest(start), 4, plane=plane)
    assert rest.duration == 0.0
    assert nothing.bits_per_positioner == 0


@pytest.mark.small
@pytest.mark.parametrize(
    ("bits", "settings", "said"),
    [
        (1, {}, "bits must be a whole number from 2 to 8, got 1"),
        (9, {}, "got 9"),
        (3.5, {}, "got 3.5"),
        (4, {"tick": 0.0}, "tick must be a positive time, got 0"),
        (4, {"tick": np.nan}, "tick must be a positive time"),
        (4, {"margin": -1.0}, "margin must be a length of 0 mm or more, got -1"),
    ],
)
def test_bad_settings(plane, bits, settings, said):
    with pytest.raises(TrajectoryError, match="quantize") as error:
        quantize(fp.Trajectory.at_rest(plane.folded), bits, plane=plane, **settings)
    assert said in str(error.value)


@pytest.mark.small
def test_another_focal_plane_is_refused(plane):
    with pytest.raises(TrajectoryError, match="61 positioners, the focal plane 7"):
        quantize(fp.Trajectory.at_rest(plane.folded), 4, plane=fp.FocalPlane.hexagonal(1, 10.0))
