"""The direct planner beside what never moves: finer lattices, ways of one's own, and solutions made shorter."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan import Obstacle, Outcome
from fiberplan.certificates import proven_unreachable
from fiberplan.focal_plane.neighbours import Neighbourhood, clearances_around
from fiberplan.planners.direct import narrow
from fiberplan.planners.direct import search as search_module
from fiberplan.planners.direct.improving import shorten
from fiberplan.planners.direct.lattice import fewest_steps, make_lattice, refined
from fiberplan.planners.direct.nodes import MOST_BETAS, step_length
from fiberplan.planners.direct.passages import stepwise, way_past_fixed
from fiberplan.planners.direct.paths import FINEST, ON_ITS_WAY
from fiberplan.planners.direct.search import DirectSearch
from fiberplan.planners.shared import threads
from fiberplan.scenes.decisive import row
from fiberplan.scenes.uniform import uniform_field
from fiberplan.tolerances import SLACK, UNDER_LIMIT
from problems import field_to_field, keeps_its_solution_when_interrupted

DEG = np.pi / 180.0


def among_posts(seed: int) -> fp.Problem | None:
    """One arm among six posts that stand at random, some of them close; None where an end touches one."""
    rng = np.random.default_rng(seed)
    angles, far = rng.uniform(0.0, 2.0 * np.pi, 6), rng.uniform(8.0, 24.0, 6)
    posts = tuple(
        Obstacle(f"post {k}", [[r * np.cos(a), r * np.sin(a)]], 1.0)
        for k, (a, r) in enumerate(zip(angles, far, strict=True))
    )
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(obstacles=posts)
    start, goal = rng.uniform((0.0, 0.0), (2.0 * np.pi, np.pi), (2, 2))
    try:
        return fp.Problem(plane, start[None], goal[None], 0.2)
    except fp.ProblemError:
        return None


def rest_of(problem: fp.Problem) -> np.ndarray:
    """(arms, 2) what never moves; the positioners are of no account."""
    rest = np.array(problem.plane.with_obstacles(problem.start))
    rest[: problem.n] = np.nan
    return rest


SCENES = [seed for seed in range(60) if among_posts(seed) is not None]


def test_a_single_arm_is_never_given_up_without_proof():
    """Whatever the posts: it arrives, or it is proven that it cannot; one passage here is too close to call."""
    narrow = undecided = 0
    for seed in SCENES:
        problem = among_posts(seed)
        plan = fp.planners.Direct().plan(problem)
        assert plan.faults() == []
        assert not any("hub" in note for note in plan.notes), seed
        undecided += plan.outcomes[0] is Outcome.DEADLOCKED
        near = Neighbourhood.of(problem.plane, problem.margin)
        search = DirectSearch(problem, near, problem.goal, 6 * DEG, None, 0)
        search.begin()
        search.run(2000, lambda: True)
        narrow += plan.outcomes[0] is Outcome.ARRIVED and search.fineness[0] == ON_ITS_WAY
    assert narrow >= 1, "no scene here needs a way"
    assert undecided <= 1


@pytest.mark.parametrize("seed", SCENES[:20])
def test_a_way_keeps_its_clearance(seed):
    """Looked at afresh, at many more places than the search did; and it begins and ends where it should."""
    problem = among_posts(seed)
    plane, near, rest = problem.plane, Neighbourhood.of(problem.plane, 0.2), rest_of(problem)
    start, goal, limit = problem.start[0], problem.goal[0], 0.2 + SLACK
    way = way_past_fixed(plane, near, rest, 0, start, goal, limit)
    if way is None:
        assert fp.planners.Direct().plan(problem).outcomes[0] is Outcome.INFEASIBLE, "a way was overlooked"
        return
    duration = 0.2
    places = stepwise(plane, near, rest, 0, way, duration, limit)
    for knots in (way, places):
        np.testing.assert_array_equal(knots[[0, -1]], [start, goal])
        steps = np.linspace(0.0, len(knots) - 1.0, 200 * len(knots))
        dense = np.stack([np.interp(steps, np.arange(len(knots)), column) for column in knots.T], axis=1)
        assert clearances_around(plane.arms, near, rest, 0, dense).min() >= limit - 1e-9
    turn = plane.max_speed[0] * duration
    assert np.all(np.abs(np.diff(places, axis=0)) <= turn * (1.0 + 1e-9))
    least = (np.abs(np.diff(way, axis=0)) / plane.max_speed[0]).max(axis=1).sum()
    assert len(places) - 1 <= np.ceil(least / duration) + 0.2 * len(way) + 1


def test_there_is_no_way_through_a_wall():
    wall = tuple(Obstacle(f"post {k}", [[12.0 * np.cos(a), 12.0 * np.sin(a)]], 1.5) for k, a in enumerate((1.4, 4.5)))
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(
        obstacles=wall,
        folded=np.array([[0.3, 0.0]]),
        lower=np.array([[0.0, 0.0]]),
        upper=np.array([[2 * np.pi, 1.0]]),
    )
    near = Neighbourhood.of(plane, 0.0)
    rest = np.array(plane.with_obstacles(plane.folded))
    rest[0] = np.nan
    assert way_past_fixed(plane, near, rest, 0, np.array([0.3, 0.0]), np.array([2.9, 0.0]), SLACK) is None


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("pace", [(2, 2), (4, 2), (3, 3)])
def test_finer_lattices_hold_both_ends_and_respect_speeds(seed, pace):
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    rng = np.random.default_rng(seed)
    plane = plane.replace(max_speed=np.radians(rng.uniform(10.0, 40.0, (plane.n, 2))))
    start, goal = uniform_field(plane, seed), np.array(uniform_field(plane, seed + 50))
    goal[::7] = np.nan
    length = step_length(plane, start, goal, 6 * DEG)
    coarse = make_lattice(plane, start, goal, plane.online, length.longest, 40, length.widest)
    who = np.arange(0, plane.n, 2)
    fine = refined(coarse, plane, who, np.tile(pace, (len(who), 1)), start, goal, length.longest, 40, length.widest)
    for i in range(plane.n):
        for d, nodes in enumerate((fine.alpha, fine.beta)):
            own, most = nodes[i, : fine.size[i, d]], plane.max_speed[i, d] * UNDER_LIMIT * length.longest
            reach = fine.pace[i, d]
            assert np.all(np.diff(own) > 0)
            assert (own[reach:] - own[:-reach]).max(initial=0.0) <= most * (1 + 1e-9)
            assert own[fine.first[i, d]] == start[i, d]
            assert plane.lower[i, d] <= own[0] <= own[-1] <= plane.upper[i, d]
            if np.isfinite(goal[i, d]):
                assert own[fine.last[i, d]] == goal[i, d]
    assert fine.size[:, 1].max() <= MOST_BETAS
    np.testing.assert_array_equal(fine.pace[1::2], 1)
    assert np.all(fine.size[who, 0] >= 1.5 * coarse.size[who, 0])


@pytest.mark.parametrize("fineness", range(FINEST + 1))
def test_any_fineness_solves_a_field(fineness):
    problem = field_to_field(1.0, rings=2)
    near = Neighbourhood.of(problem.plane, problem.margin)
    search = DirectSearch(problem, near, problem.goal, 6 * DEG, None, 0)
    search.refine(np.arange(problem.n), fineness)
    search.begin()
    assert search.run(10_000, lambda: True)
    steps = np.diff(search.lattice.path[: problem.n], axis=1)
    assert np.all(np.abs(steps) <= problem.plane.max_speed[:, None] * search.duration)
    np.testing.assert_array_equal(search.lattice.path[: problem.n, search.steps], problem.goal)


def test_a_solution_is_made_as_short_as_it_can_be():
    problem = field_to_field(0.0, rings=2)
    near = Neighbourhood.of(problem.plane, problem.margin)
    search = DirectSearch(problem, near, problem.goal, 6 * DEG, None, 0)
    search.begin()
    least = search.steps
    search.lengthen(2 * least)
    search.place(np.arange(problem.n))
    assert search.run(10_000, lambda: True)
    assert search.steps == 2 * least
    shorten(search, lambda: True)
    assert search.steps < 1.2 * least
    assert search.touching == 0


def test_nobody_is_given_fewer_steps_than_the_nodes_on_the_way(monkeypatch):
    """Also where it is not known that anyone needs as many, as of one that went elsewhere."""
    problem = field_to_field(0.0, rings=2)
    search = DirectSearch(problem, Neighbourhood.of(problem.plane, 0.0), problem.goal, 6 * DEG, None, 0)
    search.begin()
    fewest = search.steps
    assert fewest_steps(search.lattice) == fewest
    search.lengthen(2 * fewest)
    search.place(np.arange(problem.n))
    assert search.run(10_000, lambda: True)
    search.least_steps, tried, real = 1, [], search.cut
    monkeypatch.setattr(search, "cut", lambda best, steps: tried.append(steps) or real(best, steps))
    shorten(search, lambda: True)
    assert all(steps >= fewest for steps in tried)
    np.testing.assert_array_equal(search.lattice.path[: problem.n, 0], problem.start)
    np.testing.assert_array_equal(search.lattice.path[: problem.n, search.steps], problem.goal)


def test_a_solution_is_kept_when_making_it_shorter_is_interrupted(monkeypatch):
    problem = field_to_field(0.0, rings=2)
    near = Neighbourhood.of(problem.plane, problem.margin)
    search = DirectSearch(problem, near, problem.goal, 6 * DEG, None, 0)
    search.begin()
    search.lengthen(2 * search.steps)
    search.place(np.arange(problem.n))
    assert search.run(10_000, lambda: True)
    assert keeps_its_solution_when_interrupted(search, monkeypatch)


OUT, BESIDE = np.radians(
    [[125.94963968, 97.54481611], [23.33698225, 19.40880168]]
)  # of a pocket beside a fiducial, in it


def pocketed(*others):
    """The SDSS-V arm that a fiducial shuts in at a margin of 1 mm, and others."""
    sdss = fp.FocalPlane.load("sdss")
    plane = sdss.subset([sdss.index_of(name) for name in ("R-1C19", *others)])
    start = np.array(plane.folded)
    start[0] = BESIDE
    return plane, start


def test_a_goal_where_a_shut_in_arm_stands_is_given_up_at_once():
    """Both losses are proven; the arm in the way is not held, and nobody's time is searched for longer and longer."""
    plane, start = pocketed("R-1C20")
    goal = np.array([OUT, np.radians([149.50404097, 8.34104848])])
    plan = fp.planners.Direct().plan(fp.Problem(plane, start, goal, 1.0))
    assert plan.outcomes == (Outcome.INFEASIBLE, Outcome.INFEASIBLE)
    assert plan.blockers[1] == (0,)
    assert plan.makespan == 0.0
    assert plan.faults() == []


def test_another_elbow_is_taken_where_the_first_is_out_of_reach():
    plane, start = pocketed()
    start[0] = OUT
    farther = np.radians([[[340.0, 100.0]]])  # than the goal in the pocket, which is tried first
    for alternatives, arrives in ((None, False), (farther, True)):
        plan = fp.planners.Direct().plan(fp.Problem(plane, start, BESIDE[None], 1.0, alternatives=alternatives))
        assert (plan.outcomes == (Outcome.ARRIVED,)) == arrives
        assert plan.faults() == []


@pytest.mark.small
def test_a_goal_that_is_not_taken_leaves_the_bound_as_it_was(monkeypatch):
    """A way to another configuration that takes too long would otherwise keep solutions from being made shorter."""
    plane, start = pocketed()
    start[0] = OUT
    others = np.radians([[[340.0, 100.0]]])
    problem = fp.Problem(plane, start, BESIDE[None], 1.0, alternatives=others)
    search = DirectSearch(problem, Neighbourhood.of(plane, 1.0), problem.goal, 6 * DEG, None, 0)
    before = search.least_steps

    def late(paths, who):
        paths.least_steps = paths.most_steps
        return np.array([paths.most_steps + 1])

    monkeypatch.setattr(narrow, "steps_past_fixed", late)
    assert narrow.goes_elsewhere(search, 0) == -1
    assert search.least_steps == before
    np.testing.assert_array_equal(search.goal, problem.goal)


def test_off_its_way_a_positioner_has_a_lattice_as_if_it_had_never_been_on_one():
    problem = field_to_field(1.0, rings=1)
    search = DirectSearch(problem, Neighbourhood.of(problem.plane, 1.0), problem.goal, 6 * DEG, None, 0)
    fresh = DirectSearch(problem, Neighbourhood.of(problem.plane, 1.0), problem.goal, 6 * DEG, None, 0)
    fresh.change_fineness(np.array([0]), np.array([FINEST]))
    parts = np.linspace(0.0, 1.0, 2 * search.steps)[:, None]
    search.put_on(0, problem.start[0] + parts * (problem.goal[0] - problem.start[0]))
    assert search.take_off_ways(np.array([0]))
    for name in ("alpha", "beta", "way", "size", "pace", "first", "last"):
        mine, theirs = getattr(search.lattice, name)[0], getattr(fresh.lattice, name)[0]
        used = np.s_[: theirs.size - np.isnan(theirs).sum()] if theirs.ndim else ()
        np.testing.assert_array_equal(mine[used], theirs[used])
    for paths in (search, fresh):
        paths.place(np.array([0]), alone=True)
    np.testing.assert_array_equal(search.lattice.path[0, 0], problem.start[0])
    np.testing.assert_array_equal(search.lattice.path[0], fresh.lattice.path[0])


@pytest.mark.small
def test_another_configuration_is_taken_once_where_a_pair_gets_stuck():
    start, goal = np.radians([[90.0, 120.0], [90.0, 120.0]]), np.radians([[120.0, 120.0], [60.0, 120.0]])
    others = np.full((2, 1, 2), np.nan)
    others[1, 0] = np.radians([20.0, 150.0])
    problem = fp.Problem(row(2), start, goal, alternatives=others)
    search = DirectSearch(problem, Neighbourhood.of(problem.plane, 0.0), problem.goal, 20 * DEG, None, 0)
    search.begin()
    pair = np.array([0, 1])
    assert narrow.makes_room(search, pair)
    np.testing.assert_array_equal(search.goal, [goal[0], others[1, 0]])
    assert search.run(1000, lambda: True)
    np.testing.assert_array_equal(search.lattice.path[:2, -1], search.goal)
    assert not narrow.makes_room(search, pair)


def test_placed_alone_by_any_number_of_threads(monkeypatch):
    problem = field_to_field(1.0, rings=3)
    found = []
    for cores in (1, 2, 5):
        monkeypatch.setattr(threads, "_LEAST", 5)
        monkeypatch.setattr(threads, "cores", lambda cores=cores: cores)
        search = DirectSearch(problem, Neighbourhood.of(problem.plane, 1.0), problem.goal, 6 * DEG, None, 0)
        search.begin()
        found.append(search.lattice.path)
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(found[2], found[0])
    assert np.any(found[0][:, 0] != found[0][:, -1])


def test_who_only_seems_to_get_past_what_never_moves_gives_up_before_all_get_more_time(monkeypatch):
    """A path that is clear at its nodes alone: its lattice gets finer, then a proof is asked for."""
    monkeypatch.setattr(search_module, "steps_past_fixed", lambda paths, who: np.full(len(who), paths.steps))
    barred = 0
    for seed in range(40):
        problem = among_posts(seed)
        if problem is None or not proven_unreachable(problem.plane, 0, problem.start, problem.goal[0], problem.margin):
            continue
        barred += 1
        near = Neighbourhood.of(problem.plane, problem.margin)
        search = DirectSearch(problem, near, problem.goal, 6 * DEG, None, 0)
        search.begin()
        least = search.steps
        assert search.run(10_000, lambda: True)
        assert set(search.given_up) == {0}
        assert all(post > 0 for post in search.given_up[0])
        assert search.steps == least
    assert barred > 2
