"""Acceleration and least speed: what the focal plane says of them, how files keep them, and what `verify` finds."""

import numpy as np
import pytest
from astropy import units as u

import fiberplan as fp
from fiberplan.certificates import verify
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.differences import differences_of
from fiberplan.focal_plane.motor_limits import least_time
from fiberplan.motion import Trajectory
from fiberplan.tolerances import RAMP
from references import make_plane, motion_of

pytestmark = pytest.mark.small
SPEED, ACCELERATION, SLOWEST = 2.0, 4.0, 0.5  # [rad/s, rad/s^2, rad/s]


def limited(n=1, **changes):
    """Arms without bodies whose motors have both limits."""
    base = 50.0 * np.stack([np.arange(n), np.zeros(n)], axis=1)
    limits = {"max_acceleration": np.full((n, 2), ACCELERATION), "min_speed": np.full((n, 2), SLOWEST)}
    return make_plane(base, (), max_speed=SPEED, **(limits | changes))


@pytest.mark.parametrize(
    ("turn", "slowest", "seconds"),
    [
        (90.0, 0.0, 90 / 12 + 12 / 48),
        (-90.0, 0.0, 7.75),
        (3.0, 0.0, 0.5),  # just reaches 12 deg/s
        (1.0, 0.0, 2 * np.sqrt(1 / 48)),
        (1.0, 4.0, 8 / 48),  # from 4 to 8 deg/s and back
        (90.0, 4.0, 16 / 48 + (90 - 8 / 3) / 12),  # two ramps of 1/6 s and 4/3 deg
        (0.0, 4.0, 0.0),
        (np.nan, 0.0, np.nan),
    ],
)
def test_least_time_of_a_turn(turn, slowest, seconds):
    assert least_time(turn, 12.0, 48.0, slowest) == pytest.approx(seconds, nan_ok=True)


def test_least_time_without_bound_is_turn_over_speed():
    np.testing.assert_allclose(least_time(np.array([6.0, 0.1]), 12.0, np.inf, np.array([0.0, 5.0])), [0.5, 0.1 / 12])


def test_least_time_of_joints_of_many_positioners():
    plane = limited(2, max_acceleration=np.array([[np.inf, 4.0], [1.0, np.inf]]), min_speed=None)
    turn = np.ones((2, 3, 2))
    np.testing.assert_allclose(plane.least_time(turn)[:, 0], [[0.5, 1.0], [2.0, 0.5]])
    np.testing.assert_allclose(plane.least_time(turn[:1], np.array([1]))[0, 2], [2.0, 0.5])
    np.testing.assert_allclose(plane.replace(max_acceleration=None).least_time(turn), 0.5)


def test_bound_of_a_plan_takes_acceleration_into_account():
    plane = fp.FocalPlane.hexagonal(0, 22.4, max_speed=SPEED).replace(max_acceleration=np.full((1, 2), ACCELERATION))
    plan = fp.planners.Direct().plan(fp.Problem(plane, np.array([[0.0, 3.0]]), np.array([[3.0, 3.0]])))
    assert plan.lower_bound == pytest.approx(3.0 / 2.0 + 2.0 / 4.0)


def test_none_and_no_limit_are_the_same():
    plane = limited(max_acceleration=np.full((1, 2), np.inf), min_speed=np.zeros((1, 2)))
    assert plane.max_acceleration is None
    assert plane.min_speed is None
    assert "max_acceleration" not in repr(plane)
    assert repr(limited()).endswith("0 obstacles, max_acceleration, min_speed>")


def test_units_are_converted():
    plane = limited(max_acceleration=[[90.0, 180.0]] * u.deg / u.s**2, min_speed=[[6.0, 6.0]] * u.deg / u.s)
    np.testing.assert_allclose(plane.max_acceleration, [[np.pi / 2, np.pi]])
    np.testing.assert_allclose(plane.min_speed, np.radians(6.0))
    with pytest.raises(InstrumentError, match=r"max_acceleration is in 'deg / s', expected an angular acceleration"):
        limited(max_acceleration=[[90.0, 180.0]] * u.deg / u.s)


@pytest.mark.parametrize(
    ("name", "value", "complaint"),
    [
        ("max_acceleration", 0.0, "'P0': beta max_acceleration 0 deg/s^2 is not a positive acceleration"),
        ("max_acceleration", np.nan, "beta max_acceleration nan deg/s^2"),
        ("min_speed", -1.0, "'P0': beta min_speed -57.2958 deg/s is not a speed"),
        ("min_speed", 2.5, "beta min_speed 143.239 deg/s is above the joint's largest speed"),
        ("min_speed", np.nan, "beta min_speed nan"),
    ],
)
def test_limits_that_no_motor_has_are_refused(name, value, complaint):
    with pytest.raises(InstrumentError) as caught:
        limited(**{name: np.array([[1.0, value]])})
    assert complaint in str(caught.value)


def test_focal_plane_files_keep_limits(tmp_path):
    plane = limited(2, max_acceleration=np.array([[1.0, np.inf], [3.0, 4.0]]))
    plane.write(tmp_path / "plane.fits")
    read = fp.FocalPlane.load(tmp_path / "plane.fits")
    np.testing.assert_array_equal(read.max_acceleration, plane.max_acceleration)
    np.testing.assert_array_equal(read.min_speed, plane.min_speed)
    np.testing.assert_array_equal(read.subset(np.array([1])).max_acceleration, [[3.0, 4.0]])
    unlimited = plane.replace(max_acceleration=None, min_speed=None)
    unlimited.write(tmp_path / "plane.fits")
    assert fp.FocalPlane.load(tmp_path / "plane.fits").min_speed is None
    assert list(differences_of(plane, unlimited)) == [
        "max_acceleration of 2 positioners, by inf deg/s^2 at most (P0)",
        "min_speed of 2 positioners, by 28.6479 deg/s at most (P0)",
    ]


TOML = """\
format = 1
name = "two"
positioners = "two.csv"
fibers = ["fiber"]
[joints]
alpha = {{ lower = 0.0, upper = 360.0, folded = 0.0, speed = 12.0, acceleration = 48.0{alpha} }}
beta = {{ lower = 0.0, upper = 180.0, folded = 180.0, speed = 12.0 }}
"""
CSV = """\
positioner,x,y,length,arm,acceleration_beta [rad/s2],min_speed_alpha
A,0,0,7.4,15,0.5,
B,22.4,0,7.4,15,,{slow}
"""


def written(folder, alpha="", slow="2"):
    (folder / "two.toml").write_text(TOML.format(alpha=alpha))
    (folder / "two.csv").write_text(CSV.format(slow=slow))
    return folder / "two.toml"


def test_instrument_files_give_limits_for_all_and_for_one(tmp_path):
    plane = fp.FocalPlane.load(written(tmp_path))
    np.testing.assert_allclose(np.degrees(plane.max_acceleration), [[48, np.degrees(0.5)], [48, np.inf]])
    np.testing.assert_allclose(np.degrees(plane.min_speed), [[0, 0], [2, 0]])


def test_instrument_files_with_impossible_limits_are_refused(tmp_path):
    with pytest.raises(InstrumentError, match=r"two.toml: line 6.*least speed 20 deg/s is above the largest, 12 deg/s"):
        fp.FocalPlane.load(written(tmp_path, ", min_speed = 20.0", ""))
    with pytest.raises(InstrumentError, match=r"two.csv.*'B': min_speed_alpha: least speed 13 deg/s is above"):
        fp.FocalPlane.load(written(tmp_path, slow="13"))


def ramp(acceleration, pieces=10, cruise=1.0, slowest=0.0):
    """Alpha from rest to full speed, on, and back to rest, in straight pieces; it rests for a second before."""
    seconds = (SPEED - slowest) / acceleration
    t = np.linspace(0.0, seconds, pieces + 1)
    way = slowest * t + 0.5 * acceleration * t**2
    far = 2 * way[-1] + SPEED * cruise
    times = np.concatenate([[0.0], 1.0 + t, 1.0 + 2 * seconds + cruise - t[::-1]])
    alpha = np.concatenate([[0.0], way, far - way[::-1]])
    return times, alpha


def violations(plane, times, alpha, beta=None):
    beta = np.zeros(len(times)) if beta is None else beta
    motion = Trajectory(np.array([0, len(times)]), times, np.stack([alpha, beta], axis=1))
    return verify(plane, motion).violations


def test_a_ramp_in_short_pieces_obeys_its_acceleration():
    plane = limited(min_speed=None)
    assert violations(plane, *ramp(ACCELERATION)) == ()
    (said,) = violations(plane, *ramp(1.05 * ACCELERATION))
    assert "alpha changes its speed by" in said
    assert "(229.183 deg/s^2)" in said
    assert len(violations(plane.replace(online=np.array([False])), *ramp(ACCELERATION))) == 1  # that it moves, only


def test_knots_of_the_other_joint_do_not_count():
    """A knot in the middle of an even piece changes nothing, however close it is to the next."""
    times, alpha = ramp(ACCELERATION)
    beside = times[12] - 1e-4
    more = np.insert(times, 12, beside)
    between = np.interp(beside, times, alpha)
    assert violations(limited(min_speed=None), more, np.insert(alpha, 12, between)) == ()


def test_pieces_of_even_speed_are_one_however_they_are_cut():
    """A knot within a piece of a ramp: the rest of it is too short for the change of speed, the whole is not."""
    times, alpha = ramp(ACCELERATION)
    for k in (6, 16):
        beside = times[k] - 1e-4
        more = np.insert(alpha, k, np.interp(beside, times, alpha))
        assert violations(limited(min_speed=None), np.insert(times, k, beside), more) == ()


def test_a_rest_after_a_creep_is_a_rest():
    """However slow the creep: from a rest a joint may jump to less than from a piece that moves."""
    plane = limited(min_speed=None)
    most = ACCELERATION * 0.5 * np.sqrt(8 * RAMP / ACCELERATION)
    for rest, count in ((1.0, 1), (0.0, 0)):
        spans, speeds = np.array([1.0, rest, 60.0, 60.0]), most * np.array([1e-5, 0.0, 1.5, 0.75])
        moves = spans > 0
        times, alpha = (np.append(0.0, np.cumsum(values[moves])) for values in (spans, spans * speeds))
        for sign in (1.0, -1.0):
            assert len(violations(plane, times, sign * alpha)) == count


def test_a_rest_between_two_speeds_is_no_turn_unless_they_are_opposite():
    """Stopping at once is too sudden, whichever way a joint turned, and also if it goes on the same way."""
    plane = limited(min_speed=None)
    most = ACCELERATION * 0.5 * np.sqrt(8 * RAMP / ACCELERATION)
    for before, after, count in ((1.5, 0.0, 1), (1.5, 1.5, 1), (1.5, -1.5, 0), (0.9, 0.9, 0)):
        speeds = most * np.array([before / 2, before, 0.0, after, after / 2])
        alpha = np.append(0.0, np.cumsum(60.0 * speeds))
        for sign in (1.0, -1.0):
            assert len(violations(plane, 60.0 * np.arange(6), sign * alpha)) == count, (before, after, sign)


def test_a_jump_is_one_however_long_the_pieces():
    """Half of sqrt(8 RAMP / a) is what a long piece counts for at its ends."""
    plane = limited(min_speed=None)
    allowed = ACCELERATION * 0.5 * np.sqrt(8 * RAMP / ACCELERATION)
    for speed, count in ((0.999 * allowed, 0), (1.001 * allowed, 1)):
        assert len(violations(plane, np.array([0.0, 60.0]), np.array([0.0, 60.0 * speed]))) == count
    (said,) = violations(plane, np.array([1.0, 2.0, 4.0]), np.array([0.0, 0.0, 4.0]))
    assert "'P0': alpha changes its speed by 114.592 deg/s at 2.000 s, limit 6.77933 deg/s there" in said


def test_one_piece_between_rests_reaches_half_its_peak_only():
    """In 0.04 s from rest to rest at 4 rad/s^2: the peak is 0.08, the mean 0.04 rad/s."""
    plane = limited(min_speed=None)
    for speed, count in ((0.0399, 0), (0.0401, 1)):
        assert len(violations(plane, np.array([0.0, 1.0, 1.04]), np.array([0.0, 0.0, 0.04 * speed]))) == count


def test_the_least_speed_is_reached_at_once():
    plane = limited()
    assert violations(plane, *ramp(ACCELERATION, slowest=SLOWEST)) == ()
    assert violations(plane, np.array([0.0, 1.0]), np.array([0.0, SLOWEST])) == ()
    back = np.array([0.0, SLOWEST, 0.0])
    assert violations(plane, np.array([0.0, 1.0, 2.0]), back) == ()
    assert len(violations(plane.replace(min_speed=None), np.array([0.0, 1.0, 2.0]), back)) == 1


def test_slower_than_the_least_speed_is_found_in_each_joint():
    plane = limited(2, max_acceleration=None)
    motion = motion_of([(0.0, 0.0, 0.0), (1.0, 0.5, 0.0), (2.0, 0.9, 0.0), (3.0, 0.9, 0.3)], [(0.0, 0.0, 0.0)])
    assert verify(plane, motion).violations == (
        "positioner 'P0': alpha moves at 22.9183118 deg/s from 1.000 s, least 28.6478898 deg/s",
        "positioner 'P0': beta moves at 17.1887339 deg/s from 2.000 s, least 28.6478898 deg/s",
    )
    assert verify(plane.replace(min_speed=None), motion).ok


def test_a_joint_without_a_least_speed_may_creep():
    plane = limited(max_acceleration=None, min_speed=np.array([[SLOWEST, 0.0]]))
    for creep, count in (((0.0, 1e-3), 0), ((1e-3, 0.0), 1)):
        assert len(verify(plane, motion_of([(0.0, 0.0, 0.0), (1.0, *creep)])).violations) == count


def test_limits_are_of_one_joint_alone():
    plane = limited(2, max_acceleration=np.array([[np.inf, np.inf], [np.inf, 4.0]]), min_speed=None)
    swing = [(0.0, 0.0, 0.0), (1.0, 2.0, 2.0)]
    found = verify(plane, motion_of(swing, swing)).violations
    assert len(found) == 1
    assert "'P1': beta changes" in found[0]


def test_a_piece_at_the_least_speed_is_no_rest():
    """From it a joint may go on as from any speed: by a (h1 + h2) / 2 in pieces of 0.05 s."""
    plane = limited()
    for faster, count in ((0.19, 0), (0.21, 1)):
        speeds = SLOWEST + np.array([0.0, faster, 0.0])
        alpha = np.concatenate([[0.0], np.cumsum(0.05 * speeds)])
        assert len(violations(plane, 0.05 * np.arange(4), alpha)) == count


def test_where_a_ramp_turns_round_is_no_rest():
    """Samples of a turn at 4 rad/s^2 that lie even about its end: speeds of 0.2, 0 and -0.2 rad/s."""
    plane = limited(min_speed=None)
    alpha = -0.5 * ACCELERATION * (np.arange(-10, 11) * 0.05 + 0.025) ** 2
    times = 0.05 * np.arange(21)
    assert violations(plane, np.append(times, 1.05), np.append(alpha, alpha[-1])) != ()  # ends with a jump
    still = np.array([0.0, 0.5, 1.0])
    assert violations(plane, still, np.array([0.0, 0.0, 0.0])) == ()
    middle = np.stack([times, alpha - alpha[0]])[:, 8:13]
    found = violations(plane, middle[0] - middle[0, 0], middle[1])
    assert all("0.000 s" in said or "0.200 s" in said for said in found)
