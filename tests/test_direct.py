"""What the direct planner promises beyond what all planners do: close to the bound, and losses with their causes."""

import itertools

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.arrays import read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.plan import Outcome
from fiberplan.planners.direct import losses as direct_losses
from fiberplan.planners.direct import paths as direct_paths
from fiberplan.planners.direct import planner as direct_planner
from fiberplan.planners.direct import search as direct_search
from fiberplan.planners.direct.repair import place_each, repair
from fiberplan.planners.direct.search import DirectSearch
from fiberplan.planners.direct.settling import settle, stop_here
from fiberplan.scenes.decisive import pinwheel, row
from fiberplan.scenes.uniform import uniform_field
from problems import field_to_field, hexagon

DEG = np.pi / 180.0


@pytest.mark.parametrize("margin", [0.0, 1.0])
def test_straight_is_close_to_the_bound(margin):
    """Everyone arrives, in much less than by way of folded."""
    for seed in range(3):
        problem = field_to_field(margin, rings=5, seed=seed)
        plan = fp.planners.Direct().plan(problem)
        assert plan.faults() == []
        assert len(plan.lost) == 0
        hub = fp.planners.GreedyFold(step=1.0 * DEG).plan(problem)
        assert plan.lower_bound <= plan.makespan < 0.7 * hub.makespan


def test_few_knots_and_no_dithering():
    problem = field_to_field(1.0, rings=5)
    plan = fp.planners.Direct().plan(problem)
    assert len(plan.trajectory.times) < 7 * problem.n
    owner = np.repeat(np.arange(problem.n), np.diff(plan.trajectory.offsets))
    same = owner[1:] == owner[:-1]
    turns = np.diff(plan.trajectory.angles, axis=0)
    reversals = np.zeros((problem.n, 2), int)
    for d in (0, 1):
        for i in range(problem.n):
            own = turns[same & (owner[1:] == i), d]
            signs = np.sign(own[np.abs(own) > 1e-12])
            reversals[i, d] = (signs[1:] != signs[:-1]).sum()
    assert np.median(reversals) <= 1
    assert reversals.max() <= 6


@pytest.mark.small
def test_a_lone_positioner_takes_exactly_its_time():
    """No detour, no rounding up to whole steps."""
    plane = fp.FocalPlane.hexagonal(0, 22.4)
    problem = fp.Problem(plane, np.radians([[10.0, 100.0]]), np.radians([[343.3, 17.7]]))
    plan = fp.planners.Direct().plan(problem)
    assert plan.makespan == pytest.approx(plan.lower_bound, rel=1e-8)
    assert len(plan.trajectory.times) <= 3


@pytest.mark.small
def test_standing_still():
    plane = hexagon()
    plan = fp.planners.Direct().plan(fp.Problem(plane, plane.folded, plane.folded))
    assert plan.makespan == 0.0
    assert set(plan.outcomes) == {Outcome.ARRIVED}
    nobody = fp.planners.Direct().plan(fp.Problem(plane, plane.folded, np.full((plane.n, 2), np.nan)))
    assert nobody.makespan == 0.0
    assert set(nobody.outcomes) == {Outcome.NO_TARGET}


def test_one_without_a_goal_makes_room():
    """It stands across the other's goal; it has to go, anywhere."""
    plane = row(2)
    start = np.radians([[120.0, 60.0], [180.0, 0.0]])
    goal = np.radians([[0.0, 0.0], [np.nan, np.nan]])
    problem = fp.Problem(plane, start, goal)
    plan = fp.planners.Direct().plan(problem)
    assert plan.faults() == []
    assert plan.outcomes == (Outcome.ARRIVED, Outcome.NO_TARGET)
    assert np.abs(plan.trajectory.end[1] - start[1]).max() > 10 * DEG


@pytest.mark.small
def test_one_without_a_goal_stays_where_it_is_in_nobodys_way():
    plane = row(2)
    start = np.radians([[120.0, 60.0], [0.0, 60.0]])
    goal = np.radians([[150.0, 90.0], [np.nan, np.nan]])
    plan = fp.planners.Direct().plan(fp.Problem(plane, start, goal))
    np.testing.assert_array_equal(plan.trajectory.end[1], start[1])


def behind_posts():
    """The left one's goal lies in a pocket that no way leads into; the right one's does not."""
    posts = tuple(Obstacle(f"post {x:g} {y:g}", [[x, y]], 1.0) for x in (-7.0, 7.0) for y in (-2.51, 2.51))
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(obstacles=posts)
    return fp.Problem(plane, plane.folded, np.radians([[90.0, 20.0]]))


def test_no_path_past_obstacles_is_given_up_with_their_names():
    plan = fp.planners.Direct().plan(behind_posts())
    assert plan.outcomes == (Outcome.INFEASIBLE,)
    assert "proven unreachable" in plan.notes[-1]
    assert plan.lost.tolist() == [0]
    assert plan.faults() == []
    assert plan.blockers[0]
    assert all(b < 0 for b in plan.blockers[0])


@pytest.mark.parametrize("valued", [0, 1])
def test_the_one_that_matters_less_is_given_up(valued):
    """Stiff arms that sweep the same sector: either gets there, and it is proven that not both do."""
    ranges = {"lower": np.radians([[-90.0, 0.0], [40.0, 0.0]]), "upper": np.radians([[140.0, 1.0], [270.0, 1.0]])}
    plane = row(2).replace(folded=np.radians([[80.0, 0.0], [100.0, 0.0]]), **ranges)
    goal = np.radians([[-80.0, 0.0], [260.0, 0.0]])
    for alone in (0, 1):
        only = np.where((np.arange(2) == alone)[:, None], goal, np.nan)
        plan = fp.planners.Direct().plan(fp.Problem(plane, plane.folded, only))
        assert plan.outcomes[alone] is Outcome.ARRIVED
    priority = np.where(np.arange(2) == valued, 5.0, 1.0)
    plan = fp.planners.Direct().plan(fp.Problem(plane, plane.folded, goal, priority=priority))
    assert plan.faults() == []
    assert plan.outcomes[valued] is Outcome.ARRIVED
    assert plan.outcomes[1 - valued] is Outcome.INFEASIBLE
    assert plan.blockers == {1 - valued: (valued,)}
    assert plan.notes[-1].startswith("proven: not both reach their goals")


def test_max_time_caps_the_makespan():
    """Who cannot be there in time is proven unable, by its speed alone; the others arrive."""
    problem = field_to_field(rings=2)
    full = fp.planners.Direct().plan(problem)
    cap = 0.8 * full.lower_bound
    plan = fp.planners.Direct(max_time=cap).plan(problem)
    assert plan.makespan <= cap + 1e-9
    assert plan.faults() == []
    travel = (np.abs(problem.goal - problem.start) / problem.plane.max_speed).max(axis=1)
    np.testing.assert_array_equal(plan.having(Outcome.INFEASIBLE), np.flatnonzero(travel > cap))
    assert any("within" in note for note in plan.notes)
    assert len(plan.having(Outcome.ARRIVED)) > 0.5 * problem.n


def contested(alternative, goal):
    """The quick alternative of the left one touches the right one at (180, 0); its goal is slow."""
    plane = row(2).replace(lower=np.radians([[0.0, -180.0]] * 2), upper=np.radians([[400.0, 180.0]] * 2))
    start = np.radians([[0.0, 150.0], [160.0, 100.0]])
    goals = np.radians([[300.0, 40.0], goal])
    others = np.radians([[[0.0, 0.0]], [alternative]])
    return fp.Problem(plane, start, goals, alternatives=others)


@pytest.mark.parametrize(
    ("alternative", "goal"),
    [((180.0, 0.0), (30.0, 90.0)), ((30.0, 90.0), (180.0, 0.0)), ((np.nan, np.nan), (30.0, 90.0))],
)
def test_a_slow_goal_with_a_quick_alternative_is_in_time(alternative, goal):
    """Whether or not the other has to choose anew for it."""
    problem = contested(alternative, goal)
    in_time = 0.6 * (problem.goal[0, 0] - problem.start[0, 0]) / problem.plane.max_speed[0, 0]
    plan = fp.planners.Direct(max_time=in_time).plan(problem)
    assert plan.faults() == []
    assert set(plan.outcomes) == {Outcome.ARRIVED}
    assert plan.makespan <= in_time


@pytest.mark.small
def test_late_for_want_of_room_is_no_proof():
    """The only configuration in time touches the other's only goal."""
    problem = contested((np.nan, np.nan), (180.0, 0.0))
    in_time = 0.6 * (problem.goal[0, 0] - problem.start[0, 0]) / problem.plane.max_speed[0, 0]
    plan = fp.planners.Direct(max_time=in_time).plan(problem)
    assert plan.faults() == []
    assert plan.outcomes == (Outcome.DEADLOCKED, Outcome.ARRIVED)
    assert plan.makespan <= in_time
    too_short = fp.planners.Direct(max_time=0.3 * in_time).plan(problem)
    assert too_short.outcomes[0] is Outcome.INFEASIBLE


@pytest.mark.small
def test_max_time_may_be_the_time_of_a_move_at_full_speed():
    """Planners keep a hair below the speed limit; what a motion at the limit does is not proven impossible."""
    plane = fp.FocalPlane.hexagonal(0, 22.4)
    start, goal = np.radians([[10.0, 100.0]]), np.radians([[343.3, 17.7]])
    problem = fp.Problem(plane, start, goal)
    least = float((np.abs(goal - start) / plane.max_speed).max())
    straight = fp.Trajectory.from_samples([0.0, least], np.stack([start, goal]))
    assert fp.verify(plane, straight).ok
    plan = fp.planners.Direct(max_time=least).plan(problem)
    assert plan.outcomes == (Outcome.ARRIVED,)
    assert plan.makespan <= least
    assert plan.faults() == []
    late = fp.planners.Direct(max_time=least * (1 - 1e-6)).plan(problem)
    assert late.outcomes == (Outcome.INFEASIBLE,)
    assert "proven out of reach within" in late.notes[-1]


def with_alternatives(extra):
    """One positioner whose target has a far solution, stated, and others."""
    plane = row(2).replace(lower=np.radians([[0.0, -180.0]] * 2), upper=np.radians([[400.0, 180.0]] * 2))
    start = np.radians([[0.0, 90.0], [0.0, 90.0]])
    goal = np.radians([[370.0, 60.0], [20.0, 90.0]])
    return plane, start, goal, np.radians(np.array(extra, float))


@pytest.mark.small
def test_wraps_and_parities_shorten_the_move():
    """Alpha may turn beyond 360 deg, so 370 and 10 deg are one direction; the nearer is taken."""
    plane, start, goal, _ = with_alternatives([[0.0, 0.0]])
    others = np.radians([[[10.0, 60.0]], [[np.nan, np.nan]]])
    long = fp.planners.Direct().plan(fp.Problem(plane, start, goal))
    short = fp.planners.Direct().plan(fp.Problem(plane, start, goal, alternatives=others))
    assert long.makespan > 10.0
    assert short.makespan < 2.0
    assert short.faults() == []
    assert set(short.outcomes) == {Outcome.ARRIVED}
    assert short.lower_bound == pytest.approx(1.0)
    np.testing.assert_allclose(short.trajectory.end[0], np.radians([10.0, 60.0]), atol=1e-12)


@pytest.mark.small
def test_an_alternative_that_touches_is_not_taken():
    plane, start, goal, _ = with_alternatives([[0.0, 0.0]])
    goal[0], goal[1] = np.radians([200.0, 100.0]), np.radians([180.0, 0.0])
    others = np.radians([[[0.0, 0.0]], [[np.nan, np.nan]]])
    plan = fp.planners.Direct().plan(fp.Problem(plane, start, goal, alternatives=others))
    assert plan.faults() == []
    np.testing.assert_allclose(plan.trajectory.end[0], goal[0], atol=1e-12)


def test_a_deadline_gives_the_best_so_far():
    """No time at all: the fold hub, whole and safe, and marked."""
    problem = field_to_field(rings=3)
    said = []
    plan = fp.planners.Direct().plan(problem, deadline=0.0, report=said.append)
    assert plan.interrupted
    assert plan.planner == "direct"
    assert plan.faults() == []
    assert len(plan.having(Outcome.ARRIVED)) == problem.n
    assert said
    assert "contacts left" in said[0]
    assert not fp.planners.Direct().plan(problem).interrupted


def test_with_a_deadline_there_is_a_plan_soon(monkeypatch):
    """On coarser lattices, in more time: it counts where the search that follows has nothing by then."""
    problem = field_to_field(rings=4)
    turns, run = [], DirectSearch.run

    def only_the_first(self, budget, proceed):
        turns.append(self.widest_turn)
        return run(self, budget, proceed) if len(turns) == 1 else False

    monkeypatch.setattr(DirectSearch, "run", only_the_first)
    plan = fp.planners.Direct().plan(problem, deadline=3600.0)
    assert turns[0] == pytest.approx(2.0 * turns[1], rel=0.2)
    assert plan.interrupted
    assert plan.faults() == []
    assert len(plan.having(Outcome.ARRIVED)) == problem.n
    assert plan.makespan < 1.5 * plan.lower_bound
    monkeypatch.setattr(DirectSearch, "run", run)
    better = fp.planners.Direct().plan(problem, deadline=3600.0)
    assert not better.interrupted
    assert better.makespan < plan.makespan
    np.testing.assert_array_equal(better.trajectory.angles, fp.planners.Direct().plan(problem).trajectory.angles)


def test_who_is_lost_for_lack_of_time_is_asked_for_no_proof(monkeypatch):
    asked = []
    monkeypatch.setattr(direct_losses, "loss_proofs", lambda problem, i, *others: asked.append(i) or ())
    problem = field_to_field(rings=3)
    cap = 1.01 * fp.planners.Direct().plan(problem).lower_bound
    plan = fp.planners.Direct(max_time=cap).plan(problem, deadline=0.0)
    assert len(plan.having(Outcome.DEADLOCKED)) > 0
    assert asked == []


def test_ctrl_c_gives_the_best_so_far(monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    problem = field_to_field(rings=2)
    for name in ("__init__", "begin", "run"):
        with monkeypatch.context() as patched:
            patched.setattr(DirectSearch, name, interrupted)
            plan = fp.planners.Direct().plan(problem)
        assert plan.interrupted
        assert plan.faults() == []
        assert len(plan.having(Outcome.ARRIVED)) == problem.n


@pytest.mark.parametrize(
    "name", ["repair", "place_each", "find_contacts", "untangled", "lengthened", "make_scratch", "refined"]
)
def test_ctrl_c_at_any_moment(name, monkeypatch):
    """Before or after any of the things that the search does, for the first and second time."""
    problem = pinwheel()
    room = direct_search if name == "untangled" else direct_paths
    done = getattr(room, name)
    for moment, after in itertools.product((1, 2), (False, True)):
        calls = itertools.count(1)

        def now(*arguments, moment=moment, after=after, calls=calls, **named):
            due = next(calls) == moment
            if due and not after:
                raise KeyboardInterrupt
            result = done(*arguments, **named)
            if due:
                raise KeyboardInterrupt
            return result

        with monkeypatch.context() as patched:
            patched.setattr(room, name, now)
            plan = fp.planners.Direct(turn=15 * DEG).plan(problem)
        assert plan.interrupted == (next(calls) > moment)
        assert plan.faults() == []
        assert all(outcome in (Outcome.ARRIVED, Outcome.DEADLOCKED) for outcome in plan.outcomes)


def test_ctrl_c_while_finishing_loses_nothing(monkeypatch):
    problem = pinwheel()
    straight, calls = direct_planner.straighten, itertools.count()

    def once(*arguments):
        if next(calls) == 0:
            raise KeyboardInterrupt
        return straight(*arguments)

    monkeypatch.setattr(direct_planner, "straighten", once)
    plan = fp.planners.Direct().plan(problem)
    assert plan.interrupted
    assert plan.faults() == []
    assert set(plan.outcomes) == {Outcome.ARRIVED}


def test_what_the_search_has_is_better_than_a_hub_that_keeps_less():
    """A stiff arm that reaches its goal directly, while a post keeps it from ever folding."""
    post = Obstacle("post", [[0.0, 18.0]], 1.0)
    ranges = {"lower": np.radians([[-90.0, 0.0]]), "upper": np.radians([[140.0, 1.0]])}
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(obstacles=(post,), folded=np.radians([[135.0, 0.0]]), **ranges)
    problem = fp.Problem(plane, np.radians([[-80.0, 0.0]]), np.radians([[60.0, 0.0]]))
    assert fp.planners.GreedyFold(step=1.0 * DEG).plan(problem).outcomes == (Outcome.DEADLOCKED,)
    plan = fp.planners.Direct().plan(problem, deadline=0.0)
    assert plan.interrupted
    assert plan.faults() == []
    assert plan.outcomes == (Outcome.ARRIVED,)


def test_a_hub_that_takes_too_long_is_no_better():
    problem = field_to_field(rings=2)
    full = fp.planners.Direct().plan(problem)
    cap = 1.01 * full.lower_bound
    plan = fp.planners.Direct(max_time=cap).plan(problem, deadline=0.0)
    assert plan.interrupted
    assert plan.faults() == []
    assert plan.makespan <= cap
    assert len(plan.having(Outcome.DEADLOCKED)) > 0


def searched(problem, **settings):
    """A search that has begun."""
    near = Neighbourhood.of(problem.plane, problem.margin)
    search = DirectSearch(problem, near, problem.goal, 6 * DEG, None, 0)
    search.begin()
    return search


@pytest.mark.small
def test_settling_gives_up_the_least_and_holds_at_last():
    """Two stiff arms that sweep the same sector; the left one matters more."""
    ranges = {"lower": np.radians([[-90.0, 0.0], [40.0, 0.0]]), "upper": np.radians([[140.0, 1.0], [270.0, 1.0]])}
    plane = row(2).replace(folded=np.radians([[80.0, 0.0], [100.0, 0.0]]), **ranges)
    goal = np.radians([[-80.0, 0.0], [260.0, 0.0]])
    search = searched(fp.Problem(plane, plane.folded, goal, priority=np.array([5.0, 1.0])))
    assert search.touching == 1
    assert settle(search) == [1]
    assert search.given_up == {1: (0,)}
    np.testing.assert_array_equal(search.lattice.path[1], np.tile(plane.folded[1], (search.steps + 1, 1)))
    assert not search.lattice.fixed[1]
    search.give_up(1, (0,))  # it has no goal any more
    assert search.held == {1}
    assert search.lattice.fixed[1]
    assert search.given_up == {1: (0,)}
    if search.touching:
        assert settle(search) == [0]  # what is held has nothing left to lose
    stop_here(search)
    assert search.touching == 0


@pytest.mark.small
def test_one_that_never_had_a_goal_is_held_and_not_lost():
    plane = row(2)
    start = np.radians([[120.0, 60.0], [0.0, 60.0]])
    search = searched(fp.Problem(plane, start, np.radians([[150.0, 90.0], [np.nan, np.nan]])))
    search.give_up(1, (0,))
    assert search.held == {1}
    assert search.given_up == {}


def test_past_a_fixed_arm_there_is_more_time():
    """The long way around a post takes longer than the joints need, and the plan says so."""
    plane = fp.FocalPlane.hexagonal(0, 22.4)
    plane = plane.replace(obstacles=(Obstacle("post", [[0.0, 18.0]], 1.0),))
    plan = fp.planners.Direct().plan(fp.Problem(plane, np.radians([[60.0, 0.0]]), np.radians([[120.0, 0.0]])))
    assert plan.faults() == []
    assert plan.outcomes == (Outcome.ARRIVED,)
    assert plan.makespan > 1.5 * plan.lower_bound
    (bound,) = plan.bounds
    assert bound.kind == "obstacle"
    assert "past what never moves" in bound.said(plane)


def test_clearances_asked_of_pairs_are_bounded():
    """Contacts between steps make a pair keep farther apart, but not ever farther."""
    problem = field_to_field(2.0, rings=3)
    search = searched(problem)
    search.search.joint_limits[:] = search.limit + 1.5
    search.search.limits[:] = search.limit + 1.5
    search.run(3000, lambda: search.work < 3000)
    assert search.search.joint_limits.max() <= search.limit + 1.5
    assert search.search.limits.max() <= search.limit + 1.5


def test_repair_keeps_to_its_arrays_where_an_obstacle_is_touched():
    """As Python, which checks every index."""
    plane = fp.FocalPlane.hexagonal(0, 22.4)
    plane = plane.replace(obstacles=(Obstacle("post", [[0.0, 18.0]], 1.0),))
    problem = fp.Problem(plane, np.radians([[60.0, 0.0]]), np.radians([[120.0, 0.0]]))
    search = DirectSearch(problem, Neighbourhood.of(plane, 0.0), problem.goal, 6 * DEG, None, 0)
    lattice, near = search.lattice, search.near
    place_each(plane.arms, near._replace(offsets=read_only(0 * near.offsets, np.int64)), lattice, search.search,
               search._scratch, np.array([0]), search.steps)  # fmt: skip
    search.update_contacts()
    assert search.touching == 1
    for seed in range(6):
        search.search.state[0] = seed
        repair.py_func(plane.arms, near, lattice, search.pairs, search.search, search._scratch, search.limit,
                       search.steps, 1)  # fmt: skip


def test_the_seed_is_all_that_chance_knows():
    problem = field_to_field(1.0, rings=4)
    one, again, other = (fp.planners.Direct(seed=seed).plan(problem) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.trajectory.angles, again.trajectory.angles)
    np.testing.assert_array_equal(one.trajectory.times, again.trajectory.times)
    assert other.faults() == []
    assert not np.array_equal(one.trajectory.angles, other.trajectory.angles)


def test_other_speeds_lengths_and_ranges():
    """Unequal arms and speeds, alpha beyond a turn, beta of both signs, extended offline arms."""
    plane = hexagon(3)
    rng = np.random.default_rng(3)
    plane = plane.replace(
        length=7.4 + rng.uniform(-0.3, 0.3, plane.n),
        max_speed=np.radians(rng.uniform(8.0, 40.0, (plane.n, 2))),
        lower=np.tile(np.radians([-200.0, -180.0]), (plane.n, 1)),
        upper=np.tile(np.radians([260.0, 180.0]), (plane.n, 1)),
        online=rng.random(plane.n) > 0.1,
    )
    start = uniform_field(plane.replace(online=np.ones(plane.n, bool)), 1, 0.5)
    goal = uniform_field(plane, 2, 0.5, start=start)
    plan = fp.planners.Direct().plan(fp.Problem(plane, start, goal, 0.5))
    assert plan.faults() == []
    assert len(plan.having(Outcome.ARRIVED)) >= 0.9 * plane.online.sum()


@pytest.mark.small
@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"max_time": 0.0}, "max_time"),
        ({"max_time": np.nan}, "max_time"),
        ({"budget": -1.0}, "budget"),
        ({"turn": 0.0}, "turn"),
        ({"turn": 60 * DEG}, "45 deg"),
    ],
)
def test_settings_are_checked(settings, said):
    with pytest.raises(ProblemError, match="direct") as error:
        fp.planners.Direct(**settings)
    assert said in str(error.value)


def test_three_that_only_move_together():
    """Each goal is across another's start, around in a ring: no two can do it while the third stands anywhere."""
    plan = fp.planners.Direct().plan(pinwheel())
    assert plan.faults() == []
    assert set(plan.outcomes) == {Outcome.ARRIVED}
