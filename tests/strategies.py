"""What hypothesis draws: bodies, planes, trajectories, problems and plans, small and of every kind."""

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.problem import Problem
from references import STAR, make_plane

HEIGHTS = ("low", "high")
TEXT = st.text(st.characters(codec="utf-8", exclude_characters="\0", exclude_categories=("Cs", "Cc")), max_size=12)


def numbers(low, high):
    """Reals of few digits, so that equal ones and zeros come up."""
    return st.integers(round(low * 64), round(high * 64)).map(lambda k: k / 64)


def points(low, high, count):
    return st.lists(st.tuples(numbers(low, high), numbers(low, high)), min_size=count, max_size=count).map(np.array)


def angles(n, low=-3.0, high=3.0):
    return points(low, high, n)


@st.composite
def outlines(draw):
    """(points, closed): a disc, a capsule, a bent line, a box or a star."""
    kind = draw(st.sampled_from(["disc", "capsule", "line", "box", "star"]))
    if kind == "box":
        x, y, wide, high = (draw(numbers(*ends)) for ends in ((-4, 4), (-4, 4), (0.5, 8), (0.5, 4)))
        return np.array([[x, y], [x + wide, y], [x + wide, y + high], [x, y + high]]), True
    if kind == "star":
        return STAR + draw(points(-4, 4, 1)), True
    return draw(points(-8, 8, {"disc": 1, "capsule": 2, "line": 3}[kind])), False


OF_BOTH_HEIGHTS = (  #: since what meets a category that nothing has is refused
    Body(np.array([[6.0, 0.0]]), 0.5, category="low", meets=("low",), name="tip"),
    Body(np.array([[0.0, 0.0]]), 0.5, "base", category="high", meets=(), name="foot"),
)
MEETS = st.sampled_from([None, (), ("low",), ("high",), HEIGHTS])


@st.composite
def bodies(draw):
    shape, closed = draw(outlines())
    link, category = draw(st.sampled_from(["base", "alpha", "beta"])), draw(st.sampled_from(HEIGHTS))
    return Body(shape, draw(numbers(0.1, 1.5)), link, closed, category, draw(MEETS), draw(TEXT))


@st.composite
def obstacles(draw):
    shape, closed = draw(outlines())
    shape = shape + draw(points(-30, 30, 1))
    return Obstacle(draw(TEXT), shape, draw(numbers(0.1, 1.5)), closed, draw(st.sampled_from(HEIGHTS)), draw(MEETS))


@st.composite
def planes(draw, most=4):
    """Two-link positioners near each other, each with lengths, zeros and speeds of its own."""
    n = draw(st.integers(1, most))
    plane = make_plane(
        draw(points(-20, 20, n)),
        [*OF_BOTH_HEIGHTS, *draw(st.lists(bodies(), min_size=1, max_size=3))],
        draw(st.lists(obstacles(), max_size=2)),
        length=np.array(draw(st.lists(numbers(1, 9), min_size=n, max_size=n))),
        zero=draw(angles(n)),
        online=np.array(draw(st.lists(st.sampled_from([True, True, True, False]), min_size=n, max_size=n))),
        fiber_offsets={name: draw(points(-12, 12, 1))[0] for name in draw(st.sampled_from([("a",), ("a", "b")]))},
    )
    return plane.replace(max_speed=draw(angles(n, 0.5, 4.0)))


@st.composite
def trajectories(draw, n, start=None, fixed=()):
    """One to four knots for each positioner, as rare as they are apart; those `fixed` have one."""
    times, places, offsets = [], [], [0]
    for i in range(n):
        count = 1 if i in fixed else draw(st.integers(1, 4))
        steps = draw(st.lists(numbers(0.25, 3.0), min_size=count, max_size=count))
        own = np.array(draw(angles(count)))
        if start is not None:
            own[0] = start[i]
        times.append(np.cumsum(steps) - draw(st.sampled_from([0.0, 1.0])) * steps[0])
        places.append(own)
        offsets.append(offsets[-1] + count)
    return Trajectory(np.array(offsets), np.concatenate(times), np.concatenate(places))


@st.composite
def problems(draw, most=4):
    """From anywhere to anywhere, with goals missing, dropped or with alternatives."""
    plane = draw(planes(most))
    n = plane.n
    goal = np.array(draw(angles(n)))
    goal[draw(st.lists(st.booleans(), min_size=n, max_size=n))] = np.nan
    count = draw(st.sampled_from([None, 0, 1, 2]))
    alternatives = None if count is None else np.array(draw(angles(n * count))).reshape(n, count, 2)
    priority = np.array(draw(st.lists(numbers(0, 9), min_size=n, max_size=n)))
    margin, notes = draw(numbers(0, 1)), tuple(draw(st.lists(TEXT, max_size=2)))
    try:
        return Problem(plane, draw(angles(n)), goal, margin, priority, "drop", alternatives, notes=notes)
    except ProblemError:  # the start touches something
        assume(False)


@st.composite
def plans(draw):
    """A motion of no planner's, safe or not, with outcomes that are true of it."""
    problem = draw(problems())
    n = problem.n
    motion = draw(trajectories(n, problem.start, np.flatnonzero(~problem.plane.online)))
    outcomes = tuple(_outcome(draw, problem, motion.end, i) for i in range(n))
    lost = [i for i, o in enumerate(outcomes) if o in (Outcome.DROPPED, Outcome.DEADLOCKED)]
    others = st.lists(st.integers(-len(problem.plane.obstacles), n - 1), max_size=2).map(tuple)
    scalars = st.one_of(TEXT, st.booleans(), st.integers(-9, 9), st.floats(-9, 9), st.none())
    return Plan(
        problem,
        motion,
        outcomes,
        draw(st.sampled_from(["direct", "greedy-fold", "none"])),
        draw(st.dictionaries(TEXT, st.one_of(scalars, st.lists(scalars, max_size=2).map(tuple)), max_size=2)),
        draw(st.integers(0, 2**31)),
        {i: draw(others) for i in lost if draw(st.booleans())},
        draw(st.dictionaries(TEXT, st.floats(0, 9), max_size=2)),
        tuple(draw(st.lists(TEXT, max_size=2))),
        draw(st.booleans()),
    )


def _outcome(draw, problem, end, i):
    if not problem.plane.online[i]:
        return Outcome.OFFLINE
    if np.isnan(problem.requested[i, 0]):
        return Outcome.NO_TARGET
    if i in problem.dropped:
        return Outcome.DROPPED
    if np.array_equal(end[i], problem.goal[i]):
        return Outcome.ARRIVED
    return Outcome.DEADLOCKED
