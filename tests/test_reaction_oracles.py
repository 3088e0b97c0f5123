"""What is looked at next in the search for a reaction time, and how late, with the compiler off."""

import heapq

import numpy as np
import pytest

from fiberplan.certificates import reactions
from fiberplan.certificates.reactions import BOX, Stalls, reaction
from fiberplan.focal_plane.bodies import Body
from references import make_plane, motion_of

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


def test_the_reaction_is_looked_for_later_and_later(monkeypatch):
    """Until it is found sooner than was looked for, or the motion ends."""
    asked, plane = [], make_plane([[0, 0]], [Body([[10.0, 0.0]], 1.0)])
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
