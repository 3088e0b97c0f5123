"""What the potential-field planners stand on: steps that are safe at every moment, few knots, fields and choices."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.kernels.compile import kernel
from fiberplan.planners.navigation_function.singular import nudge_sides, nudged
from fiberplan.planners.shared.goal_configurations import faster_goals
from fiberplan.planners.shared.recording import FIDELITY, new_record, recorded, sample, with_room
from fiberplan.planners.shared.repulsion import push, theorem1_bound
from fiberplan.planners.shared.safe_steps import grant, room_of, stepping, take
from fiberplan.planners.shared.step_limits import limited, straight, within

pytestmark = pytest.mark.small

DT = 0.05


@kernel
def advance(arms, near, now, record, step, wanted):
    """One step of everyone as `wanted` (n, 2) [rad]."""
    for i in range(len(wanted)):
        now.pose[i].wanted_alpha, now.pose[i].wanted_beta = wanted[i, 0], wanted[i, 1]
        grant(arms, near, now, i)
    for i in range(len(wanted)):
        me = now.pose[i]
        if me.granted_alpha != 0.0 or me.granted_beta != 0.0:
            room = room_of(near, now, i)
            take(now, i)
            sample(arms, record, i, step, me.alpha, me.beta, room)


def angles_of(now, n):
    return np.stack([now.pose["alpha"][:n], now.pose["beta"][:n]], axis=1)


def run(plane, start, wanted, margin):
    """The stepped samples (steps + 1, n, 2) and the recorded motion of `wanted` (steps, n, 2) [rad]."""
    near = Neighbourhood.of(plane, margin)
    now, record = stepping(plane, start, margin, near), new_record(start)
    samples = [np.array(start)]
    for k, turns in enumerate(wanted):
        record = with_room(record, 2 * plane.n)
        advance(plane.arms, near, now, record, k + 1, turns)
        samples.append(angles_of(now, plane.n))
    return np.array(samples), recorded(record, DT), now


def pulled_about(plane, steps, seed, turn):
    """Turns that head for one random configuration after another, so that arms meet all the time."""
    rng = np.random.default_rng(seed)
    out = np.empty((steps, plane.n, 2))
    heading = rng.uniform(-1, 1, (plane.n, 2))
    for k in range(steps):
        change = rng.random(plane.n) < 0.1
        heading[change] = rng.uniform(-1, 1, (int(change.sum()), 2))
        out[k] = turn * heading
    return out


@pytest.mark.large
@pytest.mark.parametrize("margin", [0.0, 1.0])
@pytest.mark.parametrize("seed", [0, 1])
def test_whatever_is_asked_is_granted_safely(margin, seed):
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    plane = plane.replace(
        lower=np.full((plane.n, 2), -np.inf), upper=np.full((plane.n, 2), np.inf), max_speed=np.full((plane.n, 2), 1e3)
    )
    wanted = pulled_about(plane, 150, seed, np.radians(6.0))
    samples, motion, now = run(plane, plane.folded, wanted, margin)
    certificate = fp.verify(plane, motion, margin)
    assert certificate.ok, (certificate.contacts, certificate.undecided)
    granted = np.diff(samples, axis=0)
    assert np.mean(np.abs(granted).sum(axis=2) > 0) > 0.5  # it does not freeze
    refused = np.any(np.abs(granted - wanted) > 1e-12, axis=2)
    assert refused.mean() > 0.02  # and the scene is one where straight asking would touch
    for k in range(len(samples)):  # the recorded motion stays near the stepped one
        away = plane.fibers(motion.at(k * DT)) - plane.fibers(samples[k])
        assert np.hypot(*away.T).max() <= FIDELITY
    assert len(motion.times) < 0.5 * plane.n * len(samples)
    assert (now.pose["blocker"][: plane.n] >= 0).any()


def two(first, second):
    """Two SDSS-like positioners at rest at the given angles [deg]."""
    one = fp.FocalPlane.hexagonal(0, 22.4)
    plane = one.replace(
        ids=("A", "B"),
        base=np.array([[0.0, 0.0], [22.4, 0.0]]),
        fiber_offsets={"fiber": np.array([15.0, 0.0])},
        **{
            name: np.repeat(getattr(one, name), 2, axis=0)
            for name in ("length", "folded", "lower", "upper", "zero", "online")
        },
        max_speed=np.full((2, 2), 1e3),
    )
    return plane, np.radians([first, second])


def test_a_step_cannot_tunnel():
    """Clear where it begins and where it ends, but not on the way: only parts of it may be granted."""
    plane, start = two((40.0, 0.0), (180.0, 0.0))
    turns = np.radians([[[-80.0, 0.0], [0.0, 0.0]]])
    ends = start + turns[0]
    assert plane.clearance(start)[0] > 0
    assert plane.clearance(ends)[0] > 0
    samples, motion, now = run(plane, start, turns, 0.0)
    assert samples[1, 0, 0] > np.radians(5.0)  # not beyond the other arm
    assert now.pose["blocker"][0] == 1
    assert fp.verify(plane, motion).ok


def test_simultaneous_moves_are_tested_against_each_other():
    """Each of two moves is clear of where the other stands; together they touch, so only the first is whole."""
    plane, start = two((90.0, 0.0), (90.0, 0.0))
    turns = np.radians([[[-27.0, 0.0], [27.0, 0.0]]])
    for alone in ([1.0, 0.0], [0.0, 1.0]):
        single, _, _ = run(plane, start, turns * np.array(alone)[None, :, None], 0.0)
        np.testing.assert_allclose(single[1] - start, turns[0] * np.array(alone)[:, None])
    samples, motion, _ = run(plane, start, turns, 0.0)
    np.testing.assert_allclose(samples[1, 0] - start[0], turns[0, 0])
    assert abs(samples[1, 1, 0] - start[1, 0]) < 0.9 * np.radians(27.0)
    assert fp.verify(plane, motion).ok


def test_even_motion_and_rest_need_no_knots_between():
    plane, start = two((90.0, 150.0), (90.0, 150.0))
    turns = np.zeros((30, 2, 2))
    turns[5:20, 0] = 0.01, -0.02
    turns[25:, 1] = 0.01, 0.01
    samples, motion, _ = run(plane, start, turns, 0.0)
    np.testing.assert_allclose(motion.times, DT * np.array([0, 5, 20, 0, 25, 30]))
    np.testing.assert_allclose(motion.end, samples[-1])
    np.testing.assert_allclose(motion.start, start)


def test_a_winding_motion_close_to_another_is_kept_to_the_step():
    """Without room there is no thinning: what was proven is what is recorded."""
    plane, start = two((0.0, 180.0), (180.0, 180.0))
    near = Neighbourhood.of(plane, 0.0)
    now, record = stepping(plane, start, 0.0, near), with_room(new_record(start), 100)
    path = [0.02 * np.sin(0.1 * k) for k in range(40)]
    for k in range(1, 40):
        sample(plane.arms, record, 0, k, path[k], np.pi, 0.0)
    tight = recorded(record, 1.0)
    assert np.diff(tight.offsets)[0] > 30
    loose = with_room(new_record(start), 100)
    for k in range(1, 40):
        sample(plane.arms, loose, 0, k, path[k], np.pi, 1.0)
    assert np.diff(recorded(loose, 1.0).offsets)[0] < 20
    assert room_of(near, now, 0) == -np.inf  # nothing is known before anyone has looked


def test_limits_scale_both_joints_together():
    assert limited(2.0, -1.0, 1.0, 1.0) == (1.0, -0.5)
    assert limited(0.2, -0.9, 1.0, 1.0) == (0.2, -0.9)
    assert limited(1.0, 3.0, 2.0, 1.0) == pytest.approx((1.0 / 3.0, 1.0))
    assert straight(0.0, 0.0, 4.0, -2.0, 1.0, 1.0) == (1.0, -0.5)
    assert straight(0.0, 0.0, 0.5, -0.25, 1.0, 1.0) == (0.5, -0.25)
    assert within(3.0, 0.5, 0.0, 3.2) == pytest.approx(0.2)
    assert within(0.1, -0.5, 0.0, 3.2) == pytest.approx(-0.1)


def test_push_is_the_gradient_of_the_mended_term():
    D, d = 4.0, 2.0

    def term(x, y):
        x2 = x * x + y * y
        return max(0.0, (D * D - x2) / (x2 - d * d))

    for sx, sy in ((2.1, 0.0), (1.7, -2.2), (-2.4, 2.0)):
        h = 1e-6
        slope = [(term(sx + h, sy) - term(sx - h, sy)) / (2 * h), (term(sx, sy + h) - term(sx, sy - h)) / (2 * h)]
        assert push(sx, sy, D, d) == pytest.approx((-slope[0], -slope[1]), rel=1e-5)
    assert push(4.0, 0.0, D, d) == (0.0, 0.0)
    assert push(1.0, 0.0, D, d)[0] > 0.0  # below d it still repels
    assert np.isfinite(push(2.0, 0.0, D, d)).all()


def test_theorem1_bound_as_printed_with_millimetres():
    assert theorem1_bound(4.0, 2.0) == pytest.approx(0.0476, abs=1e-4)
    assert theorem1_bound(4.0, 2.0, R=14.0) == pytest.approx(theorem1_bound(4.0, 2.0) / 2)


def test_nudges_leave_singular_poses_only():
    assert nudged(0.0, 0.0, 0.0, -np.pi, np.pi, -1.0, 0.01, 1e-4) == (0.0, -0.01)
    assert nudged(0.0, 0.0, 0.0, 0.0, np.pi, -1.0, 0.01, 1e-4) == (0.0, 0.01)
    assert nudged(0.01, 0.0, 0.0, 0.0, np.pi, -1.0, 0.01, 1e-4) == (0.01, 0.0)
    sides = nudge_sides(1000, 3)
    np.testing.assert_array_equal(sides, nudge_sides(1000, 3))
    assert 400 < (sides > 0).sum() < 600
    assert set(sides) == {-1.0, 1.0}


def test_the_faster_parity_is_chosen_where_it_is_allowed():
    plane, _ = two((0.0, 180.0), (0.0, 180.0))
    plane = plane.replace(lower=np.tile([0.0, -np.pi], (2, 1)))
    start = np.radians([[150.0, -150.0], [0.0, 150.0]])
    goal = np.radians([[150.0, 60.0], [10.0, 60.0]])
    other = np.radians([[[200.0, -60.0]], [[60.0, -60.0]]])
    near = Neighbourhood.of(plane, 0.0)
    problem = fp.Problem(plane, start, goal, alternatives=other)
    np.testing.assert_array_equal(faster_goals(problem, near), [other[0, 0], goal[1]])
    np.testing.assert_array_equal(faster_goals(fp.Problem(plane, start, goal), near), goal)
    gone = np.array([goal[0], [np.nan, np.nan]])
    assert np.isnan(faster_goals(fp.Problem(plane, start, gone, alternatives=other), near)[1]).all()


def test_a_faster_parity_that_touches_is_not_chosen():
    plane, _ = two((0.0, 180.0), (0.0, 180.0))
    plane = plane.replace(lower=np.tile([0.0, -np.pi], (2, 1)))
    start = np.radians([[10.0, -150.0], [90.0, 150.0]])
    goal = np.radians([[180.0, 100.0], [180.0, 0.0]])
    other = np.radians([[[0.0, -20.0]], [[np.nan, np.nan]]])
    near = Neighbourhood.of(plane, 0.0)
    problem = fp.Problem(plane, start, goal, alternatives=other)
    np.testing.assert_array_equal(faster_goals(problem, near), goal)
