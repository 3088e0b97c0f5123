"""Numbers with units and masks at the Python door: converted, or refused by name; never taken for something else."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from astropy import units as u
from astropy.coordinates import Angle
from astropy.table import Column, MaskedColumn, QTable
from astropy.utils.masked import Masked

import fiberplan as fp
from fiberplan.arrays import FrozenDict, number, plain, read_only, texts
from fiberplan.certificates import proven_unreachable
from fiberplan.errors import FiberplanError, InstrumentError, ProblemError, TargetError, TrajectoryError
from fiberplan.focal_plane.four_bar import FourBar
from fiberplan.motion import Trajectory
from fiberplan.scenes.assigned import assignment_plan
from fiberplan.scenes.clustered import clustered_targets
from fiberplan.scenes.uniform import uniform_field
from fiberplan.shaping import quantize

pytestmark = pytest.mark.small


def row(value):
    """Of whatever kind, as an array of plain numbers."""
    return np.asarray(value, float)


@pytest.mark.parametrize(
    ("given", "unit", "expected"),
    [
        (1 * u.cm, "mm", 10.0),
        ([1, 2] * u.m, "mm", [1000.0, 2000.0]),
        ([1 * u.cm, 2 * u.um, 3.0], "mm", [10.0, 0.002, 3.0]),
        (((90 * u.deg, 1.0), (180 * u.deg, 2.0)), "rad", [[np.pi / 2, 1.0], [np.pi, 2.0]]),
        (Angle("90d"), "rad", np.pi / 2),
        (Column([1.0, 2.0], unit="m"), "mm", [1000.0, 2000.0]),
        (MaskedColumn([1, 2], unit="m", mask=[False, False]), "mm", [1000.0, 2000.0]),
        (Masked([1.0, 2.0] * u.m, mask=[False, False]), "mm", [1000.0, 2000.0]),
        (np.array([1 * u.m, 2.0], dtype=object), "mm", [1000.0, 2.0]),
        (6 * u.deg / u.s, "rad/s", np.radians(6.0)),
        (1 * u.min, "s", 60.0),
        (50 * u.percent, "", 0.5),
        (Column([1.0, 2.0]), "mm", [1.0, 2.0]),
        (np.ma.array([1.0, 2.0]), "mm", [1.0, 2.0]),
        ([1, 2], "mm", [1.0, 2.0]),
    ],
)
def test_door_converts(given, unit, expected):
    array = read_only(given, unit=unit)
    assert type(array) is np.ndarray
    assert array == pytest.approx(row(expected), rel=1e-15)
    assert not array.flags.writeable


@pytest.mark.parametrize(
    ("given", "unit", "complaint"),
    [
        (1 * u.deg, "mm", "length is in 'deg', expected a length (mm)"),
        (1 * u.mm, "rad", "length is in 'mm', expected an angle (rad)"),
        (1 * u.one, "rad", "length is in '', expected an angle (rad)"),
        (1 * u.mag, "rad", "length is in 'mag', expected an angle (rad)"),
        (1 * u.mm, "", "length is in 'mm', expected a number without one"),
        ([1 * u.s, 1 * u.mm], "mm", "length is in 's', expected a length (mm)"),
        (Column([1.0], unit=u.Unit("parrot", parse_strict="silent")), "mm", "length is in 'parrot', expected a length"),
        (np.ma.array([1.0, 2.0], mask=[False, True]), "mm", "length is masked in row 2"),
        (MaskedColumn([1.0, 2.0], mask=[True, True], unit="m"), "mm", "length is masked in row 1"),
        (Masked([1.0, 2.0] * u.m, mask=[False, True]), "mm", "length is masked in row 2"),
        ([1.0, np.ma.masked], "mm", "length is masked"),
        (["one"], "mm", "length cannot be taken as numbers"),
        ([[1.0], [1.0, 2.0]], "mm", "length cannot be taken as numbers"),
    ],
)
def test_door_refuses_in_one_line(given, unit, complaint):
    with pytest.raises(FiberplanError) as caught:
        read_only(given, unit=unit, name="length")
    assert str(caught.value).startswith(complaint)
    assert "\n" not in str(caught.value)


def test_door_refuses_units_of_other_libraries():
    class Foreign(np.ndarray):
        units = "mm"

    with pytest.raises(FiberplanError, match="length has units that are not astropy's"):
        read_only(np.ones(2).view(Foreign), unit="mm", name="length")


@pytest.mark.parametrize("given", [True, "1", [1.0], None, np.ones(2), np.nan * np.ones(1), {}])
def test_number_refuses_what_is_not_one(given):
    with pytest.raises(FiberplanError, match="margin must be one number"):
        number(given, "mm", "margin")


def test_number_takes_any_one_number():
    assert [number(one, "mm", "m") for one in (1, 1.0, np.float32(1), np.array(1), 1 * u.mm, 0.1 * u.cm)] == [1.0] * 6


def test_door_does_not_copy_what_fits():
    array = read_only([1.0, 2.0])
    assert read_only(array, unit="mm", name="length") is array
    plain_array = np.ones(3)
    assert plain(plain_array, "mm") is plain_array


def test_texts_of_columns():
    assert texts(Column([b"R0C1", b"R0C2"]), "ids") == ("R0C1", "R0C2")
    with pytest.raises(FiberplanError, match="ids is masked in row 1"):
        texts(MaskedColumn(["R0C1"], mask=[True]), "ids")


PLANE = fp.FocalPlane.hexagonal(1, 22.4)
FOLDED = PLANE.folded
ANYWHERE = np.full((PLANE.n, 2), np.nan)
GOAL = FOLDED + np.array([0.3, -0.2])
DEG = np.degrees
DEGREES = {name: DEG(getattr(PLANE, name)) * u.deg for name in ("folded", "lower", "upper", "zero")}


def fields_of(thing):
    return {name: np.asarray(value) for name, value in vars(thing).items() if isinstance(value, np.ndarray | float)}


SAME = {
    "FocalPlane": lambda: (
        PLANE,
        fp.FocalPlane(
            ids=Column(PLANE.ids),
            base=PLANE.base / 1e3 * u.m,
            length=PLANE.length * 1e3 * u.um,
            fiber_offsets={"fiber": [1.5, 0] * u.cm},
            max_speed=DEG(PLANE.max_speed) * u.deg / u.s,
            bodies=PLANE.bodies,
            pair_margin=0.5 * u.cm,
            **DEGREES,
        ),
    ),
    "hexagonal": lambda: (
        PLANE,
        fp.FocalPlane.hexagonal(
            1, 2.24 * u.cm, (0.74 * u.cm, 1.5 * u.cm), 1500 * u.um, 30 * u.deg / u.s,
            lower=[0, 0] * u.deg, upper=[360, 180] * u.deg, folded=(0 * u.deg, 180 * u.deg),
        ),
    ),
    "field_radius": lambda: (PLANE.replace(field_radius=500.0), PLANE.replace(field_radius=0.5 * u.m)),
    "Body": lambda: (fp.Body([[0.0, 0.0], [15.0, 0.0]], 1.5), fp.Body([[0, 0], [1.5, 0]] * u.cm, 0.15 * u.cm)),
    "Obstacle": lambda: (fp.Obstacle("pin", [[3.0, 4.0]], 0.5), fp.Obstacle("pin", [[3, 4]] * u.mm, 500 * u.um)),
    "FourBar": lambda: (
        FourBar([100.0], [50.0], [20.0], [90.0], [np.pi / 2]),
        FourBar([10] * u.cm, 5 * u.cm, [0.02] * u.m, [90.0] * u.mm, 90 * u.deg),
    ),
    "Problem": lambda: (
        fp.Problem(PLANE, FOLDED, GOAL, 0.5, alternatives=GOAL[:, None]),
        fp.Problem(
            PLANE, DEG(FOLDED) * u.deg, DEG(GOAL) * u.deg, 500 * u.um, alternatives=DEG(GOAL[:, None]) * u.deg
        ),
    ),
    "from_targets": lambda: (
        fp.Problem.from_targets(PLANE, targets(), FOLDED, 0.5),
        fp.Problem.from_targets(PLANE, targets(), DEG(FOLDED) * u.deg, 0.05 * u.cm),
    ),
    "Targets": lambda: (
        targets(),
        fp.Targets(targets().x / 1e3 * u.m, QTable({"y": targets().y * u.mm})["y"], positioner=targets().positioner),
    ),
    "Targets by angles": lambda: (
        fp.Targets([np.nan], [np.nan], angles=[[0.1, 3.0]], base=[[1.0, 2.0]]),
        fp.Targets([np.nan], [np.nan], angles=[DEG([0.1, 3.0])] * u.deg, base=[[0.1, 0.2]] * u.cm),
    ),
    "Trajectory": lambda: (
        Trajectory([0, 2], [0.0, 60.0], [[0.0, 1.0], [0.5, 1.0]]),
        Trajectory([0, 2], [0, 1] * u.min, DEG([[0.0, 1.0], [0.5, 1.0]]) * u.deg),
    ),
    "from_samples": lambda: (
        Trajectory.from_samples([0.0, 60.0], [FOLDED, GOAL]),
        Trajectory.from_samples([0, 1] * u.min, DEG([FOLDED, GOAL]) * u.deg),
    ),
    "from_knots": lambda: (
        Trajectory.from_knots([0, 0], [0.0, 60.0], [[0.0, 1.0], [0.5, 1.0]], 1),
        Trajectory.from_knots([0, 0], [0, 1] * u.min, DEG([[0.0, 1.0], [0.5, 1.0]]) * u.deg, 1),
    ),
    "at_rest": lambda: (Trajectory.at_rest(FOLDED), Trajectory.at_rest(DEG(FOLDED) * u.deg)),
    "verify": lambda: (
        fp.verify(PLANE, motion(), 0.5, 0.1, 0.01),
        fp.verify(PLANE, motion(), 500 * u.um, 100 * u.ms, np.full(PLANE.n, 10) * u.um),
    ),
}  # fmt: skip


def targets():
    points = PLANE.fibers(GOAL)
    return fp.Targets(points[:, 0], points[:, 1], PLANE.ids)


def motion():
    return Trajectory.from_samples([0.0, 2.0], [FOLDED, GOAL])


@pytest.mark.parametrize("case", SAME)
def test_fields_with_units_are_those_without(case):
    given, with_units = (fields_of(thing) for thing in SAME[case]())
    assert given.keys() == with_units.keys() != set()
    for name, value in given.items():
        assert with_units[name] == pytest.approx(value, rel=1e-12, abs=1e-12, nan_ok=True), name
        assert type(with_units[name]) is np.ndarray


@pytest.mark.parametrize(
    ("plain_value", "with_units"),
    [
        (lambda: PLANE.fibers(GOAL), lambda: PLANE.fibers(DEG(GOAL) * u.deg)),
        (lambda: PLANE.elbows(GOAL), lambda: PLANE.elbows(DEG(GOAL) * u.deg)),
        (lambda: PLANE.links(GOAL), lambda: PLANE.links(DEG(GOAL) * u.deg)),
        (lambda: PLANE.clearance(GOAL), lambda: PLANE.clearance(DEG(GOAL) * u.deg)),
        (lambda: PLANE.pairs_within(1.0), lambda: PLANE.pairs_within(1000 * u.um)),
        (lambda: motion().at(1.0), lambda: motion().at(1 * u.s)),
        (lambda: motion().sampled([0.5, 1.0]), lambda: motion().sampled([500, 1000] * u.ms)),
        (lambda: uniform_field(PLANE, 3, 0.5), lambda: uniform_field(PLANE, 3, 0.05 * u.cm, DEG(FOLDED) * u.deg)),
        (lambda: clustered_targets(PLANE, 1, 0.5).x, lambda: clustered_targets(PLANE, 1, 0.05 * u.cm).x),
        (
            lambda: assignment_plan(fp.FocalPlane.load("miradas"), 1, 3, 25.0, 0.5).x,
            lambda: assignment_plan(fp.FocalPlane.load("miradas"), 1, 3, 2.5 * u.cm, 0.05 * u.cm).x,
        ),
        (
            lambda: proven_unreachable(PLANE, 0, FOLDED, GOAL[0], 0.5),
            lambda: proven_unreachable(PLANE, 0, DEG(FOLDED) * u.deg, DEG(GOAL[0]) * u.deg, 0.5 * u.mm),
        ),
        (
            lambda: quantize(motion(), 4, plane=PLANE, margin=0.5, tick=0.02)[0].angles,
            lambda: quantize(motion(), 4, plane=PLANE, margin=0.5 * u.mm, tick=20 * u.ms)[0].angles,
        ),
    ],
)
def test_functions_with_units_are_those_without(plain_value, with_units):
    assert row(with_units()) == pytest.approx(row(plain_value()), rel=1e-12, abs=1e-12)


REFUSED = {
    "hexagonal: max_speed is in 'm'": (InstrumentError, lambda: PLANE.replace(max_speed=PLANE.max_speed * u.m)),
    "hexagonal: base is in 'deg'": (InstrumentError, lambda: PLANE.replace(base=PLANE.base * u.deg)),
    "hexagonal: folded is in 'mm'": (InstrumentError, lambda: PLANE.replace(folded=PLANE.folded * u.mm)),
    "hexagonal: pair_margin is in 's'": (InstrumentError, lambda: PLANE.replace(pair_margin=5 * u.s)),
    "hexagonal: fiber 'a' is in 's'": (InstrumentError, lambda: PLANE.replace(fiber_offsets={"a": [1, 2] * u.s})),
    "hexagonal: length is masked in row 3": (
        InstrumentError, lambda: PLANE.replace(length=np.ma.array(PLANE.length, mask=np.arange(7) == 2)),
    ),
    "hexagonal: online is masked in row 1": (
        InstrumentError, lambda: PLANE.replace(online=np.ma.array(PLANE.online, mask=True)),
    ),
    "pitch is in 'deg'": (InstrumentError, lambda: fp.FocalPlane.hexagonal(1, 22 * u.deg)),
    "max_speed is in 'deg'": (InstrumentError, lambda: fp.FocalPlane.hexagonal(1, 22.4, max_speed=30 * u.deg)),
    "body 'arm': radius is in 'rad'": (InstrumentError, lambda: fp.Body([[0.0, 0.0]], 1 * u.rad)),
    "'arm': points is in 'rad'": (InstrumentError, lambda: fp.Body([[0.0, 0.0]] * u.rad, 1)),
    "obstacle 'pin': radius is in 'rad'": (InstrumentError, lambda: fp.Obstacle("pin", [[0.0, 0.0]], 1 * u.rad)),
    "four-bar rocker is in 's'": (InstrumentError, lambda: FourBar([9], [5] * u.s, [1], [2], [0])),
    "angles is in 'mm'": (InstrumentError, lambda: PLANE.fibers(GOAL * u.mm)),
    "margin is in 'deg'": (ProblemError, lambda: fp.Problem(PLANE, FOLDED, GOAL, 1 * u.deg)),
    "start is in 'mm'": (ProblemError, lambda: fp.Problem(PLANE, FOLDED * u.mm, GOAL)),
    "goal is masked in row 1": (ProblemError, lambda: fp.Problem(PLANE, FOLDED, np.ma.array(GOAL, mask=True))),
    "priority is in 's'": (ProblemError, lambda: fp.Problem(PLANE, FOLDED, GOAL, priority=np.ones(7) * u.s)),
    "targets: x is in 'deg'": (TargetError, lambda: fp.Targets([1] * u.deg, [1])),
    "targets: angles is in 'mm'": (TargetError, lambda: fp.Targets([1], [1], angles=[[1, 1]] * u.mm)),
    "targets: positioner is masked in row 1": (
        TargetError, lambda: fp.Targets([1], [1], MaskedColumn(["R0C1"], mask=[True])),
    ),
    "times is in 'm'": (TrajectoryError, lambda: Trajectory.from_samples([0, 1] * u.m, [FOLDED, GOAL])),
    "t is in 'm'": (TrajectoryError, lambda: motion().at(1 * u.m)),
    "jitter is in 'mm'": (TrajectoryError, lambda: fp.verify(PLANE, motion(), 0.1, 1 * u.mm)),
    "quantize: tick is in 'mm'": (TrajectoryError, lambda: quantize(motion(), 4, plane=PLANE, tick=1 * u.mm)),
}  # fmt: skip


@pytest.mark.parametrize("complaint", REFUSED)
def test_wrong_units_and_masked_values_are_refused_by_name(complaint):
    error, make = REFUSED[complaint]
    with pytest.raises(error) as caught:
        make()
    assert str(caught.value).startswith(complaint)
    assert "\n" not in str(caught.value)


SETTINGS = [
    (name, field.name)
    for name in fp.planners.PLANNERS
    for field in dataclasses.fields(fp.planners.PLANNERS[name])
    if "float" in str(field.type)
]
UNITS_OF_SETTINGS = {
    ("direct", "max_time"): 3 * u.min,
    ("direct", "turn"): 6 * u.deg,
    ("greedy-fold", "step"): 1 * u.deg,
    ("greedy-fold", "max_travel"): 2 * u.cycle,
    ("navigation-function", "lambda1"): 1 / u.cm**2,
    ("navigation-function", "D"): 0.5 * u.cm,
    ("navigation-function", "d"): 100 * u.um,
    ("navigation-function", "dt"): 20 * u.ms,
    ("navigation-function", "convergence"): 50 * u.um,
    ("elliptic-navigation-function", "lambda2"): 3 * u.deg / u.s / u.mm**2,
    ("elliptic-navigation-function", "lambda3"): 3 * u.deg / u.s / u.mm**2,
    ("elliptic-navigation-function", "influence"): 0.3 * u.cm,
    ("elliptic-navigation-function", "near"): 500 * u.ms,
    ("elliptic-navigation-function", "stall_time"): 500 * u.ms,
    ("elliptic-navigation-function", "dt"): 50 * u.ms,
    ("elliptic-navigation-function", "patience"): 0.1 * u.min,
    ("elliptic-navigation-function", "max_time"): 1 * u.min,
    ("direct", "min_reaction"): 300 * u.ms,
    ("prioritized-roadmap", "dt"): 0.1 * u.min,
    ("prioritized-roadmap", "collision_dt"): 20 * u.ms,
    ("prioritized-roadmap", "max_time"): 3 * u.min,
}


@pytest.mark.parametrize(("planner", "setting"), SETTINGS)
def test_settings_of_planners_have_units(planner, setting):
    make = fp.planners.PLANNERS[planner]
    with pytest.raises(ProblemError, match=rf"^{planner}: {setting} is in 'cd', expected "):
        make(**{setting: 1 * u.cd})
    given = UNITS_OF_SETTINGS.get((planner, setting), 200 * u.percent)
    value = getattr(make(**{setting: given}), setting)
    assert type(value) is float
    assert value == pytest.approx(given.decompose([u.mm, u.rad, u.s]).value)


def test_a_goal_of_an_amended_plan_has_a_unit():
    plan = fp.planners.GreedyFold(step=1 * u.deg).plan(fp.Problem(PLANE, FOLDED, GOAL))
    amended = fp.amend(plan, "R0C2", [30, 150] * u.deg)
    assert amended.problem.goal[PLANE.index["R0C2"]] == pytest.approx(np.radians([30.0, 150.0]))
    with pytest.raises(ProblemError, match="amend: goal is in 'mm'"):
        fp.amend(plan, "R0C2", [30, 150] * u.mm)


def test_a_deadline_has_a_unit():
    with pytest.raises(ProblemError, match="direct: deadline is in 'mm'"):
        fp.planners.Direct().plan(fp.Problem(PLANE, FOLDED, GOAL), deadline=1 * u.mm)


def test_a_speed_in_degrees_is_held_to_in_radians():
    """At 12 deg/s taken as 12 rad/s, 300 deg/s would be called safe."""
    slow = PLANE.replace(max_speed=np.full((PLANE.n, 2), 12.0) * u.deg / u.s)
    turned = FOLDED + np.array([np.radians(10.0), 0.0])
    assert not fp.verify(slow, Trajectory.from_samples([0.0, 1 / 30], [FOLDED, turned])).ok
    assert fp.verify(slow, Trajectory.from_samples([0.0, 1.0], [FOLDED, turned])).ok


def test_alternatives_and_dropped_are_checked():
    for others, complaint in (
        (np.zeros((PLANE.n, 2)), "alternatives must have shape"),
        (np.full((PLANE.n, 1, 2), np.inf), "alternatives: positioner 'R-1C1': number 1 must be two finite angles"),
        (np.full((PLANE.n, 1, 2), [0.0, np.nan]), "alternatives: positioner 'R-1C1': number 1 must be two"),
    ):
        with pytest.raises(ProblemError, match=complaint):
            fp.Problem(PLANE, FOLDED, ANYWHERE, alternatives=others)
    for dropped, complaint in (
        ({7: fp.Dropped("late")}, "dropped: there is no positioner 7 among 7"),
        ({-1: fp.Dropped("late")}, "dropped: there is no positioner -1 among 7"),
        ({"R0C1": fp.Dropped("late")}, "dropped: there is no positioner R0C1"),
        ({0: "late"}, "dropped: positioner 'R-1C1' needs a Dropped, got 'late'"),
    ):
        with pytest.raises(ProblemError, match=complaint):
            fp.Problem(PLANE, FOLDED, ANYWHERE, dropped=dropped)
    given = np.full((PLANE.n, 1, 2), np.nan)
    problem = fp.Problem(PLANE, FOLDED, ANYWHERE, alternatives=given, dropped={np.int64(2): fp.Dropped("late")})
    given[:] = 0.0
    assert np.isnan(problem.alternatives).all()
    assert problem.dropped == {2: fp.Dropped("late")}
    assert type(problem.dropped) is FrozenDict


def test_a_recommended_margin_is_in_mm_too():
    margin = PLANE.replace(recommended_margin=500 * u.um).recommended_margin
    assert (type(margin), margin) == (float, 0.5)


def test_plain_numbers_do_not_wait_for_astropy():
    check = (
        "import sys; import fiberplan; from fiberplan.arrays import read_only; read_only([1, 2], unit='mm', name='x');"
    )
    assert subprocess.run([sys.executable, "-c", check + "sys.exit('astropy' in sys.modules)"]).returncode == 0
