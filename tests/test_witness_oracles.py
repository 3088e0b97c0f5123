"""Which of several moments, axes and pairs a witness tells, against plain arithmetic, with the compiler off."""

import itertools

import numpy as np
import pytest

from fiberplan.certificates import verify, witnesses
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.tolerances import OPENING
from references import make_plane, motion_of, placed, sampled

TIP = Body(np.array([[10.0, 0.0]]), 1.0)


def gaps_along(plane, motion, pair, times, axis):
    """(t, p, q) how far each vertex of the second arm's body is beyond each of the first's along an axis [mm]."""
    n = np.array([np.cos(axis), np.sin(axis)])
    along = []
    for arm in pair:
        if arm < 0:
            along.append(np.tile(plane.obstacles[-1 - arm].points @ n, (len(times), 1)))
        else:
            along.append(placed(plane, arm, plane.bodies[0], sampled(motion, arm, times)) @ n)
    return along[1][:, None, :] - along[0][:, :, None]


def radii(plane, pair):
    return sum(
        plane.obstacles[-1 - k].radius if k < 0 else np.broadcast_to(plane.bodies[0].radius, plane.n)[k] for k in pair
    )


def rows_of(found, pair):
    return np.flatnonzero((found.pairs == pair).all(axis=1))


def spare(plane, motion, found, pair, wanted):
    """Rows of a pair of convex bodies, which follow each other; least room beyond `wanted`(t) along each axis [mm]."""
    rows = rows_of(found, pair)
    np.testing.assert_array_equal(found.begin[rows[1:]], found.end[rows[:-1]])
    left = []
    for k in rows:
        times = np.linspace(found.begin[k], found.end[k], 302)[1:-1]  # at its ends another may be wanted
        gaps = gaps_along(plane, motion, pair, times, found.axis[k]).min(axis=(1, 2))
        left.append((gaps - radii(plane, pair) - wanted(times)).min())
    return rows, np.array(left)


def test_a_pair_that_opens_keeps_what_it_begins_with_and_then_the_margin():
    """A tip on its way round a disc that is a little off its own base: nearest at first, farther all the way."""
    errors, margin = np.array([0.03, 0.02]), 0.5
    plane = make_plane([[0, 0], [-14.5, 0]], [Body(TIP.points, np.array([1.0, 13.4]))])
    motion = motion_of([(0, 0.0, 0), (3, 3.0, 0)], [(0, 0.0, 0)])
    (opening,) = verify(plane, motion, margin, position_error=errors, opening=True).opening
    assert opening.clearance == pytest.approx(0.05, abs=1e-6)
    assert 1.0 < opening.time < 2.0
    found = witnesses.witnesses(plane, motion, margin, errors, [opening])
    rows, left = spare(
        plane, motion, found, (0, 1), lambda t: np.where(t < opening.time, 0.1 - OPENING, margin + errors.sum())
    )
    assert (found.begin[rows[0]], found.end[rows[-1]]) == (0.0, 3.0)
    assert -1e-9 <= left.min() < 1e-3
    late = witnesses.witnesses(plane, motion, margin, errors)  # who does not know that it may open shows nothing of it
    assert (late.end <= 0.0).all()


def test_rows_of_several_pairs_are_those_of_each():
    """More of them than there is room for at first, of several pairs, none of which takes another's axes."""
    discs = [Obstacle(f"disc {k}", [centre], 12.6) for k, centre in enumerate(([0.5, 0.0], [-0.4, 0.6], [0.0, -0.7]))]
    motion = motion_of([(0, 0.0, 0), (2.5, 5.0, 0.05), (5, 0.0, 0.1)])
    everyone = make_plane([0, 0], [TIP], discs)
    found = witnesses.witnesses(everyone, motion, 0.2, np.array([0.05]))
    assert len(found.axis) > 4 * 3 + 16
    assert (np.diff(-1 - found.pairs[:, 1]) >= 0).all()
    for k, disc in enumerate(discs):
        alone = witnesses.witnesses(everyone.replace(obstacles=(disc,)), motion, 0.2, np.array([0.05]))
        rows, left = spare(everyone, motion, found, (0, -1 - k), lambda t: 0.25 + 0.0 * t)
        for name in ("begin", "end", "axis"):
            np.testing.assert_array_equal(getattr(found, name)[rows], getattr(alone, name))
        assert (found.begin[rows[0]], found.end[rows[-1]]) == (0.0, 5.0)
        assert left.min() >= -1e-9


def test_where_one_axis_does_not_part_all_pieces_several_do():
    """A post in the bend of a hook, and one before it: of each piece of the hook some axis of the interval is told."""
    hook = Body(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 6.0]]), 0.5)
    posts = [Obstacle("within", [[7.0, 3.0]], 0.5), Obstacle("before", [[7.0, -6.0]], 0.5)]
    plane, motion = make_plane([0, 0], [hook], posts, length=0.0), motion_of([(0, -0.15, 0), (1, 0.15, 0)])
    found = witnesses.witnesses(plane, motion, 0.2, np.zeros(1))
    for pair, most in (((0, -1), 2), ((0, -2), 1)):
        rows = rows_of(found, pair)
        intervals = sorted({(found.begin[k], found.end[k]) for k in rows})
        assert intervals[0][0] == 0.0
        assert intervals[-1][1] == 1.0
        assert all(one[1] == other[0] for one, other in itertools.pairwise(intervals))
        for begin, end in intervals:
            axes = [k for k in rows if found.begin[k] == begin]
            assert len(axes) == most
            times = np.linspace(begin, end, 200)
            gaps = [gaps_along(plane, motion, pair, times, found.axis[k])[:, :, 0] for k in axes]
            for piece in (slice(0, 2), slice(1, 3)):
                assert max(own[:, piece].min() for own in gaps) - 1.0 >= 0.2 - 1e-9


def test_an_axis_is_told_once_for_as_long_as_it_parts_the_two():
    """A folded arm turns a little on the far side from a post, by five knots."""
    plane = make_plane([0, 0], [TIP], [Obstacle("post", [[17.0, 0.0]], 1.0)])
    motion = motion_of([(t, 0.05 * t, np.pi) for t in range(5)])
    found = witnesses.witnesses(plane, motion, 0.2, np.zeros(1))
    assert (found.begin.tolist(), found.end.tolist()) == ([0.0], [4.0])
    assert repr(found) == "<Witnesses: 1 rows>"


def test_looks_are_counted_between_knots(monkeypatch):
    """As many as are needed between two knots are enough for a motion of several; with one fewer it is left out."""
    plane = make_plane([0, 0], [TIP], [Obstacle("disc", [[0.5, 0.0]], 13.0)])
    looks, real = [], witnesses._parted
    monkeypatch.setattr(witnesses, "_parted", lambda *given: looks.append(given) or real(*given))

    def looked(motion, most):
        looks.clear()
        monkeypatch.setattr(witnesses, "_MOST_STEPS", most)
        found = witnesses.witnesses(plane, motion, 0.2, np.zeros(1))
        return len(looks), found.end[-1] == motion.duration

    once = motion_of([(0, 0.0, 0), (2, 2.0, 0)])
    needed, _ = looked(once, 20_000)
    assert 6 < needed < 100
    assert looked(once, needed) == (needed, True)
    assert looked(once, needed - 1) == (needed - 1, False)
    there_and_back = motion_of([(0, 0.0, 0), (2, 2.0, 0), (4, 0.0, 0)])
    both, whole = looked(there_and_back, needed + 8)
    assert whole
    assert both > needed + 8


def test_only_pairs_of_which_one_moves_and_that_may_come_near_are_told():
    plane = make_plane([[0, 0], [33.0, 0], [0, 33.0]], [TIP], [Obstacle("post", [[-19.0, 0.0]], 1.0)])
    plane = plane.replace(online=np.array([True, False, False]))
    motion = motion_of([(0, 2.0, 0), (1, 2.5, 0)], [(0, 2.0, 0)], [(0, 2.0, 0)])
    for margin, error, pairs in ((1.01, 0.0, {(0, 1), (0, 2)}), (0.9, 0.0, set()), (0.9, 0.06, {(0, 1), (0, 2)})):
        found = witnesses.witnesses(plane, motion, margin, np.full(3, error))
        assert {tuple(pair) for pair in found.pairs.tolist()} == pairs
    assert witnesses.witnesses(plane, motion, 2.01, np.zeros(3)).pairs.min() == -1
