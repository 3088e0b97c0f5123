"""Problems that tests of several planners share: each of a kind, and each touched by straight motion."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.inverse_kinematics import solutions
from fiberplan.planners.direct import improving
from fiberplan.scenes import decisive
from fiberplan.scenes.decisive import PITCH
from fiberplan.scenes.uniform import uniform_field

SEVEN_PLACES = """[grid]
kind = "hexagonal"
rings = 1
pitch = 22.4
"""  #: of an instrument file: where its positioners are
ARM = """[arm]
length = 7.4
[fibers]
fiber = [15.0, 0.0]
[joints.alpha]
lower = 0
upper = 360
folded = 0
speed = 30
[joints.beta]
lower = 0
upper = 180
folded = 180
speed = 20
[[bodies]]
points = [[0.0, 0.0], [15.0, 0.0]]
radius = 1.5
"""  #: and their arms


def hexagon(rings=2, **changes):
    return fp.FocalPlane.hexagonal(rings, PITCH, **changes)


def narrow_exchange():
    """Two exchange sides in joint ranges that leave room for little else, so that there is little to search."""
    there = decisive.exchange()
    ranges = {"lower": np.radians([[125.0, 30.0], [20.0, 30.0]]), "upper": np.radians([[290.0, 180.0], [225.0, 180.0]])}
    return fp.Problem(there.plane.replace(folded=there.start, **ranges), there.start, there.goal)


def field_to_field(margin=0.0, rings=4, seed=0):
    plane = hexagon(rings)
    return fp.Problem(plane, uniform_field(plane, seed, margin), uniform_field(plane, seed + 100, margin), margin)


def from_folded(margin=0.0, rings=4, seed=0, **changes):
    plane = hexagon(rings).replace(**changes)
    return fp.Problem(plane, plane.folded, uniform_field(plane, seed, margin), margin)


def offline_across():
    """An arm that cannot move lies across the others' paths; another stands folded."""
    return decisive.offline_across(4)


def among_obstacles():
    posts = tuple(Obstacle(f"post {k}", [[x, y]], 1.5) for k, (x, y) in enumerate([(11.2, 14.0), (-22.4, 13.0)]))
    wall = Obstacle("wall", [[-60.0, 52.0], [60.0, 52.0], [60.0, 54.0], [-60.0, 54.0]], closed=True)
    plane = hexagon(2).replace(obstacles=(*posts, wall))
    return fp.Problem(plane, plane.folded, uniform_field(plane, 5, 0.5), 0.5)


def park_in_range():
    """SDSS parks at (10, 170) deg, within the joints' ranges."""
    plane = hexagon(3, folded=np.radians([10.0, 170.0]))
    return fp.Problem(plane, plane.folded, uniform_field(plane, 6, 0.0), 0.0)


def unequal():
    """Speeds and arm lengths differ from positioner to positioner, and joints from each other."""
    plane = hexagon(3)
    rng = np.random.default_rng(7)
    speed = np.radians(rng.uniform(10.0, 40.0, (plane.n, 2)))
    plane = plane.replace(max_speed=speed, length=7.4 + rng.uniform(-0.1, 0.1, plane.n))
    return fp.Problem(plane, uniform_field(plane, 7, 0.2), uniform_field(plane, 8, 0.2), 0.2)


def crowded():
    """More than can be folded: some get stuck."""
    return from_folded(margin=3.0, rings=6, seed=3)


def some_without_goal():
    problem = field_to_field(seed=2)
    goal = problem.goal.copy()
    goal[::3] = np.nan
    return fp.Problem(problem.plane, problem.start, goal, 0.0)


def several_heights():
    """Two layers that pass over each other: arms turn above, and the inner links have their own height."""
    bodies = (
        Body(np.array([[3.0, 0.0], [15.0, 0.0]]), 1.5, category="high", meets=("high",), name="arm"),
        Body(np.array([[0.0, 0.0], [7.4, 0.0]]), 2.0, "alpha", category="low", meets=("low",), name="crank"),
        Body(np.array([[0.0, 0.0]]), 2.5, "base", category="low", meets=(), name="foot"),
    )
    post = Obstacle("post", [[11.2, 13.0]], 1.5, category="low", meets=("low",))
    plane = hexagon(2, bodies=bodies).replace(obstacles=(post,))
    return fp.Problem(plane, uniform_field(plane, 9, 0.1), uniform_field(plane, 10, 0.1), 0.1)


def other_elbows():
    """Beta turns both ways, so that each target has a configuration on either elbow side, and alpha wraps."""
    plane = hexagon(2, lower=np.radians([-90.0, -180.0]), upper=np.radians([300.0, 180.0]))
    start, goal = uniform_field(plane, 12, 0.1), uniform_field(plane, 21, 0.1)
    found = solutions(plane, np.arange(plane.n), plane.fibers(goal), plane.fiber, np.zeros(plane.n))
    return fp.Problem(plane, start, goal, 0.1, alternatives=found)


def endless():
    """Alpha may turn for ever."""
    plane = hexagon(2, lower=(-np.inf, 0.0), upper=(np.inf, np.pi))
    return fp.Problem(plane, uniform_field(plane, 13, 0.3), uniform_field(plane, 14, 0.3), 0.3)


def touching_goals():
    """Goals drawn by each positioner for itself: of those that touch, the one of lower priority is dropped."""
    plane, rng = hexagon(2), np.random.default_rng(15)
    goal = np.stack([rng.uniform(0.0, 2 * np.pi, plane.n), rng.uniform(0.3, np.pi, plane.n)], axis=1)
    goal[5] = plane.upper[5] + 0.1
    priority = rng.integers(1, 5, plane.n).astype(float)
    return fp.Problem(plane, plane.folded, goal, 0.2, priority, conflicts="drop")


def behind_posts():
    """The first one's goal lies in a pocket that no path leads into; the other's does not."""
    posts = tuple(Obstacle(f"post {x:g} {y:g}", [[x, y]], 1.0) for x in (-7.0, 7.0) for y in (-2.51, 2.51))
    plane = decisive.row(2, 30.0).replace(obstacles=posts)
    return fp.Problem(plane, plane.folded, np.radians([[90.0, 20.0], [180.0, 60.0]]))


def four_bars():
    """Three neighbours on MIRADAS' ring, ten times as fast, go from field to field past each other."""
    plane = fp.FocalPlane.load("miradas").subset(np.arange(3))
    plane = plane.replace(max_speed=10.0 * plane.max_speed)
    return fp.Problem(plane, uniform_field(plane, 2, 0.5), uniform_field(plane, 3, 0.5), 0.5)


SCENES = (
    decisive.exchange,
    field_to_field,
    from_folded,
    offline_across,
    among_obstacles,
    park_in_range,
    unequal,
    crowded,
    some_without_goal,
    several_heights,
    other_elbows,
    endless,
    touching_goals,
    behind_posts,
    four_bars,
)


def keeps_its_solution_when_interrupted(search, monkeypatch):
    """Whether a search that is stopped in its first attempt at fewer steps has the paths that it had."""
    before, path = search.steps, search.lattice.path.copy()

    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(search, "attempt", interrupted)
    monkeypatch.setattr(improving, "_hurry", lambda *arguments: None)
    with pytest.raises(KeyboardInterrupt):
        improving.shorten(search, lambda: True)
    np.testing.assert_array_equal(search.lattice.path, path)
    return search.steps == before and search.touching == 0
