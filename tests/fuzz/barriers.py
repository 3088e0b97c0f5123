"""Paths and proofs that there is none, of one or two arms with bodies of every kind: neither may be wrong.

Paths are certified by `verify`. Of a proof, what it calls blocked is so wherever shapely looks, and random walks that
keep the margin, by shapely too, never leave what it says can be come to, and never come to the goals.
"""

import itertools

import numpy as np

import fiberplan as fp
from fiberplan.certificates.replay_boxes import grown
from fiberplan.certificates.unreachable import decided
from references import sampled_clearance, varied_plane

LOOKS = 40  #: at blocked boxes
STEPS = 60  #: of a walk


def barriers(rng: np.random.Generator, folder) -> None:
    """A random scene, decided or not."""
    plane = varied_plane(rng)
    span = rng.uniform(0.3, 3.0, (plane.n, 2))
    plane = plane.replace(lower=-span, upper=span, online=np.arange(plane.n) < rng.integers(1, 3))
    moving = np.flatnonzero(plane.online).tolist()
    start = _clear(plane, rng.uniform(-1, 1, (60, plane.n, 2)) * span, moving)
    if start is None:
        return
    ends = np.repeat(start[None], 60, axis=0)
    ends[:, moving] = rng.uniform(-1, 1, (60, len(moving), 2)) * span[moving]
    end = _clear(plane, ends, moving)
    margin = rng.uniform(0.0, 0.5)
    goals = {i: end[i] for i in moving[: int(rng.integers(1, 3))]} if end is not None else {moving[0]: span[moving[0]]}
    path, barrier = decided(plane, moving, goals, start, margin, 20_000)
    if path is not None:
        times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path, axis=0)).max(axis=1) + 1e-3)])
        angles = np.repeat(start[None], len(path), axis=0)
        angles[:, moving] = path.reshape(len(path), -1, 2)
        assert fp.verify(plane, fp.Trajectory.from_samples(times, angles), margin - 1e-5).ok
        assert all((angles[-1, i] == goal).all() for i, goal in goals.items())
    if barrier is not None:
        _holds(rng, plane, start, margin, moving, barrier)


def _holds(rng, plane, start, margin, moving, barrier):
    _, leaves = grown(plane.lower[moving].ravel().tolist(), plane.upper[moving].ravel().tolist(), barrier.tree)
    blocked = [box for box in leaves if box.mark == "b"]
    if blocked:
        chosen = [blocked[k] for k in rng.integers(len(blocked), size=LOOKS)]
        at = np.array([rng.uniform(box.low, box.high) for box in chosen])
        assert (least(plane, start, moving, at.reshape(LOOKS, -1, 2)) < margin).all(), "what is called blocked is clear"
    assert walk_stays(rng, plane, start, margin, moving, barrier.tree), "there is a way out"


def walk_stays(rng, plane, start, margin, moving, tree) -> bool:
    """Whether a random walk that keeps the margin, by shapely, stays in what a proof says can be come to."""
    here, low, high = start[moving].ravel(), plane.lower[moving].ravel(), plane.upper[moving].ravel()
    _, leaves = grown(low.tolist(), high.tolist(), tree)
    for size in rng.uniform(0.02, 0.5, STEPS):
        there = np.clip(here + rng.normal(0.0, size, len(here)), low, high)
        between = here + np.linspace(0.0, 1.0, 25)[:, None] * (there - here)
        if (least(plane, start, moving, between.reshape(25, -1, 2)) > margin + 0.1).all():
            here = there
            if not any(box.mark == "i" and box.holds(here.tolist()) for box in leaves):
                return False
    return True


def _clear(plane, tried, moving):
    """The first of `tried` (m, n, 2) in which nobody who can move is nearer than 0.6 mm to another; None if none is."""
    fine = least(plane, tried, moving, tried[:, moving]) > 0.6
    return tried[np.argmax(fine)] if fine.any() else None


def least(plane, still, moving, at):
    """(m,) smallest clearance of those who move, at (m, k, 2), from each other and what stands `still`, by shapely."""
    poses = np.broadcast_to(still, (len(at), plane.n, 2)).copy()
    poses[:, moving] = at
    poses = np.concatenate([poses, np.zeros((len(at), len(plane.obstacles), 2))], axis=1)
    found = np.full(len(at), np.inf)
    for i, arm in itertools.combinations(range(poses.shape[1]), 2):
        if i in moving or arm in moving:
            found = np.minimum(found, sampled_clearance(plane, i, arm, poses[:, i], poses[:, arm]))
    return found
