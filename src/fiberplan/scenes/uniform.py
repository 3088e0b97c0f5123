"""Seeded fields of configurations: what the papers test planners with."""

import numpy as np

from fiberplan.arrays import number, read_only
from fiberplan.arrays.seeds import generator
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood, touching
from fiberplan.tolerances import SCENE


def uniform_field(
    plane: FocalPlane, seed: int, margin: float = 0.0, start: np.ndarray | None = None, most_rounds: int = 10_000
) -> np.ndarray:
    """Contact-free configuration (n, 2) [rad]: targets uniform in each patrol annulus, touching draws redrawn.

    Source: the experiment of Sayres2021, section 4.

    Args:
        plane: whose positioners.
        seed: the same gives the same field.
        margin: clearance that all keep at least [mm].
        start: (n, 2) where offline positioners stay [rad]; folded unless given.
        most_rounds: of redrawing.

    Raises:
        ValueError: no contact-free field was found within `most_rounds` rounds of redrawing.
        ProblemError: a seed that is none.
    """
    margin = number(margin, "mm", "margin", ProblemError)
    begin = plane.folded if start is None else read_only(start, unit="rad", name="start", error=ProblemError)
    rng = generator(seed)
    angles = begin.copy()
    online = np.flatnonzero(plane.online)
    angles[online] = plane.kinematics.random(plane, rng, online)
    limit = margin + SCENE
    near = Neighbourhood.of(plane, margin)
    for _ in range(most_rounds):
        contact = touching(plane.arms, near, plane.with_obstacles(angles), online, limit)
        bad = online[contact >= 0]
        if not len(bad):
            return read_only(angles)
        redrawn = bad if len(bad) < 3 else bad[rng.random(len(bad)) < 0.5]
        angles[redrawn] = plane.kinematics.random(plane, rng, redrawn)
    raise ValueError(f"no contact-free field at margin {margin} mm within {most_rounds} rounds")
