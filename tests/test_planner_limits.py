"""Instruments of extreme shape: memory stays bounded, and a plan or one clear line comes back."""

import tracemalloc

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.planners import PLANNERS, amend
from fiberplan.planners.direct.lattice import make_lattice
from fiberplan.planners.direct.nodes import MOST_BETAS, MOST_STEPS, step_length
from fiberplan.planners.direct.scratch import make_scratch
from fiberplan.planners.shared.memory import MOST_BYTES, refuse_large
from fiberplan.scenes.uniform import uniform_field
from fiberplan.tolerances import UNDER_LIMIT

DEG = np.pi / 180.0


def field_to_field(rings=1, **changes):
    plane = fp.FocalPlane.hexagonal(rings, 22.4)
    start, goal = uniform_field(plane, 0), uniform_field(plane, 100)
    return fp.Problem(plane.replace(**changes), start, goal)


def slow(joint, factor, who=3, rings=1):
    """One joint turns so many times slower than all others."""
    speed = fp.FocalPlane.hexagonal(rings, 22.4).max_speed.copy()
    speed[who, joint] /= factor
    return field_to_field(rings, max_speed=speed)


def many_turns():
    """Alpha has a range of 40 turns, and one goal is ten turns away."""
    plain = field_to_field()
    lower, upper = plain.plane.lower.copy(), plain.plane.upper.copy()
    lower[:, 0], upper[:, 0] = -40.0 * np.pi, 40.0 * np.pi
    goal = np.array(plain.goal)
    goal[3, 0] += 20.0 * np.pi
    return fp.Problem(plain.plane.replace(lower=lower, upper=upper), plain.start, goal)


def without_ends():
    lower, upper = (np.array(getattr(field_to_field().plane, name)) for name in ("lower", "upper"))
    lower[:, 0], upper[:, 0] = -np.inf, np.inf
    return field_to_field(lower=lower, upper=upper)


SCENES = {
    "alpha 30 times slower": lambda: slow(0, 30.0),
    "alpha 1,000 times slower": lambda: slow(0, 1000.0),
    "beta 1,000 times slower": lambda: slow(1, 1000.0),
    "alpha 1e12 times slower": lambda: slow(0, 1e12),
    "alpha 1,000 times faster": lambda: slow(0, 1e-3),
    "ten turns": many_turns,
    "no ends": without_ends,
}


@pytest.mark.parametrize("name", list(PLANNERS))
@pytest.mark.parametrize("scene", list(SCENES))
def test_a_plan_or_one_line(scene, name):
    problem, plan, said = SCENES[scene](), None, ""
    tracemalloc.start()
    try:
        plan = PLANNERS[name]().plan(problem)
    except ProblemError as error:
        said = str(error)
    finally:
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert peak < MOST_BYTES
    assert plan.faults() == [] if plan else name in said
    assert "\n" not in said


@pytest.mark.parametrize("scene", ["alpha 30 times slower", "beta 1,000 times slower", "ten turns", "no ends"])
def test_the_direct_planner_finds_the_bound_all_the_same(scene):
    plan = fp.planners.Direct().plan(SCENES[scene]())
    assert len(plan.lost) == 0
    assert plan.makespan == pytest.approx(plan.lower_bound, rel=0.05)


@pytest.mark.parametrize("scene", list(SCENES))
def test_lattices_are_bounded_by_what_a_move_takes(scene):
    problem = SCENES[scene]()
    plane, start, goal = problem.plane, problem.start, problem.goal
    bound = float((np.abs(goal - start) / (plane.max_speed * UNDER_LIMIT)).max())
    length = step_length(plane, start, goal, 6 * DEG)
    longest = max(length.longest, bound / MOST_STEPS)
    steps = int(np.ceil(bound / longest))
    lattice = make_lattice(plane, start, goal, plane.online, bound / steps, steps, length.widest)
    assert steps <= MOST_STEPS
    assert lattice.alpha.shape[1] <= MOST_STEPS + 2 * MOST_BETAS + 4
    assert lattice.beta.shape[1] < MOST_BETAS
    assert np.all(np.abs(lattice.last - lattice.first) <= steps)
    scratch = make_scratch(lattice, 6)
    assert sum(array.nbytes for array in (*scratch[:-1], *scratch.known)) < MOST_BYTES


def test_amending_is_bounded_too():
    problem = slow(0, 1000.0)
    plan = fp.planners.Direct().plan(problem)
    goal = problem.goal[3] + [0.3, 0.0]
    tracemalloc.start()
    try:
        new = amend(plan, 3, goal, longer=10.0)
        assert new.faults() == []
        assert tracemalloc.get_traced_memory()[1] < MOST_BYTES
    finally:
        tracemalloc.stop()
    with pytest.raises(ProblemError, match="longer must be a part of the makespan, 0 to 10, got 1e\\+09"):
        amend(plan, 3, goal, longer=1e9)


@pytest.mark.small
@pytest.mark.parametrize(
    ("planner", "said"),
    [
        (fp.planners.PrioritizedRoadmap(dt=1e-5, collision_dt=1e-5), r"that would take .* GiB, and 2 GiB are the most"),
        (fp.planners.PrioritizedRoadmap(grid=(1000, 1000)), r"7 positioners, 1e\+06 cells and 19 steps of 6 s"),
        (fp.planners.NavigationFunction(dt=1e-6), "dt 1e-06 s is so short that alpha of positioner"),
    ],
)
def test_settings_that_would_take_all_memory_are_refused(planner, said):
    with pytest.raises(ProblemError, match=said) as error:
        planner.plan(field_to_field())
    assert "\n" not in str(error.value)


def test_too_many_loops_are_refused():
    with pytest.raises(ProblemError, match="greedy-fold: max_travel 700 deg in steps of 1e-06 deg are 7e"):
        fp.planners.GreedyFold(step=np.radians(1e-6))


def test_what_is_large():
    refuse_large(float(MOST_BYTES), "just right")
    with pytest.raises(ProblemError, match=r"three numbers: that would take 2\.5 GiB, and 2 GiB are the most"):
        refuse_large(2.5 * 1024**3, "three numbers")
    with pytest.raises(ProblemError, match="nan"):
        refuse_large(np.nan, "no number")


def test_a_turn_that_is_too_small_is_said_to_be():
    plan = fp.planners.Direct(turn=1.0 * DEG).plan(field_to_field())
    assert plan.faults() == []
    note = next(note for note in plan.notes if "in which an alpha turns by up to" in note)
    assert "not 1 deg" in note
    assert not any("alpha turns" in note for note in fp.planners.Direct().plan(field_to_field()).notes)
