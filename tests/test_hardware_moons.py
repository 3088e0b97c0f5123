"""Waveforms of MOONS: whole steps a segment, the driver's rules, and what the motors do."""

import json

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import PlanError, TrajectoryError, UnprovenError
from fiberplan.hardware import moons
from fiberplan.hardware.moons.encode import STEPS, as_json, waveforms

pytestmark = pytest.mark.small

UP = [62, 112, 162, 212, 250]  # the fastest way to full speed, and back
TURN = [*UP, *[250] * 4, *UP[::-1]]


@pytest.fixture(scope="module")
def seven():
    """Seven arms of MOONS' size; motors count beta from folded."""
    plane = fp.FocalPlane.hexagonal(1, 25.0, (8.0, 17.0), 2.0, 0.5, lower=(-3.2, -3.2), upper=(3.2, 3.2), folded=(0, 0))
    return plane.replace(zero=np.tile([0.0, np.pi], (plane.n, 1)), ids=tuple(str(k + 1) for k in range(plane.n)))


def by_steps(plane, steps, who=(2,)):
    """A plan in which some units make `steps` of alpha, (segments,), and others of beta."""
    places = np.concatenate([[0], np.cumsum(steps)])
    at = np.tile(plane.folded, (len(places), 1, 1))
    for k, i in enumerate(who):
        at[:, i, k % 2] += np.radians(places / STEPS[k % 2])
    motion = fp.Trajectory.from_samples(np.arange(len(places)) * 0.125, at)
    problem = fp.Problem(plane, plane.folded, motion.end)
    return fp.Plan(problem, motion, (fp.Outcome.ARRIVED,) * plane.n, "by hand")


def test_steps_are_written_and_executed(tmp_path, seven):
    plan = by_steps(seven, TURN, (2, 5))
    done = moons.write(plan, tmp_path / "w.json")
    held = json.loads((tmp_path / "w.json").read_text())
    assert held["configMotion"] == {"3": [[s, 0] for s in TURN], "6": [[0, s] for s in TURN]}
    assert np.degrees(held["configPaths"]["3"][0][-1]) == pytest.approx(sum(TURN) / 113.8986, abs=1 / 113)
    executed = moons.read(tmp_path / "w.json", seven, plan.state_at(0.0))
    times = np.linspace(0, plan.makespan, 333)
    away = executed.trajectory.sampled(times) - plan.trajectory.sampled(times)
    assert np.degrees(np.abs(away)).max() < 1e-9
    assert (executed.clock_error, done.certificate.jitter) == (0.02, 0.02)
    assert done.facts == {"units": 2, "segments": len(TURN), "segment": 0.125, "seconds longer than the plan": 0.0}
    assert moons.accepts(tmp_path / "w.json", (tmp_path / "w.json").read_bytes())


def test_steps_are_differences_of_rounded_sums(seven):
    """61.6 steps a segment on average cannot be made evenly, but nothing drifts: sums are right to half a step."""
    plan = by_steps(seven, [62.4] * 100)
    (wave,) = waveforms(plan)
    assert sorted(set(wave.steps[:, 0].tolist())) == [62, 63]
    sums = np.cumsum(wave.steps[:, 0])
    assert np.abs(sums - np.arange(1, 101) * 62.4).max() <= 1.0  # half a step at either end


@pytest.mark.parametrize(
    ("steps", "says"),
    [
        ([62, 112, 162, 212, 251, 212, 162, 112, 62], "makes 251 steps from 0.500 s, at most 250 are allowed"),
        ([62, 61, 62], "makes 61 steps from 0.125 s, at least 62 or none are allowed"),
        ([62, 113, 62], "makes 113 steps from 0.125 s, after 62: 50 more or fewer are allowed"),
        ([70, 62], "makes 70 steps from 0.000 s, after 0: a turn begins and ends with 69 at most"),
        ([62, 70], "makes 0 steps from 0.250 s, after 70: a turn begins and ends with 69 at most"),
        ([69, -70, -62], "makes -70 steps from 0.125 s, after 69: a turn begins and ends with 69 at most"),
        ([69] * 257, "257 segments; the driver takes 256 of 0.125 s"),
        ([62, *[100] * 181, 62], r"alpha is 159\.\d+ deg at 22\.750 s, the driver takes -180.2 to 159 deg"),
    ],
)
def test_what_the_driver_refuses_is_named(seven, steps, says):
    with pytest.raises(PlanError, match=says):
        waveforms(by_steps(seven.replace(max_speed=np.full((7, 2), 1.0)), steps))


@pytest.mark.parametrize("steps", [[62] * 3, [69], [69, 119, 69], [69, -69], TURN, [62, 0, 62]])
def test_what_the_driver_takes_is_written(tmp_path, seven, steps):
    assert moons.write(by_steps(seven, steps), tmp_path / "w.json").certificate.ok


def test_a_plan_that_jumps_is_shaped_to_steps(tmp_path, seven):
    """Even turns to a speed that no motor has at once, and too slow ones: ends within half a step."""
    angles = np.stack([seven.folded, seven.folded])
    angles[1, 2], angles[1, 5] = np.radians([[60.0, 3.0], [-20.0, 41.0]])
    motion = fp.Trajectory.from_samples(np.array([0.0, 5.0]), angles)
    problem = fp.Problem(seven, seven.folded, motion.end)
    plan = fp.Plan(problem, motion, (fp.Outcome.ARRIVED,) * seven.n, "by hand")
    with pytest.raises(PlanError, match="a turn begins and ends with 69 at most"):
        waveforms(plan)
    done = moons.write(plan, tmp_path / "w.json")
    away = np.degrees(np.abs(done.executed.trajectory.end - motion.end))
    assert (away <= 0.5 / np.array(STEPS) + 1e-9).all()
    assert done.facts["seconds longer than the plan"] < 1.0
    for steps in json.loads((tmp_path / "w.json").read_text())["configMotion"].values():
        assert all(each == 0 or 62 <= abs(each) <= 250 for pair in steps for each in pair)


def test_a_motion_too_long_is_refused_whatever_its_shape(tmp_path, seven):
    with pytest.raises(PlanError, match="the driver takes 256 of"):
        moons.write(by_steps(seven, [62] * 257), tmp_path / "w.json")
    assert not list(tmp_path.iterdir())


def test_who_cannot_move_is_not_named(tmp_path, seven):
    """A waveform that names a locked unit is refused whole; one that rests need not be named."""
    online = np.ones(7, bool)
    online[2] = False
    plan = by_steps(seven, TURN, (2, 5))
    motion = fp.Trajectory.from_samples(
        np.arange(len(TURN) + 1) * 0.125,
        np.array(
            [np.where(online[:, None], plan.trajectory.at(t), seven.folded) for t in np.arange(len(TURN) + 1) * 0.125]
        ),
    )
    locked = seven.replace(online=online)
    outcomes = tuple(fp.Outcome.ARRIVED if o else fp.Outcome.OFFLINE for o in online)
    problem = fp.Problem(locked, seven.folded, np.where(online[:, None], motion.end, np.nan), conflicts="drop")
    moons.write(fp.Plan(problem, motion, outcomes, "by hand"), tmp_path / "w.json")
    assert list(json.loads((tmp_path / "w.json").read_text())["configMotion"]) == ["6"]


def test_bytes_that_do_something_else_are_not_left_behind(tmp_path, seven, monkeypatch):
    monkeypatch.setattr(moons, "as_json", lambda made: as_json([w._replace(unit=str(9 - int(w.unit))) for w in made]))
    with pytest.raises(UnprovenError, match="would end"):
        moons.write(by_steps(seven, TURN, (2,)), tmp_path / "w.json")
    assert not list(tmp_path.iterdir())


def test_paths_alone_are_the_steps_the_driver_makes(tmp_path, seven):
    """Places between steps are rounded; the first says where a unit stands that nobody else knows of."""
    places = np.radians([[10.0, 10.6, 11.30001], [0.0, 0.0, 0.0]])
    (tmp_path / "w.json").write_text(json.dumps({"configPaths": {"3": places.tolist()}}))
    executed = moons.read(tmp_path / "w.json", seven)
    i = seven.index["3"]
    steps = np.diff(np.rint(np.array([10.0, 10.6, 11.30001]) * 113.8986))
    np.testing.assert_allclose(np.degrees(executed.trajectory.end[i, 0]), 10.0 + steps.sum() / 113.8986, atol=1e-9)
    assert "3" not in executed.assumptions[0].split(" are ")[0].split(", ")
    stands = fp.State(seven.folded)
    assert "unit 3 begins 10 deg from where it stands" in moons.read(tmp_path / "w.json", seven, stands).notes[0]


def test_a_byte_order_mark_is_no_part_of_a_file(tmp_path, seven):
    held = json.dumps({"configMotion": {"3": [[62, 0], [62, 0]]}})
    ends = []
    for encoding in ("utf-8", "utf-8-sig"):
        (tmp_path / "w.json").write_text(held, encoding=encoding)
        ends.append(moons.read(tmp_path / "w.json", seven).trajectory.end)
    np.testing.assert_array_equal(*ends)


def test_turns_slower_than_motors_can_make_a_clock_uncertain(tmp_path, seven):
    (tmp_path / "w.json").write_text(json.dumps({"configMotion": {"3": [[62, 0], [30, 0]]}}))
    executed = moons.read(tmp_path / "w.json", seven, latency=0.0)
    assert executed.clock_error == 0.125
    assert "slower than 62 steps a segment" in executed.notes[0]


@pytest.mark.parametrize(
    ("held", "says"),
    [
        ({"a": 1}, "has neither 'configPaths' nor 'configMotion'"),
        ({"configMotion": {"99": [[62, 0]]}}, "has no positioner '99'"),
        ({"configMotion": {"3": [[62, 0.5]]}}, "unit 3: a motion is a list of pairs of whole numbers"),
        ({"configMotion": {"3": [[62, 10**400]]}}, "unit 3: a motion is a list of pairs of whole numbers"),
        ({"configPaths": {"3": [[0, -(10**400)], [0, 0]]}}, "unit 3: a path is two lists of finite numbers"),
        ({"configMotion": {"3": [[62, 0]], "4": [[62, 0], [62, 0]]}}, "units differ in the number of segments: 1, 2"),
        ({"configPaths": {"3": [[0, 1], [0]]}}, "unit 3: a path is two lists"),
        ({"configMotion": {}}, "names no unit"),
    ],
)
def test_bad_files_are_one_line(tmp_path, seven, held, says):
    (tmp_path / "w.json").write_text(json.dumps(held))
    with pytest.raises(TrajectoryError, match=says) as caught:
        moons.read(tmp_path / "w.json", seven)
    assert "\n" not in str(caught.value)
