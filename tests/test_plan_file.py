import copy
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from astropy.io import fits

from fiberplan.certificates import Certificate, Contact
from fiberplan.errors import PlanError
from fiberplan.focal_plane import FocalPlane
from fiberplan.io.focal_plane_tables import plane_hdus
from fiberplan.io.plan_file import plan_bytes, read_certificate
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.problem import Problem, State

pytestmark = pytest.mark.small


@pytest.fixture
def path(tmp_path, small_plan):
    small_plan.write(tmp_path / "plan.fits")
    return tmp_path / "plan.fits"


def edit(path, change):
    """Change a plan file through astropy, as a well-meaning person might."""
    with fits.open(io.BytesIO(path.read_bytes())) as hdul:
        change(hdul)
        hdul.writeto(path, overwrite=True)


def test_everything_round_trips(path, small_plan):
    plan, again = small_plan, Plan.read(path)
    problem, read = plan.problem, again.problem
    for name in ("start", "goal", "requested", "priority", "alternatives"):
        np.testing.assert_array_equal(getattr(problem, name), getattr(read, name))
    for name in ("margin", "conflicts", "notes", "dropped"):
        assert getattr(problem, name) == getattr(read, name)
    for name in ("offsets", "times", "angles"):
        np.testing.assert_array_equal(getattr(plan.trajectory, name), getattr(again.trajectory, name))
    for name in (
        "outcomes",
        "planner",
        "parameters",
        "seed",
        "blockers",
        "timings",
        "notes",
        "makespan",
        "lower_bound",
    ):
        assert getattr(plan, name) == getattr(again, name)
    assert problem.dropped[1].cause.startswith("out of reach")
    np.testing.assert_array_equal(problem.plane.online, read.plane.online)
    assert plan_bytes(plan) == plan_bytes(again) == path.read_bytes()


def test_forbidden_places_and_all_that_stands_are_kept(tmp_path):
    """Black dots of PFS: a plan on a focal plane with such places could not be written."""
    plane = FocalPlane.hexagonal(1, 22.4).replace(forbidden=[[50.0, 50.0, 0.5]])
    problem = Problem(plane, plane.folded, plane.folded)
    Plan(problem, Trajectory.at_rest(plane.folded), (Outcome.ARRIVED,) * 7, "none").write(tmp_path / "plan.fits")
    np.testing.assert_array_equal(Plan.read(tmp_path / "plan.fits").problem.plane.forbidden, plane.forbidden)


def test_arrays_are_native_and_read_only(path):
    plan = Plan.read(path)
    for array in (plan.trajectory.angles, plan.trajectory.times, plan.problem.goal, plan.problem.requested):
        assert array.dtype == np.float64
        assert array.dtype.isnative
        assert not array.flags.writeable
    assert plan.trajectory.offsets.dtype == np.int64


def test_columns_carry_units(path):
    with fits.open(path) as hdul:
        assert {hdu.name for hdu in hdul[1:]} >= {
            *("POSITIONERS", "KNOTS", "OBSTACLES", "BODIES", "PROBLEM", "CERTIFICATE", "PARAMETERS")
        }
        assert hdul["KNOTS"].columns["time"].unit == "s"
        assert hdul["KNOTS"].columns["alpha"].unit == "rad"
        assert hdul["POSITIONERS"].columns["base_x"].unit == "mm"
        assert hdul["POSITIONERS"].columns["max_speed_beta"].unit == "rad/s"
        assert hdul["PROBLEM"].data["outcome"][0] == "ARRIVED"


def test_stored_certificate_is_a_record(path, small_plan):
    stored, proof = read_certificate(path), small_plan.certificate
    assert str(stored) == str(proof)
    for name in ("pairs", "clearance", "obstacle_pairs", "obstacle_clearance"):
        np.testing.assert_array_equal(getattr(stored, name), getattr(proof, name))
    assert "certificate" not in Plan.read(path).__dict__


def test_certificate_of_an_unsafe_motion(tmp_path, small_plan):
    proof = Certificate(
        margin=0.1,
        jitter=0.0,
        position_error=0.0,
        pairs=np.array([[0, 1]]),
        clearance=np.array([-np.inf]),
        obstacle_pairs=np.empty((0, 2), np.int64),
        obstacle_clearance=np.empty(0),
        contacts=(Contact((0, -1), 0.25, -0.5),),
        undecided=(Contact((0, 1), 0.5, 0.1),),
        violations=("positioner 'R0C1': too fast by 1 µrad/s",),
        resting=(Contact((2, 6), 0.0, -1.0),),
    )
    small_plan.__dict__["certificate"] = proof
    small_plan.write(tmp_path / "plan.fits")
    stored = read_certificate(tmp_path / "plan.fits")
    for name in ("margin", "contacts", "undecided", "violations", "resting", "ok"):
        assert getattr(stored, name) == getattr(proof, name)
    np.testing.assert_array_equal(stored.clearance, [-np.inf])


def test_reading_decides_nothing_again(tmp_path):
    plane = FocalPlane.hexagonal(1, 22.4)
    goal = plane.folded.copy()
    goal[3], goal[4] = (0.0, 0.0), (np.pi, 0.0)  # the arms meet halfway
    problem = Problem(plane, plane.folded, goal, conflicts="drop")
    assert len(problem.dropped) == 1
    outcomes = tuple(Outcome.DROPPED if i in problem.dropped else Outcome.DEADLOCKED for i in range(plane.n))
    Plan(problem, Trajectory.at_rest(problem.start), outcomes, "none").write(tmp_path / "plan.fits")
    again = Plan.read(tmp_path / "plan.fits").problem
    assert again.dropped == problem.dropped
    assert again.alternatives is None
    np.testing.assert_array_equal(again.requested, goal)
    np.testing.assert_array_equal(again.goal, problem.goal)


def test_swapped_rows_are_noticed(path):
    def swap(hdul):
        table = hdul["KNOTS"].data
        table["alpha"][[1, 3]] = table["alpha"][[3, 1]]

    edit(path, swap)
    with pytest.raises(PlanError, match="is damaged"):
        Plan.read(path)


def test_a_changed_unit_is_noticed(path):
    edit(path, lambda hdul: hdul["KNOTS"].header.set("TUNIT2", "min"))
    with pytest.raises(PlanError, match="is damaged"):
        Plan.read(path)


@pytest.mark.parametrize("part", [0.2, 0.6, 0.95])
def test_truncated(path, part):
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * part)])
    with pytest.raises(PlanError, match="truncated or damaged") as caught:
        Plan.read(path)
    assert "\n" not in str(caught.value)


def test_one_table_short(path):
    edit(path, lambda hdul: hdul.pop())
    with pytest.raises(PlanError, match="damaged"):
        Plan.read(path)


def test_newer_format_is_refused(path):
    edit(path, lambda hdul: hdul[0].header.set("FPFORMAT", 4))
    with pytest.raises(PlanError, match=r"plan.fits: is in plan format 4, this fiberplan reads formats up to 3"):
        Plan.read(path)


def test_other_files(tmp_path, small_plane):
    with pytest.raises(PlanError, match="no such file"):
        Plan.read(tmp_path / "none.fits")
    (tmp_path / "text.fits").write_text("positioner,alpha,beta\n")
    with pytest.raises(PlanError, match="is not a FITS file"):
        Plan.read(tmp_path / "text.fits")
    small_plane.write(tmp_path / "plane.fits")
    with pytest.raises(PlanError, match="is not a plan"):
        Plan.read(tmp_path / "plane.fits")
    with pytest.raises(PlanError, match="is a folder"):
        Plan.read(tmp_path)


def test_a_failed_write_leaves_nothing_and_spoils_nothing(tmp_path, small_plan, monkeypatch):
    with pytest.raises(PlanError, match=r"none/plan.fits: cannot be written \(no such file or directory\)"):
        small_plan.write(tmp_path / "none" / "plan.fits")
    with pytest.raises(PlanError, match="cannot be written"):
        small_plan.write(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(PlanError, match="cannot be written"):
        small_plan.write(tmp_path / "file" / "plan.fits")

    target = tmp_path / "plan.fits"
    target.write_bytes(b"before")

    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.replace", refuse)
    with pytest.raises(PlanError, match="permission denied"):
        small_plan.write(target)
    assert target.read_bytes() == b"before"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "plan.fits"]


def test_parameters_that_json_cannot_hold_are_a_bug_not_a_loss(tmp_path, small_plan):
    small_plan = copy.copy(small_plan)  # others have it, too
    object.__setattr__(small_plan, "parameters", {"what": object()})
    with pytest.raises(TypeError, match="cannot be stored"):
        small_plan.write(tmp_path / "plan.fits")
    assert not list(tmp_path.iterdir())


@pytest.mark.large
def test_how_the_start_is_known_round_trips(tmp_path, small_plane):
    angles = small_plane.folded.copy()
    angles[3], angles[4] = np.radians([0.0, 29.9]), np.radians([180.0, 29.9])
    unknown = np.arange(7) == 5
    state = State(angles, ~unknown, 0.01 * np.arange(7), unknown, "seen.csv", ("one was not seen",))
    problem = Problem(small_plane, state, np.full((7, 2), np.nan), 0.8, near_start="open")
    apart = angles + np.isin(np.arange(7), (3, 4))[:, None]
    motion, outcomes = Trajectory.from_samples([0.0, 4.0], [angles, apart]), [Outcome.NO_TARGET] * 7
    outcomes[5] = Outcome.OFFLINE
    plan = Plan(problem, motion, tuple(outcomes), "direct")
    assert plan.certificate.opening
    plan.write(tmp_path / "plan.fits")
    again = Plan.read(tmp_path / "plan.fits")
    for name in ("angles", "online", "position_error", "unknown", "source", "notes"):
        np.testing.assert_array_equal(getattr(again.problem.state, name), getattr(state, name))
    np.testing.assert_array_equal(again.problem.position_error, problem.position_error)
    assert (again.problem.near_start, again.problem.assumptions) == ("open", problem.assumptions)
    assert again.certificate.assumptions == plan.certificate.assumptions != ()
    assert again.certificate.opening == plan.certificate.opening
    stored = read_certificate(tmp_path / "plan.fits")
    assert stored.opening == plan.certificate.opening
    assert stored.assumptions == plan.certificate.assumptions
    assert plan_bytes(again) == plan_bytes(plan)
    assert again.end.unknown.tolist() == unknown.tolist()


def test_every_column_is_on_the_page_of_plan_files(path, small_plan):
    """Those of any plan, and those that only some focal planes have."""
    page = (Path(__file__).parents[1] / "docs" / "plan-format.md").read_text()
    sections = {text.split(maxsplit=1)[0].strip(","): text for text in page.split("\n## ")}
    sections["OBSTACLES"] += sections["BODIES"]
    plane = small_plan.problem.plane
    rare = plane.replace(
        aliases=[f"M{k}" for k in range(plane.n)],
        site="APO",
        forbidden=[[0.0, 90.0, 1.0]],
        max_acceleration=np.ones((plane.n, 2)),
        min_speed=np.full((plane.n, 2), 0.01),
    )
    known = replace(small_plan.problem, wished=np.ones(plane.n, bool), state=State(plane.folded, plane.online))
    replace(small_plan, problem=known).write(path)
    with fits.open(path) as hdul:
        tables = [*hdul[1:], *plane_hdus(rare), *plane_hdus(FocalPlane.load("miradas"))]
    missing = {
        (hdu.name, name) for hdu in tables for name in hdu.columns.names if f"`{name}`" not in sections[hdu.name]
    }
    assert not missing
