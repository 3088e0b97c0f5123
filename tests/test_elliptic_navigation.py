"""The field of Makarem2016: its gradient, who goes first, and a way out of deadlock that never loses an arrival."""

import csv

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.plan import Outcome
from fiberplan.planners.elliptic_navigation import EllipticNavigationFunction
from fiberplan.planners.elliptic_navigation.compaction import Block, closed_up
from fiberplan.planners.elliptic_navigation.field import zone_push
from fiberplan.planners.elliptic_navigation.relief import AWAY, GOING, RESTING, RETREATING
from fiberplan.planners.elliptic_navigation.run import Drive, assigned_sizes, weighted_width
from fiberplan.planners.elliptic_navigation.zones import circles, elliptic_zones
from fiberplan.scenes.uniform import uniform_field

ALONE = EllipticNavigationFunction(relief="none")


def nearest_to_the_middle(count, name="makarem2016"):
    plane = fp.FocalPlane.load(name)
    middle = plane.base[plane.index["R0C19"]]
    order = np.argsort(np.hypot(*(plane.base - middle).T), kind="stable")
    return plane.subset(order[:count])


def frame(plane, i, angles):
    first, second = plane.links(angles)
    elbow = plane.elbows(angles)[i]
    return (*plane.base[i], *elbow, np.cos(first[i]), np.sin(first[i]), np.cos(second[i]), np.sin(second[i]))


def ellipse(zone, angle):
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    return turn @ np.diag([zone["along"], zone["across"]]) @ turn.T


def potential(plane, angles, zones, size, D, d):
    """The repulsive term of one zone of each of two positioners, from its definition."""
    first, second = plane.links(angles)
    where, shape = [], []
    for i, zone in enumerate(zones):
        turn = {1: first, 2: second}[int(zone["link"])][i]
        origin = plane.elbows(angles)[i] if zone["link"] == 2 else plane.base[i]
        c, s = np.cos(turn), np.sin(turn)
        where.append(origin + [c * zone["u"] - s * zone["v"], s * zone["u"] + c * zone["v"]])
        shape.append(ellipse(zone, turn))
    apart = where[0] - where[1]
    x2 = d**2 * apart @ np.linalg.solve(2.0 * size**2 * (shape[0] + shape[1]), apart)
    return max(0.0, (D**2 - x2) / (x2 - d**2))


@pytest.mark.parametrize("links", [("beta", "beta"), ("alpha", "beta"), ("beta", "alpha")])
@pytest.mark.parametrize("size", [1.0, 1.3])
def test_push_is_minus_the_gradient(links, size):
    """With respect to both joints, through the zone's own centre and its turning weights."""
    plane = nearest_to_the_middle(2)
    bodies = [Body([[3.0, 1.0], [9.0, 1.0]], 1.2, link, category=link, meets=None, name=link) for link in links]
    zones = [elliptic_zones(plane.replace(bodies=(body,)))[0, 0] for body in bodies]
    D, d, h = 14.0, 2.4, 1e-6
    rng, pushed = np.random.default_rng(1), 0
    for angles in rng.uniform(-np.pi, np.pi, (60, 2, 2)):
        slope = []
        for k in range(2):
            step = np.zeros((2, 2))
            step[0, k] = h
            higher, lower = (potential(plane, angles + sign * step, zones, size, D, d) for sign in (1, -1))
            slope.append((higher - lower) / (2 * h))
        frames = [frame(plane, i, angles) for i in range(2)]
        first, second = zone_push(frames[0], zones[0], frames[1], zones[1], size, D, d)
        if 0 < potential(plane, angles, zones, size, D, d) < 50:
            assert (first + second, second) == pytest.approx((-slope[0], -slope[1]), rel=1e-4, abs=1e-6)
            pushed += 1
    assert pushed > 5


def test_zones_of_moons_are_at_their_heights():
    plane = fp.FocalPlane.load("moons")
    zones = elliptic_zones(plane)[0]
    names = [body.name for body in plane.bodies]
    assert {name for name, zone in zip(names, zones, strict=True) if zone["tip"]} == {"holder", "metrology", "high"}
    meeting = {
        frozenset((a, b))
        for a, p in zip(names, zones, strict=True)
        for b, q in zip(names, zones, strict=True)
        if p["category"] & q["meets"] or q["category"] & p["meets"]
    }
    assert meeting == {*(frozenset((name,)) for name in names if name != "snag"), frozenset(("snag", "holder"))}
    assert weighted_width(plane) == pytest.approx(5.0, abs=0.01)
    middle, reach = circles(elliptic_zones(plane), plane.length)
    assert middle[0] - reach[0] <= -0.5
    assert middle[0] + reach[0] >= 19.5


def test_sizes_are_assigned_beforehand():
    sizes, rank = assigned_sizes(np.array([1.0, 3.0, 1.0, 2.0]), 0.3, seed=4)
    assert sizes[1] == 1.0
    assert sorted(rank) == [0, 1, 2, 3]
    assert sizes[1] < sizes[3] < min(sizes[0], sizes[2])
    assert sizes.max() == pytest.approx(1.3)
    drawn = [tuple(assigned_sizes(np.ones(9), 0.3, seed)[1]) for seed in (1, 1, 2)]
    assert drawn[0] == drawn[1] != drawn[2]


def arrival_times(plan):
    motion = plan.trajectory
    return [motion.times[last - 1] for last in motion.offsets[1:]]


@pytest.mark.parametrize("seed", [50, 158])
def test_of_two_arms_the_smaller_zone_goes_first(seed):
    """Both want through the same place: the other makes room and comes after, whichever it is."""
    plane = nearest_to_the_middle(2)
    goal = uniform_field(plane, seed + 1000)
    planner = EllipticNavigationFunction(relief="none", spread=0.5)
    for first in (0, 1):
        priority = np.ones(2)
        priority[first] = 2.0  # the smaller zone
        plan = planner.plan(fp.Problem(plane, plane.folded, goal, priority=priority))
        assert set(plan.outcomes) == {Outcome.ARRIVED}
        assert plan.faults() == []
        times = arrival_times(plan)
        assert times[first] < times[1 - first] - 1.0
        straight = float((np.abs(goal - plane.folded) / plane.max_speed)[first].max())
        assert times[first] < straight + 1.0


def test_one_of_five_leaves_its_target_to_let_another_pass_and_comes_back():
    plane = nearest_to_the_middle(5)
    goal = uniform_field(plane, 535)
    plan = ALONE.plan(fp.Problem(plane, plane.folded, goal))
    assert set(plan.outcomes) == {Outcome.ARRIVED}
    assert plan.faults() == []
    times = np.linspace(0.0, plan.makespan, 400)
    away = np.array([np.hypot(*(plane.fibers(plan.trajectory.at(t)) - plane.fibers(goal))[4]) for t in times])
    came = int(np.argmax(away < 0.2))
    assert 0 < came < 300
    assert away[came:].max() > 10.0
    assert away[-1] < 1e-6
    others = np.arange(5) != 4
    end = plan.trajectory.end
    without = plane.subset(np.flatnonzero(others))
    held = ALONE.plan(fp.Problem(plane.replace(online=others), np.where(others[:, None], plane.folded, end), goal))
    assert Outcome.DEADLOCKED in held.outcomes  # if it did not give way
    assert set(ALONE.plan(fp.Problem(without, without.folded, goal[others])).outcomes) == {Outcome.ARRIVED}


@pytest.fixture(scope="module")
def crowd():
    """A field that the potential alone does not finish."""
    plane = fp.FocalPlane.load("moons").subset(np.arange(400, 520))
    return fp.Problem(plane, plane.folded, uniform_field(plane, 3), priority=np.linspace(1.0, 2.0, 120))


def test_relief_only_adds_arrivals(crowd):
    alone, relieved = ALONE.plan(crowd), EllipticNavigationFunction().plan(crowd)
    for plan in (alone, relieved):
        assert plan.faults() == []
        stuck = plan.having(Outcome.DEADLOCKED)
        assert set(plan.blockers) <= set(stuck.tolist())
        for i in stuck:  # whoever is named is in the way where all stopped
            for j in plan.blockers.get(int(i), ()):
                near = np.hypot(*(crowd.plane.base[i] - crowd.plane.base[j]))
                assert near < crowd.plane.reach[[i, j]].sum()
    before, after = (set(plan.having(Outcome.ARRIVED).tolist()) for plan in (alone, relieved))
    assert len(before) < len(after)
    worth = np.asarray(crowd.priority)
    assert worth[list(before)].sum() < worth[list(after)].sum()
    assert f"{len(before)} of {crowd.n}" in " ".join(relieved.notes)


def test_what_relief_does_not_help_is_struck_out():
    """A positioner whose goal is walled off leads in vain: nobody moves for it in the end, and time does not pass."""
    plane = nearest_to_the_middle(7)
    goal = uniform_field(plane, 0)
    elbow, tip = plane.elbows(goal)[0], plane.fibers(goal)[0]
    along = (tip - elbow) / 17.0
    across = np.array([-along[1], along[0]])
    corners = [elbow + along * u + across * v for u, v in ((1.5, 2.3), (19.5, 2.3), (19.5, -2.3), (1.5, -2.3))]
    cage = Obstacle("cage", np.array([*corners, corners[0]]), 0.2)
    problem = fp.Problem(plane.replace(obstacles=(cage,)), plane.folded, goal, conflicts="drop")
    if problem.dropped:
        pytest.fail(f"the cage is meant to leave goals free: {problem.dropped}")
    plan, alone = EllipticNavigationFunction().plan(problem), ALONE.plan(problem)
    assert [outcome is Outcome.ARRIVED for outcome in plan.outcomes] == [False] + [True] * 6
    assert plan.outcomes[0] is Outcome.DEADLOCKED
    assert plan.blockers[0] == (-1,)
    assert plan.faults() == []
    assert plan.outcomes == alone.outcomes
    assert plan.makespan == alone.makespan
    np.testing.assert_array_equal(plan.trajectory.end, alone.trajectory.end)


def test_states_of_relief(crowd):
    """A leader retreats, then goes; whoever refuses it is away until it is there."""
    plane = crowd.plane
    near = Neighbourhood.of(plane, 0.0)
    sizes, rank = assigned_sizes(np.asarray(crowd.priority), 0.1, 0)
    planner = EllipticNavigationFunction()
    drive = Drive(plane, crowd.start, crowd.goal, 0.0, near, planner._field(crowd), sizes)
    drive.by_the_field(100.0)
    seen, before = set(), drive.there
    from fiberplan.planners.elliptic_navigation import run as module

    class Watched(module.Relief):
        def look(self, scene, now, dt):
            on = super().look(scene, now, dt)
            seen.update(self.state.tolist())
            leaders = self.state == RETREATING
            assert not any(leaders[self._neighbours(i)].any() for i in np.flatnonzero(leaders))
            assert not scene.aim["moves"][self.state == RESTING].any()
            return on

    original, module.Relief = module.Relief, Watched
    try:
        rounds = drive.with_relief(np.asarray(crowd.priority), rank, 1.0, 300.0)
    finally:
        module.Relief = original
    assert seen == {RESTING, RETREATING, GOING, AWAY}
    assert rounds > 0
    assert drive.there.sum() > before.sum()


def test_rounds_run_side_by_side_where_nobody_could_touch():
    """0 and 1 are neighbours, 2 is far away: its block begins at once, that of 1 when 0 has come to rest."""
    far = nearest_to_the_middle(7)
    plane = far.subset([0, 1, 2]).replace(base=np.array([[0.0, 0.0], [25.0, 0.0], [300.0, 0.0]]))
    steps = [[0, 5, 11, 20], [0, 30, 40, 60, 64], [0, 2, 50, 57]]  # the last knots of each are in its blocks
    angles = [0.01 * np.arange(len(some))[:, None] * [1.0, 1.0] for some in steps]
    offsets = np.cumsum([0, *map(len, steps)])
    motion = fp.Trajectory(offsets, 0.1 * np.concatenate(steps), np.concatenate(angles))
    blocks = [Block(np.array([0]), 11, 20), Block(np.array([1]), 30, 40), Block(np.array([2]), 50, 57)]
    blocks.append(Block(np.array([1]), 58, 64))
    closed = closed_up(motion, 0.1, blocks, Neighbourhood.of(plane, 0.0))
    found = [closed.times[a:b] / 0.1 for a, b in zip(closed.offsets[:-1], closed.offsets[1:], strict=True)]
    np.testing.assert_allclose(found[0], [0, 5, 14])
    np.testing.assert_allclose(found[1], [0, 14, 24, 26, 30])
    np.testing.assert_allclose(found[2], [0, 2, 9])
    np.testing.assert_array_equal(closed.start, motion.start)
    np.testing.assert_array_equal(closed.end, motion.end)


def test_those_without_a_target_make_way():
    """One that is wanted nowhere stands in the way of others, and goes."""
    plane = nearest_to_the_middle(5)
    start, goal = uniform_field(plane, 968), np.array(uniform_field(plane, 5968))
    goal[0] = np.nan
    plan = ALONE.plan(fp.Problem(plane, start, goal))
    assert plan.outcomes == (Outcome.NO_TARGET, *[Outcome.ARRIVED] * 4)
    assert plan.faults() == []
    np.testing.assert_allclose(plan.trajectory.end[0], plane.folded[0])


def test_time_is_limited(crowd):
    for planner in (EllipticNavigationFunction(max_time=4.0), EllipticNavigationFunction(max_time=60.0)):
        plan = planner.plan(crowd)
        assert plan.makespan <= planner.max_time + 1e-9
        assert plan.faults() == []


@pytest.mark.small
@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"lambda1": 0.0}, "lambda1 must be positive, got 0"),
        ({"lambda2": -1.0}, "lambda2"),
        ({"lambda3": np.nan}, "lambda3"),
        ({"influence": 0.0}, "influence must be positive, got 0 mm"),
        ({"dt": np.inf}, "dt must be positive, got inf s"),
        ({"spread": -0.1}, "spread"),
        ({"relief": "hope"}, "'hope'"),
        ({"max_time": 0.0}, "max_time"),
    ],
)
def test_settings_are_checked(settings, said):
    with pytest.raises(ProblemError, match="elliptic-navigation-function") as error:
        EllipticNavigationFunction(**settings)
    assert said in str(error.value)


@pytest.mark.small
def test_four_bars_are_refused():
    plane = fp.FocalPlane.load("miradas")
    with pytest.raises(ProblemError, match="four-bar arms of miradas"):
        ALONE.plan(fp.Problem(plane, plane.folded, plane.folded))


@pytest.mark.small
def test_a_step_across_the_patrol_zone_is_refused():
    plane = nearest_to_the_middle(2)
    problem = fp.Problem(plane, plane.folded, plane.folded)
    with pytest.raises(ProblemError, match=r"dt 10 s: positioner 'R0C19' could move .* \(50\.000 mm\)"):
        EllipticNavigationFunction(dt=10.0).plan(problem)
    assert set(EllipticNavigationFunction(dt=2.0).plan(problem).outcomes) == {Outcome.ARRIVED}


@pytest.mark.parametrize("k", [1, 2, 3])
def test_moons_cases_of_250(shared_data, k):
    """At least the published arrivals, and no contact."""
    folder = shared_data / "moons"
    plane = fp.FocalPlane.load(folder / "250" / "positioners.cfg")
    targets = fp.Targets.read(folder / "250" / f"targets_{k}.txt")
    with (folder / "published_results.csv").open() as file:
        rows = {(row["config"], row["n_positioners"]): row for row in csv.DictReader(file)}
    published = rows[str(k), str(len(targets))]
    problem = fp.Problem.from_targets(plane, targets, conflicts="drop")
    for planner, column in ((ALONE, "dnf_arrived"), (EllipticNavigationFunction(), "dnf_fsm_arrived")):
        plan = planner.plan(problem)
        assert plan.faults() == []
        assert len(plan.having(Outcome.ARRIVED)) >= int(published[column])
