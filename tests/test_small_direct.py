"""The direct planner's search on one to three coarse arms: solutions made shorter, late-safe, stopped, past posts.

With the compiler off, too, these run in seconds.
"""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan import Obstacle, Outcome
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.direct import improving, narrow
from fiberplan.planners.direct import planner as direct_planner
from fiberplan.planners.direct import search as direct_search
from fiberplan.planners.direct.improving import react, shorten
from fiberplan.planners.direct.paths import FINEST, ON_ITS_WAY
from fiberplan.planners.direct.repair import SPENT, note_all
from fiberplan.planners.direct.search import DirectSearch
from fiberplan.scenes.decisive import row
from problems import keeps_its_solution_when_interrupted, narrow_exchange

pytestmark = pytest.mark.small
DEG = np.pi / 180.0
TURN = 45.0 * DEG


def searched(problem, turn=TURN, longer=1):
    """A search that has found paths of so many times the steps that joints need."""
    search = DirectSearch(problem, Neighbourhood.of(problem.plane, problem.margin), problem.goal, turn, None, 0)
    search.begin()
    least = search.steps
    search.lengthen(longer * least)
    search.place(np.arange(problem.n))
    assert search.run(10_000, lambda: True)
    return search, least


@pytest.fixture
def brief(monkeypatch):
    """Few shortcuts are tried, and not for long."""
    for name, few in (("_SHORTCUTS", 5), ("_IN_VAIN", 3), ("_MOST_SHORTCUTS", 60), ("_CUTS", 2)):
        monkeypatch.setattr(improving, name, few)


@pytest.mark.usefixtures("brief")
def test_a_solution_is_made_shorter():
    search, least = searched(narrow_exchange(), longer=2)
    before = search.steps
    assert before == 2 * least
    shorten(search, lambda: True)
    assert search.steps < before
    assert search.touching == 0
    np.testing.assert_array_equal(search.lattice.path[:2, search.steps], search.problem.goal)


def test_stopped_while_it_is_made_shorter_it_is_as_it_was(monkeypatch):
    search, _ = searched(narrow_exchange(), longer=2)
    assert keeps_its_solution_when_interrupted(search, monkeypatch)


def beside():
    """Two arms that turn a little, each on its own side, in narrow ranges."""
    start, turn = np.radians([[150.0, 120.0], [30.0, 120.0]]), np.radians([[40.0, -30.0], [-20.0, 30.0]])
    ranges = {"lower": start - 60 * DEG, "upper": start + 60 * DEG}
    return fp.Problem(row(2).replace(folded=start, **ranges), start, start + turn)


@pytest.mark.usefixtures("brief")
@pytest.mark.parametrize(("scene", "longer"), [(beside, 1), (narrow_exchange, 2)])
def test_late_arms_keep_clear_or_all_is_as_it_was(scene, longer):
    search, _ = searched(scene(), longer=longer)
    before, path = search.steps, search.lattice.path.copy()
    found = react(search, 1.5 * search.duration, 0.1, lambda: True)
    assert search.touching == 0
    assert (search.lattice.delay > 0) == found
    assert found or (search.steps == before and (search.lattice.path == path).all())
    assert not react(search, 3600.0, 0.1, lambda: True)


@pytest.mark.usefixtures("brief")
@pytest.mark.parametrize("least", [0.5, 3600.0])
def test_who_stops_dead_is_touched_late_or_the_plan_says_so(least):
    plan = fp.planners.Direct(turn=TURN, min_reaction=least).plan(beside())
    assert plan.certificate.ok
    assert plan.arrivals == "2 of 2"
    kept = plan.certificate.tolerates.reaction.seconds >= least
    assert kept != any("stops dead" in note for note in plan.notes)


def test_with_a_deadline_the_first_plan_counts_where_the_next_has_nothing(monkeypatch):
    problem = beside()
    turns, run = [], DirectSearch.run

    def only_the_first(self, budget, proceed):
        turns.append(self.widest_turn)
        return run(self, budget, proceed) if len(turns) == 1 else False

    monkeypatch.setattr(DirectSearch, "run", only_the_first)
    plan = fp.planners.Direct(turn=20 * DEG).plan(problem, deadline=3600.0)
    assert turns[0] > 1.5 * turns[1]
    assert plan.interrupted
    assert plan.faults() == []
    assert plan.arrivals == "2 of 2"
    monkeypatch.setattr(DirectSearch, "run", run)
    better = fp.planners.Direct(turn=20 * DEG).plan(problem, deadline=3600.0)
    assert not better.interrupted
    assert better.makespan <= plan.makespan


@pytest.mark.parametrize("name", ["__init__", "run"])
def test_stopped_it_gives_the_hub(name, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(direct_planner, "_HUB_STEP", 15 * DEG)
    monkeypatch.setattr(DirectSearch, name, interrupted)
    start = np.radians([[150.0, 120.0], [30.0, 120.0]])
    plan = fp.planners.Direct(turn=TURN).plan(fp.Problem(row(2), start, start + 0.3))
    assert plan.interrupted
    assert plan.faults() == []
    assert plan.arrivals == "2 of 2"


@pytest.mark.parametrize(("few", "asked"), [(0, ["none"]), (2, ["none", "joint"])])
def test_the_hub_is_relieved_of_few_only(few, asked, monkeypatch):
    """Two stiff arms that block each other's way to folded: the relief is tried for two, and not where two are many."""
    problem, reliefs = narrow_exchange(), []
    fold = direct_planner.GreedyFold.plan

    def told(self, problem):
        reliefs.append(self.relief)
        return fold(self, problem)

    monkeypatch.setattr(direct_planner.GreedyFold, "plan", told)
    monkeypatch.setattr(direct_planner, "_HUB_STEP", 15 * DEG)
    monkeypatch.setattr(direct_planner, "_FEW", few)
    monkeypatch.setattr(direct_planner, "_FEW_PART", 0.0)
    monkeypatch.setattr(DirectSearch, "run", lambda *arguments: (_ for _ in ()).throw(KeyboardInterrupt))
    plan = fp.planners.Direct(turn=TURN).plan(problem)
    assert plan.interrupted
    assert reliefs == asked


def test_the_bound_of_a_pair_is_at_the_clearance_of_the_problem(monkeypatch):
    """One whose clearance was raised is asked again; one that needs no more than is known sets none."""
    search, _ = searched(narrow_exchange())
    before, asked = search.least_steps, []

    def needed(pair, apart):
        asked.append(round(apart - search.limit, 3))
        return before + (4 if apart > search.limit else 3)

    monkeypatch.setattr(search, "needed_alone", needed)
    search.slowest_pair = None
    search._lengthen_for(0)
    assert (search.least_steps, search.slowest_need, search.slowest_pair) == (before + 3, before + 3, (0, 1))
    search.search.joint_limits[0] += 0.1
    search.least_steps = before
    search._lengthen_for(0)
    assert asked == [0.0, 0.1, 0.0]
    assert (search.least_steps, search.slowest_need) == (before + 3, before + 3)
    assert search.steps >= before + 4


def test_stopped_while_finishing_it_loses_nothing(monkeypatch):
    straight, calls = direct_planner.straighten, []

    def once(*arguments):
        calls.append(arguments)
        if len(calls) == 1:
            raise KeyboardInterrupt
        return straight(*arguments)

    monkeypatch.setattr(direct_planner, "straighten", once)
    plan = fp.planners.Direct(turn=TURN).plan(beside())
    assert plan.interrupted
    assert plan.arrivals == "2 of 2"


def test_a_goal_in_a_pocket_is_given_up_with_the_posts_names():
    posts = tuple(Obstacle(f"post {x:g} {y:g}", [[x, y]], 1.0) for x in (-7.0, 7.0) for y in (-2.51, 2.51))
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(obstacles=posts)
    plan = fp.planners.Direct(turn=TURN).plan(fp.Problem(plane, plane.folded, np.radians([[90.0, 20.0]])))
    assert plan.outcomes == (Outcome.INFEASIBLE,)
    assert plan.blockers[0]
    assert all(b < 0 for b in plan.blockers[0])


def pushed(problem, monkeypatch, attempts, **settings):
    """A search in whose first attempts 10 replans come to nothing; whom it would untangle is noted."""
    for name, value in settings.items():
        monkeypatch.setattr(direct_search, name, value)
    search = DirectSearch(problem, Neighbourhood.of(problem.plane, problem.margin), problem.goal, TURN, None, 0)
    search.begin()
    real, left, untangled = search.attempt, list(range(attempts)), []

    def attempt():
        if not left:
            return real()
        left.pop()
        search.search.work[0]["replans"] += 10
        return SPENT

    monkeypatch.setattr(search, "attempt", attempt)
    monkeypatch.setattr(search, "_untangle", lambda pairs, size, most: untangled.append(size) or 0)
    return search, untangled


def test_without_headway_paths_get_longer_and_clusters_are_untangled(monkeypatch):
    search, untangled = pushed(narrow_exchange(), monkeypatch, 4, PATIENCE=5)
    least = search.steps
    assert search.run(10_000, lambda: True)
    assert search.steps >= least + 4
    assert untangled == [3, 4]  # the first two times there are only more steps
    assert search.touching == 0
    assert search.given_up == {}


def test_when_the_budget_is_spent_it_is_settled_who_stays(monkeypatch):
    """After a last joint try; what was in contact then is not any more."""
    search, untangled = pushed(narrow_exchange(), monkeypatch, 1)
    assert search.run(5, lambda: True)
    assert untangled == [8]
    assert len(search.given_up) == 1
    assert search.touching == 0


def beside_a_post():
    """One arm, and a search that has tried to get past a post for long."""
    post = Obstacle("post", [[0.0, 16.0]], 1.0)
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(obstacles=(post,))
    problem = fp.Problem(plane, np.radians([[30.0, 120.0]]), np.radians([[150.0, 120.0]]))
    search = DirectSearch(problem, Neighbourhood.of(plane, 0.0), problem.goal, TURN, None, 0)
    search.begin()
    return search, np.linspace(problem.start[0], problem.goal[0], 3 * search.steps + 1)


@pytest.mark.parametrize(("barred", "steps"), [(True, -1), (False, None)])
def test_without_a_path_on_any_lattice_it_goes_its_way_unless_it_is_barred(barred, steps, monkeypatch):
    search, way = beside_a_post()
    monkeypatch.setattr(search, "needed_past_fixed", lambda who: np.full(len(who), -1))
    monkeypatch.setattr(narrow, "_is_barred", lambda *_: barred)
    monkeypatch.setattr(narrow, "_way", lambda *_: way)
    needs = narrow.steps_past_fixed(search, np.array([0]))
    assert needs.tolist() == [len(way) - 1 if steps is None else steps]
    assert (search.fineness[0] == ON_ITS_WAY) == (not barred)


@pytest.mark.parametrize("found", ["nothing", "a way", "a proof"])
def test_who_touches_a_post_for_long_gets_finer_lattices_then_a_way_or_gives_up(found, monkeypatch):
    search, way = beside_a_post()
    monkeypatch.setattr(narrow, "_is_barred", lambda *_: found == "a proof")
    monkeypatch.setattr(narrow, "_way", lambda *_: way if found == "a way" else None)
    search.search.contacts[:] = 1
    note_all(search.search)
    for fineness in range(1, FINEST + 1):
        search.search.tries[:] = 100
        search.search.contacts[:] = 1
        note_all(search.search)
        assert narrow.eased(search)
        assert search.fineness[0] == fineness
    search.search.tries[:] = 100
    search.search.contacts[:] = 1
    note_all(search.search)
    assert narrow.eased(search) == (found != "nothing")
    assert (search.fineness[0] == ON_ITS_WAY) == (found == "a way")
    assert (0 in search.given_up) == (found == "a proof")
    assert (0 in search.off_ways) == (found == "nothing")
