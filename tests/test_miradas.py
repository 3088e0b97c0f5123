import gzip
from pathlib import Path

import numpy as np
import pytest

from fiberplan.certificates import ZoneEntry, verify
from fiberplan.cli.app import run
from fiberplan.errors import InstrumentError, ProblemError, TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.two_link import TWO_LINK
from fiberplan.io.plan_file import plan_bytes, read_certificate
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.problem import Problem, Targets
from fiberplan.visuals.page_data import page_data
from fiberplan.visuals.shapes import outlines
from references import four_bar_joints


@pytest.fixture(scope="module")
def plane():
    return FocalPlane.load("miradas")


def test_reach_field_and_park_are_as_published(plane):
    """12 arms, a field 250 mm wide, parked at (180, 0) deg with every tip outside the field and nothing touching."""
    assert plane.n == 12
    assert plane.field_radius == 125.0
    np.testing.assert_allclose(np.degrees(plane.folded), np.tile([180.0, 0.0], (12, 1)))
    np.testing.assert_allclose(plane.max_speed, 0.031416, atol=1e-6)
    tips = np.hypot(*plane.fibers(plane.folded).T)
    assert np.all(tips > 125.0 + 4.0)
    assert plane.clearance(plane.folded).min() > 5.0
    assert len(plane.pairs) == 66  # every arm can meet every other


def test_every_point_of_the_field_is_within_some_arms_reach(plane):
    around = np.linspace(0, 2 * np.pi, 60)
    points = np.concatenate([r * np.stack([np.cos(around), np.sin(around)], axis=1) for r in (0, 40, 80, 110, 124)])
    reached = np.zeros(len(points), bool)
    for id_ in plane.ids:
        for k, (x, y) in enumerate(points):
            if not reached[k]:
                reached[k] = not Targets([x], [y], (id_,)).solve(plane).unreachable
    assert reached.all()


def test_probes_cross_over_cranks_but_not_over_probes(plane):
    bodies = {body.name: body for body in plane.bodies}
    for high in ("probe", "carriage"):
        assert bodies[high].category == "probe"
        assert bodies[high].meets == ("probe",)
    for low in ("first crank", "rocker"):
        assert bodies[low].meets == ("crank",)


def test_definition_needs_ring_and_bars_together(tmp_path):
    text = (Path("src/fiberplan/instruments/builtin") / "miradas.toml").read_text()
    for old, new, words in (
        ("shortest = 60.0", "shortest = 131.0", "slider 130 mm is outside 131 to 145 mm"),
        ("count = 12", "count = 0", "grid.count = 0"),
        ("rocker = 60.0", "rocker = -60.0", "four_bar.rocker"),
        (
            'kind = "ring"\ncount = 12      # Sabater2018\nradius = 312.0',
            'kind = "hexagonal"\nrings = 1\npitch = 9.0 #',
            "four_bar arms stand on a grid of kind 'ring'",
        ),
    ):
        path = tmp_path / "arms.toml"
        assert old in text
        path.write_text(text.replace(old, new))
        with pytest.raises(InstrumentError, match=words):
            FocalPlane.load(path)


def test_rocker_bodies_need_bars(plane):
    with pytest.raises(InstrumentError, match="rides on the rocker, but two-link arms have the links base, alpha"):
        plane.replace(kinematics=TWO_LINK)


def test_instrument_file_gives_back_the_same_arms(plane, tmp_path):
    plane.write(tmp_path / "arms.fits")
    again = FocalPlane.load(tmp_path / "arms.fits")
    for name in ("spacing", "rocker", "shortest", "longest", "orientation"):
        np.testing.assert_array_equal(getattr(again.kinematics, name), getattr(plane.kinematics, name))
    assert again.field_radius == plane.field_radius
    np.testing.assert_array_equal(again.arms.bar, plane.arms.bar)
    np.testing.assert_array_equal(again.arms.arm, plane.arms.arm)


def test_plan_files_of_format_1_are_still_read(tmp_path):
    path = tmp_path / "old.fits"
    path.write_bytes(gzip.decompress((Path(__file__).parent / "format1.fits.gz").read_bytes()))
    old = Plan.read(path)
    assert not old.faults()
    assert old.problem.plane.kinematics is TWO_LINK
    assert old.problem.plane.field_radius == np.inf
    assert len(old.having(Outcome.ARRIVED)) == 6


@pytest.fixture
def through_the_zone(plane):
    """Arm A1 turns its first crank by a half turn and back, alone, which takes its slider out of range."""
    there = plane.folded.copy()
    there[0] = 0.6, 0.0
    assert plane.in_avoidance(there)[0]
    away = plane.folded.copy()
    times = np.array([0.0, 120.0, 240.0])
    motion = Trajectory.from_samples(times, np.stack([plane.folded, there, away]))
    problem = Problem(plane, plane.folded, plane.folded)
    return Plan(problem, motion, (Outcome.ARRIVED,) * 12, planner="by hand")


def test_zone_is_a_fault_of_its_own_kind(plane, through_the_zone, tmp_path, capsys):
    certificate = through_the_zone.certificate
    (entry,) = certificate.zones
    assert not certificate.ok
    assert not certificate.violations
    assert entry.positioner == 0
    before = plane.kinematics.sliders(plane.length, through_the_zone.trajectory.at(entry.time - 0.01), plane.zero)[0]
    after = plane.kinematics.sliders(plane.length, through_the_zone.trajectory.at(entry.time + 0.01), plane.zero)[0]
    assert plane.kinematics.shortest[0] < before < plane.kinematics.longest[0]
    assert not plane.kinematics.shortest[0] < after < plane.kinematics.longest[0]
    assert any("1 zones of avoidance entered" in fault for fault in through_the_zone.faults())

    path = tmp_path / "zone.fits"
    through_the_zone.write(path)
    assert read_certificate(path).zones == (ZoneEntry(0, entry.time, entry.slider),)
    assert plan_bytes(Plan.read(path)) == plan_bytes(through_the_zone)
    assert run(["verify", str(path)]) == 1
    assert "zone of avoidance: A1 at" in capsys.readouterr().out


def test_offline_arms_may_stand_anywhere(plane):
    stuck = plane.folded.copy()
    stuck[0] = 0.6, 0.0
    broken = plane.replace(online=np.arange(12) != 0)
    assert not verify(broken, Trajectory.at_rest(stuck)).zones
    assert verify(plane, Trajectory.at_rest(stuck)).zones


def test_clock_errors_do_not_move_an_arm_that_stands_in_the_zone(plane):
    """Two equal knots are no motion: whoever passes is as far from the arm as without clock errors."""
    stuck = plane.folded.copy()
    stuck[0] = 0.6, 0.0
    broken = plane.replace(online=np.arange(12) != 0)
    still = Trajectory.from_samples(np.array([0.0, 10.0]), np.stack([stuck, stuck]))
    certificate = verify(broken, still, jitter=0.1)
    assert certificate.contacts == verify(broken, still).contacts
    assert not certificate.undecided
    np.testing.assert_array_equal(certificate.clearance, verify(broken, still).clearance)


def test_an_arm_of_unbounded_speed_is_undecided_not_in_contact(plane, through_the_zone):
    certificate = verify(plane, through_the_zone.trajectory, jitter=0.1)
    assert certificate.undecided
    assert all(np.isfinite(contact.clearance) for contact in (*certificate.contacts, *certificate.undecided))
    assert all(contact.clearance >= 0 for contact in certificate.undecided)


def test_configurations_in_the_zone_are_refused_by_name(plane):
    inside = plane.folded.copy()
    inside[4] = 0.6, 0.0
    words = (
        r"positioner 'A5': theta1, theta2 34.3775, 0 deg are in the zone of avoidance: slider .* is outside 60 to 145"
    )
    with pytest.raises(ProblemError, match="start: " + words):
        Problem(plane, inside, plane.folded)
    with pytest.raises(ProblemError, match="goal: " + words):
        Problem(plane, plane.folded, inside)
    dropped = Problem(plane, plane.folded, inside, conflicts="drop").dropped
    assert list(dropped) == [4]
    assert "zone of avoidance" in dropped[4].cause


def test_targets_out_of_the_field_and_of_reach_are_refused_by_name(plane):
    with pytest.raises(
        TargetError, match=r"positioner 'A1': its target in row 1 is 126.000 mm from the middle, outside"
    ):
        Targets([126.0], [0.0], ("A1",)).configuration(plane)
    with pytest.raises(TargetError, match=r"no configuration brings it there within joint ranges and outside the zone"):
        Targets([-120.0], [0.0], ("A1",)).configuration(plane)
    with pytest.raises(TargetError, match=r"row 1: parity is given, but four-bar arms have none"):
        Targets([100.0], [0.0], ("A1",), parity=[1]).configuration(plane)


def test_instruments_command_tells_of_bars(capsys):
    assert run(["instruments", "miradas"]) == 0
    said = capsys.readouterr().out
    assert "60 to 145 mm" in said
    assert "chosen for this model" in " ".join(said.split())


def test_page_knows_the_bars(through_the_zone):
    data = page_data(through_the_zone)
    assert "bars" in data
    assert "sliders" in data
    assert "1 forbidden slider length" in data["certificate"]["statement"]
    assert any("'A1' enters its zone of avoidance" in text for text in data["certificate"]["violations"])


def test_figures_draw_the_arms_where_they_are(plane):
    """The probe's outline reaches from J3 to the tip, the rocker's from J2 to J4."""
    angles = plane.folded.copy()
    angles[3] = 2.0, 0.8
    j1, j2, j3, j4 = four_bar_joints(plane, 3, angles[[3]])
    ends = {"probe": (j3[0], complex(*plane.fibers(angles)[3])), "rocker": (j2, j4[0]), "first crank": (j1, j3[0])}
    drawn_last = sorted(plane.bodies, key=lambda body: body.link == "beta")
    for body, some in zip(drawn_last, outlines(plane), strict=True):
        if body.name in ends:
            outline = some.split(some.placed(plane, angles))[3] @ np.array([1, 1j])
            a, b = ends[body.name]
            assert np.abs(outline - a).min() < body.radius + 1e-9
            assert np.abs(outline - b).min() < body.radius + 1e-9
            assert np.ptp(outline.real) + np.ptp(outline.imag) > 0.9 * abs(b - a)
