"""True outlines of bodies and obstacles, as pictures and films draw them.

A rounded convex piece is the hull of a disc at each of its vertices, so an arm is drawn as wide as it is planned.
Outlines are made once, in the frame of the link that they ride on, and placed for all positioners together.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body

_ARC = 24  # corners that stand for a full circle


class Outlines(NamedTuple):
    """Outlines of one body on positioners, ragged: those of outline k are points[offsets[k] : offsets[k + 1]]."""

    link: str  #: that they ride on
    points: np.ndarray  #: (k, 2) in the frame of the link [mm]
    owner: np.ndarray  #: (k,) the positioner of each point
    offsets: np.ndarray  #: (m + 1,)

    def placed(self, plane: FocalPlane, angles: np.ndarray) -> np.ndarray:
        """Points (k, 2) in the focal plane [mm] at commanded `angles` (n, 2) [rad]."""
        origin, turn = plane.kinematics.frames(plane, angles)[self.link]
        c, s = np.cos(turn)[self.owner], np.sin(turn)[self.owner]
        x, y = self.points.T
        return np.stack([c * x - s * y, s * x + c * y], axis=1) + origin[self.owner]

    @property
    def positioners(self) -> np.ndarray:
        """(m,) whose each outline is."""
        return self.owner[self.offsets[:-1]]

    def split(self, points: np.ndarray) -> list[np.ndarray]:
        """`points` (k, 2) outline by outline."""
        return np.split(points, self.offsets[1:-1])


def outlines(plane: FocalPlane, who: np.ndarray | None = None) -> Iterator[Outlines]:
    """Outlines of every body on the positioners `who` (all unless given), in the order in which they are drawn.

    What rides on the second link comes last, since arms reach over each other with it.
    """
    chosen = range(plane.n) if who is None else who
    for body in sorted(plane.bodies, key=lambda body: body.link == "beta"):
        shapes = list(_of_body(body, chosen))
        sizes = np.array([len(shape) for _, shape in shapes], np.int64)
        owner = np.repeat(np.array([i for i, _ in shapes], np.int64), sizes)
        points = np.concatenate([shape for _, shape in shapes]) if shapes else np.empty((0, 2))
        yield Outlines(body.link, points, owner, np.concatenate([[0], np.cumsum(sizes)]))


def _of_body(body: Body, who: "range | np.ndarray") -> Iterator[tuple[int, np.ndarray]]:
    """Each positioner with each of its outlines; outlines that are alike are made once."""
    made: dict[tuple[bytes, float], list[np.ndarray]] = {}
    for i in map(int, who):
        radius = float(np.broadcast_to(body.radius, max(i + 1, np.size(body.radius)))[i])
        points = body.points[i] if body.points.ndim == 3 else body.points
        key = (points.tobytes(), radius)
        if key not in made:
            made[key] = [rounded(piece, radius) for piece in body.pieces(i)]
        yield from ((i, outline) for outline in made[key])


def fixed_outlines(plane: FocalPlane) -> list[np.ndarray]:
    """Outlines (k, 2) of the obstacles [mm]."""
    return [rounded(piece, obstacle.radius) for obstacle in plane.obstacles for piece in obstacle.pieces()]


def rounded(piece: np.ndarray, radius: float) -> np.ndarray:
    """Outline (k, 2) of a convex `piece` (v, 2) grown by `radius`; its arcs are drawn with straight chords."""
    if radius <= 0 and len(piece) < 3:
        return piece
    turns = np.arange(_ARC) * 2 * np.pi / _ARC
    disc = radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    cloud = (piece[:, None] + disc[None]).reshape(-1, 2) if radius > 0 else piece
    return cloud[ConvexHull(cloud).vertices]


def span(plane: FocalPlane) -> np.ndarray:
    """(2, 2) lower and upper corner of all that positioners and obstacles can cover [mm]."""
    low, high = (plane.base - plane.reach[:, None]).min(axis=0), (plane.base + plane.reach[:, None]).max(axis=0)
    for outline in fixed_outlines(plane):
        low, high = np.minimum(low, outline.min(axis=0)), np.maximum(high, outline.max(axis=0))
    return np.stack([low, high])
