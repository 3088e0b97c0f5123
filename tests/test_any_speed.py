"""Arms that are each anywhere within their turns: what is shown to be clear is so, and a box with a contact is not."""

import numpy as np
import pytest

from fiberplan.certificates.any_speed import clear_at_any_speed, contacts_at_any_speed
from fiberplan.certificates.keeping import keeps
from fiberplan.certificates.path import as_motion
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.kernels.boxes import clear_boxes
from fiberplan.scenes.decisive import row
from references import motion_of

pytestmark = pytest.mark.small
PAIR = np.array([[0, 1]])


def shown(plane, low, high, margin):
    """What the two ways to look at boxes say of a pair that is anywhere from `low` to `high` (2, 2) [deg]."""
    boxes = np.radians(np.stack([low, high], axis=-1))
    alone = clear_boxes(plane.arms, PAIR, np.concatenate([boxes, boxes]), 2, margin)
    clear, gap = clear_at_any_speed(plane, PAIR, *np.moveaxis(boxes, -1, 0)[:, None], margin, np.zeros(2))
    assert alone[0] == clear[0]
    assert (gap[0] == np.inf) == clear[0]
    return bool(clear[0])


@pytest.mark.parametrize(("turn", "clear"), [(10.0, True), (30.0, True), (120.0, False)])
def test_a_turn_is_clear_if_all_of_it_is(turn, clear):
    """Both lean away from each other, and the first turns until it lies across the other."""
    plane = row(2)
    low, high = np.array([[90.0 - turn, 60.0], [0.0, 170.0]]), np.array([[90.0, 60.0], [10.0, 180.0]])
    assert shown(plane, low, high, 0.5) is clear
    alpha = np.radians(np.linspace(low[0, 0], high[0, 0], 50))
    poses = np.radians([[[0.0, 60.0], [5.0, 175.0]]]) + alpha[:, None, None] * [[1.0, 0.0], [0.0, 0.0]]
    sampled = [plane.clearance(pose).min() for pose in poses]
    assert (min(sampled) >= 0.5) == clear
    assert not shown(plane, low, high, max(sampled) + 1.0)


def test_whoever_may_touch_on_its_way_is_named_with_the_time():
    """The first reaches the post half way, and nobody asks how fast it goes."""
    post = Obstacle("post", [[-20.0, 0.0]], 1.0)
    plane = row(2).replace(obstacles=(post,), online=np.array([True, False]))
    begin, end = np.radians([[[90.0, 20.0], [0.0, 180.0]], [[220.0, 20.0], [0.0, 180.0]]])
    (contact,) = contacts_at_any_speed(plane, begin, end, 0.5, np.zeros(2), 3.0)
    assert (contact.pair, contact.time) == ((0, -1), 3.0)
    assert contact.clearance < 0.5
    assert contacts_at_any_speed(plane, begin, np.radians([[120.0, 20.0], [0.0, 180.0]]), 0.5, np.zeros(2)) == ()


def test_a_margin_is_kept_as_arms_are_timed():
    """One sweeps over where the other is until that has left; sooner, and it comes too near."""
    plane = row(2)
    for begin, clear in ((6, True), (0, False)):
        sweep = [(0, 2.5, 0.0), (begin + 0.1, 2.5, 0.0), (begin + 6, 0.0, 0.0), (begin + 12, 2.5, 0.0)]
        path = as_motion(plane.arms, motion_of(sweep, [(0, np.pi, 1.5), (6, 0.0, 0.0), (18, 0.0, 0.0)]))
        assert keeps(plane.arms, path, PAIR, np.zeros(2), 2.0).tolist() == [clear]
