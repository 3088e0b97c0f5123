"""Pairs that begin nearer than the margin: the rule against closed forms and sampling, with the compiler off."""

import itertools

import numpy as np
import pytest

from fiberplan.certificates.opening import _opens, _pad, _signed_bound, _signed_interval, judge_opening
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels.arms import frame, vertex
from fiberplan.kernels.clearance import meet
from fiberplan.kernels.depth import signed_clearance, signed_gap
from fiberplan.kernels.four_bar import largest_acceleration
from fiberplan.tolerances import OPENING, ROUNDING
from references import four_bar_plane, make_plane, motion_of, sampled
from test_clearance_oracles import mixed_plane
from test_depth_oracles import whole
from test_path_oracles import as_path
from test_proof_oracles import LATE, fastest, interval, scene, split_of, stack, travelled

TIP = Body(np.array([[10.0, 0.0]]), 1.0)
TIPPED = make_plane([0, 0], [TIP], [Obstacle("post", [[15.5, 0.0]], 1.0)])  # the tip is 15 mm from the base
PAIR = np.array([[0, 1]])


def turn_for(gap):
    """Angle of the tip from the post at which it is so far from it, by the law of cosines."""
    return np.arccos((15.0**2 + 15.5**2 - (gap + 2.0) ** 2) / (2 * 15.0 * 15.5))


def judged(*gaps, plane=TIPPED, margin=0.5, jitter=0.0, errors=(0.0, 0.0), pause=0.0):
    """The answer for a tip that goes through these gaps, a second (and a pause) for each stretch."""
    knots = [(k * (1.0 + pause), turn_for(gap), 0.0) for k, gap in enumerate(gaps)]
    path = as_path(plane, motion_of(knots))
    return judge_opening(plane.arms, path, PAIR, np.array(errors), margin, jitter)[0]


def moment_of(gap, first, last):
    """When a tip that goes from one gap to another in a second is at `gap`."""
    return (turn_for(gap) - turn_for(first)) / (turn_for(last) - turn_for(first))


def test_comes_apart():
    for first in (0.2, 0.0, -0.7, -1.4):
        seen, reached, failed = judged(first, 3.0)
        assert seen == pytest.approx(first, abs=1e-12)
        assert moment_of(0.5, first, 3.0) <= reached <= moment_of(0.5, first, 3.0) + 1e-4
        assert np.isnan(failed)
    seen, reached, failed = judged(-0.7, 0.3)  # never gets the margin, and never comes nearer
    assert (seen, reached) == (pytest.approx(-0.7), np.inf)
    assert np.isnan(failed)
    seen, reached, failed = judged(0.1, 0.1)  # stands
    assert (seen, reached) == (pytest.approx(0.1), np.inf)
    assert np.isnan(failed)


def test_who_stands_keeps_what_it_has_to_rounding():
    path = as_path(TIPPED, motion_of([(0, turn_for(0.1), 0.0), (1, turn_for(0.1), 0.0)]))
    _, now, bound, most = _signed_interval(TIPPED.arms, path, 0, 1, 0.25, 0.75, 0.0, 0.0)
    assert (now - bound, most - now) == (pytest.approx(ROUNDING, rel=1e-3),) * 2


def test_may_come_back_before_it_has_the_margin_but_not_nearer():
    assert np.isnan(judged(-0.5, 0.2, -0.2, 3.0)[2])
    assert np.isnan(judged(-0.5, 0.2, -0.5 + 1e-5, 3.0)[2])
    failed = judged(-0.5, 0.2, -0.6, 3.0)[2]
    assert 1.0 + moment_of(-0.5, 0.2, -0.6) - 1e-3 <= failed <= 2.0 + moment_of(-0.5, -0.6, 3.0)
    assert judged(-0.5, -0.5 - 2e-6, 3.0)[2] < 1.2
    assert np.isnan(judged(-0.5, -0.5 - 0.5 * OPENING, 3.0)[2])
    assert judged(0.3, 0.2)[2] <= 1.0


def test_keeps_the_margin_once_it_has_it():
    assert np.isnan(judged(-0.5, 3.0, 0.7, 3.0)[2])
    _, reached, failed = judged(-0.5, 3.0, 0.4, 3.0)
    assert reached == pytest.approx(moment_of(0.5, -0.5, 3.0), abs=1e-4)
    assert failed == pytest.approx(1.0 + moment_of(0.5, 3.0, 0.4), abs=0.2)
    assert failed >= 1.0 + moment_of(0.5, 3.0, 0.4) - 1e-3
    assert not np.isnan(judged(-0.5, 3.0, 0.5 - 1e-4, 3.0)[2])


def test_the_margin_counts_however_briefly_it_was_had():
    """Nothing that a look at its middle and its ends misses: what had the margin between them has to keep it."""
    assert not np.isnan(judged(-1.4, 0.45, 0.52, 0.45, 0.52, 0.45)[2])
    assert np.isnan(judged(-1.4, 0.45, 0.49, 0.45, 0.49, 0.45)[2])
    assert np.isnan(judged(-1.4, 0.45, 0.5 + 0.5 * OPENING, 0.45, 3.0)[2])


def test_nothing_to_open_is_no_opening():
    assert judged(0.6, 3.0)[1:].tolist() == [0.0, 0.0]
    assert judged(0.2, 3.0, errors=(np.nan, 0.0))[1:].tolist() == [0.0, 0.0]
    assert np.isnan(judged(0.7, 3.0, errors=(0.3, 0.0))[2])


def test_errors_and_jitter():
    seen, reached, failed = judged(0.2, 3.0, errors=(0.25, 0.125))
    assert seen == pytest.approx(0.2 - 0.375)
    assert reached == pytest.approx(moment_of(0.875, 0.2, 3.0), abs=1e-4)
    assert np.isnan(failed)
    seen, reached, failed = judged(0.2, 3.0, jitter=0.01)
    speed = 15.0 * (turn_for(3.0) - turn_for(0.2))
    assert seen == pytest.approx(0.2 - 0.01 * speed)
    assert reached == pytest.approx(moment_of(0.5 + 0.01 * speed, 0.2, 3.0), abs=1e-3)
    assert np.isnan(failed)
    seen, _, _ = judged(0.2, 0.3, 3.0, jitter=0.01)  # of the speeds near the start
    assert seen == pytest.approx(0.2 - 0.01 * 15.0 * (turn_for(0.3) - turn_for(0.2)))
    rng = np.random.default_rng(0)
    for _ in range(20):
        _, _, path = scene(rng)
        t0, t1 = np.sort(rng.uniform(0, 6, 2))
        for jitter in (0.0, 0.2):
            expected = 0.25 + jitter * sum(fastest(path, k, t0 - jitter, t1 + jitter) for k in (0, 1))
            assert _pad(path, 0, 1, t0, t1, jitter, 0.25) == pytest.approx(expected)


def test_pairs_are_judged_one_after_the_other():
    """What the first leaves on the stack is nothing to the second; with no room there is no proof."""
    for gaps in ((0.2, 3.0), (-0.5, 0.2, -0.6, 3.0), (0.3, 0.2, 3.0)):
        path = as_path(TIPPED, motion_of([(k, turn_for(gap), 0.0) for k, gap in enumerate(gaps)]))
        alone = judge_opening(TIPPED.arms, path, PAIR, np.zeros(2), 0.5, 0.0)[0]
        np.testing.assert_array_equal(_opens(TIPPED.arms, path, 0, 1, 0.5, 0.0, 0.0, *stack()), alone)
        twice = judge_opening(TIPPED.arms, path, np.concatenate([PAIR, PAIR]), np.zeros(2), 0.5, 0.0)
        np.testing.assert_array_equal(twice, [alone, alone])
        other = judge_opening(TIPPED.arms, path, PAIR[:, ::-1], np.zeros(2), 0.5, 0.0)[0]
        np.testing.assert_allclose(other, alone, atol=1e-9)
        assert not np.isnan(_opens(TIPPED.arms, path, 0, 1, 0.5, 0.0, 0.0, np.empty(2), np.empty(2))[2])


def test_a_middle_that_is_rounded():
    plane = make_plane([0, 0], [TIP], [Obstacle("post", [[20.0, 0.0]], 1.0)], length=0.0)
    path = as_path(plane, LATE)
    t, now, bound, most = _signed_interval(plane.arms, path, 0, 1, 1e16 + 2, 1e16 + 8, 0.0, 0.0)
    assert t == 1e16 + 4
    end = signed_clearance(plane.arms, 0, *sampled(LATE, 0, np.array([1e16 + 8]))[0], 1, 0.0, 0.0)
    assert end - 0.1 < bound < end < now < most


def test_overlapping_outlines_come_apart():
    """Depths, not saturated gaps: two plates that overlap by 1.5 mm slide apart, or deeper in."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    plate, fixed = Body(square * 2 + [30.0, 0.0], 0.1, closed=True), Obstacle("plate", square * 2, 0.1, closed=True)
    plane = make_plane([-30.0, 2.5], [plate], [fixed], length=0.0)
    for turn, holds in ((0.2, True), (-0.02, False), (0.02, True)):
        path = as_path(plane, motion_of([(0, 0.0, 0.0), (1, turn, 0.0)]))
        seen, reached, failed = judge_opening(plane.arms, path, PAIR, np.zeros(2), 0.3, 0.0)[0]
        assert seen == pytest.approx(-1.7, abs=1e-9)
        assert np.isnan(failed) == holds
        assert np.isfinite(reached) == (turn == 0.2)


def test_bound_of_depth_is_sound_and_as_sharp_as_derived():
    rng, depths = np.random.default_rng(3), 0
    for seed in range(30):
        plane = mixed_plane(rng)
        if seed % 5 == 0:
            plane = four_bar_plane(rng)
            plane = plane.replace(bodies=(plane.bodies[0], plane.bodies[3]), obstacles=())
        i, j = (0, 1) if seed % 3 or seed % 5 == 0 else (1, 2 + seed % 2)
        q, v, h = rng.uniform(-4, 4, (2, 2)), rng.uniform(-2, 2, (2, 2)), rng.choice([0.02, 0.1])
        if j >= plane.n:
            q[1] = v[1] = 0.0
        frames = [frame(plane.arms, k, *at) for k, at in zip((i, j), q, strict=True)]
        now, bound = _signed_bound(plane.arms, i, frames[0], *v[0], j, frames[1], *v[1], h)
        depths += now < 0

        def at(t, k, q=q, v=v, i=i, j=j, plane=plane):
            angles = np.zeros((len(plane.arms.arm), 2))
            angles[[i, j]] = q + t * v
            return frame(plane.arms, k, *angles[k]), angles

        assert now == pytest.approx(whole(plane, i, j, at(0.0, i)[1]), abs=1e-9)
        smallest = min(signed_clearance(plane.arms, i, *(q[0] + t * v[0]), j, *(q[1] + t * v[1])) for t in (-h, 0, h))
        assert bound <= smallest + 1e-12
        bend = 0.5 * h * h * sum(largest_acceleration(plane.arms, k, frames[n], *v[n], h) for n, k in enumerate((i, j)))
        expected, d = np.inf, 1e-5
        pieces = [range(*(int(plane.arms.arm[k][name]) for name in ("first_piece", "last_piece"))) for k in (i, j)]
        for p, r in itertools.product(*pieces):
            if not meet(plane.arms, p, r):
                continue
            _, *normal = signed_gap(plane.arms, frames[0], p, frames[1], r)
            along = []
            for k, piece in ((i, plane.arms.piece[p]), (j, plane.arms.piece[r])):
                three = [
                    np.array(
                        [
                            vertex(plane.arms, at(t, k)[0], piece["link"], m)
                            for m in range(piece["first"], piece["last"])
                        ]
                    )
                    @ normal
                    for t in (-d, 0.0, d)
                ]
                along.append([three[1] + e * h * (three[2] - three[0]) / (2 * d) for e in (-1, 1)])
            ends = [theirs.min() - ours.max() for ours, theirs in zip(*along, strict=True)]
            radii = plane.arms.piece[p]["radius"] + plane.arms.piece[r]["radius"]
            expected = min(expected, min(ends) - bend - radii)
        assert bound == pytest.approx(expected - ROUNDING, abs=1e-6)
    assert depths > 5
    unknown = _signed_bound(
        TIPPED.arms, 0, frame(TIPPED.arms, 0, np.nan, 0.0), 0, 0, 1, frame(TIPPED.arms, 1, 0, 0), 0, 0, 1
    )
    assert np.isnan(unknown[0])
    assert unknown[1] == -np.inf


def test_bounds_over_intervals():
    rng, kinds, sharp = np.random.default_rng(0), [], 0
    for _ in range(40):
        plane, motion, path, i, j, t0, t1 = interval(rng)
        t, now, bound, most = _signed_interval(plane.arms, path, i, j, t0, t1, 0.1, 0.25)
        at, inside = split_of(path, i, j, t0, t1)
        kinds.append(min(len(inside), 2))
        assert t == at
        angles = np.zeros((3, 2))
        angles[:2] = np.concatenate([sampled(motion, k, np.array([t])) for k in (0, 1)])
        gap = whole_any(plane, i, j, angles)
        assert now == pytest.approx(gap - _pad(path, i, j, t, t, 0.1, 0.25), abs=1e-9)
        lost = max(sum(abs(travelled(path, k, e) - travelled(path, k, t)) for k in (i, j)) for e in (t0, t1))
        expected = gap - lost - ROUNDING
        if not len(inside):
            both = []
            for k in (i, j):
                q = sampled(motion, k, np.array([t - 1e-6, t, t + 1e-6]))
                both += [frame(plane.arms, k, *q[1]), *((q[2] - q[0]) / 2e-6)]
            expected = max(expected, _signed_bound(plane.arms, i, *both[:3], j, *both[3:], (t1 - t0) / 2)[1])
        assert bound == pytest.approx(expected - _pad(path, i, j, t0, t1, 0.1, 0.25), abs=1e-6)
        moments = np.linspace(t0, t1, 501)
        pads = [0.25 + 0.1 * sum(fastest(path, k, at - 0.1, at + 0.1) for k in (i, j)) for at in moments]
        least = gap + lost + ROUNDING - most
        assert 0.25 - 1e-9 <= least <= min(pads) + 1e-9
        sharp += least > 0.25 + 1e-6
    assert sharp > 5
    assert set(kinds) == {0, 1, 2}


def whole_any(plane, i, j, angles):
    """`whole` of bodies that meet everything."""
    everything = tuple({b.category for b in (*plane.bodies, *plane.obstacles)})
    bodies = tuple(Body(b.points, b.radius, closed=b.closed, meets=everything) for b in plane.bodies)
    fixed = tuple(Obstacle(o.name, o.points, o.radius, meets=everything) for o in plane.obstacles)
    return whole(plane.replace(bodies=bodies, obstacles=fixed), i, j, angles)
