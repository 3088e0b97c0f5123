"""The compiled walk against the paper's listing written out plainly, and its traps."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.kernels.clearance import clearance
from fiberplan.planners.greedy_fold.ranked_moves import EXHAUSTED, FOLDED, STALLED, STUCK
from fiberplan.planners.greedy_fold.walker import Walker
from fiberplan.scenes.uniform import uniform_field
from fiberplan.tolerances import SLACK, UNDER_LIMIT

DEG = np.pi / 180.0
RANKING = [(-1, 1), (0, 1), (1, 1), (-1, 0), (1, 0), (-1, -1), (0, -1), (1, -1)]  # as printed, (alpha, beta)


def listing(plane, angles, margin, step, loops, skip_noops):
    """Sayres2021's listing: in turn, the first of eight moves whose end touches nobody where they are now."""
    angles = angles.copy()
    neighbours = [[] for _ in range(plane.n)]
    for i, j in plane.pairs:
        neighbours[i].append(j)
        neighbours[j].append(i)
    for loop in range(loops):
        if np.array_equal(angles, plane.folded):
            return angles, loop
        for i in range(plane.n):
            if np.array_equal(angles[i], plane.folded[i]):
                continue
            for da, db in RANKING:
                new = angles[i] + step * np.array([da, db])
                new = np.clip(new, plane.lower[i], plane.upper[i])
                for stop in (plane.lower[i], plane.upper[i]):
                    new = np.where(np.abs(new - stop) < 1e-12, stop, new)
                if np.array_equal(new, angles[i]):
                    if skip_noops:
                        continue
                    break
                if all(clearance(plane.arms, i, *new, j, *angles[j]) >= margin + SLACK for j in neighbours[i]):
                    angles[i] = new
                    break
    return angles, loops


@pytest.mark.parametrize("skip_noops", [True, False])
@pytest.mark.parametrize(("margin", "seed"), [(0.0, 0), (2.0, 1), (3.0, 2)])
def test_sampled_rule_is_the_listing(margin, seed, skip_noops):
    """Allowances, lazy frames and remembered refusals change nothing: same angles, same number of loops."""
    plane = fp.FocalPlane.hexagonal(3, 22.4)
    start = uniform_field(plane, seed, margin)
    expected, loops = listing(plane, start, margin, 2 * DEG, 250, skip_noops)
    walker = Walker(plane, start, margin, 2 * DEG, plane.online, swept=False, skip_noops=skip_noops)
    ended = walker.run(500 * DEG)
    if ended != STUCK:  # the listing goes on standing still
        assert walker.loops == loops
    np.testing.assert_allclose(walker.angles, expected, atol=1e-9)
    assert (ended == FOLDED) == np.array_equal(expected, plane.folded)


@pytest.mark.parametrize("step", [2.0, 0.5])
@pytest.mark.parametrize("seed", range(6))
def test_swept_rule_is_safe_as_recorded(seed, step):
    """The recorded motion is simultaneous; it is proven safe whether or not everyone folds."""
    plane = fp.FocalPlane.hexagonal(4, 22.4)
    margin = 0.5 * seed
    walker = Walker(plane, uniform_field(plane, seed, margin), margin, step * DEG, plane.online)
    walker.run(700 * DEG)
    certificate = fp.verify(plane, walker.trajectory(), margin)
    assert certificate.ok, (certificate.contacts, certificate.undecided, certificate.violations)


def test_sampled_rule_is_not_safe_as_recorded():
    """What the swept test is for: by the published rule, simultaneous motion touches."""
    plane = fp.FocalPlane.hexagonal(10, 22.4)
    touching = 0
    for seed in range(15):
        walker = Walker(plane, uniform_field(plane, seed, 1.0), 1.0, 3 * DEG, plane.online, swept=False)
        walker.run(700 * DEG)
        touching += len(fp.verify(plane, walker.trajectory(), 1.0).contacts)
    assert touching > 0


def alone(alpha, beta, **changes):
    plane = fp.FocalPlane.hexagonal(0, 22.4).replace(**changes)
    return plane, np.array([[alpha, beta]]) * DEG


@pytest.mark.small
def test_one_arm_folds_at_full_speed():
    plane, start = alone(100.0, 30.0)
    walker = Walker(plane, start, 0.0, 1 * DEG, plane.online)
    assert walker.run(700 * DEG) == FOLDED
    assert walker.loops == 150
    np.testing.assert_array_equal(walker.angles, plane.folded)
    assert walker.trajectory().duration == pytest.approx(5.0 / UNDER_LIMIT)
    assert fp.verify(plane, walker.trajectory()).ok


@pytest.mark.small
def test_a_step_that_does_not_divide_the_way_lands_on_folded():
    plane, start = alone(100.3, 30.7, folded=np.radians([[10.05, 169.9]]))
    walker = Walker(plane, start, 0.0, 0.7 * DEG, plane.online)
    assert walker.run(700 * DEG) == FOLDED
    np.testing.assert_array_equal(walker.angles, plane.folded)


@pytest.mark.small
def test_an_arm_beyond_the_park_state_comes_back():
    """Folded within the range: some have to turn alpha up and beta down."""
    plane, start = alone(3.0, 178.0, folded=np.radians([[10.0, 170.0]]))
    walker = Walker(plane, start, 0.0, 1 * DEG, plane.online)
    assert walker.run(700 * DEG) == FOLDED
    assert walker.loops == 8


def test_noop_trap():
    """As printed, a blocked arm at its limit "takes" a clamped move for ever; skipping no-ops lets it unfold."""
    plane = fp.FocalPlane.load("sayres2021")
    trapped = 0
    for seed in range(10):
        start = uniform_field(plane, seed, 1.0)
        walkers = [Walker(plane, start, 1.0, 1 * DEG, plane.online, skip_noops=skip) for skip in (False, True)]
        literal, skipping = (walker.run(700 * DEG) for walker in walkers)
        if literal != FOLDED and skipping == FOLDED:
            angles = walkers[0].angles[walkers[0].stuck]
            trapped += bool(np.any(angles == plane.folded[0]))  # one joint home, and so half of its moves are none
    assert trapped > 0


def test_ends_are_told_apart():
    plane, start = alone(100.0, 30.0)
    walker = Walker(plane, start, 0.0, 1 * DEG, plane.online)
    assert walker.run(20 * DEG) == EXHAUSTED
    assert walker.loops == 20
    assert walker.run(700 * DEG) == FOLDED  # goes on where it stopped
    plane = fp.FocalPlane.hexagonal(6, 22.4)
    start = uniform_field(plane, 3, 3.0)
    assert Walker(plane, start, 3.0, 1 * DEG, plane.online, patience=20 * DEG).run(700 * DEG) in (STALLED, STUCK)


@pytest.mark.small
def test_reversed_ranking_unfolds():
    plane, start = alone(100.0, 30.0)
    walker = Walker(plane, start, 0.0, 1 * DEG, plane.online)
    walker.reverse_ranking(0, 10 * DEG)
    walker.run(10 * DEG)
    assert walker.angles[0, 0] > start[0, 0]
    assert walker.angles[0, 1] < start[0, 1]
    assert walker.run(700 * DEG) == FOLDED
