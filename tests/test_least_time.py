"""Times that are proven to be needed: never more than a motion takes, and nearly as much as the quickest one does."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates import least_time as least_time_module
from fiberplan.certificates.least_time import proven_least_time
from fiberplan.certificates.unreachable import decided
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.focal_plane.neighbours import Neighbourhood, clearances_around
from fiberplan.scenes.uniform import uniform_field

SPEED = np.radians(30.0)  # of both joints


def beside_a_post():
    """An arm that has to fold to pass a post."""
    plane = fp.FocalPlane.hexagonal(0, 22.4, lower=(-np.pi, 0.0), upper=(np.pi + 0.2, np.pi), folded=(0.0, np.pi))
    plane = plane.replace(max_speed=np.full((1, 2), SPEED))
    return plane.replace(obstacles=(Obstacle("post", [[0.0, 15.0]], 1.5),))


def quickest_on_nodes(plane, start, goal, margin, turn):
    """Seconds of the quickest motion of the arm over nodes that are clear and so far apart."""
    nodes = [np.arange(plane.lower[0, m], plane.upper[0, m] + 1e-9, turn) for m in (0, 1)]
    grid = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1).reshape(-1, 2)
    near = Neighbourhood.of(plane, margin)
    clear = clearances_around(plane.arms, near, plane.with_obstacles(start), 0, grid) >= margin
    clear = clear.reshape(len(nodes[0]), -1)
    first, last = (tuple(int(np.abs(nodes[m] - q[0, m]).argmin()) for m in (0, 1)) for q in (start, goal))
    reached = np.zeros_like(clear)
    reached[first] = True
    for step in range(1, 4 * len(nodes[0])):
        spread = reached.copy()
        for joint in (0, 1):
            ahead, behind = np.roll(spread, 1, joint), np.roll(spread, -1, joint)
            ahead[(slice(None),) * joint + (0,)] = behind[(slice(None),) * joint + (-1,)] = False
            spread = spread | ahead | behind
        reached = spread & clear
        if reached[last]:
            return step * turn / SPEED
    raise AssertionError("the nodes have no path")


def two_arms(seed, margin):
    """Two arms beside each other that go from field to field, and a motion of theirs; None if none was found."""
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    plane = plane.replace(max_speed=np.full((plane.n, 2), SPEED), online=np.isin(np.arange(plane.n), [3, 4]))
    start, other = (np.array(uniform_field(plane, 2 * seed + k, margin)) for k in (0, 1))
    goal = start.copy()
    goal[[3, 4]] = other[[3, 4]]
    if np.nanmin(plane.clearance(goal)) < margin + 2e-3:
        return None
    path, _ = decided(plane, [3, 4], {3: goal[3], 4: goal[4]}, start, margin)
    if path is None:
        return None
    seconds = float((np.abs(np.diff(path, axis=0)).max(axis=1) / SPEED).sum())
    return plane, start, goal, seconds


def test_an_arm_with_nothing_around_needs_what_its_joints_need():
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(max_speed=np.full((1, 2), SPEED))
    start, goal = np.radians([[10.0, 20.0]]), np.radians([[100.0, 170.0]])
    assert proven_least_time(plane, [0], start, goal, 0.0, 60.0) == pytest.approx(5.0)
    assert proven_least_time(plane, [0], start, goal, 0.0, 3.0) == 3.0  # nobody asks for more


def test_an_arm_that_has_to_fold_on_its_way_needs_nearly_what_the_quickest_path_takes():
    plane, start, goal = beside_a_post(), np.radians([[60.0, 0.0]]), np.radians([[120.0, 0.0]])
    quickest = quickest_on_nodes(plane, start, goal, 0.2, np.radians(0.5))
    assert quickest > 1.5 * 60.0 / 30.0  # by its alpha
    for turn, part in ((2.0, 0.93), (0.5, 0.98), (0.25, 0.985)):
        proven = proven_least_time(plane, [0], start, goal, 0.2, 20.0, np.radians(turn))
        assert part * quickest < proven <= quickest


@pytest.mark.parametrize("longest", [5.0, 20.0])
def test_who_never_gets_there_needs_all_the_time_that_is_asked_about(longest):
    stiff = {"upper": np.array([[np.pi + 0.2, 0.01]]), "folded": np.zeros((1, 2))}
    plane = beside_a_post().replace(**stiff)
    start, goal = np.radians([[60.0, 0.0]]), np.radians([[120.0, 0.0]])
    assert proven_least_time(plane, [0], start, goal, 0.2, longest) == longest


@pytest.mark.parametrize("where", ["start", "goal", "range"])
def test_nothing_is_proven_of_ends_that_may_not_be(where):
    plane, start, goal = beside_a_post(), np.radians([[60.0, 0.0]]), np.radians([[120.0, 0.0]])
    if where == "range":
        goal[0, 0] = plane.upper[0, 0] + 0.1
    else:
        (start if where == "start" else goal)[0, 0] = np.radians(88.0)
    joints = float(np.abs(goal - start).max() / SPEED)
    assert proven_least_time(plane, [0], start, goal, 0.2, 20.0) == pytest.approx(joints)


def test_a_goal_that_is_open_is_anywhere():
    plane, start = beside_a_post(), np.radians([[60.0, 0.0]])
    assert proven_least_time(plane, [0], start, np.full((1, 2), np.nan), 0.2, 20.0) == 0.0
    goal = np.radians([[120.0, np.nan]])  # beta may stay folded
    extended = proven_least_time(plane, [0], start, np.nan_to_num(goal), 0.2, 20.0)
    assert proven_least_time(plane, [0], start, goal, 0.2, 20.0) < extended


@pytest.mark.parametrize("seed", range(6))
def test_no_motion_of_two_takes_less(seed):
    scene = two_arms(seed, 0.5)
    if scene is None:
        pytest.skip("no such scene")
    plane, start, goal, seconds = scene
    joints = float((np.abs(goal - start) / SPEED).max())
    before = 0.0
    for margin in (-1.0, 0.5):
        proven = proven_least_time(plane, [3, 4], start, goal, margin, seconds + 1.0, np.radians(6.0))
        assert max(before, joints) <= proven <= seconds
        assert proven == proven_least_time(plane, [4, 3], start, goal, margin, seconds + 1.0, np.radians(6.0))
        before = proven


@pytest.mark.parametrize(
    ("start", "goal", "part"),
    [
        ([[94.0, 129.0], [107.0, 35.0]], [[34.0, 88.0], [156.0, 47.0]], 0.85),
        ([[333.0, 31.0], [249.0, 104.0]], [[149.0, 92.0], [46.0, 66.0]], 0.95),
    ],
)
def test_two_in_each_others_way_need_more_than_each_alone(start, goal, part):
    plane = fp.FocalPlane.hexagonal(1, 22.4).subset(np.array([3, 4]))
    plane = plane.replace(max_speed=np.full((2, 2), SPEED))
    start, goal = np.radians(start), np.radians(goal)
    plan = fp.planners.Direct().plan(fp.Problem(plane, start, goal, 1.0))
    (bound,) = plan.bounds
    assert plan.certificate.ok
    assert bound.kind == "pair"
    assert not bound.proven
    proven = proven_least_time(plane, [0, 1], start, goal, 1.0, plan.makespan, np.radians(1.5))
    assert max(1.05 * plan.lower_bound, part * bound.seconds) < proven <= plan.makespan


@pytest.mark.parametrize(
    "wrong",
    [
        *({"positioners": who} for who in ([], [0, 0], [1], [-1], [0, 1, 2], [0.7], "0", None, [False])),
        *({"turn": turn} for turn in (-1.0, 0.0, np.nan, np.inf, 1e-19, "fine", [0.1, 0.2])),
        *({"margin": margin} for margin in (np.nan, np.inf, "wide")),
        *({"longest": seconds} for seconds in (-1.0, np.inf, np.nan, "long")),
        *({"start": q} for q in (np.zeros(2), np.zeros((3, 2)), np.full((1, 2), np.nan), None)),
        *({"goal": q} for q in (np.zeros(2), np.full((1, 2), np.inf), "there")),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_line(wrong):
    asked = {"positioners": [0], "start": np.zeros((1, 2)), "goal": np.zeros((1, 2)), "margin": 0.2, "longest": 1.0}
    with pytest.raises(ProblemError) as raised:
        proven_least_time(beside_a_post(), **asked | wrong)
    assert "\n" not in str(raised.value)


def test_one_that_cannot_move_is_not_asked_about():
    plane = beside_a_post().replace(online=np.zeros(1, bool))
    with pytest.raises(ProblemError, match="can move"):
        proven_least_time(plane, [0], np.zeros((1, 2)), np.zeros((1, 2)), 0.2, 1.0)


@pytest.mark.parametrize("margin", [-0.2, 0.0, 2e-6, 1e-3])
def test_overlaps_count_by_their_depth_at_the_ends_too(margin):
    """An arm without a radius that stands within a post is nearer than any margin: nothing is proven of it."""
    plane = fp.FocalPlane.hexagonal(0, 22.4, radius=0.0, upper=(2 * np.pi, 0.01), folded=(0.0, 0.0))
    post = Obstacle("post", [[-3.0, 15.0], [3.0, 15.0], [3.0, 18.0], [-3.0, 18.0]], 0.0, closed=True)
    plane, within = plane.replace(obstacles=(post,)), np.radians([[90.0, 0.0]])
    assert proven_least_time(plane, [0], within, within, margin, 20.0) == 0.0
    start, goal = np.radians([[20.0, 0.0]]), np.radians([[160.0, 0.0]])
    assert proven_least_time(plane, [0], start, goal, margin, 20.0) == 20.0  # it cannot go through


def test_ranges_and_times_without_bounds_take_no_more_memory_or_steps(monkeypatch):
    monkeypatch.setattr(least_time_module, "_MOST_WORK", 1e6)
    plane = beside_a_post()
    wide = plane.replace(lower=np.full((1, 2), -np.inf), upper=np.full((1, 2), np.inf))
    start, goal = np.radians([[60.0, 0.0]]), np.radians([[120.0, np.nan]])
    assert proven_least_time(wide, [0], start, goal, 0.2, 1e9) < 10.0


def test_cells_are_wider_where_memory_asks_for_it(monkeypatch):
    plane, start, goal = beside_a_post(), np.radians([[60.0, 0.0]]), np.radians([[120.0, 0.0]])
    fine = proven_least_time(plane, [0], start, goal, 0.2, 20.0, np.radians(0.5))
    monkeypatch.setattr(least_time_module, "_MOST_WORDS", 2000)
    wide = proven_least_time(plane, [0], start, goal, 0.2, 20.0, np.radians(0.5))
    assert 2.0 < wide < fine
