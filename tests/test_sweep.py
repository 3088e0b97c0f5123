import numpy as np
import pytest

from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.kernels.sweep import swept_clear
from references import make_plane, sampled_clearance, varied_plane

CAPSULE = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0)


def swept(plane, i, start_i, step_i, j, start_j=(0.0, 0.0), step_j=(0.0, 0.0), limit=0.0, shown=0.0, landing=0.0):
    q = [float(v) for v in (*start_i, *step_i)], [float(v) for v in (*start_j, *step_j)]
    return swept_clear(plane.arms, i, *q[0], j, *q[1], float(limit), float(shown), float(landing))


@pytest.mark.parametrize("seed", range(8))
def test_never_true_where_sampling_finds_contact(seed):
    rng = np.random.default_rng(seed)
    answers = []
    for _ in range(60):
        plane = varied_plane(rng) if rng.random() < 0.7 else make_plane(rng.uniform(-12, 12, (2, 2)), [CAPSULE])
        i, j = 0, int(rng.integers(1, plane.n + len(plane.obstacles)))
        start, step = rng.uniform(-4, 4, (2, 2)), rng.normal(0, rng.choice([0.02, 0.3, 2.0]), (2, 2))
        if j >= plane.n:
            start[1] = step[1] = 0.0
        along = np.linspace(0, 1, 400)[:, None]
        gaps = sampled_clearance(plane, i, j, start[0] + along * step[0], start[1] + along * step[1])
        limit = rng.uniform(0, 1)
        found = swept(plane, i, start[0], step[0], j, start[1], step[1], limit)
        assert found == swept(plane, j, start[1], step[1], i, start[0], step[0], limit)
        if found:
            assert gaps.min() >= limit
        elif gaps.min() >= limit + 0.05 and np.abs(step).max() < 0.5:
            pytest.fail(f"clear by {gaps.min() - limit:.3f} mm but refused")
        answers.append(found)
    assert 0.1 < np.mean(answers) < 0.9


def test_contact_between_two_clear_ends():
    plane = make_plane([0, 0], [CAPSULE], [Obstacle("post", np.array([[0.0, 9.0]]), 0.1)], length=0.0)
    for step in (3.0, -3.0, 2 * np.pi):
        assert not swept(plane, 0, (0.1, 0.0), (step, 0.0), 1) or step < 0
    assert swept(plane, 0, (0.1, 0.0), (-3.0, 0.0), 1)


def test_tiny_overlap_at_the_end_of_a_step():
    plane = make_plane([0, 0], [CAPSULE], [Obstacle("wall", np.array([[-20.0, -4.0], [20.0, -4.0]]))], length=0.0)
    touching = np.arcsin(0.3)  # the tip, 1 mm thick, is then at the wall, 3 mm below
    assert swept(plane, 0, (0.0, 0.0), (-touching + 1e-4, 0.0), 1)
    assert not swept(plane, 0, (0.0, 0.0), (-touching - 1e-9, 0.0), 1)


def test_both_move_and_never_meet_at_the_same_time():
    plane = make_plane([[0, 0], [14, 0]], [CAPSULE], length=0.0)
    up, down = (np.pi / 2, 0.0), (np.pi / 2 - np.pi, 0.0)
    assert swept(plane, 0, up, (-np.pi, 0.0), 1, (np.pi / 2, 0.0), (-np.pi, 0.0))  # side by side, like wipers
    assert not swept(plane, 0, up, (-np.pi, 0.0), 1, down, (-np.pi, 0.0))  # towards each other
    assert not swept(plane, 0, up, (-np.pi, 0.0), 1, up, (0.0, 0.0), limit=2.1)  # past one that stands


def test_nothing_moves():
    plane = make_plane([[0, 0], [12, 0]], [CAPSULE], length=0.0)
    assert swept(plane, 0, (1.5, 0), (0, 0), 1, (1.5, 0), (0, 0), limit=9.0)
    assert not swept(plane, 0, (1.5, 0), (0, 0), 1, (1.5, 0), (0, 0), limit=10.0)


def test_none_meet():
    apart = Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0, meets=())
    plane = make_plane([[0, 0], [2, 0]], [apart], length=0.0)
    assert swept(plane, 0, (0, 0), (9, 0), 1, (0, 0), (0, 0), limit=5.0)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_unknown_is_not_clear(bad):
    plane = make_plane([[0, 0], [40, 0]], [CAPSULE], length=0.0)
    for k in range(4):
        q = [0.0, 0.0, 0.1, 0.1]
        q[k] = bad
        assert not swept(plane, 0, q[:2], q[2:], 1)


def test_what_is_known_to_be_clear_is_not_asked_again():
    plane = make_plane([0, 0], [CAPSULE], [Obstacle("post", np.array([[0.0, 9.0]]), 0.1)], length=0.0)
    through = (np.pi / 2 - 1.0, 0.0), (2.0, 0.0)  # past the post half way
    assert not swept(plane, 0, *through, 1)
    assert not swept(plane, 0, *through, 1, shown=0.4)
    assert swept(plane, 0, *through, 1, shown=0.7)
    into = (np.pi / 2 - 1.0, 0.0), (1.0, 0.0)
    assert not swept(plane, 0, *into, 1, shown=1.0)  # the end is always looked at


def test_landing_asks_for_room_at_the_end_unless_it_grows():
    plane = make_plane([0, 0], [CAPSULE], [Obstacle("wall", np.array([[-20.0, -4.0], [20.0, -4.0]]))], length=0.0)
    near = -np.arcsin(0.29)  # the tip is then 0.1 mm from the wall
    assert swept(plane, 0, (0.0, 0.0), (near, 0.0), 1, landing=0.05)
    assert not swept(plane, 0, (0.0, 0.0), (near, 0.0), 1, landing=0.15)
    assert swept(plane, 0, (near - 0.005, 0.0), (0.005, 0.0), 1, landing=0.15)
