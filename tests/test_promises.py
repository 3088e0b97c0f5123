"""What every planner promises, one test a promise, of every planner on every scene where straight motion fails."""

from functools import cache

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.kernels.clearance import clearances
from fiberplan.plan import Outcome
from fiberplan.planners import PLANNERS
from fiberplan.scenes.decisive import exchange
from problems import SCENES, behind_posts, four_bars, from_folded, touching_goals
from references import path_past_fixed

COARSE = {"step": np.radians(1.0)}
SHORT = {"grid": (4, 3), "dt": 1.0, "collision_dt": 0.25, "max_time": 25.0, "orders": 1, "early_abort": True}
FIELD = {"D": 6.0, "d": 3.0, "dt": 0.04}
VARIANTS = {
    "direct": ("direct", {}),
    "direct-in-9-s": ("direct", {"max_time": 9.0}),
    **{f"greedy-fold-{r}": ("greedy-fold", {"relief": r, **COARSE}) for r in ("joint", "reverse", "replace", "none")},
    **{f"elliptic-{r}": ("elliptic-navigation-function", {"relief": r}) for r in ("layers", "none")},
    "roadmap": ("prioritized-roadmap", SHORT),
    "roadmap-garages": ("prioritized-roadmap", SHORT | {"garages": True, "continuous": True}),
    **{f"navigation-{m}": ("navigation-function", {"mode": m, **FIELD}) for m in ("repaired", "literal")},
}
TAKES_FOUR_BARS = {"prioritized-roadmap"}
NAMES_ALL_BLOCKERS = {"direct", "direct-in-9-s", "greedy-fold-joint", "greedy-fold-reverse"}
ONLY_ON = {"direct-in-9-s": (exchange, from_folded, touching_goals, behind_posts)}  #: where time decides
CANNOT_EXCHANGE = {"elliptic-none", "roadmap", "roadmap-garages"}  #: neither of two comes past the other
RESTS_BESIDE = "navigation-literal"  #: its goals, as printed
CASES = [
    pytest.param((variant, scene), id=f"{variant}-{scene.__name__}", marks=pytest.mark.xdist_group(variant))
    for variant, (name, _) in VARIANTS.items()
    for scene in ONLY_ON.get(variant, SCENES)
    if scene is not four_bars or name in TAKES_FOUR_BARS
]


@cache
def problem_of(scene):
    return scene()


def planner_of(variant):
    name, settings = VARIANTS[variant]
    return PLANNERS[name](**settings)


@cache
def plan_of(variant, scene):
    """Planned once for all promises."""
    return planner_of(variant).plan(problem_of(scene))


@pytest.fixture(scope="session", params=CASES)
def case(request):
    """(variant, plan)."""
    return request.param[0], plan_of(*request.param)


def only(keeps):
    """For promises that not all make: of the cases, those for which `keeps(variant, scene)`."""
    return pytest.mark.parametrize("case", [c for c in CASES if keeps(*c.values[0])], indirect=True, scope="session")


@pytest.fixture
def variant(case):
    return case[0]


@pytest.fixture
def plan(case):
    return case[1]


def configurations(problem, i):
    """All (k, 2) in which positioner i is at its target."""
    others = np.empty((0, 2)) if problem.alternatives is None else problem.alternatives[i]
    every = np.concatenate([problem.goal[[i]], others])
    return every[~np.isnan(every[:, 0])]


def test_every_planner_is_asked():
    assert {name for name, _ in VARIANTS.values()} == set(PLANNERS)


@pytest.mark.parametrize("scene", SCENES, ids=lambda s: s.__name__)
def test_scenes_are_decisive(scene):
    """Straight synchronized motion touches in every scene, so that a planner has something to do."""
    problem = problem_of(scene)
    goal = np.where(np.isnan(problem.goal), problem.start, problem.goal)
    time = float((np.abs(goal - problem.start) / problem.plane.max_speed).max()) * 1.001
    straight = fp.Trajectory.from_samples([0.0, time], np.stack([problem.start, goal]))
    assert fp.verify(problem.plane, straight, problem.margin).contacts


@pytest.mark.parametrize("name", sorted(set(PLANNERS) - TAKES_FOUR_BARS))
def test_who_cannot_plan_four_bar_arms_says_so_in_one_line(name):
    with pytest.raises(ProblemError, match=f"{name}.*four-bar") as refused:
        PLANNERS[name]().plan(problem_of(four_bars))
    assert "\n" not in str(refused.value)


def test_it_says_who_made_it(plan, variant):
    planner = planner_of(variant)
    assert plan.planner == planner.name == VARIANTS[variant][0]
    assert planner.reference
    assert plan.parameters.items() >= VARIANTS[variant][1].items()
    assert not plan.interrupted


def test_it_begins_at_the_start(plan):
    np.testing.assert_allclose(plan.trajectory.start, plan.problem.start, atol=1e-12)


def test_it_is_proven_safe(plan):
    proof = plan.certificate
    assert proof.ok, (proof.contacts, proof.undecided, proof.violations, proof.zones)
    assert plan.faults() == []


def test_it_is_safe_where_sampled(plan):
    problem, plane = plan.problem, plan.problem.plane
    pairs = plane.arm_pairs_within(problem.margin)
    moves = np.concatenate([plane.online, np.zeros(len(plane.obstacles), bool)])
    pairs = np.ascontiguousarray(pairs[moves[pairs].any(axis=1)])
    pairs.setflags(write=False)
    for t in np.linspace(0.0, plan.makespan, 1500):
        gaps = clearances(plane.arms, plane.with_obstacles(plan.trajectory.at(t)), pairs)
        assert gaps.min(initial=np.inf) >= problem.margin, t


def test_who_arrives_is_there(plan):
    for i in plan.having(Outcome.ARRIVED):
        away = np.abs(configurations(plan.problem, i) - plan.trajectory.end[i]).max(axis=1)
        assert away.min() < 1e-9


def test_outcomes_agree_with_the_problem(plan):
    problem = plan.problem
    for i, outcome in enumerate(plan.outcomes):
        assert (outcome is Outcome.OFFLINE) == (not problem.plane.online[i])
        if problem.plane.online[i]:
            assert (outcome is Outcome.NO_TARGET) == bool(np.isnan(problem.requested[i, 0]))
            assert (outcome is Outcome.DROPPED) == (i in problem.dropped)
    lost = {i for i, o in enumerate(plan.outcomes) if o in (Outcome.DROPPED, Outcome.INFEASIBLE, Outcome.DEADLOCKED)}
    assert lost == set(plan.lost.tolist())


def test_who_cannot_move_does_not(plan):
    off = ~plan.problem.plane.online
    np.testing.assert_array_equal(plan.trajectory.end[off], plan.problem.start[off])


def test_blockers_are_others_of_those_lost(plan):
    count = len(plan.problem.plane.obstacles)
    assert set(plan.blockers) <= set(plan.lost.tolist())
    for i, blockers in plan.blockers.items():
        assert all(-count <= b < plan.problem.n and b != i for b in blockers)


@only(lambda variant, scene: variant in NAMES_ALL_BLOCKERS)
def test_blockers_of_all_lost_are_named(plan):
    """But for those whom no one keeps from their goals: out of reach, or too slow for the time allowed."""
    for i in plan.lost.tolist():
        dropped = plan.problem.dropped.get(i)
        nobody = dropped.cause.startswith("out of reach") if dropped else is_too_slow(plan, i)
        assert nobody or plan.blockers[i], i


def is_too_slow(plan, i):
    """Whether every configuration at its target takes positioner i longer than the plan may take."""
    problem, most = plan.problem, plan.parameters.get("max_time")
    travel = np.abs(configurations(problem, i) - problem.start[i]) / problem.plane.max_speed[i]
    return most is not None and bool(np.all(travel.max(axis=1) > most))


def test_infeasible_is_true(plan):
    """Too slow in every configuration, or a flood past what never moves comes to none."""
    problem = plan.problem
    for i in plan.having(Outcome.INFEASIBLE):
        goals = configurations(problem, i)
        flooded = (path_past_fixed(problem.plane, i, problem.start, goal, problem.margin) for goal in goals)
        assert is_too_slow(plan, i) or all(path is False for path in flooded)


def test_it_keeps_the_time_allowed(plan):
    assert plan.lower_bound * (1.0 - 1e-9) <= plan.makespan <= (plan.parameters.get("max_time") or np.inf) + 1e-9


@only(lambda variant, scene: variant != RESTS_BESIDE and not (scene is exchange and variant in CANNOT_EXCHANGE))
def test_someone_arrives(plan):
    assert len(plan.having(Outcome.ARRIVED))


def test_it_is_the_same_again(plan, variant):
    again = planner_of(variant).plan(plan.problem)
    for field in ("offsets", "times", "angles"):
        np.testing.assert_array_equal(getattr(again.trajectory, field), getattr(plan.trajectory, field))
    assert (again.outcomes, again.blockers, again.notes) == (plan.outcomes, plan.blockers, plan.notes)
