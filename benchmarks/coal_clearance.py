"""How far two arms are apart at moments of their motion, by coal (once hpp-fcl), where that is installed.

coal answers for a pose at a time: it knows no motion, and has no continuous collision. Its shapes are solid: a point
becomes a ball, a segment a capsule, a convex part of an outline a plate, each rounded by coal's own radius. All lie at
one height, so that their distances are those in the plane.
"""

import itertools

import coal
import numpy as np

from fiberplan.focal_plane.bodies import convex_pieces
from references import links, sampled

HEIGHT = 1.0  # [mm] of a plate, up and down


def clearance_over_time(plane, motion, i: int, arm: int, times: np.ndarray) -> np.ndarray:
    """Clearance (t,) of two arms of two links at `times` [mm]; where they overlap, a number below 0."""
    asked, told = coal.DistanceRequest(), coal.DistanceResult()
    smallest = np.full(len(times), np.inf)
    both = (_placed(plane, k, sampled(motion, k, times)) for k in (i, arm))
    for (body, one), (other_body, other) in itertools.product(*both):
        if not _meet(body, other_body):
            continue
        for (shape, at), (other_shape, other_at) in itertools.product(one, other):
            distance = coal.ComputeDistance(shape, other_shape)
            for k, (here, there) in enumerate(zip(at, other_at, strict=True)):
                told.clear()
                smallest[k] = min(smallest[k], distance(here, there, asked, told))
    return smallest


def _meet(one, other) -> bool:
    return any(a.meets is None or b.category in a.meets for a, b in ((one, other), (other, one)))


def _placed(plane, arm: int, angles: np.ndarray) -> list[tuple]:
    """Of each body of an arm, or of an obstacle: it, and (shape, its place at all `angles` (t, 2)) of every part."""
    still = np.zeros(len(angles))
    if arm >= plane.n:
        body = plane.obstacles[arm - plane.n]
        return [(body, _parts(body.points, body.radius, body.closed, np.zeros((len(angles), 2)), still))]
    elbow, first, second = links(plane, arm, angles)
    base = np.broadcast_to(plane.base[arm], elbow.shape)
    frames = {"base": (base, still), "alpha": (base, first), "beta": (elbow, second)}
    found = []
    for body in plane.bodies:
        points = body.points[arm] if body.points.ndim == 3 else body.points
        radius = float(np.broadcast_to(body.radius, plane.n)[arm])
        found.append((body, _parts(points, radius, body.closed, *frames[body.link])))
    return found


def _parts(points, radius: float, closed: bool, origin: np.ndarray, turn: np.ndarray) -> list[tuple]:
    """(shape, its places) of each convex part of a body whose link's frame is at `origin` (t, 2), turned by (t,)."""
    found = []
    for piece in convex_pieces(points, closed):
        middle, (x, y) = piece.mean(axis=0), piece[-1] - piece[0]
        lean = 0.0
        if len(piece) == 1:
            shape = coal.Sphere(radius)
        elif len(piece) == 2:
            shape, lean = coal.Capsule(radius, float(np.hypot(x, y))), float(np.arctan2(y, x))
        else:
            shape = _plate(piece - middle)
            shape.setSweptSphereRadius(radius)
        upright = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # a capsule's axis is z, x here
        lying = upright if len(piece) == 2 else np.eye(3)
        found.append((shape, [_place(o, t, middle, lean, lying) for o, t in zip(origin, turn, strict=True)]))
    return found


def _place(origin: np.ndarray, turn: float, middle: np.ndarray, lean: float, lying: np.ndarray):
    c, s = np.cos(turn), np.sin(turn)
    beside = np.array([[c, -s], [s, c]]) @ middle
    c, s = np.cos(turn + lean), np.sin(turn + lean)
    about = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return coal.Transform3s(about @ lying, np.array([*(origin + beside), 0.0]))


def _plate(outline: np.ndarray):
    """A convex outline (k, 2) as a solid of some height."""
    points = coal.StdVec_Vec3s()
    for z in (-HEIGHT, HEIGHT):
        points.extend([np.array([x, y, z]) for x, y in outline])
    return coal.Convex.convexHull(points, False, "")
