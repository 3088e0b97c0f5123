"""Sabater2018's planner: the search along one path, the decisive scenes, and what it asks of arms."""

import dataclasses

import numpy as np
import pytest

from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion.moves import moves, start_stops
from fiberplan.plan import Outcome
from fiberplan.planners import PLANNERS, PrioritizedRoadmap
from fiberplan.planners.prioritized_roadmap.edge_search import search
from fiberplan.planners.prioritized_roadmap.motions import Motion
from fiberplan.planners.prioritized_roadmap.roadmap import Path, cells, middle_edges, paths
from fiberplan.planners.prioritized_roadmap.run import Search
from fiberplan.planners.prioritized_roadmap.step_checks import Timetable
from fiberplan.problem import Problem
from fiberplan.scenes.assigned import assignment_plan
from fiberplan.scenes.uniform import uniform_field
from fiberplan.tolerances import SLACK
from references import make_plane

DT = 1.0
HALF = np.radians(180.0)


@pytest.fixture(scope="module")
def miradas():
    return FocalPlane.load("miradas")


def two_arms(apart=18.0):
    """Two arms of a 10 mm capsule on no first link, that meet between their bases."""
    body = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 0.5)
    return make_plane([[0.0, 0.0], [apart, 0.0]], (body,), length=0.0, max_speed=0.2)


def table(plane, poses, limit=SLACK, looks=20, quiet=None):
    tally = np.zeros(plane.n + 2, np.int64)
    until = np.full(plane.n, poses.shape[1])
    quiet = poses.shape[1] - 1 if quiet is None else quiet
    return Timetable(poses, until, np.array([1]), limit, looks, quiet, tally)


def straight(start, end, steps):
    way = np.linspace(start, end, steps + 1)
    return Path(way, np.zeros(steps + 1, bool), float(steps), 0)


def run_edge(plane, poses, path, most_stops, looks=20, begin=(0, 0, 0, 0)):
    steps, stops, _ = search(
        plane.arms, table(plane, poses, looks=looks), 0, path.configurations, path.vertex, most_stops, begin, -1, False
    )
    return steps, stops


SWEEP = [0, 5, 6, 7, 9, 11, 16, 30], [50, 0, 20, -70, 35, -70, -100, -100]  # [steps], [deg] from facing the arm


def fig10(most_stops, looks=20):
    """One edge, one obstacle that sweeps across it three times; how often may the arm stop and start?"""
    plane = two_arms(apart=15.0)
    poses = np.zeros((2, 31, 2))
    poses[1, :, 0] = HALF + np.radians(np.interp(np.arange(31), *SWEEP))
    path = straight([np.radians(90.0), 0.0], [np.radians(-90.0), 0.0], 10)
    return *run_edge(plane, poses, path, most_stops, looks), path


@pytest.mark.parametrize(("limit", "stops"), [(30, 4), (2, 2), (0, 0)])
def test_one_edge_one_moving_obstacle_three_stop_limits(limit, stops):
    """Fig. 10 in kind: 4 start-stops without a limit, 2 with a limit of 2, and none with 0."""
    steps, counted, path = fig10(limit)
    assert counted == stops
    motion = Motion(path, steps, counted)
    assert motion.state(motion.arrival)[1] == stops  # the search and an independent count agree
    assert steps[-1] == 10
    assert np.abs(np.diff(steps)).max() == 1


def test_without_start_stops_all_waiting_comes_first():
    """Fig. 10: nine waits, then forward without a pause."""
    steps, _, _ = fig10(0)
    np.testing.assert_array_equal(steps, np.concatenate([np.zeros(9, int), np.arange(11)]))


def test_no_motion_where_the_goal_is_never_free():
    plane = two_arms(apart=15.0)
    poses = np.zeros((2, 21, 2))
    poses[1, :, 0] = HALF
    steps, _ = run_edge(plane, poses, straight([1.5, 0.0], [0.0, 0.0], 5), 20)
    assert not len(steps)


def test_vertices_cost_a_stop_and_waiting_at_them_nothing():
    plane = two_arms(apart=100.0)
    poses = np.zeros((2, 31, 2))
    way = straight([0.0, 0.0], [1.0, 0.0], 6)
    vertex = np.zeros(7, bool)
    vertex[[2, 4]] = True
    three_edges = Path(way.configurations, vertex, 6.0, 2)
    assert not len(run_edge(plane, poses, three_edges, 1)[0])  # two vertices are two start-stops
    steps, stops = run_edge(plane, poses, three_edges, 2)
    assert stops == 2
    assert len(steps) == 7
    waiting = Motion(three_edges, np.array([0, 0, 1, 2, 2, 2, 3, 4, 5, 6]), 2)
    assert waiting.state(9)[1] == 2
    stopped = Motion(three_edges, np.array([0, 1, 1, 2, 3, 4, 5, 6]), 3)
    assert stopped.state(7)[1] == 3  # on the way it costs one more


def test_arrived_arms_stay_safe_until_all_have_arrived():
    """The goal is free when the arm could first get there, but someone comes by later: it arrives after them."""
    plane = two_arms(apart=15.0)
    poses = np.zeros((2, 31, 2))
    poses[1, :, 0] = HALF + np.radians(80.0) * np.interp(np.arange(31), [0, 8, 12, 16, 30], [1, 1, 0, -1, -1])
    steps, _ = run_edge(plane, poses, straight([1.5, 0.0], [0.0, 0.0], 4), 30)
    assert len(steps) - 1 > 12
    clear = poses[1, len(steps) - 1 :, 0]
    assert np.all(np.abs(clear - HALF) > np.radians(20.0))


def test_pair_checks_are_counted_as_in_the_paper(miradas):
    """An unobstructed arm costs 60 n + 2 for every arm before it, n its steps."""
    goal = assignment_plan(miradas, 3, margin=1.0).configuration(miradas)
    problem = Problem(miradas, miradas.folded, goal, 1.0)
    found = PrioritizedRoadmap(orders=1).search(problem)
    done = found.run()
    clear = 0
    for before, (i, motion) in enumerate(done.motions.items()):
        straight_on = not motion.path.through and motion.arrival == len(motion.path.vertex) - 1
        if straight_on and motion.path.estimate == found.roadmap(i, goal[i])[0].estimate:
            assert done.checks[i] == before * (60 * motion.arrival + 2)
            clear += 1
    assert clear > 5
    assert sum(done.checks.values()) == found.checks


def test_roadmap_is_the_papers(miradas):
    """Cells outside the zone of avoidance, disjoint middle edges, paths by estimate and none too long."""
    points = cells(miradas, 0, (8, 6))
    assert 0 < len(points) < 48
    assert not any(miradas.in_avoidance(np.tile(point, (12, 1)))[0] for point in points)
    pairs = middle_edges(len(points), 24, np.random.default_rng(0))
    assert len(np.unique(pairs)) == pairs.size
    goal = assignment_plan(miradas, 0, margin=1.0).configuration(miradas)[0]
    found = paths(miradas, 0, miradas.folded[0], goal, points, pairs, 6.0, 19)
    times = [path.estimate for path in found]
    assert times == sorted(times)
    assert times[-1] < 120.0
    assert {path.through for path in found} >= {0, 1}
    for path in found:
        speed = np.abs(np.diff(path.configurations, axis=0)) / 6.0
        assert np.all(speed <= miradas.max_speed[0])


@pytest.mark.parametrize("looks", [20, 0])
def test_continuous_and_sampled_checks_agree_on_what_is_safe(looks):
    steps, stops, path = fig10(0, looks)
    assert len(steps)
    assert stops == 0
    assert steps[-1] == len(path.vertex) - 1


def mirrored(seed, plane, **settings):
    goals = [assignment_plan(plane, s, margin=1.0).configuration(plane) for s in (seed, seed + 1)]
    problem = Problem(plane, goals[0], goals[1], 1.0)
    return PrioritizedRoadmap(**settings).plan(problem)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "settings",
    [
        {"orders": 1},
        {"orders": 4, "garages": True, "continuous": True, "early_abort": True},
        {"orders": 2, "varying": True, "aside": True, "max_stops": 2, "early_abort": True},
    ],
)
def test_probe_arms_move_from_plan_to_plan(seed, settings, miradas):
    """Certified, start-stops within the limit by an independent count, in time, and deterministic."""
    plan = mirrored(10 * seed, miradas, **settings)
    assert plan.faults() == []
    assert start_stops(plan.trajectory).max() <= settings.get("max_stops", 1)
    assert plan.makespan < 120.0
    assert len(plan.having(Outcome.ARRIVED)) >= (12 if settings["orders"] == 4 else 9)
    again = mirrored(10 * seed, miradas, **settings)
    np.testing.assert_array_equal(again.trajectory.angles, plan.trajectory.angles)


def goal_conflict():
    """The second arm's way leads over where the first wants to be; who is longest under way goes first."""
    plane = two_arms(apart=15.0)
    start = np.array([[0.6, 0.0], [HALF - 1.2, 0.0]])
    goal = np.array([[0.0, 0.0], [HALF + 0.9, 0.0]])
    return Problem(plane, start, goal, 0.1)


def en_route_conflict():
    """Both sweep through the place between them, and neither ends there."""
    plane = two_arms(apart=15.0)
    start = np.array([[1.0, 0.0], [HALF - 1.0, 0.0]])
    goal = np.array([[-1.0, 0.0], [HALF + 1.0, 0.0]])
    return Problem(plane, start, goal, 0.1)


@pytest.mark.parametrize("scene", [goal_conflict, en_route_conflict])
def test_conflicts_are_resolved_by_waiting(scene):
    problem = scene()
    turn = problem.goal - problem.start
    at_once = [problem.start + np.clip(turn, -0.2 * t, 0.2 * t) for t in np.linspace(0, 12, 200)]  # at full speed
    assert min(problem.plane.clearance(angles).min() for angles in at_once) < 0.0
    plan = PrioritizedRoadmap(dt=0.5, collision_dt=0.05, max_time=60.0).plan(problem)
    assert plan.faults() == []
    assert len(plan.having(Outcome.ARRIVED)) == 2
    assert start_stops(plan.trajectory).max() <= 1


def blocked_for_good():
    """The first in order wants to stay where the second must pass, and the order is not tried the other way round."""
    plane = two_arms(apart=15.0)
    start = np.array([[0.0, 0.0], [HALF - 2.6, 0.0]])
    goal = np.array([[0.0, 0.0], [HALF + 1.2, 0.0]])
    return Problem(plane, start, goal, 0.1)


def only_grid_point(monkeypatch):
    """Detours of one arm lead over one place, so that the other cannot go round the far side."""
    monkeypatch.setattr(
        "fiberplan.planners.prioritized_roadmap.run.cells",
        lambda plane, i, grid: np.array([[1.5, 0.0]]) if i == 0 else np.zeros((0, 2)),
    )


@pytest.mark.parametrize(("option", "word"), [("aside", "P0 moves aside for P1"), ("varying", "P0 yields from")])
def test_who_has_priority_can_make_room(option, word, monkeypatch):
    """P0 goes first and rests where P1 must pass: as printed P1 is lost; it gets through if P0 makes room."""
    only_grid_point(monkeypatch)
    monkeypatch.setattr(Search, "_longest_first", lambda self, task: [0, 1])
    settings = {"dt": 0.5, "collision_dt": 0.05, "max_time": 60.0, "orders": 1, "max_stops": 2}
    problem = blocked_for_good()
    assert problem.plane.clearance(problem.start).min() > 0.1
    if option == "varying":  # under way already: it waits for P1 on its own path
        start = problem.start.copy()
        start[0] = 1.5, 0.0
        problem = Problem(problem.plane, start, problem.goal, 0.1)
    lost = PrioritizedRoadmap(**settings).plan(problem)
    assert list(lost.lost) == [1]
    assert lost.blockers[1] == (0,)
    assert lost.faults() == []
    plan = PrioritizedRoadmap(**settings, **{option: True}).plan(problem)
    assert not len(plan.lost)
    assert plan.faults() == []
    assert any(word in note for note in plan.notes)
    assert start_stops(plan.trajectory).max() <= 2


def test_early_abort_costs_less_and_finds_the_same(monkeypatch):
    only_grid_point(monkeypatch)
    monkeypatch.setattr(Search, "_longest_first", lambda self, task: [0, 1])
    counts = []
    for early in (False, True):
        settings = PrioritizedRoadmap(dt=0.5, collision_dt=0.05, max_time=60.0, orders=1, early_abort=early)
        found = settings.search(blocked_for_good())
        found.run()
        assert list(found.lost) == [1]
        counts.append(found.checks)
    assert counts[1] < counts[0]


def test_same_planner_on_37_alpha_beta_positioners():
    plane = FocalPlane.load("sayres2021")
    middle = np.argsort(np.hypot(*plane.base.T), kind="stable")[:37]
    rows = {f.name: getattr(plane, f.name) for f in dataclasses.fields(plane)}
    cut = {k: v[middle] for k, v in rows.items() if isinstance(v, np.ndarray) and v.shape[:1] == (plane.n,)}
    small = plane.replace(ids=tuple(plane.ids[i] for i in middle), fiber_offsets={"fiber": plane.fiber[middle]}, **cut)
    problem = Problem(small, small.folded, uniform_field(small, 1))
    plan = PrioritizedRoadmap(dt=0.5, collision_dt=0.05, max_time=25.0, continuous=True, orders=4).plan(problem)
    assert plan.faults() == []
    assert len(plan.having(Outcome.ARRIVED)) >= 35
    assert start_stops(plan.trajectory).max() <= 1


@pytest.mark.small
@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"dt": 0.0}, "dt must be a time above 0 s, got 0.0"),
        ({"collision_dt": 7.0}, "collision_dt must be at most the step, 6 s, got 7.0"),
        ({"dt": 130.0}, "dt must be less than max_time, 120 s, got 130.0"),
        ({"grid": "8"}, r"grid must be two counts from 1 to 1000, got \(8,\)"),
        ({"grid": (0, 6)}, "grid must be two counts"),
        ({"max_stops": -1}, "max_stops must be 0 or more, got -1"),
        ({"orders": 0}, "orders must be 1 or more, got 0"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings, words):
    with pytest.raises(ProblemError, match=words):
        PrioritizedRoadmap(**settings)


@pytest.mark.small
def test_steps_longer_than_any_edge_are_refused(miradas):
    problem = Problem(miradas, miradas.folded, miradas.folded)
    with pytest.raises(
        ProblemError, match=r"a step of 300 s is longer than the longest edge takes on miradas, 200.000 s"
    ):
        PrioritizedRoadmap(dt=300.0, max_time=1000.0).plan(problem)
    assert PrioritizedRoadmap(grid="4x3").grid == (4, 3)


@pytest.mark.parametrize("name", sorted(set(PLANNERS) - {"prioritized-roadmap"}))
def test_other_planners_refuse_four_bar_arms_in_one_line(name, miradas):
    problem = Problem(miradas, miradas.folded, miradas.folded)
    with pytest.raises(ProblemError, match=rf"{name}.*(four-bar arms|four bars)"):
        PLANNERS[name]().plan(problem)


def test_arms_without_targets_park(miradas):
    goals = assignment_plan(miradas, 0, margin=1.0).configuration(miradas)
    none = np.full_like(goals, np.nan)
    none[:3] = goals[:3]
    plan = PrioritizedRoadmap(orders=2, garages=True).plan(Problem(miradas, goals, none, 1.0))
    assert plan.faults() == []
    assert [plan.outcomes[i] for i in (0, 5)] == [Outcome.ARRIVED, Outcome.NO_TARGET]
    parked = np.abs(plan.trajectory.end[3:] - miradas.folded[3:]).max(axis=1) < 1e-9
    assert parked.sum() >= 7


def test_moves_list_says_what_the_trajectory_does(miradas):
    plan = mirrored(0, miradas, orders=2)
    listed = moves(plan.trajectory)
    turned = np.zeros((12, 2))
    for move in listed:
        turned[move.positioner] += move.duration * np.array(move.speed)
        assert move.duration > 0
        assert np.all(np.abs(move.speed) <= miradas.max_speed[0])
    np.testing.assert_allclose(plan.trajectory.start + turned, plan.trajectory.end, atol=1e-9)
    assert max(move.start + move.duration for move in listed) == pytest.approx(plan.makespan)


def test_neighbourhood_reaches_across_the_bench(miradas):
    assert len(Neighbourhood.of(miradas, 1.0).pairs) == 66
