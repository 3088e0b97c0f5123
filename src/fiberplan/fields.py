"""Seeded fields of configurations: what the papers test planners with."""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.arms import frame
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.kernels.neighbours import adjacency


@leaf
def _first_contact(arms, angles, offsets, neighbour, i, limit):
    """First neighbour that arm i does not clear by `limit` [mm], or -1."""
    frame_i = frame(arms, i, angles[i, 0], angles[i, 1])
    for k in range(offsets[i], offsets[i + 1]):
        j = neighbour[k]
        gap = frames_clearance(arms, i, frame_i, j, frame(arms, j, angles[j, 0], angles[j, 1]))
        if not (gap >= limit):
            return j
    return -1


@kernel
def _touching(arms, angles, offsets, neighbour, limit):
    """Arms that touch a neighbour of lower number, in order: redrawing these alone can clear the field."""
    out = np.empty(len(offsets) - 1, np.int64)
    count = 0
    for i in range(len(offsets) - 1):
        j = _first_contact(arms, angles, offsets, neighbour, i, limit)
        if j >= 0:
            out[count] = i
            count += 1
    return out[:count].copy()


def random_configuration(plane: FocalPlane, rng: np.random.Generator, who: np.ndarray) -> np.ndarray:
    """Angles (len(who), 2) [rad] whose fibers are uniform over each patrol annulus, as far as the joint ranges allow.

    Alpha is uniform over its range (at most one turn), and beta such that equal areas are equally likely: the squared
    distance of the fiber from the base is uniform in cos(beta).
    """
    low, high = plane.lower[who], plane.upper[who]
    alpha = low[:, 0] + rng.random(len(who)) * np.minimum(high[:, 0] - low[:, 0], 2 * np.pi)
    bend = plane.zero[who, 1] + np.arctan2(plane.fiber[who, 1], plane.fiber[who, 0])  # beta of a straight arm is -bend
    first, last = low[:, 1] + bend, np.minimum(high[:, 1] + bend, low[:, 1] + bend + 2 * np.pi)
    # cos(beta) is monotonic on half turns only: draw by weight |sin(beta)| through the integral of |sin|
    draw = _abs_sin_integral(first) + rng.random(len(who)) * (_abs_sin_integral(last) - _abs_sin_integral(first))
    turns = np.floor(draw / 2.0)
    beta = turns * np.pi + np.arccos(np.clip(1.0 - (draw - 2.0 * turns), -1.0, 1.0)) - bend
    return np.stack([alpha, np.clip(beta, low[:, 1], high[:, 1])], axis=1)


def _abs_sin_integral(x: np.ndarray) -> np.ndarray:
    """Integral of |sin| from 0 to x: 2 per half turn."""
    turns = np.floor(x / np.pi)
    return 2.0 * turns + 1.0 - np.cos(x - turns * np.pi)


def uniform_field(
    plane: FocalPlane, seed: int, margin: float = 0.0, start: np.ndarray | None = None, most_rounds: int = 10_000
) -> np.ndarray:
    """Contact-free configuration (n, 2) [rad]: targets uniform in each patrol annulus, touching draws redrawn.

    Offline positioners stay at `start` (folded unless given). Source: the experiment of Sayres2021, section 4.

    Raises:
        ValueError: no contact-free field was found within `most_rounds` rounds of redrawing.
    """
    rng = np.random.default_rng(seed)
    angles = np.array(plane.folded if start is None else start, float)
    online = np.flatnonzero(plane.online)
    angles[online] = random_configuration(plane, rng, online)
    limit = margin + 2e-3  # clear of what `Problem` asks for
    pairs = plane.arm_pairs_within(limit)
    offsets, neighbour, _ = adjacency(len(plane.arms.arm), pairs)
    offsets = offsets[: plane.n + 1].copy()
    for _ in range(most_rounds):
        everyone = plane.with_obstacles(angles)
        touching = _touching(plane.arms, everyone, offsets, neighbour, limit)
        touching = touching[plane.online[touching]]
        if not len(touching):
            return read_only(angles)
        redrawn = touching if len(touching) < 3 else touching[rng.random(len(touching)) < 0.5]
        angles[redrawn] = random_configuration(plane, rng, redrawn)
    raise ValueError(f"no contact-free field at margin {margin} mm within {most_rounds} rounds")
