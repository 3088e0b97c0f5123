import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fiberplan.certificates import verify
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.four_bar import FourBar
from fiberplan.focal_plane.inverse_kinematics import solutions
from fiberplan.kernels.arms import frame, motion, vertex
from fiberplan.kernels.four_bar import largest_acceleration, leaves_range, rates, slider
from fiberplan.motion import Trajectory
from references import four_bar_joints, four_bar_plane, motion_of, placed, smallest_over_time

SEED = st.integers(0, 10_000)
ANGLE = st.floats(0.0, 6.3)
TURN = st.floats(-2.0, 2.0)


def sampled_sliders(plane, i, start, step, samples=4000):
    """Slider lengths (t,) of arm i during an even move."""
    _, _, j3, j4 = four_bar_joints(plane, i, start + np.linspace(0, 1, samples)[:, None] * np.asarray(step))
    return np.abs(j4 - j3)


def test_frames_agree_with_the_papers_joints():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        plane = four_bar_plane(rng)
        for _ in range(20):
            i, angles = int(rng.integers(plane.n)), rng.uniform(-7, 7, 2)
            frame_, arm = frame(plane.arms, i, *angles), plane.arms.arm[i]
            found = [
                vertex(plane.arms, frame_, piece["link"], k)
                for piece in plane.arms.piece[arm["first_piece"] : arm["last_piece"]]
                if piece["last"] - piece["first"] != 3 and piece["link"] != 1  # outlines are cut into triangles
                for k in range(piece["first"], piece["last"])
            ]
            shapes = [placed(plane, i, body, angles[None])[0] for body in plane.bodies if body.link != "alpha"]
            shapes[1] = shapes[1][[0, 1, 1, 2]]  # an open line is cut into segments
            np.testing.assert_allclose(found, np.concatenate(shapes), atol=1e-10)
            _, _, j3, j4 = four_bar_joints(plane, i, angles[None])
            assert slider(plane.arms, i, *angles) == pytest.approx(abs(j4 - j3)[0], abs=1e-11)
            assert plane.kinematics.sliders(plane.length, np.tile(angles, (plane.n, 1)), plane.zero)[
                i
            ] == pytest.approx(abs(j4 - j3)[0], abs=1e-11)


def test_tip_as_printed_where_the_print_is_right():
    """Sabater2018's formula, which loses a sign where J4 is left of J3: there ours points the other way."""
    bar = FourBar(np.array([110.0]), np.array([60.0]), np.array([20.0]), np.array([300.0]), np.array([0.0]))
    plane = four_bar_plane(np.random.default_rng(0), n=1).replace(
        base=np.zeros((1, 2)),
        length=np.array([80.0]),
        zero=np.zeros((1, 2)),
        kinematics=bar,
        folded=np.array([[np.pi, 0.0]]),
        fiber_offsets={"tip": np.array([260.0, 0.0])},
    )
    signs = set()
    for t1, t2 in np.random.default_rng(1).uniform(0, [np.pi, 2 * np.pi], (200, 2)):
        denominator = 110.0 - 80.0 * np.cos(t1) - 60.0 * np.cos(t2)
        u = (-80.0 * np.sin(t1) + 60.0 * np.sin(t2)) / denominator
        away = 260.0 / np.sqrt(1 + u * u) * np.array([1.0, u]) * np.sign(denominator)
        tip = 80.0 * np.array([np.cos(t1), np.sin(t1)]) + away
        np.testing.assert_allclose(plane.fibers(np.array([[t1, t2]]))[0], tip, atol=1e-9)
        signs.add(np.sign(denominator))
    assert signs == {-1.0, 1.0}


@settings(max_examples=50, deadline=None, derandomize=True)
@given(SEED, ANGLE, ANGLE)
def test_inverse_kinematics_finds_every_solution(seed, theta1, theta2):
    """Any configuration outside the zone of avoidance is among the solutions for its own tip."""
    plane = four_bar_plane(np.random.default_rng(seed), n=1)
    angles = np.array([[theta1, theta2]])
    point = plane.fibers(angles)
    found = solutions(plane, np.arange(1), point, plane.fiber, np.zeros(1))[0]
    found = found[np.isfinite(found[:, 0])]
    assert all(np.abs(plane.fibers(f[None]) - point).max() < 1e-7 for f in found)
    assert not any(plane.in_avoidance(f[None])[0] for f in found)
    length = plane.kinematics.sliders(plane.length, angles, plane.zero)[0]
    if plane.kinematics.shortest[0] <= length <= plane.kinematics.longest[0]:
        turned = np.abs((found - angles + np.pi) % (2 * np.pi) - np.pi).max(axis=1)
        assert turned.min() < 1e-5  # the root is flat at the edge of reach
    assert np.all(found[:, 0] >= plane.lower[0, 0])


def test_points_just_beyond_an_end_are_taken_to_it():
    """Tables have three decimals: at the end of a joint's range, and of what the arm reaches at all."""
    rng, ends, edges = np.random.default_rng(8), 0, 0
    for _ in range(60):
        plane = four_bar_plane(rng, n=1)
        who, offset = np.array([0]), plane.fiber
        q = plane.kinematics.random(plane, rng, who)
        lever = plane.kinematics.levers(plane, who, offset)
        tip = plane.fibers(q)
        for d, (joint, sign) in enumerate([(0, 1), (1, 1), (0, -1), (1, -1)]):
            for off in (0.9e-3, 0.1):
                end = q[0, joint] - sign * off / lever[0].sum()
                limits = {name: getattr(plane, name).copy() for name in ("lower", "upper", "folded")}
                limits["upper" if sign > 0 else "lower"][0, joint] = end
                limits["lower" if sign > 0 else "upper"][0, joint] = end - sign * 1e-3
                limits["folded"][0] = q[0]
                limits["folded"][0, joint] = end
                shut = plane.replace(**limits)
                found = solutions(shut, who, tip, offset, np.zeros(1))[0]
                found = found[np.isfinite(found[:, 0])]
                here = np.abs(found - q[0]).max(axis=1) < 0.05 if len(found) else np.zeros(0, bool)
                assert here.any() == (off < 1e-3), (d, off)
                for each in found:
                    assert np.hypot(*(shut.fibers(each[None]) - tip)[0]) <= 1e-3
                ends += here.any()
        length, arm = plane.length[0], np.hypot(*offset[0])
        away = tip[0] - plane.base[0]
        far = plane.base + away / np.hypot(*away) * (length + arm + 0.9e-3)
        for each in solutions(plane, who, far, offset, np.zeros(1))[0]:
            if np.isfinite(each[0]):
                edges += 1
                assert np.hypot(*(plane.fibers(each[None]) - far)[0]) <= 1e-3 + 1e-9
    assert ends > 200
    assert edges > 0


@pytest.mark.small
def test_most_points_have_several_solutions():
    plane = four_bar_plane(np.random.default_rng(3), n=1, longest=(100.0, 120.0), shortest=(1.0, 1.1))
    plane = plane.replace(lower=np.zeros((1, 2)), upper=np.full((1, 2), 2 * np.pi), folded=plane.folded % (2 * np.pi))
    points = plane.fibers(plane.folded) + np.random.default_rng(0).normal(0, 3, (300, 2))
    who = np.zeros(300, int)
    found = solutions(plane, who, points, plane.fiber[who], np.zeros(300))
    counts = np.isfinite(found[:, :, 0]).sum(axis=1)
    assert counts.max() == 4
    assert len(set(counts)) > 1
    assert np.all(np.isfinite(found[:, :, 0]) == np.isfinite(found[:, :, 1]))


@settings(max_examples=300, deadline=None, derandomize=True)
@given(SEED, ANGLE, ANGLE, TURN, TURN)
def test_leaving_the_range_is_never_missed(seed, theta1, theta2, turn1, turn2):
    plane = four_bar_plane(np.random.default_rng(seed), n=1)
    low, high = plane.kinematics.shortest[0], plane.kinematics.longest[0]
    part, length = leaves_range(plane.arms, 0, theta1, theta2, turn1, turn2)
    lengths = sampled_sliders(plane, 0, (theta1, theta2), (turn1, turn2))
    outside = (lengths < low - 1.1e-6) | (lengths > high + 1.1e-6)
    if np.isnan(part):
        assert not outside.any()
    else:
        assert not outside[: int(part * 3999)].any()
        assert length < low - 1e-7 or length > high + 1e-7  # it really is outside there: nothing is refused in vain


def test_touching_the_limit_is_in_range():
    plane = four_bar_plane(np.random.default_rng(5), n=1)
    step = np.array([0.7, -1.1])
    lengths = sampled_sliders(plane, 0, plane.folded[0], step, 200_001)
    bar = plane.kinematics
    exactly = plane.replace(
        kinematics=FourBar(
            bar.spacing, bar.rocker, np.array([lengths.min()]), np.array([lengths.max()]), bar.orientation
        )
    )
    assert np.isnan(leaves_range(exactly.arms, 0, *plane.folded[0], *step)[0])
    tighter = plane.replace(
        kinematics=FourBar(
            bar.spacing, bar.rocker, np.array([lengths.min() + 1e-4]), np.array([lengths.max()]), bar.orientation
        ),
        folded=plane.folded + step * (0.5 if lengths[100_000] > lengths.min() + 1e-3 else 0.25),
    )
    assert not np.isnan(leaves_range(tighter.arms, 0, *plane.folded[0], *step)[0])


@settings(max_examples=300, deadline=None, derandomize=True)
@given(SEED, ANGLE, ANGLE, TURN, TURN)
def test_no_point_moves_farther_than_the_bound(seed, theta1, theta2, turn1, turn2):
    plane = four_bar_plane(np.random.default_rng(seed), n=1)
    start, step = np.array([theta1, theta2]), np.array([turn1, turn2])
    if not np.isnan(leaves_range(plane.arms, 0, *start, *step)[0]):
        start, step = plane.folded[0], step * 0.02  # the bound holds outside the zone of avoidance
        if not np.isnan(leaves_range(plane.arms, 0, *start, *step)[0]):
            return
    angles = start + np.linspace(0, 1, 60)[:, None] * step
    for body in plane.bodies:
        track = placed(plane, 0, body, angles)
        assert np.linalg.norm(track - track[:1], axis=2).max() <= motion(plane.arms, 0, *step) + 1e-9


@settings(max_examples=400, deadline=None, derandomize=True)
@given(SEED, ANGLE, ANGLE, TURN, TURN, st.floats(1e-3, 0.5))
def test_no_point_accelerates_more_than_the_bound(seed, theta1, theta2, va, vb, h):
    """Second differences of the sampled motion within +-h never exceed the bound from one look in the middle."""
    plane = four_bar_plane(np.random.default_rng(seed), n=1)
    bound = largest_acceleration(plane.arms, 0, frame(plane.arms, 0, theta1, theta2), va, vb, h)
    if not np.isfinite(bound):
        return
    tick = 1e-4
    times = np.linspace(-h, h, 41)[:, None] + tick * np.array([-1.0, 0.0, 1.0])
    angles = np.array([theta1, theta2]) + times.reshape(-1, 1) * np.array([va, vb])
    slack = 1e-3 + 1e-2 * bound  # the outermost differences look 1e-4 s beyond h
    for body in plane.bodies:
        before, now, after = placed(plane, 0, body, angles).reshape(41, 3, -1, 2).transpose(1, 0, 2, 3)
        assert np.linalg.norm(before - 2 * now + after, axis=2).max() / tick**2 <= bound + slack


def test_the_bounds_are_sharp_somewhere():
    """A bound a hundred times too large would be safe and of no use."""
    sharpest = 0.0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        plane = four_bar_plane(rng, n=1)
        angles, speed, tick = rng.uniform(0, 6.3, 2), rng.uniform(-1, 1, 2), 1e-4
        bound = largest_acceleration(plane.arms, 0, frame(plane.arms, 0, *angles), *speed, tick)
        before, now, after = placed(plane, 0, plane.bodies[0], angles + tick * np.outer([-1, 0, 1], speed))
        sharpest = max(sharpest, np.linalg.norm(before - 2 * now + after, axis=1).max() / tick**2 / bound)
    assert sharpest > 0.7


def test_links_turn_as_fast_as_they_say():
    for seed in range(50):
        rng = np.random.default_rng(seed)
        plane = four_bar_plane(rng, n=1)
        angles, speed, tick = rng.uniform(0, 6.3, 2), rng.uniform(-1, 1, 2), 1e-6
        joints = four_bar_joints(plane, 0, angles + tick * np.outer([-1, 1], speed))
        j1, j2, j3, j4 = joints
        if abs(j4 - j3).min() < 0.5:
            continue
        turned = [np.angle(np.divide(*link[::-1])) / (2 * tick) for link in (j3 - j1, j4 - j3, j4 - j2)]
        np.testing.assert_allclose(rates(plane.arms, 0, frame(plane.arms, 0, *angles), *speed), turned, atol=1e-6)


def test_singular_configurations_have_an_answer():
    """Where J3 and J4 coincide the probe has no direction: clearances are not numbers, bounds say nothing."""
    plane = four_bar_plane(np.random.default_rng(1), n=2)
    bar = FourBar(*(np.full(2, x) for x in (20.0, 12.0, 2.0, 60.0)), np.zeros(2))
    angle = np.arccos(10.0 / 12.0)  # J3 and J4 meet above the middle of J1 J2
    plane = plane.replace(
        kinematics=bar,
        length=np.full(2, 12.0),
        zero=np.zeros((2, 2)),
        folded=np.zeros((2, 2)) + [np.pi, 0.0],
        base=np.array([[0.0, 0.0], [25.0, 0.0]]),
    )
    at = np.array([angle, angle])
    assert slider(plane.arms, 0, *at) < 1e-14
    assert plane.in_avoidance(np.tile(at, (2, 1))).all()
    assert largest_acceleration(plane.arms, 0, frame(plane.arms, 0, *at), 0.1, 0.1, 0.1) == np.inf
    assert largest_acceleration(plane.arms, 0, frame(plane.arms, 0, *at), 0.0, 0.0, 0.1) == 0.0
    through = Trajectory.from_samples(
        np.array([0.0, 1.0, 2.0]), np.stack([plane.folded * 0 + at - 0.3, plane.folded * 0 + at + 0.3, plane.folded])
    )
    certificate = verify(plane, through)
    assert [entry.positioner for entry in certificate.zones] == [0, 1]
    assert not certificate.ok


@pytest.mark.parametrize("seed", range(14))
@pytest.mark.parametrize("jitter", [0.0, 0.004])
def test_certificates_are_never_above_what_is_sampled(seed, jitter):
    """Random motions of three arms, through zones of avoidance and near-singular poses too, by shapely."""
    rng = np.random.default_rng(100 + seed)
    plane = four_bar_plane(rng, shortest=(1.0, 3.0))
    knots = [
        [(0.0, *plane.folded[i])] + [(t, *(plane.folded[i] + rng.normal(0, 0.5, 2))) for t in (1.0, 2.1, 3.0 + i)]
        for i in range(3)
    ]
    motion_ = motion_of(*knots)
    certificate = verify(plane, motion_, margin=0.0, jitter=jitter)
    singular = {entry.positioner for entry in certificate.zones}
    for (i, j), low in zip(certificate.pairs, certificate.clearance, strict=True):
        seen, _ = smallest_over_time(plane, motion_, i, j, 600)
        assert low <= seen + 1e-9
        if seen < 1.0 and not jitter and not singular & {i, j}:
            assert low > seen - 0.02  # and sharp where it matters
    seen_inside = {
        i
        for i in range(3)
        for length in [
            np.concatenate(
                [
                    sampled_sliders(plane, i, np.array(a[1:]), np.subtract(b[1:], a[1:]))
                    for a, b in zip(knots[i], knots[i][1:], strict=False)
                ]
            )
        ]
        if (length < plane.kinematics.shortest[i] - 1e-5).any() or (length > plane.kinematics.longest[i] + 1e-5).any()
    }
    assert singular >= seen_inside
    assert certificate.ok is (
        not (certificate.zones or certificate.contacts or certificate.undecided or certificate.violations)
    )


def test_zone_between_knots_is_found_with_its_time():
    """Both ends are outside the zone of avoidance, the middle is not: knots alone would not tell."""
    found = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        plane = four_bar_plane(rng, n=1)
        end = rng.uniform(-3, 3, 2) + plane.folded[0]
        if plane.in_avoidance(end[None])[0]:
            continue
        lengths = sampled_sliders(plane, 0, plane.folded[0], end - plane.folded[0], 100_001)
        outside = np.flatnonzero((lengths < plane.kinematics.shortest[0]) | (lengths > plane.kinematics.longest[0]))
        certificate = verify(plane, motion_of([(0.0, *plane.folded[0]), (4.0, *end)]))
        if not len(outside):
            assert not certificate.zones
            continue
        (entry,) = certificate.zones
        assert entry.time == pytest.approx(4.0 * outside[0] / 100_000, abs=1e-3)
        found += 1
    assert found >= 8


@pytest.mark.small
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"shortest": 0.5}, "shortest 0.5 mm slider is under 1 mm"),
        ({"longest": 50.0}, "longest 50 mm slider is not above the shortest"),
        ({"rocker": -1.0}, "rocker -1 mm is not a positive length"),
        ({"orientation": np.nan}, "orientation must be one finite number"),
    ],
)
def test_constants_that_make_no_arm_are_refused(change, words):
    values = {"spacing": 110.0, "rocker": 60.0, "shortest": 60.0, "longest": 145.0, "orientation": 0.0} | change
    with pytest.raises(InstrumentError, match=words):
        FourBar(**{name: np.array([value]) for name, value in values.items()})
