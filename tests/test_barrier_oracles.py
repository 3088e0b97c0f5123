"""What a proof that there is no way says, box by box, and paths, against shapely, with the compiler off."""

import itertools

import numpy as np
import pytest

from fiberplan.certificates import lost, unreachable
from fiberplan.certificates.unreachable import Barrier, decided, proven_excluded
from fiberplan.focal_plane.bodies import Obstacle
from references import make_plane, motion_of, sampled_clearance, smallest_over_time
from test_unreachable_oracles import CAPSULE, walled

pytestmark = pytest.mark.small  # every case of each


def boxes_of(tree, low, high):
    """(mark, low, high) of each box of a `Barrier.tree` that is not halved."""
    mark, rest = tree[0], tree[1:]
    if mark in "ibo":
        return [(mark, low, high)], rest
    d = int(mark)
    middle, begin = high.copy(), low.copy()
    middle[d] = begin[d] = (low[d] + high[d]) / 2
    first, rest = boxes_of(rest, low, middle)
    second, rest = boxes_of(rest, begin, high)
    return first + second, rest


def checked(plane, barrier, start, margin):
    """Boxes of a barrier, after a look at each: blocked ones by samples, others by who their neighbours are."""
    rng, who = np.random.default_rng(0), list(barrier.positioners)
    boxes, rest = boxes_of(barrier.tree, plane.lower[who].ravel(), plane.upper[who].ravel())
    assert rest == ""
    begin, goal = start[who].ravel(), [barrier.goals.get(i, (np.nan, np.nan)) for i in who]
    inside = [(low, high) for mark, low, high in boxes if mark == "i"]
    lows, highs = (np.array(ends) for ends in zip(*inside, strict=True))
    assert any((low <= begin).all() and (begin <= high).all() for low, high in inside)
    stands = np.array(start)
    for i, q in barrier.goals.items():
        stands[i] = q
    for low, high in inside:  # either the goal is elsewhere, or it is no place to be
        ends = np.where(np.isnan(np.ravel(goal)), rng.uniform(low, high, (40, len(low))), np.ravel(goal))
        here = ((low <= ends) & (ends <= high)).all(axis=1)
        assert (nearest_of(plane, who, ends[here], stands, set(barrier.goals)) < margin).all()
    for mark, low, high in boxes:
        if mark == "b":
            at = rng.uniform(low, high, (40, len(low)))
            at[:16] = np.where(rng.random((16, len(low))) < 0.5, low, high)
            assert (nearest_of(plane, who, at, stands, set()) < margin).all()
        if mark == "o":
            apart = np.maximum(low - highs, lows - high)  # a side is shared if it is zero once and negative elsewhere
            assert ((apart > 0).any(axis=1) | ((apart == 0).sum(axis=1) > 1)).all()
    return boxes


def nearest_of(plane, who, at, stands, others):
    """Least clearance (t,) of `who` at angles (t, 2 k) to each other, to what never moves and to `others`."""
    arms = range(plane.n + len(plane.obstacles))
    fixed = [j for j in arms if j >= plane.n or not plane.online[j] or (j in others and j not in who)]
    angles = {i: at[:, 2 * k : 2 * k + 2] for k, i in enumerate(who)}
    angles |= {j: np.tile(stands[j] if j < plane.n else [0.0, 0.0], (len(at), 1)) for j in fixed if j not in who}
    pairs = [*itertools.combinations(who, 2), *itertools.product(who, set(fixed) - set(who))]
    return np.min([sampled_clearance(plane, i, j, angles[i], angles[j]) for i, j in pairs], axis=0)


def facing(turn):
    """Stiff arms of 15 mm whose bases are 26 mm apart, and which turn by so much [rad] to both sides of the middle."""
    base, zero = [[0.0, 0.0], [26.0, 0.0]], [[0.0, 0.0], [np.pi, 0.0]]
    ends = {"lower": np.tile([-turn, 0.0], (2, 1)), "upper": np.tile([turn, 0.01], (2, 1)), "zero": np.array(zero)}
    return make_plane(base, [CAPSULE], **ends)


def with_a_third(plane):
    """The same two, and one that is far away."""
    third = {
        name: np.append(getattr(plane, name), [[90.0, 90.0]], axis=0) for name in ("base", "lower", "upper", "zero")
    }
    third["lower"][2], third["upper"][2] = -0.5, 0.5
    return make_plane(third.pop("base"), [CAPSULE], **third)


@pytest.mark.parametrize("room", [2_000, 2])
def test_what_a_barrier_states_holds(room, monkeypatch):
    """One arm before a post, one that is shut off by another, and two that cannot pass each other."""
    monkeypatch.setattr(unreachable, "_FIRST", room)
    plane, start, goal = walled(-0.4), np.array([[0.7, 0.0]]), np.array([-3.9, 0.0])
    _, barrier = decided(plane, [0], {0: goal}, start, 0.0)
    assert (barrier.positioners, barrier.goals) == ((0,), {0: (-3.9, 0.0)})
    assert {mark for mark, _, _ in checked(plane, barrier, start, 0.0)} == set("ibo")
    plane, start = facing(0.5), np.array([[-0.45, 0.0], [-0.45, 0.0]])  # the second is above the first
    swapped = {0: np.array([0.45, 0.0]), 1: np.array([0.45, 0.0])}
    _, barrier = decided(plane, [0, 1], swapped, start, 0.0)
    checked(plane, barrier, start, 0.0)
    assert decided(plane, [0, 1], swapped, start, 0.0, 3) == (None, None)  # that few boxes decide nothing
    _, beside = decided(with_a_third(plane), [2, 0, 1], swapped, np.append(start, [[0.0, 0.0]], axis=0), 0.0)
    assert beside.positioners == (2, 0, 1)
    deeper = str.maketrans("0123", "2345")  # the joints of who is far away come first, and need no halving
    assert beside.tree == barrier.tree.translate(deeper)


def test_whose_elbow_turns_past_another_arm_cannot_if_that_lies_across():
    """Alpha of both is as good as fixed: the elbow's turn is what there is to halve, here the last of six joints."""
    ends = {"lower": np.array([[-0.01, 0.0], [-0.01, -1.3]]), "upper": np.array([[0.01, 0.01], [0.01, 1.3]])}
    plane = make_plane([[0, 0], [23.0, 0]], [CAPSULE], zero=facing(0.5).zero, **ends)
    start, goals = np.array([[0.0, 0.0], [0.0, -1.2]]), {1: np.array([0.0, 1.2])}
    for who, joint in (([0, 1], "3"), ([1, 0], "1"), ([2, 0, 1], "5"), ([2, 1, 0], "3")):
        many = with_a_third(plane) if len(who) > 2 else plane
        stands = np.append(start, [[0.0, 0.0]], axis=0)[: many.n]
        _, barrier = decided(many, who, goals, stands, 0.0)
        checked(many, barrier, stands, 0.0)
        assert set(barrier.tree) - set("ibo") == {joint}


def test_a_path_is_clear_and_leads_to_the_goal(monkeypatch):
    """Round a post with a bent elbow; and everyone at once, where there is nobody in the way."""
    posts = [Obstacle("post", [[11.0, 3.0]], 1.0), Obstacle("pole", [[9.0, -9.0]], 1.0)]
    ends = {"lower": np.array([[-2.0, 0.0]]), "upper": np.array([[2.0, 2.5]])}
    plane = make_plane([0, 0], [CAPSULE], posts, length=8.0, **ends)
    start, goal = np.array([[-1.2, 1.5]]), np.array([0.8, 0.3])
    looked, real = [], unreachable.search
    monkeypatch.setattr(unreachable, "search", lambda *given: looked.append(given[1]) or real(*given))
    path, barrier = decided(plane, [0], {0: goal}, start, 0.3)
    assert barrier is None
    assert looked[-1].used[0] < 130  # boxes are halved where that decides it, and nowhere else
    assert len(path) > 3
    assert (path[0] == start[0]).all()
    assert (path[-1] == goal).all()
    assert ((plane.lower[0] <= path) & (path <= plane.upper[0])).all()
    motion = motion_of(np.column_stack([np.arange(len(path)), path]))
    assert min(smallest_over_time(plane, motion, 0, j, 200)[0] for j in (1, 2)) >= 0.3
    apart = make_plane([[0, 0], [80, 0], [0, 80]], [CAPSULE], lower=np.full((3, 2), -1.0), upper=np.full((3, 2), 1.0))
    path, _ = decided(apart, [0, 1, 2], {1: np.array([0.5, 0.25])}, np.zeros((3, 2)), 0.3)
    assert path.tolist() == [[0.0] * 6, [0.0, 0.0, 0.5, 0.25, 0.0, 0.0]]


def test_a_path_leads_through_the_middles_of_shared_sides():
    query = unreachable._query(walled(0.4), [0], {0: np.array([1.2, 1.9])}, np.array([[0.1, 0.2]]), 0.0)
    boxes = unreachable._room(4, query, np.zeros(2), np.full(2, 2.0))
    corners = [[0, 0, 1, 1], [1, 0.5, 1.5, 1], [1, 1, 1.5, 2], [7, 7, 9, 9]]
    boxes.low[:], boxes.high[:] = np.array(corners)[:, :2], np.array(corners)[:, 2:]
    boxes.box["before"] = -1, 0, 1, 2
    assert unreachable._path(query, boxes, 2).tolist() == [[0.1, 0.2], [1, 0.75], [1.25, 1], [1.2, 1.9]]
    anywhere = query._replace(goal=np.full(2, np.nan))
    assert unreachable._path(anywhere, boxes, 2)[-1].tolist() == [1.25, 1]
    assert unreachable._path(anywhere, boxes, 0).tolist() == [[0.1, 0.2], [0.1, 0.2]]


def test_a_goal_leaves_another_arm_a_place_or_not():
    """As samples of all that the other can do say; what keeps it there may be a post, too."""
    seen = set()
    for turn in (0.2, 0.6):
        plane, start = facing(turn), np.array([[0.0, 0.0], [0.9 * turn, 0.0]])
        for aim in (0.0, 0.15):
            goal = np.array([aim, 0.0])
            at = np.column_stack([np.linspace(-turn, turn, 400), np.zeros(400)])
            for margin in (0.0, 1.0):
                free = sampled_clearance(plane, 0, 1, np.tile(goal, (400, 1)), at).max() > margin
                assert proven_excluded(plane, 0, goal, 1, start, margin) == (not free)
                seen.add(bool(free))
    assert seen == {True, False}
    post = Obstacle("post", [[12.0, 4.5]], 1.0)
    plane, start, goal = facing(0.6), np.array([[0.0, 0.0], [0.5, 0.0]]), np.array([0.45, 0.0])
    assert not proven_excluded(plane, 0, goal, 1, start, 0.0)
    start[1, 0] = -0.5  # on the side of the post, which it cannot leave
    assert proven_excluded(plane.replace(obstacles=(post,)), 0, goal, 1, start, 0.0)
    start[1, 0] = 0.55
    assert not proven_excluded(plane.replace(obstacles=(post,)), 0, goal, 1, start, 0.0)


def test_a_start_out_of_range_proves_nothing():
    goal = np.array([-3.9, 0.0])
    assert decided(walled(-0.4), [0], {0: goal}, np.array([[1.8, 0.0]]), 0.0) == (None, None)
    assert decided(walled(-0.4), [0], {0: goal}, np.array([[0.7, 0.02]]), 0.0) == (None, None)


def test_the_smallest_question_that_has_a_proof_is_asked_first(monkeypatch):
    """Of 0 to 2: alone; where another could be; with it; with it at its own goal, in all of its configurations."""
    ends = {0: np.array([[0.0, 1.0], [0.0, 2.0]]), 1: np.array([[1.0, 1.0], [1.0, 2.0]]), 2: np.empty((0, 2))}
    asked, proven = [], set()

    def answers(plane, who, goals, start, margin):
        question = tuple(who), tuple((i, int(q[1])) for i, q in goals.items())
        asked.append(question)
        return None, Barrier(*question, "i") if question in proven else None

    monkeypatch.setattr(lost, "decided", answers)

    def said(*questions):
        asked.clear()
        proven.clear()
        proven.update(questions)
        return [(one.positioners, one.goals) for one in lost.proofs_of_loss(None, 0, ends, None, 0.0, [2, 1])]

    smaller = [((0,), ((0, 1),)), ((2,), ((0, 1),)), ((1,), ((0, 1),)), ((0, 2), ((0, 1),)), ((0, 1), ((0, 1),))]
    jointly = [((0, 1), ((0, 1), (1, 1))), ((0, 1), ((0, 1), (1, 2)))]
    other = ((2,), ((0, 2),))
    for k, question in enumerate(smaller):
        assert said(question, *smaller[k + 1 :], other) == [question, other]
        assert asked[: k + 1] == smaller[: k + 1]
        assert said(question) == []
    assert said(*jointly, other) == [*jointly, other]
    assert asked[:7] == smaller + jointly
    assert said(jointly[0], other) == said(jointly[1], other) == said(other) == []
