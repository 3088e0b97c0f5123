"""Every kind of figure: labelled, in vectors, on one's own axes, and showing what the plan says."""

import matplotlib
import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates.safety import CAP, TOLERANCE
from fiberplan.cli.app import run
from fiberplan.errors import FiberplanError, PlanError
from fiberplan.plan.closest import closest_pairs
from fiberplan.plan.diagnosis import stop_times
from fiberplan.visuals.canvas import blank
from fiberplan.visuals.figures import FIGURES, clearance, draw, joint_space, joints, makespan, snapshots, speeds
from fiberplan.visuals.figures.workspaces import possible_contacts
from test_page import small_plan

pytestmark = pytest.mark.small

KINDS = (
    "focal-plane", "snapshots", "joints", "speeds", "clearance", "histogram", "makespan", "coverage", "multiplicity",
    "joint-space",
)  # fmt: skip
MANY_LOOKS = ("clearance", "joint-space")  #: which take long with the compiler off
MAGIC = {"svg": b"<?xml", "pdf": b"%PDF", "png": b"\x89PNG"}


@pytest.fixture(scope="module")
def plan():
    return small_plan(touching=True)


@pytest.fixture(scope="module")
def plan_file(plan, tmp_path_factory):
    path = tmp_path_factory.mktemp("plan") / "plan.fits"
    plan.write(path)
    return path


def test_kinds_are_the_promised_ones():
    assert tuple(FIGURES) == KINDS
    assert {kind.replace("-", "_") for kind in KINDS} <= set(fp.visuals.__all__)


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=[pytest.mark.large] if kind in MANY_LOOKS else []) for kind in KINDS]
)
def test_axes_are_labelled_with_units_and_given_back(kind, plan):
    before = dict(matplotlib.rcParams)
    drawn = FIGURES[kind](plan)
    axes = drawn if isinstance(drawn, list) else [drawn]
    first = axes[0].get_figure().axes
    assert list(axes) == list(first)
    for k, ax in enumerate(axes):
        assert ax.get_xlabel().endswith(("[mm]", "[s]", "[deg]"))
        shared = kind == "snapshots" and k > 0  # beside the first, which has the label
        assert shared or kind == "histogram" or ax.get_ylabel().endswith(("[mm]", "[s]", "[deg]", "[deg/s]"))
        assert ax.get_title(loc="left")
    assert dict(matplotlib.rcParams) == before

    own = blank((9, 3), columns=len(axes))[1]
    again = FIGURES[kind](plan, own if isinstance(drawn, list) else own[0])
    assert (again if isinstance(again, list) else [again]) == own


@pytest.mark.large
@pytest.mark.parametrize("suffix", MAGIC)
def test_formats_by_ending_and_the_same_bytes_twice(suffix, plan, tmp_path):
    for name in ("one", "two"):
        draw(plan, "joints", tmp_path / f"{name}.{suffix}")
    first = (tmp_path / f"one.{suffix}").read_bytes()
    assert first.startswith(MAGIC[suffix])
    assert first == (tmp_path / f"two.{suffix}").read_bytes()


def test_joints_are_the_knots(plan):
    i = int(np.argmax(np.diff(plan.trajectory.offsets)))
    times, angles = plan.trajectory.knots(i)
    for k, ax in enumerate(joints(plan, positioners=[i])):
        line = ax.lines[0]
        assert line.get_xdata()[: len(times)] == pytest.approx(times)
        assert line.get_ydata()[: len(times)] == pytest.approx(np.degrees(angles[:, k]))
        assert line.get_label() == plan.problem.plane.ids[i]


def test_speeds_add_up_to_the_turn(plan):
    i = int(np.argmax(np.diff(plan.trajectory.offsets)))
    for k, ax in enumerate(speeds(plan, positioners=[i])):
        values, edges, _ = ax.patches[0].get_data()
        turn = plan.trajectory.end[i, k] - plan.trajectory.start[i, k]
        assert (values * np.diff(edges)).sum() == pytest.approx(np.degrees(turn))


def test_makespan_shows_when_who_stops(plan):
    ax = makespan(plan)
    shown = np.concatenate([points.get_offsets() for points in ax.collections])
    assert len(shown) == plan.problem.n
    assert shown[:, 1].max() == pytest.approx(np.nanmax(stop_times(plan.trajectory)))
    assert np.all(shown[:, 1] >= shown[:, 0] - 1e-9)  # nobody is quicker than its joints
    assert f"kinematic bound {plan.lower_bound:.2f} s" in [line.get_label() for line in ax.lines]


def test_joint_space_marks_where_it_is(plan):
    ax = joint_space(plan, positioner=0, time=plan.makespan, cells=7)
    at = [line for line in ax.lines if line.get_label().startswith("at ")]
    assert at[0].get_xydata()[0] == pytest.approx(np.degrees(plan.trajectory.end[0]))


def test_clearance_is_no_less_than_the_certificate_says(plan):
    ax = clearance(plan, slices=2)
    shown = np.concatenate([part.get_data().values for part in ax.patches])
    (closest,) = closest_pairs(plan)
    top = plan.problem.margin + CAP
    assert np.nanmin(np.append(shown, top)) == pytest.approx(min(closest.clearance, top), abs=2 * TOLERANCE)
    assert [line.get_label() for line in ax.lines] == [f"margin {plan.problem.margin:g} mm"]
    with pytest.raises(PlanError, match="cannot be cut into 0 slices"):
        clearance(plan, slices=0)


def test_closest_pairs_are_those_of_the_certificate(plan):
    certificate = plan.certificate
    (first, *_) = closest_pairs(plan, 3)
    online = plan.problem.plane.online
    gaps = certificate.clearance[online[certificate.pairs].any(axis=1)]
    fixed = certificate.obstacle_clearance[online[certificate.obstacle_pairs[:, 0]]]
    assert first.clearance == min(gaps.min(), fixed.min())
    assert first.names == tuple(plan.problem.plane.label(i) for i in first.pair)


def test_possible_contacts_of_a_hexagon():
    """Reach 23.9 mm at a pitch of 22.4 mm: everyone within two steps, 44.8 mm, is within twice that."""
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    counts = dict(zip(plane.ids, possible_contacts(plane, 0.0), strict=True))
    assert counts["R0C3"] == 18
    assert min(counts.values()) == 3 + 2 + 3  # at a corner: those at 1, sqrt(3) and 2 steps


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["clearence", "-o", "x.svg"], "no figure 'clearence'; there are " + ", ".join(KINDS)),
        (["clearance", "-o", "x.gif"], "x.gif: this command writes a figure, which ends in .svg or .pdf or .png"),
        (["clearance", "-o", "x"], "x: a figure's name ends in .svg, .pdf or .png"),
        (["clearance", "--time", "3", "-o", "x.svg"], "--time: a figure of the kind 'clearance' has no such option"),
        (
            ["focal-plane", "--time", "1", "--time", "2", "-o", "x.svg"],
            "--time: a figure of the kind 'focal-plane' takes one, got 2",
        ),
        (["focal-plane", "--time", "1e9", "-o", "x.svg"], "time 1e+09 s is not within the motion"),
        (["joints", "--positioner", "R0c1", "-o", "x.svg"], "small array has no positioner 'R0c1'; did you mean"),
    ],
)
def test_bad_requests_are_one_line_and_leave_nothing(arguments, complaint, plan_file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["figure", str(plan_file), *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"fiberplan: error: {complaint}")
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.large
def test_the_command_takes_moments_and_positioners(plan_file, tmp_path, capsys):
    row = tmp_path / "row.svg"
    middle = ["--positioner", "R0C3", "--time", "0", "--time", "2.5"]
    assert run(["figure", str(plan_file), "snapshots", *middle, "-o", str(row)]) == 0
    assert capsys.readouterr().out == f"wrote {row}\n"
    assert row.read_bytes().startswith(MAGIC["svg"])


def test_snapshots_have_one_scale(plan):
    assert len({(ax.get_xlim(), ax.get_ylim()) for ax in snapshots(plan)}) == 1


def test_axes_that_do_not_fit_are_refused(plan):
    (ax,) = blank()[1]
    with pytest.raises(PlanError, match="3 moments need as many axes, got 1"):
        snapshots(plan, [ax], [0.0, 1.0, 2.0])
    with pytest.raises(PlanError, match="two joints need two axes, got 1"):
        joints(plan, [ax])
    with pytest.raises(FiberplanError, match="no figure 'none'"):
        draw(plan, "none", "x.svg")
