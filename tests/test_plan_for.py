"""Plans for controllers: mended until what the motors do is proven, or refused by robot and moment."""

import json
import re

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.errors import FiberplanError, PlanError
from fiberplan.hardware import CONTROLLERS, moons
from fiberplan.hardware.planned import executed, fitted, plan_for
from fiberplan.plan.summary import headline
from fiberplan.planners.amending import mended
from fiberplan.planners.parking import plan_with_parking
from fiberplan.scenes.uniform import uniform_field
from fiberplan.shaping.replanned import Made, replanned


@pytest.fixture(scope="module")
def nineteen():
    """Arms of MOONS' size, close to each other, whose motors count beta from folded."""
    plane = fp.FocalPlane.hexagonal(2, 25.0, (8.0, 17.0), 2.0, 0.5, lower=(-3.1, -3.1), upper=(2.7, 2.4), folded=(0, 0))
    zero = np.tile([0.0, np.pi], (plane.n, 1))
    return fitted(plane.replace(zero=zero, ids=tuple(str(k + 1) for k in range(plane.n))), "moons")


def field(plane, seed, margin=0.5):
    start = uniform_field(plane, 2 * seed, margin)
    return fp.Problem(plane, start, uniform_field(plane, 2 * seed + 1, margin, start=start), margin)


@pytest.fixture(scope="module")
def mended_plan(nineteen):
    """A field whose waveform brings somebody too near, planned for the driver."""
    problem = field(nineteen, 1)
    plain = fp.planners.GreedyFold().plan(problem)
    assert executed("moons", moons.fit(plain)).contacts
    return plan_for("moons", fp.planners.GreedyFold(), problem)


def test_what_the_motors_do_is_proven(tmp_path, mended_plan):
    assert mended_plan.faults() == []
    assert re.search(r"planned 1 time, \d+ pairs led past each other anew", mended_plan.notes[-1])
    done = moons.write(mended_plan, tmp_path / "w.json")
    assert done.certificate.ok
    assert done.facts["seconds longer than the plan"] == 0.0
    assert (done.certificate.jitter, done.certificate.margin) == (0.02, 0.45)


def test_all_others_keep_their_paths(nineteen):
    problem = field(nineteen, 1)
    plan = fp.planners.GreedyFold().plan(problem)
    pair = next(c.pair for c in executed("moons", moons.fit(plan)).contacts)
    made, parted = mended(plan, {pair: 0.1}, np.full(nineteen.n, 0.05))
    assert parted == 1
    changed = [
        i for i in range(nineteen.n) if not np.array_equal(made.trajectory.knots(i)[1], plan.trajectory.knots(i)[1])
    ]
    assert set(pair) & set(changed)
    assert len(changed) < 5
    assert (made.certificate.contacts, made.certificate.undecided) == ((), ())
    rows = [k for k, each in enumerate(made.certificate.pairs.tolist()) if tuple(each) == pair]
    assert made.certificate.clearance[rows[0]] >= problem.margin + 0.1 - 1e-6


@pytest.mark.parametrize("conflicts", ["drop", "raise"])
def test_who_comes_too_near_whatever_is_tried_is_given_up(conflicts):
    """Motors that never keep two apart while both have goals: the lesser goal goes, by name, if it may."""
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    goal, asked = plane.folded + np.array([0.4, -0.3]), []
    problem = fp.Problem(plane, plane.folded, goal, 0.1, np.arange(1.0, 8.0), conflicts)

    def made(plan):
        asked.append(plan)
        return Made(plan, {} if np.isnan(plan.problem.goal[[2, 3]]).any() else {(2, 3): 0.01})

    plan = replanned(fp.planners.GreedyFold(), problem, made)
    assert len(asked) < 12
    if conflicts == "raise":
        assert plan.problem.dropped == {}
        return
    cause = "its motors come too near others on any path that was tried: R0C2"
    np.testing.assert_array_equal(plan.problem.requested, goal)
    assert [(i, each.cause, each.blockers) for i, each in plan.problem.dropped.items()] == [(2, cause, (3,))]
    assert plan.kept == 28 - 3  # priorities
    assert plan.faults() == []


@pytest.mark.small
def test_waiting_in_vain_keeps_nobody_from_being_led_past(monkeypatch):
    plane, waited, led = fp.FocalPlane.hexagonal(1, 22.4), [], []

    def waiting(plane, motion, lacking, *given):
        waited.append(lacking)
        return np.zeros(plane.n)

    def mending(plan, lacking, *given, **options):
        led.append(lacking)
        return plan, len(lacking)

    monkeypatch.setattr("fiberplan.shaping.replanned.waits", waiting)
    monkeypatch.setattr("fiberplan.shaping.replanned.mended", mending)
    problem = fp.Problem(plane, plane.folded, plane.folded + np.array([0.4, -0.3]), 0.1)
    replanned(fp.planners.GreedyFold(), problem, lambda plan: Made(plan, {} if led else {(2, 3): 0.01}))
    assert waited == led == [{(2, 3): 0.01}]


@pytest.mark.small
def test_nobody_waits_for_longer_than_a_controller_allows(monkeypatch):
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    problem = fp.Problem(plane, plane.folded, plane.folded + np.array([0.4, -0.3]), 0.1)
    longest = fp.planners.GreedyFold().plan(problem).makespan

    def made(plan):
        if plan.makespan > longest:
            raise PlanError("the motion takes too long")
        return Made(plan, {(2, 3): 0.01})

    monkeypatch.setattr("fiberplan.shaping.replanned.waits", lambda plane, *given: np.eye(plane.n)[2])
    monkeypatch.setattr("fiberplan.shaping.replanned.mended", lambda plan, *given, **options: (plan, 0))
    plan = replanned(fp.planners.GreedyFold(), problem, made, 1)
    assert plan.makespan == longest
    assert plan.notes[-1] == "planned 1 time"


@pytest.mark.small
def test_what_is_given_up_while_others_are_parked_is_named():
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    goal = plane.folded + np.array([0.4, -0.3])
    goal[6] = np.nan
    problem = fp.Problem(plane, plane.folded, goal, 0.1, np.arange(1.0, 8.0), "drop")

    def made(plan):
        return Made(plan, {} if np.isnan(plan.problem.goal[[2, 3]]).any() else {(2, 3): 0.01})

    def planned(problem):
        return replanned(fp.planners.GreedyFold(), problem, made)

    plan = plan_with_parking(planned, problem)
    assert list(plan.problem.dropped) == [2]
    assert dict(headline(plan))["losses"] == "1: its motors come too near others on any path that was tried"
    np.testing.assert_array_equal(plan.problem.requested, goal)


@pytest.mark.parametrize("name", ["sdss", "desi", "moons", "pfs"])
def test_planes_are_fitted_to_controllers(name):
    wide = fp.FocalPlane.hexagonal(1, 22.4, lower=(-7.0, 0.0), upper=(7.0, np.pi), max_speed=100.0)
    plane = fitted(wide, name)
    again = fitted(plane, name)
    for field_name in ("lower", "upper", "max_speed"):
        np.testing.assert_array_equal(getattr(plane, field_name), getattr(again, field_name))
    if name != "pfs":
        assert (plane.max_speed < 10.0).all()
        assert (plane.upper <= wide.upper).all()
    if name in ("sdss", "moons"):
        assert ((plane.upper - plane.lower) < (wide.upper - wide.lower))[:, 0].all()
    with pytest.raises(FiberplanError, match="no controller 'lamost'"):
        fitted(wide, "lamost")


@pytest.mark.small
def test_what_a_controller_cannot_do_is_named_without_a_file():
    """The message is not about the file that was written to find out."""
    unnamed = field(fitted(fp.FocalPlane.hexagonal(0, 22.4), "desi"), 0)
    with pytest.raises(PlanError, match=r"^positioner 'R0C1' has no device id"):
        plan_for("desi", fp.planners.GreedyFold(), unnamed)


@pytest.mark.small
@pytest.mark.parametrize("name", ["desi", "moons", "pfs"])
def test_a_file_that_moves_nobody_is_refused_as_such(name):
    plane = fitted(fp.FocalPlane.hexagonal(0, 22.4), name)
    with pytest.raises(PlanError, match=r"^nobody turns: .* at least$"):
        executed(name, fp.planners.GreedyFold().plan(fp.Problem(plane, plane.folded, plane.folded)))


def test_the_command_plans_for_a_controller(tmp_path, capsys, monkeypatch, nineteen):
    monkeypatch.chdir(tmp_path)
    nineteen.replace(max_acceleration=None, min_speed=None, recommended_margin=0.5).write("nineteen.fits")
    rows = [f"{id_},{a},{b}" for id_, (a, b) in zip(nineteen.ids, np.degrees(field(nineteen, 1).goal), strict=True)]
    (tmp_path / "field.csv").write_text("\n".join(["positioner,alpha,beta", *rows]) + "\n")
    options = ("nineteen.fits", "field.csv", "--planner", "greedy-fold", "--for", "moons", "-o", "p.fits")
    assert run(["plan", *options]) == 0
    said = capsys.readouterr().out
    assert "executed by moons: safe: " in said
    assert "planned 1 time" in said
    assert run(["export", "p.fits", "--to", "moons", "-o", "w.json", "--latency", "0.01", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["facts"]["seconds longer than the plan"] == 0.0
    assert run(["simulate", "nineteen.fits", "w.json", "--latency", "0.01", "--runs", "20"]) == 0
    assert run(["plan", *options, "--export", "latency=0.01", "--export", "allowance=0.01"]) == 0
    assert "executed by moons: safe: " in capsys.readouterr().out
    assert run(["plan", *options[:-4], "--for", "lamost"]) == 2
    assert "no controller 'lamost'; there are sdss, desi, moons, pfs" in capsys.readouterr().err
    assert set(CONTROLLERS) >= {"sdss", "desi", "moons", "pfs"}


@pytest.mark.small
@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        (["--export", "power=0.5"], "--export power=0.5: of which controller? Say --for, too"),
        (["--for", "moons", "--export", "power=0.5"], "--export power: 'moons' has no such option; it has allowance,"),
        (["--for", "desi", "--export", "power"], "--export power: expected key=value"),
        (["--for", "desi", "--export", "power=half"], "--export power=half: expected a number"),
        (["--for", "desi", "--export", "tail=1"], "--export tail=1: expected true or false"),
        (["--for", "desi", "--export", "tail=true", "--export", "tail=false"], "--export tail is given twice"),
        (["--for", "desi", "--export", "power=2"], "power must be a share above 0 and at most 1, got 2"),
        (["--for", "desi", "--export", "calibration=no.ecsv"], "no.ecsv"),
    ],
)
def test_options_of_the_export_that_make_no_sense_are_one_line(tmp_path, capsys, monkeypatch, given, complaint):
    monkeypatch.chdir(tmp_path)
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(aliases=("M00001",))
    plane.write("one.fits")
    (tmp_path / "field.csv").write_text("positioner,alpha,beta\nR0C1,30,150\n")
    assert run(["plan", "one.fits", "field.csv", "--margin", "0", "-o", "p.fits", *given]) == 2
    said = capsys.readouterr().err
    assert complaint in said
    assert len(said.splitlines()) == 1
    assert not (tmp_path / "p.fits").exists()


@pytest.mark.small
def test_options_of_writers_are_options_of_export(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plane = fp.FocalPlane.hexagonal(0, 22.4)
    plan = fp.planners.GreedyFold().plan(fp.Problem(plane, plane.folded, np.radians([[40.0, 90.0]])))
    plan.write("p.fits")
    assert run(["export", "p.fits", "--to", "pfs", "-o", "t.csv", "--visit", "77", "--config", "5"]) == 0
    assert (tmp_path / "t.csv").read_text().splitlines()[1].startswith("77,1,R0C1,5,")
    assert executed("pfs", plan).ok  # the file is called otherwise there
    assert run(["export", "p.fits", "--to", "sdss", "-o", "t.json", "--visit", "77"]) == 2
    assert "--visit: 'sdss' has no such option" in capsys.readouterr().err
