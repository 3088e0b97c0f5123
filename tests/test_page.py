"""The page as a file: self-contained, inert to what ids and notes contain, whole or not at all."""

import base64
import json
import os
import re
from dataclasses import fields
from functools import cache

import numpy as np
import pytest

from fiberplan import __version__
from fiberplan.errors import PlanError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.plan.diagnosis import diagnose
from fiberplan.planners import PLANNERS
from fiberplan.problem import Dropped, Problem
from fiberplan.visuals import show
from fiberplan.visuals.approaches import CEILING, approaches
from fiberplan.visuals.heights import kinds, passed_over
from fiberplan.visuals.origin import Origin
from fiberplan.visuals.page import SCRIPTS, render
from fiberplan.visuals.page_data import page_data
from fiberplan.visuals.proof_data import proven_clearance
from fiberplan.visuals.settings import UNITS, said_settings

pytestmark = pytest.mark.small

HOSTILE = '</script><img src=x onerror="window.hit=1">&amp;<!--'
CENTRE, RIGHT = 9, 10  # of the second ring's middle row
LOST, OFFLINE, IDLE, STUCK = 0, 4, 7, 12


@cache
def small_plan(touching: bool = False, **changes) -> Plan:
    """19 positioners of which one is offline, one idle, one dropped and one stuck; the middle two may collide."""
    plane = FocalPlane.hexagonal(2, 22.4, name="small array")
    online = np.ones(plane.n, bool)
    online[OFFLINE] = False
    fiducial = Obstacle("F1", plane.base[[4, 5, 9]].mean(axis=0)[None], 1.0)
    plane = plane.replace(**({"online": online, "obstacles": (fiducial,)} | changes))
    rng = np.random.default_rng(5)
    goal = np.stack([rng.uniform(0, 2 * np.pi, plane.n), rng.uniform(2.75, 3.1, plane.n)], axis=1)
    goal[IDLE] = np.nan
    lost = {LOST: Dropped(f"its goal touches something at rest: {HOSTILE}", (1, -1))}
    problem = Problem(
        plane,
        plane.folded,
        goal,
        margin=0.5,
        conflicts="drop",
        dropped=lost,
        notes=("beta <b>assumed</b>",),
        source="designs/field-7.ecsv",
    )
    rest = dict.fromkeys(problem.dropped, Outcome.DROPPED) | {
        OFFLINE: Outcome.OFFLINE,
        IDLE: Outcome.NO_TARGET,
        STUCK: Outcome.DEADLOCKED,
    }
    outcomes = tuple(rest.get(i, Outcome.ARRIVED) for i in range(plane.n))
    end = np.where([[o is Outcome.ARRIVED] for o in outcomes], problem.goal, problem.start)
    motion = Trajectory.from_samples(np.array([0.0, 16.0]), np.stack([problem.start, end]))
    if touching:
        out = problem.start.copy()
        out[CENTRE] = (0.0, 0.35)  # onto the folded arm to its right
        there_and_back = np.stack([problem.start, out, problem.start])
        motion = Trajectory.from_samples(np.array([0.0, 6.0, 12.0]), there_and_back).then(motion)
    return Plan(
        problem,
        motion,
        outcomes,
        "greedy-fold",
        {"step": np.radians(1.0)},
        blockers={STUCK: (8, -1)},
        timings={"fold": 0.02},
    )


def still_plan() -> Plan:
    """19 positioners, none of which can move."""
    plane = FocalPlane.hexagonal(2, 22.4).replace(online=np.zeros(19, bool))
    problem = Problem(plane, plane.folded, np.full((plane.n, 2), np.nan))
    return Plan(problem, Trajectory.at_rest(plane.folded), (Outcome.OFFLINE,) * plane.n, "none")


MIXED = (
    Body(np.array([[0.0, 0.0], [15.0, 0.0]]), 1.2),
    Body(
        np.array([[14.0, -2.0], [18.0, -2.0], [16.0, 0.0], [18.0, 2.0], [14.0, 2.0]]), 0.3, closed=True, name="holder"
    ),
    Body(np.array([[0.0, 0.0]]), np.linspace(1.0, 2.0, 19), link="alpha", name="hub"),
    Body(np.array([[0.0, 3.0]]), 1.0, link="base", category="plate", meets=("arm",), name="post"),
    Body(np.tile([[2.0, 1.0], [4.0, 2.0], [6.0, 1.0]], (19, 1, 1)), 0.4, category="cable", meets=(), name="cable"),
)


def displaced_plan():
    """The one in the middle has no target and gives way to the one beside it."""
    plane = FocalPlane.hexagonal(1, 22.4, name="small array")
    goal, wished = plane.folded.copy(), np.zeros(plane.n, bool)
    goal[3], goal[4], wished[3] = (0.0, 0.0), (np.pi, 0.0), True
    problem = Problem(plane, plane.folded, goal, conflicts="drop", wished=wished, assumptions=(f"a guess {HOSTILE}",))
    end = np.where(np.isnan(problem.goal), problem.start, problem.goal)
    motion = Trajectory.from_samples(np.array([0.0, 60.0]), np.stack([problem.start, end]))
    outcomes = [Outcome.DROPPED if i in problem.dropped else Outcome.ARRIVED for i in range(plane.n)]
    return Plan(problem, motion, tuple(outcomes), "none")


def test_page_tells_premises_and_who_is_displaced():
    plan = displaced_plan()
    data = page_data(plan)
    assert [one["positioner"] for one in data["displaced"]] == [3]
    assert data["displaced"][0]["cause"].startswith("its goal touches something at rest")
    assert data["certificate"]["geometry"] == str(plan.certificate.geometry)
    assert f"a guess {HOSTILE}" in data["certificate"]["assumptions"]
    assert data["certificate"]["opening"] == []


def test_page_asks_for_nothing_else(tmp_path):
    show(small_plan(), tmp_path / "field.html")
    text = (tmp_path / "field.html").read_bytes().decode("ascii")
    assert not re.findall(r"https?://(?!www\.w3\.org/)", text)
    assert not re.findall(r"@import|url\(|<(?:img|iframe|object|script src)", text)
    assert "default-src 'none'" in text
    assert sorted(path.name for path in tmp_path.iterdir()) == ["field.html"]


def test_strings_from_files_are_inert():
    ids = (HOSTILE, *small_plan().problem.plane.ids[1:])
    text = render([small_plan(ids=ids, name=f"array {HOSTILE}")]).decode()
    assert "<img" not in text
    assert "<b>assumed" not in text
    assert text.count("</script>") == 2
    embedded = json.loads(re.search(r'id="plan">(.*?)</script>', text, re.DOTALL).group(1))
    assert embedded["plans"][0]["ids"][0] == HOSTILE
    assert embedded["plans"][0]["notes"] == ["beta <b>assumed</b>"]


def test_ids_beyond_ascii_and_unpaired_surrogates_can_be_written(tmp_path):
    ids = ("\udc80 \u2028 \u03b1", *small_plan().problem.plane.ids[1:])
    show(small_plan(ids=ids, name="Teleskop \udc80 β"), tmp_path / "field.html")
    assert (tmp_path / "field.html").stat().st_size > 10_000


def test_data_is_the_plan():
    plan = small_plan(touching=True)
    data = page_data(plan)

    def floats(key, dtype):
        return np.frombuffer(base64.b64decode(data[key]), dtype)

    np.testing.assert_array_equal(floats("offsets", "<u4"), plan.trajectory.offsets)
    np.testing.assert_allclose(floats("angles", "<f4").reshape(-1, 2), plan.trajectory.angles, atol=1e-6)
    names = [outcome["meaning"] for outcome in data["outcomes"]]
    assert [names[k] for k in floats("outcome", "u1")] == [outcome.value for outcome in plan.outcomes]
    blockers = {loss["positioner"]: loss["blockers"] for loss in data["losses"] if loss["blockers"]}
    assert blockers == {STUCK: [8, -1], LOST: [1, -1]}
    np.testing.assert_array_equal(floats("priority", "<f4"), plan.problem.priority)
    goal = floats("goal", "<f4").reshape(-1, 2)
    np.testing.assert_allclose(goal[LOST], plan.problem.plane.fibers(plan.problem.requested)[LOST], atol=1e-4)
    assert np.isnan(goal[IDLE]).all()
    assert [contact["pair"] for contact in data["certificate"]["contacts"]] == [
        list(c.pair) for c in plan.certificate.contacts
    ]


def test_diagnosis_is_the_librarys():
    plan = small_plan()
    data, diagnosis = page_data(plan), diagnose(plan)
    assert HOSTILE in data["losses"][0]["cause"]
    for shown, loss in zip(data["losses"], diagnosis.losses, strict=True):
        assert (shown["positioner"], shown["cause"], shown["priority"]) == (loss.positioner, loss.cause, loss.priority)
        assert shown["distance"] == pytest.approx(loss.distance)
    assert {LOST, STUCK} <= {loss.positioner for loss in diagnosis.losses}
    assert [one["positioner"] for one in data["diagnosis"]["slowest"]] == [s.positioner for s in diagnosis.slowest]
    assert data["diagnosis"]["boundBy"]["needed"] == diagnosis.bound_by.needed
    assert data["diagnosis"]["reversals"]["alpha"] == {"median": 0.0, "most": 0, "positioner": None}


def test_a_target_out_of_reach_has_no_distance():
    plan = small_plan()
    goal = plan.problem.requested.copy()
    goal[LOST] = np.nan
    problem = Problem(plan.problem.plane, plan.problem.start, goal, 0.5, dropped={LOST: Dropped("out of reach")})
    data = page_data(Plan(problem, plan.trajectory, plan.outcomes, "none"))
    assert next(loss for loss in data["losses"] if loss["positioner"] == LOST)["distance"] is None
    json.dumps(data, allow_nan=False)


def test_proven_clearance_names_the_tightest_neighbour():
    plan = small_plan(touching=True)
    smallest, partner = proven_clearance(plan.problem.plane, plan.certificate)
    assert plan.certificate.contacts[0].pair == (CENTRE, RIGHT)
    assert partner[CENTRE] == RIGHT
    assert partner[RIGHT] == CENTRE
    assert smallest[CENTRE] == smallest[RIGHT] < 0
    for k, (i, j) in enumerate(plan.certificate.pairs):
        assert (
            max(smallest[i], smallest[j]) <= plan.certificate.clearance[k]
            or not plan.problem.plane.online[[i, j]].any()
        )


def test_clearance_of_two_that_cannot_move_is_no_merit_of_the_plan():
    still = still_plan()
    assert np.isinf(proven_clearance(still.problem.plane, still.certificate)[0]).all()
    assert page_data(still)["certificate"]["smallest"] is None
    assert render([still])


@pytest.mark.parametrize(("touching", "words"), [(False, "Proven safe"), (True, "Not safe: 1 contact at")])
def test_statement(touching, words):
    assert page_data(small_plan(touching))["certificate"]["statement"].startswith(words)


@pytest.mark.large
def test_five_thousand_positioners_stay_light():
    plane = FocalPlane.hexagonal(40, 22.4)
    problem = Problem(plane, plane.folded * [1.0, 0.9], np.full((plane.n, 2), np.nan))
    times = np.linspace(0, 20, 12)
    motion = Trajectory.from_samples(times, plane.folded * [1.0, 0.9] + 0.01 * times[:, None, None])
    plan = Plan(problem, motion, (Outcome.NO_TARGET,) * plane.n, "none")
    assert plane.n == 4921
    assert len(render([plan])) < 3e6


def test_unwritable_page_is_one_line_and_leaves_nothing(tmp_path):
    with pytest.raises(PlanError, match=r"field\.html: cannot be written \(no such file or directory\)") as error:
        show(small_plan(), tmp_path / "missing" / "field.html")
    assert "\n" not in str(error.value)
    (tmp_path / "folder").mkdir()
    with pytest.raises(PlanError, match="is a directory"):
        show(small_plan(), tmp_path / "folder")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


def test_same_plan_same_page():
    assert render([small_plan()]) == render([small_plan()])


def test_page_says_where_a_plan_comes_from():
    data = page_data(small_plan(), Origin("night/plan.fits", "2026-11-26 21:15 UTC"))
    assert data["title"] == "field-7 on small array"
    said = dict(data["origin"])
    assert said["targets"] == "field-7.ecsv"
    assert (said["plan"], said["date"], said["fiberplan"]) == ("night/plan.fits", "2026-11-26 21:15 UTC", __version__)
    assert page_data(still_plan(), Origin("plan.fits"))["title"] == "plan on hexagonal"


def test_origin_of_a_file_and_of_now(tmp_path, monkeypatch):
    path = tmp_path / "one.fits"
    path.write_bytes(b"")
    os.utime(path, (0, 60))
    assert Origin.of_file(path) == Origin("one.fits", "1970-01-01 00:01 UTC")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "3600")
    assert Origin.now() == Origin("", "1970-01-01 01:00 UTC")


def test_settings_have_the_units_of_the_planners():
    told = {f.name: f.metadata["unit"] for p in PLANNERS.values() for f in fields(p) if f.metadata.get("unit")}
    assert told == UNITS
    said = dict(said_settings({"step": np.radians(1.0), "turn": None, "tries": 3, "seed": 1}))
    assert said == {"step": "1 deg", "turn": "None", "tries": "3"}


def test_losses_are_grouped_by_cause():
    groups = {loss["positioner"]: loss["group"] for loss in page_data(small_plan())["losses"]}
    assert groups == {LOST: "dropped: its goal touches something at rest", STUCK: "deadlocked", OFFLINE: "offline"}


def test_two_plans_share_a_page_and_three_do_not(tmp_path):
    show([small_plan(), small_plan(touching=True)], tmp_path / "both.html")
    text = (tmp_path / "both.html").read_text()
    plans = json.loads(re.search(r'id="plan">(.*?)</script>', text, re.DOTALL).group(1))["plans"]
    assert [plan["certificate"]["ok"] for plan in plans] == [True, False]
    with pytest.raises(PlanError, match="one plan or two, not 3"):
        show([small_plan()] * 3, tmp_path / "three.html")


def test_approaches_find_the_nearest_moment_of_each_pair():
    plan = small_plan(touching=True)
    plane, motion, proof = plan.problem.plane, plan.trajectory, plan.certificate
    found = approaches(plane, motion, proof)
    worst = found.closest[0]
    assert worst.pair == (CENTRE, RIGHT)
    assert worst.time == pytest.approx(6.0, abs=1e-3)  # where it turns back
    for one in found.closest:
        a, b = map(plane.arm, one.pair)
        gap = plane.clearance(motion.at(one.time), np.array([[a, b]]))[0]
        assert gap == pytest.approx(one.clearance, abs=1e-9)
        assert one.proven <= one.clearance <= one.proven + 0.02
    assert [one.proven for one in found.closest] == sorted(one.proven for one in found.closest)
    assert found.gaps.min() == worst.clearance
    assert np.all(np.diff(found.times) >= 0)
    assert found.gaps.max() <= proof.margin + CEILING


def test_curve_of_clearances_is_that_of_all_who_can_move():
    plan = small_plan(touching=True)
    plane, motion, proof = plan.problem.plane, plan.trajectory, plan.certificate
    found = approaches(plane, motion, proof)
    every = plane.arm_pairs_within(proof.margin + CEILING)
    moves = np.append(plane.online, False)
    every = every[moves[every].any(axis=1)]
    for t, gap in zip(found.times[::17], found.gaps[::17], strict=True):
        assert gap == pytest.approx(min(plane.clearance(motion.at(t), every).min(), proof.margin + CEILING))


def test_approaches_of_a_plan_without_motion():
    still = still_plan()
    found = approaches(still.problem.plane, still.trajectory, still.certificate)
    assert len(found.times) == len(found.closest) == 0


def test_kinds_say_what_may_lie_over_what():
    camera = Obstacle("camera", np.zeros((1, 2)), 1.0, category="camera", meets=("hub",))
    posts = [Obstacle(name, np.zeros((1, 2)), 1.0) for name in ("P1", "P2")]
    bodies = (Body(np.zeros((1, 2)), 1.0), Body(np.zeros((1, 2)), 1.0, category="hub", meets=("hub",), name="hub"))
    plane = FocalPlane.hexagonal(1, 22.4, bodies=bodies).replace(obstacles=(camera, *posts))
    arm, hub, high, low = kinds(plane)
    assert (arm.meets, arm.over) == (("arm", "obstacle"), ("hub", "camera"))
    assert (hub.meets, hub.over) == (("hub", "camera", "obstacle"), ("arm",))
    assert (high.name, high.count, high.meets, high.over) == ("camera", 1, ("hub",), ("arm",))
    assert (low.name, low.count, low.over) == ("obstacle", 2, ())
    assert passed_over(plane, camera) == ("arm",)


def test_assets_are_ascii_and_name_their_model():
    from importlib.resources import files

    for name in SCRIPTS:
        assert files("fiberplan.visuals").joinpath("assets", name).read_text("ascii").startswith("// ")
