"""What must not change a plan or a proof: where the plane lies, who is counted first, which way time runs, its unit."""

import dataclasses

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

import fiberplan as fp
from fiberplan.certificates import proven_unreachable
from fiberplan.certificates.safety import CAP, TOLERANCE
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.io.plan_file import plan_bytes
from fiberplan.motion import Trajectory
from fiberplan.scenes.decisive import few, offline_across
from problems import field_to_field, from_folded
from references import path_past_fixed
from strategies import numbers, planes, plans, trajectories

# what strategies draw is often refused, and compiling takes seconds once
FEW = settings(
    max_examples=20,
    deadline=None,
    derandomize=True,
    phases=[Phase.generate, Phase.shrink],
    suppress_health_check=list(HealthCheck),
)


def moved(plane, turn, shift):
    """The same array somewhere else: turned by `turn` [rad] about the origin, then shifted by `shift` (2,) [mm]."""
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, s], [-s, c]])
    fixed = (dataclasses.replace(body, points=body.points @ rotation) for body in plane.bodies if body.link == "base")
    return plane.replace(
        base=plane.base @ rotation + shift,
        zero=plane.zero + np.array([turn, 0.0]),
        bodies=tuple(next(fixed) if body.link == "base" else body for body in plane.bodies),
        obstacles=tuple(dataclasses.replace(o, points=o.points @ rotation + shift) for o in plane.obstacles),
    )


def reversed_in_time(motion):
    """The same motion backwards."""
    order = np.concatenate(
        [np.arange(b - 1, a - 1, -1) for a, b in zip(motion.offsets, motion.offsets[1:], strict=False)]
    )
    return Trajectory(motion.offsets, motion.duration - motion.times[order], motion.angles[order])


def assert_same_proof(one, other, pairs=None):
    """The same clearances, as far as both are sharp, of the same pairs."""
    assert len(one.violations) == len(other.violations)
    for kind in ("", "obstacle_"):
        mine, theirs = (
            {
                tuple(pair): gap
                for pair, gap in zip(getattr(p, f"{kind}pairs").tolist(), getattr(p, f"{kind}clearance"), strict=True)
            }
            for p in (one, other)
        )
        for pair in mine.keys() | theirs.keys():  # whoever is missing cannot come near
            gaps = [min(p.get(pair, np.inf), one.margin + CAP) for p in (mine, theirs)]
            assert gaps[0] == pytest.approx(gaps[1], abs=TOLERANCE + 1e-6), pair
    undecidable = any(abs(c.clearance - one.margin) < TOLERANCE for p in (one, other) for c in p.contacts + p.undecided)
    if not undecidable:
        assert {c.pair for c in one.contacts} == {c.pair for c in other.contacts}
        assert {c.pair for c in one.resting} == {c.pair for c in other.resting}


@st.composite
def motions(draw):
    plane = draw(planes())
    return plane, draw(trajectories(plane.n)), draw(numbers(0, 1))


@FEW
@given(motions(), st.floats(-3.0, 3.0), st.tuples(numbers(-500, 500), numbers(-500, 500)))
def test_the_proof_does_not_depend_on_where_the_plane_lies(scene, turn, shift):
    plane, motion, margin = scene
    assert_same_proof(fp.verify(plane, motion, margin), fp.verify(moved(plane, turn, shift), motion, margin))


@FEW
@given(motions())
def test_the_proof_does_not_depend_on_the_direction_of_time(scene):
    plane, motion, margin = scene
    assert_same_proof(fp.verify(plane, motion, margin), fp.verify(plane, reversed_in_time(motion), margin))


@FEW
@given(motions(), st.sampled_from([0.25, 3.0, 60.0]))
def test_the_proof_does_not_depend_on_the_unit_of_time(scene, unit):
    plane, motion, margin = scene
    slow = Trajectory(motion.offsets, motion.times * unit, motion.angles)
    one, other = (
        fp.verify(plane, motion, margin),
        fp.verify(plane.replace(max_speed=plane.max_speed / unit), slow, margin),
    )
    assert_same_proof(one, other)
    for mine, theirs in zip(one.contacts, other.contacts, strict=False):
        if mine.pair == theirs.pair and mine.clearance < margin - TOLERANCE:
            assert theirs.time == pytest.approx(mine.time * unit, abs=1e-3 * unit)


@FEW
@given(motions(), st.randoms(use_true_random=False))
def test_the_proof_does_not_depend_on_who_is_counted_first(scene, random):
    plane, motion, margin = scene
    order = np.array(random.sample(range(plane.n), plane.n))
    knots = [np.arange(*motion.offsets[i : i + 2]) for i in order]
    offsets = np.concatenate([[0], np.cumsum([len(k) for k in knots])])
    knots = np.concatenate(knots)
    other = fp.verify(plane.subset(order), Trajectory(offsets, motion.times[knots], motion.angles[knots]), margin)
    one = fp.verify(plane, motion, margin)
    number = np.argsort(order)  # of positioner i among those in the new order

    def renamed(pair):
        i, j = pair
        return (int(number[i]), j) if j < 0 else tuple(sorted(number[[i, j]].tolist()))

    def all_renamed(contacts):
        return tuple(dataclasses.replace(c, pair=renamed(c.pair)) for c in contacts)

    expected = dataclasses.replace(
        one,
        pairs=np.sort(number[one.pairs], axis=1).reshape(-1, 2),
        obstacle_pairs=np.stack([number[one.obstacle_pairs[:, 0]], one.obstacle_pairs[:, 1]], axis=1),
        contacts=all_renamed(one.contacts),
        resting=all_renamed(one.resting),
    )
    assert_same_proof(expected, other)


PROBLEMS = {
    "field to field": lambda: field_to_field(0.5, 3, 0),
    "another": lambda: field_to_field(0.5, 3, 2),
    "from folded": lambda: from_folded(1.0, 3, 1),
    "offline across": lambda: offline_across(2),
}


def direct(problem):
    return fp.planners.Direct().plan(problem)


@pytest.fixture(scope="module", params=PROBLEMS.values(), ids=PROBLEMS)
def direct_plan(request):
    plan = direct(request.param())
    assert plan.certificate.contacts == ()
    return plan


def test_direct_does_not_depend_on_where_the_plane_lies(direct_plan):
    problem = direct_plan.problem
    plane = moved(problem.plane, 0.0, np.array([1024.0, -512.0]))
    other = direct(fp.Problem(plane, problem.start, problem.goal, problem.margin))
    assert other.outcomes == direct_plan.outcomes
    assert other.makespan == pytest.approx(direct_plan.makespan, rel=1e-6)


def test_direct_does_not_depend_on_who_is_counted_first(direct_plan):
    problem = direct_plan.problem
    order = np.random.default_rng(0).permutation(problem.n)
    plane = problem.plane.subset(order)
    other = direct(fp.Problem(plane, problem.start[order], problem.goal[order], problem.margin))
    assert other.outcomes == tuple(direct_plan.outcomes[i] for i in order)
    assert other.makespan == pytest.approx(direct_plan.makespan, rel=1e-6)


def test_twice_as_fast_takes_half_the_time(direct_plan):
    problem = direct_plan.problem
    plane = problem.plane.replace(max_speed=2.0 * problem.plane.max_speed)
    other = direct(fp.Problem(plane, problem.start, problem.goal, problem.margin))
    np.testing.assert_array_equal(other.trajectory.angles, direct_plan.trajectory.angles)
    np.testing.assert_array_equal(2.0 * other.trajectory.times, direct_plan.trajectory.times)


def test_a_plan_backwards_is_a_plan_back(direct_plan):
    problem, back = direct_plan.problem, reversed_in_time(direct_plan.trajectory)
    assert fp.verify(problem.plane, back, problem.margin).ok
    np.testing.assert_array_equal(back.end, problem.start)


@FEW
@given(plans())
def test_plans_read_back_as_they_were_written(tmp_path_factory, plan):
    path = tmp_path_factory.mktemp("plans") / "plan.fits"
    plan.write(path)
    again = fp.Plan.read(path)
    assert plan_bytes(again) == path.read_bytes()
    for name in (
        "outcomes",
        "planner",
        "parameters",
        "seed",
        "blockers",
        "timings",
        "notes",
        "interrupted",
        "makespan",
    ):
        assert getattr(again, name) == getattr(plan, name), name
    for name in ("start", "goal", "requested", "priority", "alternatives"):
        np.testing.assert_array_equal(getattr(again.problem, name), getattr(plan.problem, name))
    for name in ("margin", "conflicts", "dropped", "notes"):
        assert getattr(again.problem, name) == getattr(plan.problem, name), name
    for name in ("offsets", "times", "angles"):
        np.testing.assert_array_equal(getattr(again.trajectory, name), getattr(plan.trajectory, name))
    for name in ("base", "length", "zero", "lower", "upper", "max_speed", "folded", "online"):
        np.testing.assert_array_equal(getattr(again.problem.plane, name), getattr(plan.problem.plane, name))
    assert again.problem.plane.ids == plan.problem.plane.ids
    assert str(again.certificate) == str(plan.certificate)
    np.testing.assert_array_equal(again.certificate.clearance, plan.certificate.clearance)


def walled_in(seed):
    """One arm that can move among two that cannot and five posts; (plane, start, goal), or None if either touches."""
    rng = np.random.default_rng(seed)
    plane = few(np.array([[0.0, 0.0], [22.4, 0.0], [-11.0, 19.4]])).replace(
        online=np.array([True, False, False]),
        obstacles=tuple(Obstacle(f"post {k}", rng.uniform(-16, 16, (1, 2)), 1.0) for k in range(5)),
    )
    start = plane.kinematics.random(plane, rng, np.arange(3))
    goal = plane.kinematics.random(plane, rng, np.array([0]))
    try:
        fp.Problem(plane, start, np.concatenate([goal, np.full((2, 2), np.nan)]), 0.2)
    except ProblemError:
        return None
    return plane, start, goal[0]


def test_what_is_proven_unreachable_is_what_a_grid_says():
    """Wherever free cells of a grid join, nothing is proven; and wherever a coarse grid finds no path, it is."""
    counts = {True: 0, False: 0, None: 0}
    for seed in range(120):
        scene = walled_in(seed)
        if scene is None:
            continue
        plane, start, goal = scene
        proven = proven_unreachable(plane, 0, start, goal, 0.2)
        path = path_past_fixed(plane, 0, start, goal, 0.2, 0.05)
        counts[path] += 1
        assert path is None or proven == (not path), seed
        if min(counts[True], counts[False]) == 3:
            return
    pytest.fail(f"of each kind three are needed: {counts}")
