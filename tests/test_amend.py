"""A target of opportunity: one goal changes, and as little of the plan as can be."""

import dataclasses

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import PlanError, ProblemError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.plan import Outcome, Plan
from fiberplan.planners import amend
from fiberplan.planners.amending import one_goal
from fiberplan.planners.amending.rerouting import Rerouted
from fiberplan.scenes.decisive import row
from fiberplan.scenes.uniform import uniform_field
from problems import among_obstacles, crowded, field_to_field, hexagon, offline_across, unequal
from references import make_plane, varied_plane

STEP = np.radians(1.0)


def greedy(problem, relief="joint"):
    return fp.planners.GreedyFold(step=STEP, relief=relief).plan(problem)


def knots(plan, i):
    own = slice(*plan.trajectory.offsets[i : i + 2])
    return plan.trajectory.times[own], plan.trajectory.angles[own]


def moved(before, after):
    """Who moves otherwise than before, to the last bit."""
    pairs = [(knots(before, i), knots(after, i)) for i in range(before.problem.n)]
    return [i for i, (a, b) in enumerate(pairs) if not all(map(np.array_equal, a, b))]


def opportunities(plan, count, seed=0):
    """Positioners and goals that touch nobody's goal."""
    rng, plane = np.random.default_rng(seed), plan.problem.plane
    while count:
        i = int(rng.choice(np.flatnonzero(plane.online)))
        goal = plane.kinematics.random(plane, rng, np.array([i]))[0]
        others = plan.problem.requested.copy()
        others[list(plan.problem.dropped)] = np.nan
        others[i] = goal
        try:
            fp.Problem(plane, plan.problem.start, others, plan.problem.margin)
        except ProblemError:
            continue
        count -= 1
        yield i, goal


def still(plane, start, outcomes=None):
    """A plan in which everybody stays; by default all have a goal, where they stand."""
    outcomes = outcomes or (Outcome.ARRIVED,) * plane.n
    goal = np.where([[o is Outcome.ARRIVED] for o in outcomes], start, np.nan)
    return Plan(fp.Problem(plane, start, goal), fp.Trajectory.at_rest(start), tuple(outcomes), "none", seed=3)


@pytest.fixture(scope="module")
def folds():
    """Plans of another planner, by scene."""
    scenes = (field_to_field, offline_across, among_obstacles, unequal)
    return {scene.__name__: greedy(scene()) for scene in scenes} | {"crowded": greedy(crowded(), relief="none")}


@pytest.mark.parametrize("scene", ["field_to_field", "offline_across", "among_obstacles", "unequal", "crowded"])
def test_one_goal_changes_and_the_rest_stays(folds, scene):
    plan = folds[scene]
    assert plan.certificate.ok
    crowd = []
    for i, goal in opportunities(plan, 6):
        new = amend(plan, i, goal)
        assert new.faults() == []
        np.testing.assert_array_equal(new.problem.goal[i], goal)
        np.testing.assert_array_equal(np.delete(new.problem.goal, i, 0), np.delete(plan.problem.goal, i, 0))
        others = moved(plan, new)
        crowd.append(len(others))
        assert new.outcomes[:i] + new.outcomes[i + 1 :] == plan.outcomes[:i] + plan.outcomes[i + 1 :]
        if new.outcomes[i] is Outcome.ARRIVED:
            np.testing.assert_array_equal(new.trajectory.end[i], goal)
            assert others.count(i) == 1
            assert i not in new.blockers
        else:
            assert new.outcomes[i] is Outcome.DEADLOCKED
            assert others == []
            assert new.blockers[i]
        needed = (np.abs(goal - plan.problem.start[i]) / plan.problem.plane.max_speed[i]).max()
        assert new.makespan <= 1.05 * max(plan.makespan, needed) * (1 + 1e-8)
    assert np.median(crowd) <= 1
    assert max(crowd) <= 4
    assert sum(crowd) > 0


def test_the_direct_planners_plans_too():
    plan = fp.planners.Direct().plan(field_to_field(rings=2))
    for i, goal in opportunities(plan, 4, seed=1):
        new = amend(plan, i, goal)
        assert new.faults() == []
        assert new.outcomes[i] is Outcome.ARRIVED


def test_same_again(folds):
    plan = folds["field_to_field"]
    ((i, goal),) = opportunities(plan, 1, seed=5)
    one, other = amend(plan, i, goal), amend(plan, plan.problem.plane.ids[i], list(goal))
    for field in ("offsets", "times", "angles"):
        np.testing.assert_array_equal(getattr(one.trajectory, field), getattr(other.trajectory, field))
    assert one.outcomes == other.outcomes
    assert one.notes == other.notes


@pytest.mark.small
def test_a_neighbour_that_has_arrived_makes_room_and_comes_back():
    """P1 stands at its goal, across the only way of P0 (alpha has ends): it has to leave and return."""
    plane = row(2)
    start = np.radians([[345.0, 101.0], [133.0, 134.0]])
    plan, goal = still(plane, start), np.radians([199.0, 45.0])
    alone = Plan(
        dataclasses.replace(plan.problem, goal=np.array([goal, start[1]])),
        fp.Trajectory.from_samples([0.0, 6.0], np.stack([start, [goal, start[1]]])),
        (Outcome.ARRIVED,) * 2,
        "none",
    )
    assert alone.certificate.contacts  # straight there is no way
    new = amend(plan, 0, goal)
    assert new.faults() == []
    assert new.outcomes == (Outcome.ARRIVED,) * 2
    assert moved(plan, new) == [0, 1]
    np.testing.assert_array_equal(new.trajectory.end, [goal, start[1]])
    assert "P1 made room" in new.notes[-1]


def test_one_without_a_target_stands_aside():
    """P1 rests where P0 is to go; it has no target, so it may end anywhere."""
    plane = row(2)
    start = np.radians([[90.0, 170.0], [150.0, 60.0]])
    plan = still(plane, start, (Outcome.ARRIVED, Outcome.NO_TARGET))
    goal = np.radians([0.0, 0.0])
    resting = np.array([goal, start[1]])
    assert plane.clearance(resting)[0] < 0
    new = amend(plan, 0, goal)
    assert new.faults() == []
    assert new.outcomes == (Outcome.ARRIVED, Outcome.NO_TARGET)
    assert moved(plan, new) == [0, 1]


def walled():
    """A wall reaches from the base of P0 outwards, and alpha cannot go around."""
    wall = Obstacle("wall", [[0.0, 3.0], [0.0, 30.0]], 0.5)
    return row(2).replace(obstacles=(wall,))


def test_where_no_path_is_found_all_move_as_before_and_the_blocker_is_named():
    plane = walled()
    start = np.radians([[45.0, 30.0], [0.0, 170.0]])
    plan = still(plane, start)
    new = amend(plan, 0, np.radians([135.0, 10.0]))
    assert new.outcomes == (Outcome.DEADLOCKED, Outcome.ARRIVED)
    assert new.blockers == {0: (-1,)}
    assert moved(plan, new) == []
    assert new.faults() == []
    assert "no path was found" in new.notes[-1]
    again = amend(new, 0, np.radians([20.0, 60.0]))  # on its own side
    assert again.outcomes == (Outcome.ARRIVED,) * 2
    assert again.blockers == {}
    assert again.faults() == []


def test_no_target_any_more(folds):
    plan = folds["field_to_field"]
    new = amend(plan, 7, (np.nan, np.nan))
    assert new.outcomes[7] is Outcome.NO_TARGET
    assert np.isnan(new.problem.requested[7]).all()
    assert moved(plan, new) == []
    assert new.certificate.ok
    assert len(new.having(Outcome.ARRIVED)) == len(plan.having(Outcome.ARRIVED)) - 1


def test_the_goal_it_has_already_changes_nothing(folds):
    plan = folds["field_to_field"]
    new = amend(plan, 7, plan.problem.goal[7])
    assert moved(plan, new) == []
    assert new.outcomes == plan.outcomes


def test_the_lost_stay_lost_and_may_be_sent_elsewhere(folds):
    plan = folds["crowded"]
    lost = int(plan.lost[0])
    i, goal = next((i, goal) for i, goal in opportunities(plan, 9, seed=2) if i not in plan.lost)
    new = amend(plan, i, goal)
    np.testing.assert_array_equal(new.lost, plan.lost)
    assert new.blockers[lost] == plan.blockers[lost]
    back = amend(new, lost, new.trajectory.end[lost])
    assert back.outcomes[lost] is Outcome.ARRIVED
    assert lost not in back.blockers
    assert back.faults() == []


def test_a_dropped_goal_is_replaced(tmp_path):
    plane = row(2)
    start = np.radians([[90.0, 170.0], [90.0, 170.0]])
    goal = np.radians([[10.0, 10.0], [170.0, 10.0]])
    alternatives = np.full((2, 1, 2), np.nan)
    alternatives[0, 0] = np.radians([20.0, 20.0])
    problem = fp.Problem(plane, start, goal, priority=np.array([1.0, 2.0]), conflicts="drop", alternatives=alternatives)
    plan = greedy(problem)
    assert plan.outcomes == (Outcome.DROPPED, Outcome.ARRIVED)
    new = amend(plan, 0, np.radians([200.0, 90.0]))
    assert new.outcomes == (Outcome.ARRIVED,) * 2
    assert new.problem.dropped == {}
    assert np.isnan(new.problem.alternatives[0]).all()  # they reached the old target
    assert new.faults() == []
    new.write(tmp_path / "new.fits")
    read = Plan.read(tmp_path / "new.fits")
    assert moved(new, read) == []
    assert read.outcomes == new.outcomes


def test_time_may_grow_by_what_is_allowed():
    """Beside one that nearly fills its patrol zone, the joints' time is not enough; more of it is."""
    plane = row(2)
    start = np.radians([[263.0, 81.0], [204.0, 167.0]])
    plan, goal = still(plane, start), np.radians([352.0, 80.0])
    short, long = amend(plan, 0, goal), amend(plan, 0, goal, longer=3.0)
    assert short.outcomes[0] is Outcome.DEADLOCKED
    assert short.blockers == {0: (1,)}
    assert long.outcomes == (Outcome.ARRIVED,) * 2
    assert long.faults() == []


@pytest.mark.parametrize(
    ("positioner", "goal", "words"),
    [
        ("Q9", (1.0, 3.0), "no positioner 'Q9'"),
        (19, (1.0, 3.0), "no positioner 19; they are counted from 0 to 18"),
        (-1, (1.0, 3.0), "no positioner -1"),
        (1.0, (1.0, 3.0), r"named by its index or id, not by 1\.0"),
        (True, (1.0, 3.0), "named by its index or id, not by True"),
        (3, (1.0, 3.0), "positioner 'R-1C1' is offline"),
        (0, (1.0,), "two angles"),
        (0, ((1.0, 3.0), (1.0, 3.0)), "two angles"),
        (0, "north", "two angles, alpha and beta, got 'north'"),
        (0, None, "two angles"),
        (0, (1.0, np.nan), "'R-2C1' has only one of two angles"),
        (0, (np.inf, 3.0), "'R-2C1' has an infinite angle"),
        (0, (7.0, 3.0), r"'R-2C1': alpha 401\.07 deg is outside 0 to 360 deg"),
    ],
)
def test_bad_input(folds, positioner, goal, words):
    with pytest.raises(ProblemError, match=words) as error:
        amend(folds["offline_across"], positioner, goal)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("longer", [-0.1, 10.1, np.nan, np.inf])
def test_bad_time(folds, longer):
    with pytest.raises(ProblemError, match="longer must be a part of the makespan"):
        amend(folds["offline_across"], 0, (1.0, 3.0), longer=longer)


def test_a_goal_that_touches_another_is_refused():
    plane = row(2)
    start = np.radians([[90.0, 170.0], [150.0, 60.0]])
    with pytest.raises(
        ProblemError, match=r"goal: positioner 'P0' and positioner 'P1' overlap \(clearance -4\.091 mm, margin 0 mm\)"
    ) as error:
        amend(still(plane, start), 0, (0.0, 0.0))
    assert error.value.positioners == (0, 1)


def test_arms_with_a_third_link_are_refused():
    plane = fp.FocalPlane.load("miradas")
    with pytest.raises(ProblemError, match="four-bar arms"):
        amend(still(plane, plane.folded), 0, plane.folded[0])


def test_an_unsafe_plan_is_refused():
    plane = hexagon(2)
    out = plane.folded.copy()
    out[9] = 0.0, 0.35  # onto its folded neighbour, and back
    motion = fp.Trajectory.from_samples([0.0, 6.0, 12.0], np.stack([plane.folded, out, plane.folded]))
    plan = Plan(fp.Problem(plane, plane.folded, plane.folded), motion, (Outcome.ARRIVED,) * plane.n, "none")
    assert len(plan.certificate.contacts) == 1
    for target in (np.radians([30.0, 170.0]), np.full(2, np.nan)):
        with pytest.raises(PlanError, match="a plan that is not safe cannot be amended; it is not safe: 1 contacts"):
            amend(plan, 0, target)


def test_a_path_that_cannot_be_proven_is_not_taken(folds, monkeypatch):
    """Everyone moves as before, and the outcome claims no more than that."""
    plan = folds["field_to_field"]
    ((i, goal),) = opportunities(plan, 1, seed=5)
    start = plan.problem.start
    onto = start.copy()
    onto[:] = 0.0  # all extended in one direction at once, far too fast
    unsafe = fp.Trajectory.from_samples([0.0, 1e-3], np.stack([start, onto]))
    assert not fp.verify(plan.problem.plane, unsafe).ok
    monkeypatch.setattr(one_goal, "reroute", lambda *_: Rerouted(unsafe, (i,), ()))
    new = amend(plan, i, goal)
    assert new.outcomes[i] is Outcome.DEADLOCKED
    assert new.blockers[i] == ()
    assert moved(plan, new) == []
    assert new.faults() == []
    assert "could be proven safe" in new.notes[-1]


def test_a_large_plan_moves_no_more_than_a_few(folds):
    """The mm that separate arms are the same far and near: only what is close may change."""
    plane = fp.FocalPlane.hexagonal(6, 22.4)
    plan = greedy(fp.Problem(plane, plane.folded, uniform_field(plane, 3, 1.0), 1.0))
    for i, goal in opportunities(plan, 5, seed=4):
        new = amend(plan, i, goal)
        far = np.linalg.norm(plane.base[moved(plan, new)] - plane.base[i], axis=1)
        assert far.max(initial=0.0) < 3 * 22.4


@pytest.mark.small
def test_bodies_of_ones_own_and_categories_that_are_not_near():
    """A patch has whose bodies are whose, and misses categories that are elsewhere only."""
    capsule = np.array([[0.0, 0.0], [10.0, 0.0]])
    own = np.stack([capsule * s for s in np.linspace(0.6, 1.1, 6)])
    bodies = (
        Body(own, np.linspace(0.5, 1.0, 6), category="arm", meets=("arm", "camera")),
        Body(np.array([[0.0, 0.0]]), 0.5, link="base", category="post", meets=("arm",)),
    )
    far = Obstacle("far", [[500.0, 0.0]], 1.0, category="camera")
    base = np.stack([16.0 * np.arange(6), np.zeros(6)], axis=1)
    plane = make_plane(base, bodies, (far,), length=np.linspace(4.0, 6.0, 6))
    start = np.tile([np.pi / 2, 0.0], (6, 1))
    plan = still(plane, start)
    new = amend(plan, 4, [-np.pi / 2, 0.3])
    assert new.faults() == []
    assert new.outcomes[4] is Outcome.ARRIVED


def test_a_part_is_what_it_is_in_the_whole():
    from fiberplan.planners.amending.subarray import with_part

    rng = np.random.default_rng(8)
    plane = varied_plane(rng, n=6)
    who, obstacles = np.array([0, 2, 3, 5]), np.array([0, 2])
    part = plane.subset(who, obstacles)
    angles = rng.uniform(-3, 3, (6, 2))
    for a in range(4):
        for b in [*range(a + 1, 4), 4, 5]:
            from fiberplan.kernels.clearance import clearances

            whole = who[b] if b < 4 else plane.n + obstacles[b - 4]
            gap = clearances(part.arms, part.with_obstacles(angles[who]), np.array([[a, b]]))
            same = clearances(plane.arms, plane.with_obstacles(angles), np.array([[who[a], whole]]))
            np.testing.assert_array_equal(gap, same)

    counts = rng.integers(1, 5, 6)
    times = np.concatenate([np.cumsum(rng.uniform(0.1, 1, c)) for c in counts])
    motion = fp.Trajectory(np.concatenate([[0], np.cumsum(counts)]), times, rng.normal(size=(len(times), 2)))
    piece = motion.select(who)
    for t in (0.0, 0.7, 9.0):
        np.testing.assert_array_equal(piece.at(t), motion.at(t)[who])
        np.testing.assert_allclose(motion.sampled(np.array([t]))[:, 0], motion.at(t), atol=1e-12)
    back = with_part(motion, who, piece)
    for field in ("offsets", "times", "angles"):
        np.testing.assert_array_equal(getattr(back, field), getattr(motion, field))
