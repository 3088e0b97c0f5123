"""Seeded fields of configurations: what the papers test planners with."""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood, touching
from fiberplan.tolerances import SCENE


def random_configuration(plane: FocalPlane, rng: np.random.Generator, who: np.ndarray) -> np.ndarray:
    """Angles (len(who), 2) [rad] whose fibers are uniform over each patrol annulus, as far as the joint ranges allow.

    Alpha is uniform over its range (at most one turn), and beta such that equal areas are equally likely: the squared
    distance of the fiber from the base is uniform in cos(beta). Angles of four-bar arms are uniform over their joint
    ranges, outside the zone of avoidance and with the tip in the field.
    """
    if plane.four_bar is not None:
        return _random_bars(plane, rng, who)
    turn = 2 * np.pi  # of a range without ends, one turn each way from folded
    low = np.maximum(plane.lower[who], plane.folded[who] - turn)
    high = np.minimum(plane.upper[who], plane.folded[who] + turn)
    alpha = low[:, 0] + rng.random(len(who)) * np.minimum(high[:, 0] - low[:, 0], 2 * np.pi)
    bend = plane.zero[who, 1] + np.arctan2(plane.fiber[who, 1], plane.fiber[who, 0])  # beta of a straight arm is -bend
    first, last = low[:, 1] + bend, np.minimum(high[:, 1] + bend, low[:, 1] + bend + 2 * np.pi)
    # cos(beta) is monotonic on half turns only: draw by weight |sin(beta)| through the integral of |sin|
    draw = _abs_sin_integral(first) + rng.random(len(who)) * (_abs_sin_integral(last) - _abs_sin_integral(first))
    turns = np.floor(draw / 2.0)
    beta = turns * np.pi + np.arccos(np.clip(1.0 - (draw - 2.0 * turns), -1.0, 1.0)) - bend
    return np.stack([alpha, np.clip(beta, low[:, 1], high[:, 1])], axis=1)


def _random_bars(plane: FocalPlane, rng: np.random.Generator, who: np.ndarray) -> np.ndarray:
    """Angles (len(who), 2) [rad] of four-bar arms, drawn again until they may be taken."""
    drawn, missing = np.array(plane.folded), who
    while len(missing):
        low, high = plane.lower[missing], plane.upper[missing]
        drawn[missing] = low + rng.random((len(missing), 2)) * (high - low)
        bad = plane.in_avoidance(drawn) | (np.hypot(*plane.fibers(drawn).T) > plane.field_radius)
        missing = missing[bad[missing]]
    return drawn[who]


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
    limit = margin + SCENE
    near = Neighbourhood.of(plane, margin)
    for _ in range(most_rounds):
        contact = touching(plane.arms, near, plane.with_obstacles(angles), online, limit)
        bad = online[contact >= 0]
        if not len(bad):
            return read_only(angles)
        redrawn = bad if len(bad) < 3 else bad[rng.random(len(bad)) < 0.5]
        angles[redrawn] = random_configuration(plane, rng, redrawn)
    raise ValueError(f"no contact-free field at margin {margin} mm within {most_rounds} rounds")
