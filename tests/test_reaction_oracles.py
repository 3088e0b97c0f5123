"""How soon somebody touches who has stopped, against closed forms and dense sampling, with the compiler off."""

import heapq

import numpy as np
import pytest

from fiberplan.certificates import reactions
from fiberplan.certificates.reactions import BOX, RESOLUTION, Stalls, reaction, stalls
from fiberplan.errors import TrajectoryError
from references import make_plane, motion_of
from test_reactions import BAR, TIP, sampled_stall, tips

pytestmark = pytest.mark.small  # every case of each


def test_the_first_box_is_always_that_of_the_least_time():
    rng, boxes, count, ours = np.random.default_rng(0), np.zeros(64, BOX), 0, []
    for step in range(400):
        if count < 60 and rng.random() < (0.7 if step < 200 else 0.4):
            soon = float(rng.integers(0, 40))
            count = reactions._put(boxes, count, soon, soon + 1, step, step + 2, 3 * step)
            heapq.heappush(ours, soon)
        elif count:
            first = boxes[0]
            assert first.soon == heapq.heappop(ours)
            assert (first.late, first.end, first.other) == (first.soon + 1, first.begin + 2, 3 * first.begin)
            count = reactions._drop_first(boxes, count)
        assert count == len(ours)
        assert len(set(boxes["other"][:count].tolist())) == count


FOLLOWING = ([(0, 1.27, 0), (0.6, 1.87, 0)],) * 2  #: both at 10 mm/s along x, the second behind


@pytest.mark.parametrize("errors", [np.array([0.0, 0.0]), np.array([0.3, 0.1]), np.array([0.0, 0.4])])
def test_who_follows_touches_who_stops(errors):
    plane, motion = tips(1.0, *FOLLOWING)
    exact = 2.0 * np.arcsin(0.05 * (1.0 - errors.sum()))
    found = stalls(plane, motion, errors)
    assert exact - RESOLUTION <= found.seconds[0] <= exact
    assert (found.seconds[1], found.other.tolist()) == (np.inf, [1, -1])
    assert abs(found.moment[0] - 0.3 + exact / 2) < 0.02  # so that both are in the middle, where it is nearest
    assert np.isnan(found.moment[1])
    for within in (exact + 1e-3, exact - 1e-3):
        assert (stalls(plane, motion, errors, within).seconds[0] < within) == (within > exact)
    for one in (found.soonest, reaction(plane, motion, errors)):
        assert (one.positioner, one.other) == (0, 1)
        assert exact - RESOLUTION <= one.seconds <= exact


def test_of_many_the_soonest_is_told_and_the_first_who_touches():
    """Four tips in a row, 1.0, 0.6 and 1.4 mm behind each other: the third is the first to touch, at the second."""
    plane = make_plane(np.array([[0, 0], [3.0, 0], [5.6, 0], [9.0, 0]]), [TIP], length=0.0, max_speed=1e3)
    motion = motion_of(*(FOLLOWING[0],) * 4)
    found = stalls(plane, motion)
    exact = 2.0 * np.arcsin(0.05 * np.array([1.0, 0.6, 1.4]))
    assert found.other.tolist() == [1, 2, 3, -1]
    assert (np.abs(found.seconds[:3] - exact) <= RESOLUTION).all()
    soonest = stalls(plane, motion, soonest=True).soonest
    assert (soonest.positioner, soonest.other) == (1, 2)
    assert soonest.seconds == pytest.approx(exact[1], abs=RESOLUTION)
    assert found.soonest == found[1]
    assert Stalls(np.empty(0), np.empty(0), np.empty(0, int)).soonest.positioner == -1
    with pytest.raises(TrajectoryError, match="2 positioners, the focal plane 4"):
        stalls(plane, motion_of(*FOLLOWING))


def test_who_rests_or_has_left_is_no_stall():
    """Behind somebody who goes on after a rest: the rest needs no look, the two turns do."""
    turns = [(0, 1.27, 0), (0.3, 1.57, 0), (1.3, 1.57, 0), (1.6, 1.87, 0)]
    plane, motion = tips(1.0, turns, turns)
    found = stalls(plane, motion)
    exact = 2.0 * np.arcsin(0.05)
    assert found.seconds[0] == pytest.approx(exact, abs=0.11)
    assert found.seconds[0] <= sampled_stall(plane, motion, 0, 1, 200)
    plane, motion = tips(1.0, [(0, 1.27, 0), (0.6, 1.87, 0)], [(0, 1.27, 0)])
    assert (stalls(plane, motion).seconds == np.inf).all()  # nobody comes


def test_bounds_hold_for_motions_of_all_kinds(monkeypatch):
    monkeypatch.setattr(reactions, "RESOLUTION", 0.02)
    monkeypatch.setattr(reactions, "FLOOR", 0.05)
    rng, touched = np.random.default_rng(3), 0
    for _ in range(8):
        plane = make_plane([[0, 0], [rng.uniform(24, 26), 0]], [BAR], max_speed=1e3)
        times = np.cumsum(rng.uniform(0.1, 1.0, (2, 3)), axis=1) - 0.1
        angles = np.cumsum(rng.normal(0.0, 0.4, (2, 3, 2)), axis=1) + [[[0.0, 0.0]], [[np.pi, 0.0]]]
        motion = motion_of(*(np.column_stack([t, q]) for t, q in zip(times, angles, strict=True)))
        found = stalls(plane, motion)
        for i, j in ((0, 1), (1, 0)):
            seen = sampled_stall(plane, motion, i, j)
            assert found.seconds[i] <= seen
            if np.isfinite(seen):
                touched += 1
                assert seen - found.seconds[i] <= 2.0 * motion.duration / 59 + 0.03
    assert touched > 2


def test_the_reaction_is_looked_for_later_and_later(monkeypatch):
    """Until it is found sooner than was looked for, or the motion ends."""
    asked, plane = [], make_plane([[0, 0]], [TIP])
    motion = motion_of([(0, 0, 0), (9, 1, 0)])

    def found(where, what, errors, within=np.inf, soonest=False):
        asked.append((within, soonest))
        late = seconds if seconds < within else np.inf
        return Stalls(np.array([late]), np.array([1.0]), np.array([0]))

    monkeypatch.setattr(reactions, "stalls", found)
    for seconds, looks in ((0.05, [0.1]), (0.3, [0.1, 0.4]), (8.0, [0.1, 0.4, 1.6, 6.4, np.inf]), (np.inf, 5)):
        asked.clear()
        assert reaction(plane, motion).seconds == seconds
        assert all(soonest for _, soonest in asked)
        assert [within for within, _ in asked] == pytest.approx(looks) if looks != 5 else len(asked) == 5
