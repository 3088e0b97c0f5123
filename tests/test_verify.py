"""Planted contacts are all found, what is clear is proven, and no bound is ever above the truth."""

import itertools
from decimal import Decimal, localcontext

import numpy as np
import pytest

from fiberplan.certificates import verify
from fiberplan.certificates.bisection import closest, interval_bound
from fiberplan.certificates.path import KNOT, Motion, measure
from fiberplan.certificates.safety import CAP, TOLERANCE
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels.arms import frame
from fiberplan.kernels.even_motion import constant_speed_bound
from fiberplan.motion import Trajectory
from references import (
    STAR,
    clearance_over_time,
    first_below,
    make_plane,
    motion_of,
    sampled,
    sampled_clearance,
    smallest_over_time,
    varied_plane,
)

TIP = Body(np.array([[10.0, 0.0]]), 1.0)
CAPSULE = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0)


def post(x, y, radius=1.0, **others):
    return Obstacle("post", np.array([[x, y]]), radius, **others)


def one(*bodies, obstacles=(), **others):
    return make_plane([0, 0], bodies or (TIP,), obstacles, **others)


def pair_minimum(plane, motion, margin=0.0, **others):
    """The certificate and the only contact in it."""
    certificate = verify(plane, motion, margin, **others)
    assert not certificate.ok
    (contact,) = certificate.contacts
    return certificate, contact


# --- grazing -------------------------------------------------------------------------------------------------------

SWING = motion_of([(0.0, 0.0, 0.0), (7.0, np.pi, 0.0)])  # the tip on a circle of radius 15 about the origin


@pytest.mark.parametrize("margin", [0.0, 0.7])
@pytest.mark.parametrize("graze", [1e-6, -1e-6, 3e-5, -3e-5])
def test_grazing_is_decided_to_a_millionth(graze, margin):
    far = 17.0 + margin + graze
    plane = one(obstacles=[post(far * np.cos(1.0), far * np.sin(1.0))])
    certificate = verify(plane, SWING, margin)
    assert certificate.ok == (graze > 0)
    assert not certificate.undecided
    if graze > 0:
        assert margin <= certificate.obstacle_clearance[0] <= margin + graze
    else:
        (contact,) = certificate.contacts
        assert contact.pair == (0, -1)
        assert margin + graze - 1e-9 <= contact.clearance < margin  # seen, and no deeper than it is
        # by the law of cosines, the angle before the post at which the gap reaches the margin
        angle = np.arccos((15.0**2 + far**2 - (2.0 + margin) ** 2) / (2 * 15.0 * far))
        assert contact.time == pytest.approx((1.0 - angle) * 7.0 / np.pi, abs=1e-4)


def test_equality_cannot_be_decided_and_counts_as_unsafe():
    at_rest = Trajectory.at_rest(np.zeros((1, 2)))
    assert not verify(one(obstacles=[post(17.0, 0.0)]), at_rest).ok
    assert not verify(one(obstacles=[post(18.0, 0.0)]), at_rest, margin=1.0).ok
    assert not verify(one(obstacles=[post(0.0, 17.0)]), SWING).ok
    assert verify(one(obstacles=[post(17.0 + 1e-8, 0.0)]), at_rest).ok


def test_margin_is_kept_or_not_at_all_scales():
    plane = one(obstacles=[post(0.0, 20.0)])  # 3 mm clear at the closest
    for margin in (0.0, 1.0, 2.9, 2.9999, 2.999999):
        assert verify(plane, SWING, margin).ok
    for margin in (3.000001, 3.0001, 3.1, 5.0, 40.0):
        assert not verify(plane, SWING, margin).ok


def test_grazing_for_long_is_decided():
    """Concentric with the swing: the clearance is small and the same all the way."""
    ring = Obstacle("ring", 17.01 * np.stack([np.cos(a := np.linspace(0, 3, 400)), np.sin(a)], axis=1))
    certificate = verify(one(Body(np.array([[10.0, 0.0]]), 2.0), obstacles=[ring]), SWING)
    assert certificate.ok
    assert 0.0 < certificate.smallest <= 0.01


# --- brief contacts ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rest", [0.0, 1.0, 1e3, 1e5])
def test_a_contact_of_a_millisecond_within_a_long_motion(rest):
    """The tip crosses a post of 0.9 mm (with its own) at 900 mm/s: seen at no coarse sample."""
    plane = one(Body(np.array([[10.0, 0.0]]), 0.2), obstacles=[post(0.0, 15.0, 0.25)], max_speed=100.0)
    quick = 3.0 / 60.0
    start = rest + 1e-3
    motion = motion_of([(0.0, 0.0, 0.0), (start, 0.1, 0.0), (start + quick, 3.1, 0.0), (3 * rest + 9, 0, 0)])
    _, contact = pair_minimum(plane, motion)
    assert contact.pair == (0, -1)
    arc = 2 * np.arcsin(0.225 / 15.0)
    expected = start + (np.pi / 2 - arc - 0.1) / 60.0
    assert contact.time == pytest.approx(expected, abs=1e-4)
    clear = plane.replace(obstacles=(post(0.0, 15.451, 0.25),))
    assert verify(clear, motion).ok


def test_contact_only_between_two_knots_that_are_clear():
    plane = one(CAPSULE, obstacles=[post(-16.0, 0.5, 0.5)], length=0.0)
    assert verify(plane.replace(obstacles=(post(-12.0, 0.5, 0.5),)), motion_of([(0, 3.0, 0), (1, 3.3, 0)])).ok
    near = plane.replace(obstacles=(post(-11.4, 0.0, 0.5),))
    motion = motion_of([(0, 3.0, 0), (1, 3.3, 0)])
    for t in (0.0, 1.0):
        assert clearance_over_time(near, motion, 0, 1, np.array([t]))[0] > 0
    assert len(verify(near, motion).contacts) == 1


def test_contact_exactly_at_a_knot_only():
    """A corner of the motion touches; both stretches move away from it."""
    plane = one(obstacles=[post(0.0, 17.0 - 1e-5)])
    motion = motion_of([(0, np.pi / 2 - 1, 0), (np.e, np.pi / 2, 0), (5, np.pi / 2 - 1, 0)])
    _, contact = pair_minimum(plane, motion)
    assert contact.time == pytest.approx(np.e, abs=0.01)
    assert contact.clearance == pytest.approx(-1e-5, abs=1e-9)
    assert verify(plane.replace(obstacles=(post(0.0, 17.0 + 1e-5),)), motion).ok


def test_contact_at_the_start_and_at_the_end():
    plane = one(obstacles=[post(16.5, 0.0)])
    away = motion_of([(0, 0, 0), (2, 2, 0)])
    assert pair_minimum(plane, away)[1].time == 0.0
    back = away.reversed()
    contact = pair_minimum(plane, back)[1]
    assert contact.time == pytest.approx(first_below(plane, back, 0, 1, 0.0), abs=1e-4)
    assert contact.clearance == pytest.approx(-0.5, abs=TOLERANCE)


def test_one_that_waits_is_hit_before_its_first_knot_and_after_its_last():
    plane = make_plane([[0, 0], [24, 0]], [CAPSULE], length=5.0)
    sweeping = [(0.0, 1.5, 0.0), (3.0, -1.5, 0.0)]
    for waiting in ([(3.0, np.pi, 0.0)], [(2.9, np.pi, 0.0), (3.5, 2.0, 0.0)], [(0.0, np.pi, 0.0)]):
        motion = motion_of(sweeping, waiting)
        _, contact = pair_minimum(plane, motion)
        assert contact.time == pytest.approx(first_below(plane, motion, 0, 1, 0.0), abs=1e-4)
    late = motion_of([(0.0, 1.5, 0.0), (5.0, 1.5, 0.0), (8.0, -1.5, 0.0)], [(0.0, 2.0, 0.0), (1.0, np.pi, 0.0)])
    _, contact = pair_minimum(plane, late)
    assert contact.time == pytest.approx(first_below(plane, late, 0, 1, 0.0), abs=1e-4)
    assert 5.0 < contact.time < 8.0


# --- who can touch whom --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("meets", "safe"), [(("high",), True), ((), True), (("low",), False), (None, False)])
def test_arms_at_different_heights_pass_over_each_other(meets, safe):
    high = Body(CAPSULE.points, 1.0, category="high", meets=meets)
    low = Body(CAPSULE.points, 1.0, link="alpha", category="low", meets=())
    plane = make_plane([[0, 0], [16, 0]], [high, low], length=0.0)
    # the high arm of the first sweeps over the low arm of the second; the two others point away
    motion = motion_of([(0, np.pi, -np.pi / 2), (2, np.pi, -1.5 * np.pi)], [(0, np.pi, np.pi)])
    certificate = verify(plane, motion)
    assert certificate.ok == safe
    if not safe:
        assert certificate.contacts[0].time == pytest.approx(first_below(plane, motion, 0, 1, 0.0), abs=1e-4)


def test_obstacles_of_every_kind_are_hit_and_named_by_number():
    wall = Obstacle("petal edge", np.array([[-40.0, 16.5], [0.0, 15.5], [40.0, 17.0]]), 0.1)
    camera = Obstacle("camera", STAR * 2 + [0.0, 16.0], closed=True)
    far = [post(500.0, 500.0), post(0.0, -40.0)]
    for k, obstacle in enumerate([wall, camera, post(0.0, 15.0)]):
        for place in range(3):
            obstacles = [*far[:place], obstacle, *far[place:]]
            plane = one(obstacles=obstacles)
            _, contact = pair_minimum(plane, SWING)
            assert contact.pair == (0, -1 - place), k
            assert contact.time == pytest.approx(first_below(plane, SWING, 0, 1 + place, 0.0), abs=1e-4)


def bent_swing():
    """A swing that is not stretched, so that more is in reach than is come close to; and how far out the tip is."""
    return motion_of([(0.0, 0.0, 1.0), (7.0, np.pi, 1.0)]), abs(5 + 10 * np.exp(1j))


def test_obstacle_pairs_number_obstacles():
    motion, far = bent_swing()
    plane = one(obstacles=[post(900.0, 0.0), post(0.0, far + 2.6), post(-far - 2.7, 0.0)])
    certificate = verify(plane, motion, margin=0.5)
    assert certificate.ok
    np.testing.assert_array_equal(certificate.obstacle_pairs, [[0, 1], [0, 2]])
    np.testing.assert_allclose(certificate.obstacle_clearance, [0.6, 0.7], atol=TOLERANCE)


@pytest.mark.parametrize("radius", [0.0, 1.0])
def test_an_arm_within_a_filled_outline_is_in_contact(radius):
    box = np.array([[-90.0, -90.0], [90.0, -90.0], [90.0, 90.0], [-90.0, 90.0]])
    arm = Body(np.array([[10.0, 0.0]]), radius)
    inside = one(arm, obstacles=[Obstacle("hall", box, closed=True)])
    certificate = verify(inside, SWING)
    assert not certificate.ok
    (found,) = certificate.contacts + certificate.undecided
    assert (found.time, found.clearance) == (0.0, -radius)
    assert verify(one(arm, obstacles=[Obstacle("walls", box)]), SWING).ok


def test_overlap_of_bodies_without_radius_is_no_safe_motion():
    outline = Body(np.array([[0.0, -1.0], [12.0, -1.0], [12.0, 1.0], [0.0, 1.0]]), 0.0, closed=True)
    line = Body(np.array([[0.0, 0.0], [12.0, 0.0]]), 0.0)
    for body in (outline, line):
        plane = make_plane([[0, 0], [15, 0]], [body], length=0.0)
        crossing = motion_of([(0, 0.0, 0), (3, 1.2, 0)], [(0, np.pi, 0), (2, np.pi - 1.2, 0)])
        assert not verify(plane, crossing).ok
        assert not verify(plane, motion_of([(0, 0.8, 0)], [(0, np.pi - 0.8, 0)])).ok
        assert verify(plane, motion_of([(0, 1.5, 0), (3, 1.2, 0)], [(0, 1.5, 0)])).ok


# --- offline -------------------------------------------------------------------------------------------------------


def three(offline):
    """Three in a row 15 mm apart, the first two overlapping when they face each other."""
    plane = make_plane([[0, 0], [15, 0], [15, 28]], [CAPSULE], [post(15.0, -5.0)], length=0.0)
    return plane.replace(online=~np.isin(np.arange(3), offline))


FACING = [(0.0, 0.0, 0.0)], [(0.0, np.pi, 0.0)], [(0.0, 1.0, 0.0)]


def test_two_that_cannot_move_and_touch_are_reported_only():
    certificate = verify(three([0, 1]), motion_of(*FACING))
    assert certificate.ok
    assert [(c.pair, c.clearance) for c in certificate.resting] == [((0, 1), pytest.approx(-2.0))]
    assert certificate.clearance.min() < 0  # what is proven of them is nothing
    for offline in ([], [0], [1], [2], [1, 2]):
        certificate = verify(three(offline), motion_of(*FACING))
        assert [c.pair for c in certificate.contacts] == [(0, 1)]
        assert not certificate.resting


def test_offline_in_an_obstacle_is_reported_only():
    down = [(0.0, 1.0, 0.0)], [(0.0, -np.pi / 2, 0.0)], [(0.0, 1.0, 0.0)]
    certificate = verify(three([1]), motion_of(*down))
    assert certificate.ok
    assert [c.pair for c in certificate.resting] == [(1, -1)]
    assert [c.pair for c in verify(three([0]), motion_of(*down)).contacts] == [(1, -1)]


def test_hitting_an_arm_that_is_offline():
    motion = motion_of([(0.0, 1.0, 0.0), (1.0, 0.0, 0.0)], *FACING[1:])
    certificate, contact = pair_minimum(three([1]), motion)
    assert contact.pair == (0, 1)
    assert contact.time == pytest.approx(first_below(three([1]), motion, 0, 1, 0.0), abs=1e-4)
    assert not certificate.resting


def test_offline_that_moves_is_a_violation():
    moving = motion_of([(0.0, 1.0, 0.0)], [(0.0, 1.0, 0.0), (2.0, 1.0, 1e-9)], [(0.0, 1.0, 0.0)])
    certificate = verify(three([1]), moving)
    assert not certificate.ok
    assert certificate.violations == ("positioner 'P1' is offline but its beta moves from 0.000 s",)
    assert verify(three([]), moving).ok


# --- ranges and speeds ---------------------------------------------------------------------------------------------


def test_ranges():
    plane = one(lower=[[-1.0, 0.0]], upper=[[1.0, 2.0]], folded=[[0.0, 1.0]])
    assert verify(plane, motion_of([(0, -1.0, 0.0), (9, 1.0, 2.0)])).ok
    for k, (joint, value) in enumerate([(0, -1.001), (0, 1.001), (1, -0.001), (1, 2.001)]):
        knots = np.array([[0.0, 0.0, 1.0], [3.0, 0.0, 1.0], [6.0, 0.0, 1.0]])
        knots[k % 3, 1 + joint] = value
        certificate = verify(plane, motion_of(knots))
        assert not certificate.ok
        (violation,) = certificate.violations
        assert "'P0'" in violation
        assert f"{('alpha', 'beta')[joint]} {np.degrees(value):.6g} deg at {3.0 * (k % 3):.3f} s" in violation
    resting = verify(plane.replace(online=np.array([False])), motion_of([(0.0, 2.0, 9.0)]))
    assert resting.ok  # where an offline one stands is no one's fault


def test_speeds():
    plane = one(max_speed=0.5)
    assert verify(plane, motion_of([(0, 0.0, 1.0), (2, 1.0, 0.0), (4, 0.0, 1.0)])).ok
    certificate = verify(plane, motion_of([(0, 0.0, 1.0), (2, 1.0, 1.0), (3.9, 0.0, 1.0)]))
    assert not certificate.ok
    (violation,) = certificate.violations
    assert "alpha moves at 30.15" in violation
    assert "from 2.000 s" in violation
    assert verify(plane, motion_of([(0, 0.0, 0.0), (2, 1.0 + 1e-10, 0.0)])).ok
    assert not verify(plane, motion_of([(0, 0.0, 0.0), (2, 1.0 + 1e-8, 0.0)])).ok


def test_each_joint_is_named_once_with_its_worst():
    plane = make_plane([[0, 0], [90, 0]], [TIP], max_speed=0.1)
    motion = motion_of([(0, 0, 0), (1, 1, 0), (2, 3, 3), (3, 9, 3)], [(0, 0, 0), (1, 0, 1)])
    violations = verify(plane, motion).violations
    assert len(violations) == 3
    assert "'P0': alpha moves at 343.774677 deg/s from 2.000 s" in violations[0]


@pytest.mark.small
def test_another_number_of_positioners_and_senseless_settings_are_refused():
    plane = one()
    with pytest.raises(TrajectoryError, match="2 positioners, the focal plane 1"):
        verify(plane, Trajectory.at_rest(np.zeros((2, 2))))
    for bad in ({"margin": -1.0}, {"margin": np.nan}, {"jitter": -1e-9}, {"position_error": np.inf}):
        with pytest.raises(TrajectoryError, match="finite and 0 or more"):
            verify(plane, SWING, **bad)


# --- soundness of the bound ----------------------------------------------------------------------------------------


def as_path(plane, motion):
    knots = np.zeros(len(motion.times), KNOT)
    knots["time"], knots["alpha"], knots["beta"] = motion.times, *motion.angles.T
    measure(plane.arms, motion.offsets, knots)
    return Motion(motion.offsets, knots, motion.duration)


def random_knots(rng, n, duration, most=6, size=3.0):
    """Waits, swings, quick jerks; knots of some coincide, some begin late and end early."""
    shared = rng.uniform(0, duration, 3)
    knots = []
    for _ in range(n):
        times = np.unique(np.concatenate([rng.uniform(0, duration, rng.integers(1, most)), shared[: rng.integers(4)]]))
        times = times[np.append(True, np.diff(times) > 2e-3)]
        if rng.random() < 0.5:
            times[0] = 0.0
        angles = np.cumsum(rng.normal(0, size / np.sqrt(len(times)), (len(times), 2)), axis=0) + rng.uniform(-3, 3, 2)
        for k in range(1, len(times)):
            if rng.random() < 0.25:
                angles[k] = angles[k - 1]
        knots.append(np.column_stack([times, angles]))
    return motion_of(*knots)


def test_trap_another_vertex_closes_faster():
    """At the middle the pivot's end is closest and stays so near; the far end swings into the wall."""
    long = Body(np.array([[0.0, 0.0], [20.0, 0.0]]), 0.5)
    wall = Obstacle("wall", np.array([[-30.0, -1.0], [30.0, -1.0]]), 0.2)
    plane = one(long, obstacles=[wall], length=0.0)
    for motion in (motion_of([(0, 0.13, 0), (1, -0.03, 0)]), motion_of([(0, -0.03, 0), (1, 0.13, 0)])):
        middle = clearance_over_time(plane, motion, 0, 1, np.array([0.5]))[0]
        assert middle == pytest.approx(0.3)  # of the pivot, which does not move at all
        _, contact = pair_minimum(plane, motion)
        assert contact.time == pytest.approx(first_below(plane, motion, 0, 1, 0.0), abs=1e-4)
    short = motion_of([(0, 0.09, 0), (1, -0.01, 0)])
    assert verify(plane, short).ok


@pytest.mark.parametrize("seed", range(6))
def test_bound_at_constant_speeds_is_never_above_the_truth(seed):
    rng = np.random.default_rng(seed)
    slack = []
    for _ in range(120):
        plane = varied_plane(rng)
        i, j = (int(k) for k in rng.choice(plane.n + len(plane.obstacles), 2, replace=False))
        if min(i, j) >= plane.n:
            continue
        q, v = rng.uniform(-4, 4, (2, 2)), rng.normal(0, rng.choice([0.1, 1.0, 5.0]), (2, 2))
        fixed = np.array([i, j]) >= plane.n
        q[fixed], v[fixed] = 0.0, 0.0
        h = rng.choice([0.003, 0.03, 0.3])
        frames = [frame(plane.arms, a, *angles) for a, angles in ((i, q[0]), (j, q[1]))]
        now, bound = constant_speed_bound(plane.arms, i, frames[0], *v[0], j, frames[1], *v[1], h)
        times = np.linspace(-h, h, 61)[:, None]
        truth = sampled_clearance(plane, i, j, q[0] + times * v[0], q[1] + times * v[1])
        assert now == pytest.approx(truth[30], abs=1e-9)
        assert bound <= truth.min() + 1e-12
        slack.append(min(truth.min() - bound, 1e3))
    assert np.median(slack) < 0.1  # sharp enough to mean something


@pytest.mark.parametrize(("va", "vb"), [(1.0, 0.0), (-2.0, 0.0), (0.0, 1.5), (0.7, -2.0), (1.0, 1.0), (1.0, -1.0)])
def test_bound_is_attained_where_an_arm_curves_towards_a_wall(va, vb):
    """A stretched arm whose tip recedes along its axis with all of its acceleration, as far as h^4 goes."""
    plane = one(obstacles=[Obstacle("wall", np.array([[12.0, -50.0], [12.0, 50.0]]))])
    frames = frame(plane.arms, 0, 0.0, 0.0), frame(plane.arms, 1, 0.0, 0.0)
    for h in (0.01, 0.05, 0.1):
        now, bound = constant_speed_bound(plane.arms, 0, frames[0], va, vb, 1, frames[1], 0.0, 0.0, h)
        truth = 5.0 * np.cos(va * h) + 10.0 * np.cos((va + vb) * h) - 13.0
        assert now == pytest.approx(2.0)
        assert truth - 10.0 * (3.0 * h) ** 4 - 2e-9 <= bound <= truth


@pytest.mark.parametrize("seed", range(6))
def test_bound_of_an_interval_is_never_above_the_truth(seed):
    """Across knots, waits, late starts and early ends, with clocks and arms that are off."""
    rng = np.random.default_rng(100 + seed)
    slack = []
    for _ in range(25):
        plane = varied_plane(rng)
        motion = random_knots(rng, plane.n, rng.choice([0.5, 10.0]))
        path = as_path(plane, motion)
        for _ in range(6):
            i, j = 0, int(rng.integers(1, plane.n + len(plane.obstacles)))
            if rng.random() < 0.5:
                i, j = j, i
            ends = rng.uniform(0, motion.duration, 2)
            if rng.random() < 0.5:
                ends[1] = ends[0] + rng.choice([1e-3, 1e-2, 0.1])
            t0, t1 = np.sort(np.clip(ends, 0, motion.duration))
            jitter, error = rng.choice([0.0, 0.01, 0.3]), rng.choice([0.0, 0.2])
            t, now, bound = interval_bound(plane.arms, path, i, j, t0, t1, jitter, error)
            assert t0 <= t <= t1
            times = np.linspace(t0, t1, 200)
            truth = clearance_over_time(plane, motion, i, j, times) - error
            here = clearance_over_time(plane, motion, i, j, np.array([t]))[0] - error
            assert bound <= truth.min() + 1e-9
            assert now <= here + 1e-9
            if jitter:
                shifts = rng.uniform(-jitter, jitter, (2, 200))
                shifts[:, :100] = rng.choice([-jitter, jitter], (2, 100))
                truth = clearance_over_time(plane, motion, i, j, rng.permutation(times), *shifts) - error
                assert bound <= truth.min() + 1e-9
                there = clearance_over_time(plane, motion, i, j, np.full(200, t), *shifts).min() - error
                assert now <= there + 1e-9
            else:
                assert now == pytest.approx(here, abs=1e-9)
                slack.append(min(truth.min() - bound, 1e3) if t1 - t0 < 0.02 else np.nan)
    assert np.nanmedian(slack) < 0.3


# --- whole motions -------------------------------------------------------------------------------------------------


def assert_certificate_is_true(plane, motion, margin=0.0, count=1500):
    """Proven clearances are below all that sampling finds and close to one that exists; contacts are those it finds."""
    certificate = verify(plane, motion, margin)
    path, stack = as_path(plane, motion), np.empty((2, 256))
    low = {tuple(p): c for p, c in zip(certificate.pairs.tolist(), certificate.clearance, strict=True)}
    fixed = zip(certificate.obstacle_pairs.tolist(), certificate.obstacle_clearance, strict=True)
    low |= {(i, plane.n + k): c for (i, k), c in fixed}
    found = {c.pair: c for c in (*certificate.contacts, *certificate.undecided, *certificate.resting)}
    everyone = itertools.combinations(range(plane.n + len(plane.obstacles)), 2)
    unsafe = False
    for i, j in everyone:
        if i >= plane.n:
            continue
        smallest, when = smallest_over_time(plane, motion, i, j, count)
        proven = low.get((i, j), margin)
        assert proven <= smallest + 1e-9, (i, j, when)
        contact = found.pop((i, j if j < plane.n else plane.n - 1 - j), None)
        if (i, j) in low and not (proven > margin + CAP):
            lower, upper, when_seen = closest(plane.arms, path, i, j, margin, 0.0, 0.0, TOLERANCE, margin + CAP, *stack)
            assert lower == proven
            assert upper - lower <= TOLERANCE + 2e-9
            assert clearance_over_time(plane, motion, i, j, np.array([when_seen]))[0] == pytest.approx(upper, abs=1e-6)
        assert (contact is None) == (proven >= margin)
        if smallest < margin - 1e-7:
            assert contact is not None
        if contact is not None:
            assert smallest < margin + 1e-6
            assert contact.clearance - smallest < TOLERANCE + 1e-6
            crossing = first_below(plane, motion, i, j, margin + 1e-6, count, when)
            assert contact.time <= crossing + 1e-4
            if contact.time > 0:
                earlier = clearance_over_time(plane, motion, i, j, np.linspace(0, contact.time, 50)[:-1])
                assert np.all(earlier >= margin - 1e-9)
            edge = clearance_over_time(plane, motion, i, j, np.array([contact.time]))[0]
            assert edge <= margin + 0.01  # it is where the crossing happens, not just before it
            unsafe = True
    assert not found
    assert certificate.ok == (not unsafe)
    return certificate.ok


@pytest.mark.parametrize("seed", range(60))
def test_random_motions_of_a_hexagon(seed):
    rng = np.random.default_rng(seed)
    plane = FocalPlane.hexagonal(1, rng.uniform(18, 24), radius=rng.choice([0.0, 0.5, 1.5]), max_speed=1e3)
    plane = plane.replace(lower=np.full((7, 2), -99.0), upper=np.full((7, 2), 99.0))
    if seed % 3 == 0:
        plane = plane.replace(
            obstacles=(post(9.0, 7.0, 0.8), Obstacle("camera", STAR + np.array([-11.0, 5.0]), closed=True))
        )
    motion = random_knots(rng, 7, 12.0, size=rng.choice([0.1, 0.5, 2.0]))
    assert_certificate_is_true(plane, motion, rng.choice([0.0, 0.5]), count=700)


def test_random_motions_are_of_both_kinds():
    plane = FocalPlane.hexagonal(1, 22.4, max_speed=1e3)
    plane = plane.replace(lower=np.full((7, 2), -99.0), upper=np.full((7, 2), 99.0))
    answers = [verify(plane, random_knots(np.random.default_rng(s), 7, 12.0, size=0.1)).ok for s in range(200)]
    assert 0.03 < np.mean(answers) < 0.97


@pytest.mark.parametrize("seed", range(15))
def test_random_motions_of_bodies_of_every_kind(seed):
    rng = np.random.default_rng(1000 + seed)
    plane = varied_plane(rng).replace(max_speed=np.full((3, 2), 1e3))
    motion = random_knots(rng, 3, rng.choice([1.0, 8.0]), size=1.5)
    assert_certificate_is_true(plane, motion, rng.choice([0.0, 1.0]), count=900)


def test_many_turns():
    plane = make_plane([[0, 0], [26, 0]], [TIP], max_speed=10.0)
    motion = motion_of([(0.0, 0.0, 0.0), (20.0, 50.0, 0.0)], [(0.0, 0.0, 0.0), (20.0, 50.0, 0.0)])
    assert verify(plane, motion).ok  # in step
    assert_certificate_is_true(plane, motion, count=20000)
    mirrored = motion_of([(0.0, 1.5, 0.0), (20.0, 50.0, 0.0)], [(0.0, np.pi - 1.5, 0.0), (20.0, np.pi - 50.0, 0.0)])
    assert not assert_certificate_is_true(plane, mirrored, count=20000)


@pytest.mark.parametrize("duration", [1e-6, 1e-3, 1.0, 1e4, 1e6])
def test_any_duration(duration):
    """The same motion at any speed has the same clearance."""
    for graze in (1e-4, -1e-4):
        plane = one(obstacles=[post(0.0, 17.0 + graze)], max_speed=1e9)
        motion = motion_of([(0.0, 0.0, 0.0), (duration, np.pi, 0.0)])
        certificate = verify(plane, motion)
        assert certificate.ok == (graze > 0)
        if graze < 0:
            expected = duration * (0.5 - np.arccos((225 + (17 + graze) ** 2 - 4) / (30 * (17 + graze))) / np.pi)
            assert certificate.contacts[0].time == pytest.approx(expected, abs=max(1e-6, 1e-5 * duration))


@pytest.mark.parametrize("begin", [1.0, 1.7e9])
def test_motions_that_begin_late(begin):
    """As with a clock that counts from 1970."""
    for graze in (1e-3, -1e-3):
        plane = one(obstacles=[post(0.0, 17.0 + graze)])
        certificate = verify(plane, motion_of([(begin, 0.0, 0.0), (begin + 7.0, np.pi, 0.0)]))
        assert certificate.ok == (graze > 0)
        assert not certificate.undecided


@pytest.mark.parametrize("begin", [0.0, 1e7, 1.7e9, 1e12])
def test_contacts_between_two_floating_point_times_are_found(begin):
    """Points with radii of a nanometre cross at full speed: they touch for less than the spacing of times."""
    rng = np.random.default_rng(1)
    for depth in (2e-9, 1e-7, 1e-5):
        for angle in rng.uniform(0.3, 2.8, 20):
            place = 15.0 * np.cos(angle), 15.0 * np.sin(angle)
            plane = one(Body(np.array([[10.0, 0.0]]), depth / 2), obstacles=[post(*place, radius=depth / 2)])
            motion = motion_of([(begin, 0.0, 0.0), (begin + 7.0, np.pi, 0.0)])
            assert not verify(plane, motion).ok
    away = one(obstacles=[post(0.0, 17.1)])
    assert verify(away, motion_of([(begin, 0.0, 0.0), (begin + 7.0, np.pi, 0.0)])).ok


def test_turns_so_many_that_their_rounding_counts():
    """One unit in the last place of 1e12 turns is a milliradian: what is within that is not taken as safe."""
    digits = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899")
    rng = np.random.default_rng(2)
    anywhere = {"lower": np.full((1, 2), -np.inf), "upper": np.full((1, 2), np.inf)}
    with localcontext() as context:
        context.prec = 70
        for turns, zero in zip(rng.uniform(1e12, 2e12, 20), rng.uniform(0.0, 1.0, 20), strict=True):
            alpha = float(turns) * 2 * np.pi
            exact = (Decimal(alpha) + Decimal(zero)) % (2 * digits)
            x, y = 15.0 * np.cos(float(exact)), 15.0 * np.sin(float(exact))
            touched = Obstacle("post", np.array([[x, y]]) * (1 + (2.0 - 1e-6) / 15.0), 1.0)
            beside = post(x - (2.0 - 1e-6) * y / 15.0, y + (2.0 - 1e-6) * x / 15.0)
            still = Trajectory.at_rest(np.array([[alpha, 0.0]]))
            for obstacle in (touched, beside):
                certificate = verify(one(obstacles=[obstacle], **(anywhere | {"zero": np.array([[zero, 0.0]])})), still)
                assert certificate.contacts or certificate.undecided
            assert verify(one(obstacles=[post(-3 * x, -3 * y)], **anywhere), still).ok


def test_motion_bounds_of_long_journeys_do_not_cancel():
    """After a light second of travel a difference of two distances is only as good as their rounding."""
    plane = make_plane([[0, 0]], (TIP,), [post(0.0, 15.0, radius=1.0 - 1e-6)], max_speed=1e12)
    turns = 1e11
    knots = [(0.0, 0.0, 0.0), (10.0, turns, 0.0), (10.5, turns + 0.5, 0.0)]
    certificate = verify(plane, motion_of(knots))
    assert certificate.contacts or certificate.undecided


@pytest.mark.parametrize("speed", [1e3, 1e6, 1e9])
def test_any_speed(speed):
    for graze in (1e-6, -1e-6):
        plane = one(obstacles=[post(0.0, 17.0 + graze)], max_speed=2 * speed)
        certificate = verify(plane, motion_of([(0.0, 0.0, 0.0), (np.pi / speed, np.pi, 0.0)]))
        assert certificate.ok == (graze > 0)
        assert not certificate.undecided


def test_no_duration():
    plane = make_plane([[0, 0], [32, 0]], [TIP])
    assert verify(plane, Trajectory.at_rest(np.array([[0.1, 0.0], [np.pi, 0.0]]))).contacts == ()
    certificate = verify(plane, Trajectory.at_rest(np.array([[0.0, 0.0], [np.pi, 0.0]])))
    assert not certificate.ok  # 2 mm apart at the centres: they touch


def test_thousands_of_knots():
    """As a controller's log: the pose every few milliseconds, a little off each time."""
    rng = np.random.default_rng(7)
    times = np.linspace(0.0, 20.0, 6001)
    base = np.stack([np.linspace(0, np.pi, 6001), 0.1 * np.sin(times)], axis=1)
    knots = [np.column_stack([times, base + rng.normal(0, 1e-4, base.shape)]) for _ in range(2)]
    plane = make_plane([[0, 0], [22, 0]], [CAPSULE], [post(0.0, 17.5)], max_speed=9.0, length=5.0)
    motion = motion_of(*knots)
    certificate = verify(plane, motion)
    assert not certificate.undecided
    for (i, j), low in zip(certificate.pairs, certificate.clearance, strict=True):
        smallest, _ = smallest_over_time(plane, motion, i, j, 12001)
        assert low <= smallest + 1e-9
        assert low > min(smallest, CAP) - 0.02
    jerk = [knots[0].copy(), knots[1]]
    jerk[0][3000] = [times[3000], np.pi / 2, 0.0]
    plane = plane.replace(obstacles=(post(0.0, 16.95),))
    _, contact = pair_minimum(plane, motion_of(*jerk))
    assert contact.pair == (0, -1)


def test_no_neighbour_list_of_anyone_is_trusted():
    """`pair_margin` says whom a plane calls neighbours; the proof looks at all that could come within the margin."""
    plane = make_plane([[0, 0], [33, 0]], [TIP], pair_margin=-99.0)
    assert len(plane.pairs) == 0
    facing = Trajectory.at_rest(np.array([[0.0, 0.0], [np.pi, 0.0]]))
    assert verify(plane, facing, margin=0.9).ok
    assert not verify(plane, facing, margin=1.1).ok
    assert not verify(plane, facing, margin=0.9, position_error=0.2).ok


# --- clocks and arms that are off ----------------------------------------------------------------------------------

CROSSING = motion_of(
    [(0.0, -1.5, 0.0), (2.0, 0.0, 0.0), (4.0, -1.5, 0.0)],
    [(0.0, np.pi, 0.0), (0.5, np.pi, 0.0), (2.5, np.pi - 1.5, 0.0)],
)


def test_contact_only_if_a_clock_is_late():
    """One leaves upward before the other comes from below; too late, it is hit."""
    plane = make_plane([[0, 0], [17.0, 0]], [Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 0.5)], length=0.0)
    calm, _ = smallest_over_time(plane, CROSSING, 0, 1)
    assert calm > 0
    times = np.linspace(0, 4, 4000)
    worst = {
        tau: min(
            clearance_over_time(plane, CROSSING, 0, 1, times, a, b).min() for a in (-tau, tau) for b in (-tau, tau)
        )
        for tau in (0.001, 0.01, 0.1, 0.3, 0.5, 0.6, 0.7, 1.0)
    }
    assert min(worst.values()) < 0 < max(worst.values())  # the scene is about the clocks
    assert verify(plane, CROSSING).ok
    for tau, smallest in worst.items():
        certificate = verify(plane, CROSSING, jitter=tau)
        if smallest < 0:
            assert not certificate.ok
        assert certificate.smallest <= smallest + 1e-9
    assert verify(plane, CROSSING, jitter=0.001).ok


@pytest.mark.parametrize("seed", range(10))
def test_no_shift_of_an_accepted_motion_touches(seed):
    """Random motions, accepted for the largest jitter that halving finds, stay clear whatever the clocks do."""
    rng = np.random.default_rng(seed)
    plane = make_plane(rng.uniform(-15, 15, (3, 2)), [CAPSULE], [post(0.0, 0.0)], length=4.0, max_speed=1e3)
    margin, error, accepted = 0.1, np.array([0.0, 0.05, 0.1]), 0
    for _ in range(40):
        motion = random_knots(rng, 3, 6.0, size=0.3)
        jitter = next((tau for tau in (1.0, 0.3, 0.1, 0.03) if verify(plane, motion, margin, tau, error).ok), None)
        if jitter is None:
            continue
        accepted += 1
        wrong = np.concatenate([error, [0.0]])
        for i, j in itertools.combinations(range(4), 2):
            times = np.linspace(-jitter, motion.duration + jitter, 400)
            shifts = np.where(rng.random((2, 400)) < 0.7, rng.choice([-jitter, jitter], (2, 400)), 0.0)
            gaps = clearance_over_time(plane, motion, i, j, times, *shifts)
            assert gaps.min() >= margin + wrong[i] + wrong[j] - 1e-9
    assert accepted


def test_jitter_reaches_past_the_knots():
    """At rest when the other passes, but moving shortly after: a late clock counts the speed that is near in time."""
    plane = make_plane([[0, 0], [31.5, 0]], [TIP], max_speed=1e3)
    # the first's tip comes to (15, 0) just when the second has left (16.5, 0)
    motion = motion_of(
        [(0.0, -1.0, 0.0), (1.0, 0.0, 0.0)], [(0.0, np.pi, 0.0), (0.85, np.pi, 0.0), (0.9, np.pi - 1, 0.0)]
    )
    assert verify(plane, motion).ok
    late = clearance_over_time(plane, motion, 0, 1, np.linspace(0, 1.2, 3000), 0.0, -0.2).min()
    assert late < 0
    assert not verify(plane, motion, jitter=0.2).ok


def test_position_errors_are_those_of_the_two():
    plane = make_plane([[0, 0], [33, 0], [66, 0]], [TIP], [post(-18.0, 0.0)])
    facing = Trajectory.at_rest(np.array([[0.0, 0.0], [np.pi, 0.0], [np.pi, 0.0]]))
    assert pair_minimum(plane, facing, position_error=0.51)[1].clearance == pytest.approx(-0.02)
    assert verify(plane, facing, position_error=0.49).ok
    assert not verify(plane, facing, position_error=0.51).ok
    assert verify(plane, facing, position_error=np.array([0.9, 0.0, 5.0])).ok
    assert not verify(plane, facing, position_error=np.array([0.9, 0.2, 0.0])).ok
    outward = Trajectory.at_rest(np.array([[np.pi, 0.0], [0.5, 0.0], [0.5, 0.0]]))
    assert verify(plane, outward, position_error=np.array([0.99, 9.0, 0.0])).ok  # an obstacle is where it is
    assert not verify(plane, outward, position_error=np.array([1.01, 0.0, 0.0])).ok


def test_shifted_angles_are_of_both_arms():
    """The helper these tests lean on moves what it says it moves."""
    motion = motion_of([(0, 0, 0), (1, 1, 0)], [(0, 0, 0), (1, 0, 1)])
    np.testing.assert_allclose(sampled(motion, 0, np.array([0.5]) + 0.25), [[0.75, 0.0]])


def test_certificate_says_what_it_found():
    motion, far = bent_swing()
    plane = one(obstacles=[post(0.0, far + 2.5)])
    assert str(verify(plane, motion, margin=0.4)).startswith("safe: smallest proven clearance 0.4")
    assert str(verify(plane, motion, margin=0.4)).endswith("(margin 0.4 mm, 1 pairs)")
    assert str(verify(plane, motion, margin=0.6)) == "not safe: 1 contacts"
    assert "nothing is within reach" in str(verify(one(), SWING))
