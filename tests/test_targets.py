import numpy as np
import pytest
from astropy import units as u
from astropy.coordinates import SkyCoord
from astropy.table import QTable, Table
from hypothesis import given, settings
from hypothesis import strategies as st

from fiberplan.errors import TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.inverse_kinematics import solutions
from fiberplan.io.states import read_state
from fiberplan.problem import Problem, Targets
from fiberplan.tolerances import ARRIVAL

pytestmark = pytest.mark.small

angle = st.floats(-np.pi, np.pi)


def one_arm(l1, offset, zero, lower=(0.0, -np.pi), upper=(2 * np.pi, np.pi)):
    plane = FocalPlane.hexagonal(0, 10.0)
    return plane.replace(
        base=np.array([[3.0, -2.0]]),
        length=np.array([l1]),
        fiber_offsets={"fiber": np.array([offset])},
        zero=np.array([zero]),
        lower=np.array([lower]),
        upper=np.array([upper]),
        folded=np.array([lower]),
    )


@pytest.mark.large
@settings(deadline=None, max_examples=200)
@given(st.floats(0.5, 20.0), st.floats(0.5, 20.0), st.floats(-2.0, 2.0), angle, angle, st.floats(0.0, 6.28), angle)
def test_inverse_kinematics_round_trip(l1, along, across, zero_a, zero_b, alpha, beta):
    plane = one_arm(l1, (along, across), (zero_a, zero_b))
    point = plane.fibers(np.array([[alpha, beta]]))
    bend = np.sin(beta + zero_b + np.arctan2(across, along))
    for parity in (0, 1, -1):
        found = solutions(plane, np.array([0]), point, plane.fiber, np.array([parity]))[0]
        found = found[np.isfinite(found[:, 0])]
        for row in found:
            at_an_edge = ((row == plane.lower[0]) | (row == plane.upper[0])).any()  # which takes in what is ARRIVAL off
            assert np.hypot(*(plane.fibers(row[None]) - point)[0]) < (ARRIVAL if at_an_edge else 2e-6)
            assert (row >= plane.lower[0]).all()
            assert (row <= plane.upper[0]).all()
        if abs(bend) > 1e-3 and (parity == 0 or parity == np.sign(bend)):
            nearest = np.abs(np.exp(1j * found) - np.exp(1j * np.array([alpha, beta]))).max(axis=1).min()
            assert nearest < 1e-6


@pytest.mark.parametrize("end", [10.0, 200.0])
def test_a_table_with_three_decimals_at_the_end_of_alpha(end):
    """There a rounded place takes alpha out of its range: most where beta moves the fiber across, not along."""
    lower, upper = np.radians([[10.0, 0.0], [200.0, 180.0]])
    plane = one_arm(7.4, (15.0, 0.0), (0.0, 0.0), lower, upper)
    angles = np.radians([[end, beta] for beta in np.linspace(1.0, 179.0, 179)])
    points = np.concatenate([plane.fibers(row[None]) for row in angles])
    who, fiber, right = np.zeros(179, int), np.tile(plane.fiber, (179, 1)), np.ones(179)
    rounded = np.round(points, 3)
    found = solutions(plane, who, rounded, fiber, right)[:, 0]
    reached = np.concatenate([plane.fibers(row[None]) for row in found])
    assert np.hypot(*(reached - rounded).T).max() <= ARRIVAL
    elbows = np.concatenate([plane.elbows(row[None]) for row in angles])
    along = (points - elbows) / 15.0 * 1.1 * ARRIVAL
    lost = [np.isnan(solutions(plane, who, points + step, fiber, right)[:, 0, 0]) for step in (along, -along)]
    assert (lost[0] ^ lost[1]).all()  # one side of where the end of alpha leads to is too far


def test_both_parities_are_found_and_told_apart():
    plane = one_arm(8.0, (17.0, 0.0), (0.0, 0.0))
    point = plane.base[0] + [12.0, 15.0]
    goals = {}
    for parity in (1, -1):
        solution = Targets([point[0]], [point[1]], ("R0C1",), parity=[parity]).solve(plane)
        goals[parity] = solution.goal[0]
        assert np.sign(solution.goal[0, 1]) == parity
    either = Targets([point[0]], [point[1]], ("R0C1",)).solve(plane)
    both = {tuple(either.goal[0]), tuple(either.alternatives[0, 0])}
    assert both == {tuple(goal) for goal in goals.values()}


def test_left_parity_in_a_range_beyond_half_a_turn():
    plane = one_arm(8.0, (17.0, 0.0), (0.0, 0.0), lower=(-np.pi, 0.0), upper=(np.pi, np.radians(330)))
    goal = Targets([15.0], [13.0], ("R0C1",), parity=[-1]).configuration(plane)
    assert np.radians(180) < goal[0, 1] < np.radians(330)
    np.testing.assert_allclose(plane.fibers(goal), [[15.0, 13.0]], atol=1e-9)


def test_whole_turns_are_alternatives():
    plane = one_arm(8.0, (17.0, 0.0), (0.0, 0.0), lower=(-2 * np.pi, 0.0), upper=(2 * np.pi, np.pi))
    solution = Targets([15.0], [13.0], ("R0C1",)).solve(plane)
    assert solution.alternatives.shape == (1, 1, 2)
    assert abs(solution.goal[0, 0] - solution.alternatives[0, 0, 0]) == pytest.approx(2 * np.pi)


def test_quickest_from_folded_is_the_default_and_ties_go_right():
    plane = one_arm(5.0, (5.0, 0.0), (0.0, 0.0), lower=(-np.pi, -np.pi), upper=(np.pi, np.pi))
    point = plane.fibers(np.array([[0.5, 1.0]]))[0]
    quick = plane.replace(folded=np.array([[1.5, -1.0]]))
    assert Targets([point[0]], [point[1]], ("R0C1",)).solve(quick).goal[0, 1] == pytest.approx(-1.0)
    mirrored = plane.replace(folded=np.array([[0.0, 0.0]]))  # target on the x axis: the two solutions mirror each other
    assert Targets([mirrored.base[0, 0] + 6.0], [mirrored.base[0, 1]], ("R0C1",)).solve(mirrored).goal[0, 1] > 0


@pytest.mark.parametrize(
    ("distance", "reachable"),
    [(22.4, True), (22.4 + 9e-4, True), (22.4 + 1.1e-3, False), (7.6 - 9e-4, True), (7.6 - 1.1e-3, False)],
)
def test_edge_of_the_annulus(small_plane, distance, reachable):
    x, y = small_plane.base[3] + [distance, 0.0]
    solution = Targets([x], [y], (small_plane.ids[3],)).solve(small_plane)
    assert (3 not in solution.unreachable) == reachable
    if reachable:
        assert np.hypot(*(small_plane.fibers(solution.goal)[3] - [x, y])) < ARRIVAL


def test_equal_arms_reach_their_own_base():
    plane = one_arm(5.0, (5.0, 0.0), (0.0, 0.0))
    goal = Targets([3.0], [-2.0], ("R0C1",)).configuration(plane)
    np.testing.assert_allclose(np.abs(goal), [[plane.folded[0, 0], np.pi]])


def test_named_fiber_goes_to_the_target(small_plane):
    plane = small_plane.replace(fiber_offsets={"fiber": [15.0, 0.0], "boss": [14.0, -0.4]})
    point = plane.base[:2] + np.array([10.0, 4.0])
    targets = Targets(*point.T, plane.ids[:2], fiber=("boss", ""))
    goal = targets.configuration(plane)
    np.testing.assert_allclose(plane.fibers(goal, "boss")[0], point[0], atol=1e-9)
    np.testing.assert_allclose(plane.fibers(goal)[1], point[1], atol=1e-9)
    with pytest.raises(TargetError, match=r"row 1.*no fiber 'ap'; it has fiber, boss"):
        Targets(*point.T, plane.ids[:2], fiber=("ap", "")).solve(plane)


def test_commanded_angles_win(small_plane):
    angles = np.array([[1.0, 2.0], [np.nan, np.nan]])
    point = small_plane.base[:2] + np.array([10.0, 4.0])
    goal = Targets(*point.T, small_plane.ids[:2], angles=angles, prefer="angles").configuration(small_plane)
    np.testing.assert_array_equal(goal[0], [1.0, 2.0])
    np.testing.assert_allclose(small_plane.fibers(goal)[1], point[1], atol=1e-9)
    assert np.isnan(goal[2:]).all()


def test_unreachable_targets_are_named_with_distance_and_reach(small_plane):
    targets = Targets([100.0], [0.0], ("R0C2",), source="field.csv", rows=("line 3",))
    with pytest.raises(
        TargetError, match=r"field.csv: out of reach: positioner 'R0C2': its target in line 3 is 100.000 mm"
    ):
        targets.configuration(small_plane)
    assert "reach 7.600 to 22.400 mm" in targets.solve(small_plane).unreachable[3]


def test_reachable_but_for_the_joint_ranges(small_plane):
    plane = small_plane.replace(upper=np.tile([0.1, np.pi], (7, 1)))
    with pytest.raises(TargetError, match="no elbow solution that is allowed"):
        Targets([-10.0], [-5.0], ("R0C2",)).configuration(plane)


@pytest.mark.parametrize("suffix", ["ecsv", "fits", "csv"])
def test_tables_with_units(tmp_path, small_plane, suffix):
    path = tmp_path / f"field.{suffix}"
    if suffix == "csv":
        path.write_text("# x: cm\n# made for a test\n\npositioner,x,y [um],priority\nR0C2,1.2,5000,3\n")
    else:
        columns = [["R0C2"], [1.2] * u.cm, [5000.0] * u.um, [3]]
        Table(columns, names=["positioner", "x", "y", "priority"]).write(path)
    targets = Targets.read(path)
    assert targets.positioner == ("R0C2",)
    np.testing.assert_allclose([targets.x[0], targets.y[0], targets.priority[0]], [12.0, 5.0, 3.0])
    np.testing.assert_allclose(small_plane.fibers(targets.configuration(small_plane))[3], [12.0, 5.0])


def test_arrays_from_fits_are_native_and_read_only(tmp_path, small_plane):
    path = tmp_path / "field.fits"
    Table({"positioner": ["R0C2"], "x": [12.0], "y": [5.0]}).write(path)
    targets = Targets.read(path)
    solution = targets.solve(small_plane)
    for array in (targets.x, targets.y, targets.priority, targets.angles, solution.goal, solution.alternatives):
        assert array.dtype == np.float64
        assert array.dtype.isnative
        assert not array.flags.writeable


def test_angles_in_a_table_are_degrees_and_parities_words(tmp_path, small_plane):
    path = tmp_path / "field.csv"
    path.write_text("positioner,x,y,alpha,beta,parity\nR0C2,12,5,90,45,left\nR0C1,,,,,\n")
    with pytest.raises(TargetError, match="line 3: x is empty"):
        Targets.read(path)
    path.write_text("positioner,x,y,alpha,beta,parity\nR0C2,12,5,90,45,left\nR0C1,-20,5,,,right\n")
    targets = Targets.read(path)
    np.testing.assert_allclose(targets.angles[0], np.radians([90, 45]))
    np.testing.assert_array_equal(targets.commanded, [True, False])
    np.testing.assert_array_equal(targets.parity, [-1, 1])


def test_problem_from_targets_drops_the_unreachable(small_plane):
    targets = Targets([100.0, -22.4], [0.0, 15.0], ("R0C2", "R0C1"), priority=[2.0, 3.0])
    with pytest.raises(TargetError, match="out of reach"):
        Problem.from_targets(small_plane, targets)
    problem = Problem.from_targets(small_plane, targets, conflicts="drop")
    assert "out of reach" in problem.dropped[3].cause
    np.testing.assert_array_equal(problem.has_goal, [False, False, True, False, False, False, False])
    assert problem.priority[3] == 2.0


def test_unknown_positions_are_offline_where_the_start_says_or_folded(small_plane):
    targets = Targets([-22.4], [15.0], ("R0C1",), offline=("R+1C1", "R+1C2"), source="design")
    start = small_plane.folded.copy()
    start[5] = 0.1, 3.0
    start[6] = np.nan
    problem = Problem.from_targets(small_plane, targets, start=start)
    np.testing.assert_array_equal(np.flatnonzero(~problem.plane.online), [5, 6])
    np.testing.assert_array_equal(problem.start[5:], [[0.1, 3.0], small_plane.folded[6]])
    assert len(problem.notes) == 2
    assert "'R+1C1'" in problem.notes[0]
    assert "where the start says" in problem.notes[0]
    assert "folded, at alpha 0, beta 180 deg" in problem.notes[1]


def test_start_from_a_table_and_from_a_plan(tmp_path, small_plane, small_plan):
    path = tmp_path / "start.csv"
    rows = [f"{id_},{10 * k},170" for k, id_ in enumerate(small_plane.ids)]
    path.write_text("\n".join(["positioner,alpha,beta", *rows[::-1]]))
    start = read_state(path, small_plane).angles
    np.testing.assert_allclose(np.degrees(start), [[10 * k, 170] for k in range(7)])
    small_plan.write(tmp_path / "plan.fits")
    np.testing.assert_array_equal(read_state(tmp_path / "plan.fits", small_plane).angles, small_plan.trajectory.end)


def test_observed_design(calibration, conf_summary):
    plane, targets = FocalPlane.load(calibration), Targets.read(conf_summary)
    solution = targets.solve(plane)
    assert np.isfinite(solution.goal[:, 0]).sum() == len(targets) == 490
    assert len(targets.offline) == 10
    who = targets.indices(plane)
    residual = np.hypot(*(plane.fibers(solution.goal)[who] - np.stack([targets.x, targets.y], axis=1)).T)
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(0.16, abs=0.01)
    assert np.median(residual) == pytest.approx(0.04, abs=0.005)


def test_tables_with_more_than_columns(tmp_path):
    table = QTable({"positioner": ["R0C2", "R0C1"], "x": [1.0, 2.0] * u.cm, "y": [3.0, 4.0] * u.mm})
    table["sky"] = SkyCoord([1, 2] * u.deg, [3, 4] * u.deg)
    table.write(tmp_path / "field.ecsv")
    np.testing.assert_allclose(Targets.read(tmp_path / "field.ecsv").x, [10.0, 20.0])
    (tmp_path / "field.dat").write_text("positioner x y\nR0C2 12 5\n")
    assert Targets.read(tmp_path / "field.dat").positioner == ("R0C2",)
