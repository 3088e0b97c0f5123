"""Facts that a table states twice are compared; records say who stands still and who may give way."""

import numpy as np
import pytest

from fiberplan.errors import ProblemError, TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.plan.diagnosis import displaced, losses
from fiberplan.planners import Direct
from fiberplan.problem import Problem, State, Targets

pytestmark = pytest.mark.small

POSES = np.radians([[20.0, 150.0], [200.0, 150.0], [80.0, 120.0], [300.0, 100.0], [10.0, 90.0]])
TYPEDEF = """#%yanny
observatory {site}   # where
typedef enum {{
    BOSS, APOGEE, METROLOGY
}} FIBERTYPE;

typedef struct {{
    char holeId[28];  # of the hole }}
    FIBERTYPE fiberType;
    short assigned;
    short on_target;
    short disabled;
    short valid;
    double xwok;
    double ywok;
    float alpha;
    float beta;
    float mag[5];
    char cadence[400];
}} FIBERMAP;
"""


def with_both(plane, off=(), poses=POSES, **more):
    """A row each for the first positioners, with angles and the place they lead to, some of them off by so much."""
    m = len(poses)
    angles = plane.folded.copy()
    angles[:m] = poses
    x, y = plane.fibers(angles)[:m].T.copy()
    for row, distance in dict(off).items():
        x[row] += distance
    return Targets(x, y, plane.ids[:m], angles=poses, **more)


def record(path, plane, poses, site="APO", assigned=(), disabled=()):
    """A confSummary of our own, with comments, lines that go on and empty braces."""
    angles = plane.folded.copy()
    angles[: len(poses)] = poses
    lines = [TYPEDEF.format(site=site)]
    for i, (alpha, beta) in enumerate(np.degrees(poses)):
        id_, (x, y) = plane.ids[i], plane.fibers(angles)[i]
        flags = f"{int(id_ in disabled)} 1"
        on = int(id_ in assigned)
        lines.append(f'FIBERMAP {id_} BOSS {on} {on} {flags} 0 0 {alpha} {beta} {{1 2 3 4 5}} "dark # 1" # faint')
        lines.append(f"fibermap {id_} METROLOGY 0 0 {flags} {x} {y} \\")
        lines.append(f'    {alpha} {beta} {{}} "" # as commanded')
    path.write_text("\n".join(lines) + "\n")
    return path


def test_rows_that_agree_are_noted_with_median_and_largest(small_plane):
    solution = with_both(small_plane, {1: 0.302, 2: 0.05}).solve(small_plane)
    assert solution.notes == (
        "angles and positions of 5 rows were compared: median 0.000 mm, largest 0.302 mm (R-1C2 in row 2); the angles "
        "are taken; 0.1 to 1 mm apart: R-1C2 in row 2 0.302 mm",
    )
    np.testing.assert_array_equal(solution.goal[:5], POSES)
    alone = Targets([np.nan], [np.nan], small_plane.ids[:1], angles=POSES[:1])
    assert not alone.solve(small_plane).notes


def test_a_field_that_disagrees_is_refused_unless_it_is_said_which_counts(small_plane):
    off = {0: 0.3, 1: 9.0, 3: 0.21}
    with pytest.raises(TargetError, match=r"disagree on hexagonal: median 0\.210 mm, largest 9\.000 mm \(R-1C2 in row"):
        with_both(small_plane, off).solve(small_plane)
    by_angles = with_both(small_plane, off, prefer="angles").solve(small_plane)
    np.testing.assert_array_equal(by_angles.goal[:5], POSES)
    wanted = with_both(small_plane, off, prefer="xy")
    solution = wanted.solve(small_plane)
    ends = small_plane.fibers(solution.goal)[:5]
    there = [i for i in range(5) if i not in solution.unreachable]
    np.testing.assert_allclose(ends[there], np.stack([wanted.x, wanted.y], axis=1)[there], atol=1e-3)
    assert len(there) >= 4
    assert "R-1C2 in row 2 9.000 mm; the positions are taken" in solution.named[0]
    with pytest.raises(TargetError, match="prefer must be"):
        with_both(small_plane, prefer="both")


def test_single_rows_are_named_in_plan_and_certificate_or_dropped(small_plane):
    problem = Problem.from_targets(small_plane, with_both(small_plane, {0: 3.456}), margin=0.1, conflicts="drop")
    named = "angles and position disagree by more than 1 mm: R-1C1 in row 1 3.456 mm; the angles are taken"
    assert named in problem.notes
    stays = np.where(problem.has_goal, Outcome.DEADLOCKED, Outcome.NO_TARGET)
    still = Trajectory.from_samples(np.array([0.0, 1.0]), np.stack([problem.start, problem.start]))
    assert named in Plan(problem, still, tuple(stays), planner="none").certificate.assumptions
    far = with_both(small_plane, {2: 5.1})
    with pytest.raises(TargetError, match=r"angles and position disagree: positioner 'R0C1': .* 5\.100 mm"):
        Problem.from_targets(small_plane, far)
    assert Problem.from_targets(small_plane, far, conflicts="drop").dropped[2].cause.startswith("angles and position")


def test_observatories_are_compared(tmp_path, small_plane):
    plane = small_plane.replace(site="LCO")
    path = record(tmp_path / "confSummary-1.par", small_plane, POSES)
    with pytest.raises(TargetError, match=r"confSummary-1\.par: is of APO, but hexagonal is of LCO$"):
        Targets.read(path).solve(plane)
    plane.write(tmp_path / "plane.fits")
    assert FocalPlane.load(tmp_path / "plane.fits").site == "LCO"
    table = tmp_path / "field.csv"
    table.write_text("positioner,x,y,site\nR0C2,0,10,lco\nR0C3,22.4,10,LCO\n")
    assert np.isfinite(Targets.read(table).solve(plane).goal[3:5]).all()
    table.write_text("positioner,x,y,site\nR0C2,0,10,LCO\nR0C3,22.4,10,APO\n")
    with pytest.raises(TargetError, match="line 3: site is APO, and LCO before"):
        Targets.read(table)


@pytest.mark.large
def test_disabled_robots_stand_where_the_record_says(tmp_path, small_plane):
    path = record(tmp_path / "a.par", small_plane, POSES, assigned=small_plane.ids[:5], disabled=("R0C1",))
    targets = Targets.read(path)
    assert targets.site == "APO"
    plan = Direct().plan(Problem.from_targets(small_plane, targets, margin=0.1, conflicts="drop"))
    np.testing.assert_allclose(plan.trajectory.at(0.0)[2], POSES[2])
    np.testing.assert_allclose(plan.trajectory.end[2], POSES[2])
    assert plan.outcomes[2] is Outcome.OFFLINE
    assert not len(plan.lost)
    assert any(
        note.startswith(f"disabled in {path}, so offline") and "R0C1 (line" in note for note in plan.problem.notes
    )
    elsewhere = Problem.from_targets(small_plane, targets, start=small_plane.folded, margin=0.1, conflicts="drop")
    plan = Direct().plan(elsewhere)
    assert 2 in plan.lost
    plan.write(tmp_path / "plan.fits")
    assert 2 in Plan.read(tmp_path / "plan.fits").lost


def test_folded_start_inside_a_disabled_arm_is_refused(small_plane):
    towards = np.radians([[180.0, 0.0]])  # across the folded neighbour
    targets = Targets([np.nan], [np.nan], ("R0C3",), angles=towards, disabled=[True])
    with pytest.raises(ProblemError, match=r"cannot be folded beside disabled arms.*'R0C2' and positioner 'R0C3'"):
        Problem.from_targets(small_plane, targets)


@pytest.mark.large
@pytest.mark.parametrize("conflicts", ["raise", "drop"])
@pytest.mark.parametrize("assigned", [0, 1])
def test_of_two_that_touch_the_idle_one_gives_way(tmp_path, small_plane, assigned, conflicts):
    poses = np.radians([[0.0, 5.0], [180.0, 0.0]])
    path = record(tmp_path / "a.par", small_plane, poses, assigned=(small_plane.ids[assigned],))
    plan = Direct().plan(Problem.from_targets(small_plane, Targets.read(path), margin=0.1, conflicts=conflicts))
    plan.write(tmp_path / "plan.fits")
    for each in (plan, Plan.read(tmp_path / "plan.fits")):
        assert each.outcomes[assigned] is Outcome.ARRIVED
        assert str(each).startswith("1 of 1 arrived")
        assert not len(each.lost)
        assert not losses(each)
        assert [int(i) for i in each.displaced] == [1 - assigned]
        assert displaced(each)[0].startswith(f"idle positioner '{small_plane.ids[1 - assigned]}' ends elsewhere")


def test_a_record_without_any_target_takes_all_as_targets(tmp_path, small_plane):
    targets = Targets.read(record(tmp_path / "a.par", small_plane, POSES))
    assert targets.assigned.all()
    assert "has no fiber on a target" in targets.notes[0]


def test_a_wish_goes_before_a_target_without_priority(small_plane):
    poses = np.radians([[0.0, 5.0], [180.0, 0.0]])
    targets = Targets([np.nan] * 2, [np.nan] * 2, small_plane.ids[:2], [1.0, 0.0], angles=poses, assigned=[False, True])
    assert list(Problem.from_targets(small_plane, targets, conflicts="drop").dropped) == [0]


def test_real_record_on_its_folder_and_elsewhere(calibration, conf_summary, shared_data):
    plane, targets = FocalPlane.load(calibration), Targets.read(conf_summary)
    solution = targets.solve(plane)
    (compared,) = [note for note in solution.notes if "rows were compared" in note]
    assert "of 490 rows were compared: median 0.039 mm, largest 1.276 mm (R-10C3" in compared
    assert "57 rows" in compared
    named = [word for word in solution.named[0].replace(",", " ").split() if word.startswith("R")]
    assert named == ["R-10C3", "R+4C8", "R-3C18", "R+2C3"]
    with pytest.raises(TargetError, match=r"disagree on sdss: median 22\.\d+ mm"):
        targets.solve(FocalPlane.load("sdss"))
    with pytest.raises(TargetError, match="is of APO, but duPontFlatCMM is of LCO"):
        targets.solve(FocalPlane.load(shared_data / "sdss/lco/wok_calibs/duPontFlatCMM"))


def numbered(plane, names):
    """The plane, whose robots have these numbers."""
    return plane.replace(aliases=tuple(map(str, names)))


def test_numbers_of_robots_are_compared(tmp_path, small_plane):
    """A record knows robots by number too: some have been replaced since, but most must be the same."""
    path = record(tmp_path / "a.par", small_plane, POSES, assigned=small_plane.ids[:5])
    text = path.read_text().replace("char holeId[28];", "int positionerId; char holeId[28];")
    for k, id_ in enumerate(small_plane.ids):
        for kind in ("FIBERMAP", "fibermap"):
            text = text.replace(f"{kind} {id_} ", f"{kind} {100 + k} {id_} ")
    path.write_text(text)
    same, some, other = ([*range(100, 107)], [100, 999, *range(102, 107)], [*range(200, 207)])
    targets = Targets.read(path)
    assert targets.second_names == ("100", "101", "102", "103", "104")
    assert not any("others than" in note for note in targets.solve(numbered(small_plane, same)).notes)
    assert not any("others than" in note for note in targets.solve(small_plane).notes)
    (note,) = [note for note in targets.solve(numbered(small_plane, some)).notes if "others than" in note]
    assert note.endswith(f"others than in {small_plane.name}: {small_plane.ids[1]} is 101, now 999")
    with pytest.raises(TargetError, match=r"5 of 5 positioners in .* are others than in .*; another array\?"):
        targets.solve(numbered(small_plane, other))
    assert Targets.read(path, prefer="angles").solve(numbered(small_plane, other)).notes
    state = State.read(path, numbered(small_plane, some))
    assert any("1 of 5 positioners" in note for note in state.notes)
    with pytest.raises(ProblemError, match="5 of 5 positioners"):
        State.read(path, numbered(small_plane, other))
    targets.write(tmp_path / "again.ecsv")
    assert Targets.read(tmp_path / "again.ecsv").second_names == targets.second_names


def test_targets_that_no_positioner_can_have_are_lost_by_name(small_plane):
    plane = small_plane.replace(aliases=("one", *[""] * 6))
    ids = (plane.ids[0], "nobody", "one", plane.ids[2])
    poses = np.radians([[20.0, 150.0], [1.0, 150.0], [30.0, 150.0], [40.0, 150.0]])
    nowhere = [np.nan] * 4
    targets = Targets(nowhere, nowhere, ids, angles=poses, priority=[1, 2, 3, 4], offline=("ghost", plane.ids[6]))
    with pytest.raises(TargetError, match="no positioner 'nobody'"):
        Problem.from_targets(plane, targets)
    problem = Problem.from_targets(plane, targets, conflicts="drop")
    assert np.flatnonzero(problem.has_goal).tolist() == [0, 2]
    np.testing.assert_allclose(problem.goal[[0, 2]], poses[[0, 3]])
    assert problem.priority[2] == 4
    assert not problem.plane.online[6]
    assert [text.split(" was left out: ")[1] for text in problem.left_out] == [
        f"{plane.name} has no positioner 'nobody'; its target is lost",
        f"positioner '{plane.ids[0]}' already has a target in row 1; its target is lost",
    ]
    assert any("no positioner 'ghost'" in note for note in problem.notes)
    with pytest.raises(TargetError, match="no positioner 'x'"):
        Problem.from_targets(plane, Targets([1.0], [1.0], ("x",)), conflicts="drop")
