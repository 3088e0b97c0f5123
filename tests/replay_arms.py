"""Arms and obstacles for tests of the replay, without a plan file; and convex parts as shapely has them."""

import numpy as np
import shapely
from flint import acb

from fiberplan.certificates.replay import Claims, Shape

PLACE = [[3.0, -2.0, 8.0, 0.3, -0.3], [25.0, 1.0, 6.0, 0.1, 0.2], [40.0, 0.0, 6.0, 0.0, 0.0]]


def shape(link, points, radius=0.0, filled=False):
    points = np.array(points, complex)
    k = len(points)
    parts = (tuple(range(k)),) if filled or k == 1 else tuple((i, i + 1) for i in range(k - 1))
    return Shape(link, points, parts, False, radius, "x", None, [acb(z.real, z.imag) for z in points.tolist()])


def scene(arms, obstacles=(), margin=0.5):
    """Claims of up to three positioners with these shapes, and of obstacles of a shape each."""
    claims = object.__new__(Claims)
    claims.n, claims.margin, claims.arms = len(arms), margin, [*arms, *([own] for own in obstacles)]
    claims.place = np.array(PLACE[: len(arms)])
    claims.bar, claims.base = np.zeros((claims.n, 0)), claims.place[:, 0] + 1j * claims.place[:, 1]
    claims.reach, claims.online = np.full(claims.n, 20.0), np.ones(claims.n, bool)
    claims.knots = [np.array([[0.0, 0.1 * i, 0.2 * i]]) for i in range(claims.n)]
    return claims


def place_of(link, z, alpha, beta):
    """Where a point of the first positioner is."""
    x, y, length, zero, other = PLACE[0]
    if link == 0:
        return x + 1j * y + z
    crank = np.exp(1j * (alpha + zero))
    return x + 1j * y + (z * crank if link == 1 else length * crank + z * crank * np.exp(1j * (beta + other)))


def convex(rng, k, size=4.0, centre=0.0):
    """k vertices of a convex outline, in order."""
    turns = np.sort(rng.uniform(0, 2 * np.pi, k))
    return centre + size * np.exp(1j * turns) if k > 1 else np.array([centre], complex)


def geometry(part):
    points = np.stack([part.real, part.imag], axis=1)
    return (shapely.Point, shapely.LineString, shapely.Polygon)[min(len(part), 3) - 1](
        points[0] if len(part) == 1 else points
    )
