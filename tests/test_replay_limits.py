"""A replay's view of limits and of boxes of joint space, at either side of each tolerance and against brute force."""

from itertools import combinations

import numpy as np
import pytest

from fiberplan.certificates.replay_boxes import grown, sides
from fiberplan.certificates.replay_infeasible import _ends, _excluded, _too_late
from fiberplan.certificates.replay_outcomes import _limits, _sliders
from test_replay_claims import moving, places

pytestmark = pytest.mark.small


def told(*knots, start=None, lower=(-1.0, -1.0), upper=(1.0, 1.0), online=True):
    """What is wrong with the limits of one who moves by these knots, as one word each."""
    claims = moving()
    claims.n, claims.online, claims.knots = 1, np.array([online]), [np.array(knots, float)]
    start = claims.knots[0][0, 1:] if start is None else start
    claims.problem = {f"start_{joint}": np.array([at]) for joint, at in zip(("alpha", "beta"), start, strict=True)}
    claims.table = {"positioner": np.array([b"it"])}
    for name, both in (("lower", lower), ("upper", upper), ("max_speed", (0.5, 2.0))):
        claims.table |= {f"{name}_{joint}": np.array([at]) for joint, at in zip(("alpha", "beta"), both, strict=True)}
    words = {"stated": "start", "offline": "offline", "leaves": "range", "faster": "speed"}
    return [next(word for key, word in words.items() if key in fault) for fault in _limits(claims)]


def test_the_start_is_the_stated_one_and_who_is_offline_stands():
    still = [(0, 0.3, 0.4), (1, 0.3, 0.4)]
    assert told(*still) == []
    for off, faults in ((0.6e-9, []), (1.5e-9, ["start"])):
        for way in (-1, 1):
            assert told(*still, start=(0.3 + way * off, 0.4)) == told(*still, start=(0.3, 0.4 + way * off)) == faults
    assert told(*still, online=False, upper=(0.1, 0.1)) == []
    assert told((0, 0.3, 0.4), (1, 0.3, 0.5), online=False) == ["offline"]
    assert told(*still, start=(0.3, np.nan)) == ["start"]


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("way", [-1, 1])
def test_a_joint_that_begins_out_of_range_only_comes_back(joint, way):
    for out, faults in (
        ((-0.5, 0.6e-9), []),
        ((-0.5, 1.6e-9), ["range"]),
        ((-0.5, 0.005), ["range"]),
        ((0.005, 0.003, 0.0, -0.2), []),
        ((0.005, 0.005, 0.003), []),
        ((0.005, 0.0055), ["range"]),
        ((0.005, 0.003, 0.0045), ["range"]),
        ((0.005, -0.1, 0.003), ["range"]),
        ((0.0087, 0.0), []),
        ((0.009, 0.0), ["range"]),
        ((1.5e-9, 0.9e-9), []),
    ):
        knots = [[9.0 * k, 0.0, 0.0] for k in range(len(out))]
        for own, far in zip(knots, out, strict=True):
            own[1 + joint] = way * (1 + far)
        assert told(*knots) == faults
    both = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]]
    both[0][1 + joint], both[1][2 - joint] = way * 1.005, way * 1.003  # what one may, the other may not
    assert told(*both) == ["range"]
    assert told((0, 2.0, 2.0), lower=(1.0, 3.0), upper=(4.0, 1.0)) == ["range"]


@pytest.mark.parametrize(("joint", "most"), [(0, 0.5), (1, 2.0)])
def test_speed_is_that_between_knots(joint, most):
    for off, faults in ((0.6e-9, []), (1.6e-9, ["speed"])):
        for way in (-1, 1):
            knots = [[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [8.0, 0.0, 0.0]]
            knots[2][1 + joint] = way * most * 4 * (1 + off)
            assert told(*knots, lower=(-9.0, -9.0), upper=(9.0, 9.0)) == faults


def test_a_slider_is_in_its_range_between_knots_too():
    claims = moving(bars=True)
    claims.online, claims.table = np.array([True, False]), {"positioner": np.array([b"it", b"no"])}
    times = np.linspace(0.9, 4.1, 16001)
    lengths = np.array([abs(places(claims, 0, t)[-1][0]) for t in times])
    low, high = lengths.min(), lengths.max()
    for less, more, wrong in (
        (0.5e-6, 0.0, 0),
        (1.5e-6, 0.0, 1),
        (0.0, 0.5e-6, 0),
        (0.0, 1.5e-6, 1),
        (-1.0, -1.0, 0),
        (1e-3, 1e-3, 1),
    ):
        claims.bar[0, 2:4] = low + less, high - more
        assert len([*_sliders(claims)]) == wrong
    claims.bar[0, 2:4] = -1.0, 1e3
    assert not [*_sliders(claims)]
    claims.online[:] = False
    claims.bar[:, 2:4] = 1e3
    assert not [*_sliders(claims)]


def random_tree(rng, d, depth):
    """Marks of a box that is halved at random, d joints."""
    if depth == 0 or rng.random() < 0.15:
        return rng.choice(["i", "b", "o"], p=[0.3, 0.4, 0.3])
    return str(rng.integers(d)) + random_tree(rng, d, depth - 1) + random_tree(rng, d, depth - 1)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_boxes_that_share_a_side_are_those_that_brute_force_finds(d):
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(12):
        low, high = [-1.0] * d, [2.0 + k for k in range(d)]
        tree = random_tree(rng, d, 6)
        whole, leaves = grown(low, high, tree)
        assert [box.mark for box in leaves] == [mark for mark in tree if mark in "ibo"]
        assert sum(np.prod(np.subtract(box.high, box.low)) for box in leaves) == pytest.approx(
            np.prod(np.subtract(high, low))
        )
        for q in rng.uniform(low, high, (20, d)).tolist():
            assert sum(box.holds(q) for box in leaves) == 1
        expected = set()
        for a, b in combinations(leaves, 2):
            shared = np.minimum(a.high, b.high) - np.maximum(a.low, b.low)
            if "i" in (a.mark, b.mark) and (shared == 0).sum() == 1 and (shared >= 0).all():
                expected.add(frozenset((id(a), id(b))))
        pairs = [(a, b) for a, b in sides(whole) if "i" in (a.mark, b.mark)]
        assert all("i" in (a.mark, b.mark) for a, b in sides(whole))
        assert len(pairs) == len(expected)
        assert {frozenset((id(a), id(b))) for a, b in pairs} == expected
        found += len(pairs)
    assert found > 10


def test_trees_that_are_none():
    for tree in ("", "0i", "ii", "0iii", "2ii", "xi", "0ix", "-1ii", "1"):
        assert grown([0.0, 0.0], [1.0, 1.0], tree) is None
    assert grown([0.0] * 6, [1.0] * 6, "5ib") is not None
    assert grown([1.0], [np.nextafter(1.0, 2.0)], "0ii") is None
    whole, (lower, upper) = grown([0.0, 0.0], [1.0, 4.0], "1ib")
    assert (lower.low, lower.high, upper.low, upper.high) == ([0, 0], [1, 2], [0, 2], [1, 4])
    assert lower.holds([1.0, 2.0])
    assert upper.holds([0.0, 2.0])
    assert upper.holds([np.nan, 3.0])
    assert not lower.holds([1.1, 1.0])
    assert not lower.holds([-0.1, np.nan])
    assert (whole.within, lower.within, upper.within) == (True, True, False)
    assert not grown([0.0], [1.0], "0bo")[0].within
    assert not any(box.beside for box in (whole, lower, upper))


def test_who_is_too_far_for_the_time_the_plan_keeps_to():
    """Three seconds, of joints that turn by 1 and 2 rad/s from 0.4 and -0.5 rad."""
    claims = moving()
    claims.table = {"max_speed_alpha": np.array([1.0, 9.0]), "max_speed_beta": np.array([2.0, 9.0])}

    def late(most, *ends):
        claims.said = {"parameters": {} if most is None else {"max_time": most}}
        return _too_late(claims, 0, [*ends])

    for off, said in ((-1e-3, False), (0.6e-9, False), (1.6e-9, True), (1e-3, True)):
        for way in (-1, 1):
            alpha, beta = 0.4 + way * 3 * (1 + off), -0.5 + way * 6 * (1 + off)
            assert late(3.0, (alpha, 0.0), (0.0, 0.0), (0.0, beta)) == [said, False, said]
    assert late(3.0 * (1 - 0.6e-9), (99.0, 0.0)) == [True]
    assert late(3.0 * (1 - 1.6e-9), (99.0, 0.0)) == late(None, (99.0, 0.0)) == [False]


def test_a_goal_is_excluded_if_all_others_of_the_proof_arrive_wherever_they_may():
    claims = moving()
    kinds = [("outcome", "S12"), *((f"goal_{joint}", float) for joint in ("alpha", "beta"))]
    kinds += [(f"alternatives_{joint}", float, 2) for joint in ("alpha", "beta")]
    none = (np.nan, np.nan)
    rows = [(b"INFEASIBLE", 1.0, 2.0, none, none), (b"ARRIVED", 0.1, 0.2, (0.3, np.nan), (0.4, np.nan))]
    claims.problem = np.array(rows, kinds)
    end, others = (1.0, 2.0), frozenset({1})
    first, second = (((0, end), (1, at)) for at in ((0.1, 0.2), (0.3, 0.4)))
    assert _ends(claims, 0) == [end]
    assert _ends(claims, 1) == [(0.1, 0.2), (0.3, 0.4)]
    assert _excluded(claims, 0, end, others, [(others, first), (others, second)])
    assert not _excluded(claims, 0, (1.0, 2.5), others, [(others, first), (others, second)])
    assert not _excluded(claims, 0, end, others, [(others, first)])
    assert not _excluded(claims, 0, end, others, [(others, first), (frozenset(), second)])
    assert _excluded(claims, 0, end, frozenset(), [(frozenset(), ((0, end),))])
    claims.problem["outcome"][1] = b"DEADLOCKED"
    assert not _excluded(claims, 0, end, others, [(others, first), (others, second)])
