"""Filled outlines cut into convex pieces, by signs that are exact.

On which side of a line a point lies is decided in floating point where rounding cannot change the answer, and in
fractions where it could. So an outline whose edges nearly touch is neither refused nor cut wrongly, and one whose edges
do touch is refused. Source of the error bound: Shewchuk 1997, "Adaptive Precision Floating-Point Arithmetic and Fast
Robust Geometric Predicates".
"""

from fractions import Fraction
from itertools import pairwise

import numpy as np

from fiberplan.errors import InstrumentError

_ERROR_BOUND = (3.0 + 16.0 * 2.0**-53) * 2.0**-53  # of the determinant, relative to the sum of its two products
_UNDERFLOW = 1e-290  # more than products that underflow can lose
_BLOCK = 256  # edges that are held against all others at a time


def convex_pieces(points: np.ndarray, closed: bool) -> list[np.ndarray]:
    """The shape as convex pieces: a point, the segments of an open line, or the parts of a filled outline.

    Raises:
        InstrumentError: a closed outline crosses or touches itself or encloses no area, so it has no inside.
    """
    if not closed:
        return [points[k : k + 2] for k in range(len(points) - 1)] if len(points) > 2 else [points]
    points = simple_outline(points)
    if len(points) <= 2:
        return [points]
    outermost = np.lexsort((points[:, 1], points[:, 0]))[0]
    if _turns(points)[outermost] < 0:  # the outermost corner turns as the whole does
        points = points[::-1]
    return [points] if _is_convex(points) else [points[piece] for piece in _merged(points, _triangles(points))]


def strictly_convex(outlines: np.ndarray) -> np.ndarray:
    """(m,) which closed outlines (m, k, 2) turn left at every point and once around: those are their only piece."""
    before, after = np.roll(outlines, 1, axis=1), np.roll(outlines, -1, axis=1)
    edges = after - outlines
    headings = np.arctan2(edges[..., 1], edges[..., 0])
    turned = np.sum((np.roll(headings, -1, axis=1) - headings + np.pi) % (2 * np.pi) - np.pi, axis=1)
    return np.all(side(before, outlines, after) > 0, axis=1) & (np.abs(turned - 2 * np.pi) < 1e-6)


def simple_outline(points: np.ndarray) -> np.ndarray:
    """A closed outline (k, 2) without its repeated points, once it is known to have an inside.

    Raises:
        InstrumentError: it crosses or touches itself or encloses no area.
    """
    again = np.all(points == np.roll(points, 1, axis=0), axis=1)
    points = points[~again] if not again.all() else points[:1]
    if len(points) > 2 and not np.any(_turns(points)):
        raise InstrumentError("a closed outline encloses no area")
    if len(points) > 2 and _crosses_itself(points):
        raise InstrumentError("a closed outline crosses itself")
    return points


def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Exact side of the line from `a` to `b` on which `c` lies: 1 left, -1 right, 0 on it; points are (..., 2)."""
    a, b, c = np.broadcast_arrays(a, b, c)
    with np.errstate(over="ignore", invalid="ignore"):
        u, v = b - a, c - a
        left, right = u[..., 0] * v[..., 1], u[..., 1] * v[..., 0]
        value = left - right
        sure = np.abs(value) > _ERROR_BOUND * (np.abs(left) + np.abs(right)) + _UNDERFLOW
    out = np.array(np.sign(np.where(sure, value, 0.0)), np.int8)
    for k in map(tuple, np.argwhere(~sure)):
        out[k] = _exact_side(a[k].tolist(), b[k].tolist(), c[k].tolist())
    return out


def _exact_side(a: list[float], b: list[float], c: list[float]) -> int:
    """As `side`, of one point each."""
    if a[0] == b[0] == c[0] or a[1] == b[1] == c[1]:  # the usual reason for zero, and cheap
        return 0
    (ax, ay), (bx, by), (cx, cy) = map(Fraction, a), map(Fraction, b), map(Fraction, c)
    left, right = (bx - ax) * (cy - ay), (by - ay) * (cx - ax)
    return (left > right) - (left < right)


def _turns(outline: np.ndarray) -> np.ndarray:
    """(k,) which way the outline turns at each vertex: 1 left, -1 right, 0 straight on or straight back."""
    return side(np.roll(outline, 1, axis=0), outline, np.roll(outline, -1, axis=0))


def _crosses_itself(outline: np.ndarray) -> bool:
    """Whether two edges of an outline that are not next to each other meet."""
    n, ends = len(outline), np.roll(outline, -1, axis=0)
    low, high = np.minimum(outline, ends), np.maximum(outline, ends)
    for first in range(0, n, _BLOCK):
        rows = slice(first, first + _BLOCK)
        near = np.all((low[rows, None] <= high[None]) & (low[None] <= high[rows, None]), axis=2)
        a, b = np.nonzero(near)
        a += first
        apart = (b > a + 1) & (b - a < n - 1)
        a, b = a[apart], b[apart]
        if len(a) and np.any(_meet(outline[a], ends[a], outline[b], ends[b])):
            return True
    return False


def _meet(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Which segments ab and cd have a point in common."""
    of_c, of_d, of_a, of_b = side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b)
    meet = (of_c * of_d < 0) & (of_a * of_b < 0)
    for on, p, one, other in ((of_c, c, a, b), (of_d, d, a, b), (of_a, a, c, d), (of_b, b, c, d)):
        within = np.all((np.minimum(one, other) <= p) & (p <= np.maximum(one, other)), axis=1)
        meet |= (on == 0) & within
    return meet


def _is_convex(outline: np.ndarray) -> bool:
    """Whether a counter-clockwise outline turns left only, and only once around.

    Rounding counts as straight on: the bodies of positioners are cut into as few pieces as they can be.
    """
    edges = np.roll(outline, -1, axis=0) - outline
    before = np.roll(edges, 1, axis=0)
    if np.any(before[:, 0] * edges[:, 1] - before[:, 1] * edges[:, 0] < 0):
        return False
    headings = np.arctan2(edges[:, 1], edges[:, 0])
    turned = np.sum((np.roll(headings, -1) - headings + np.pi) % (2 * np.pi) - np.pi)
    return bool(abs(turned - 2 * np.pi) < 1e-6)


def _merged(outline: np.ndarray, triangles: list[list[int]]) -> list[list[int]]:
    """Convex pieces, as vertices in counter-clockwise order, of a triangulation: cuts that are not needed are undone.

    A cut is needed where the outline would turn right at one of its ends without it; trying each once leaves at most
    four times as many pieces as the fewest there can be. Source: Hertel and Mehlhorn 1985, "Fast Triangulation of the
    Plane with Respect to Simple Polygons".
    """
    pieces = dict(enumerate(triangles))
    owner = {edge: k for k, piece in pieces.items() for edge in zip(piece, piece[1:] + piece[:1], strict=True)}
    for a, b in [edge for edge in owner if edge[0] < edge[1]]:
        if (b, a) not in owner:
            continue  # an edge of the outline
        keeps, joins = owner[a, b], owner[b, a]
        mine, other = pieces[keeps], pieces[joins]
        at, to = mine.index(b), other.index(a)
        mine, other = mine[at:] + mine[:at], other[to:] + other[:to]  # b ... a and a ... b
        ends = np.array([[mine[-2], a, other[1]], [other[-2], b, mine[1]]])
        if not np.all(side(outline[ends[:, 0]], outline[ends[:, 1]], outline[ends[:, 2]]) >= 0):
            continue
        pieces[keeps] = mine + other[1:-1]
        del pieces[joins], owner[a, b], owner[b, a]
        for edge in pairwise(other):
            owner[edge] = keeps
    return list(pieces.values())


def _triangles(outline: np.ndarray) -> list[list[int]]:
    """A simple counter-clockwise outline cut into triangles, three vertices each, by clipping ears, always the first.

    Only vertices that do not turn left can lie in the way of an ear, and clipping one changes only its neighbours.

    Raises:
        InstrumentError: no ear is left, which no simple outline comes to.
    """
    n = len(outline)
    before, after = np.roll(np.arange(n), 1), np.roll(np.arange(n), -1)
    turns, there = _turns(outline), np.ones(n, bool)
    open_ = turns > 0  # may be an ear
    triangles: list[list[int]] = []
    for left in range(n, 3, -1):
        k = _first_ear(outline, before, after, there & (turns <= 0), open_)
        if k < 0:
            flat = np.flatnonzero(there & (turns == 0))
            if not len(flat):
                raise InstrumentError("a closed outline crosses itself")
            k = int(flat[0])
        else:
            triangles.append([int(before[k]), k, int(after[k])])
        i, j = int(before[k]), int(after[k])
        after[i], before[j] = j, i
        there[k] = open_[k] = False
        if left > 4:
            turns[[i, j]] = side(outline[[before[i], i]], outline[[i, j]], outline[[j, after[j]]])
            open_[[i, j]] = turns[[i, j]] > 0
    return [*triangles, np.flatnonzero(there).tolist()]


def _first_ear(
    outline: np.ndarray, before: np.ndarray, after: np.ndarray, blocking: np.ndarray, open_: np.ndarray
) -> int:
    """The first vertex that can be cut off, -1 if there is none; those tried in vain are struck from `open_`."""
    while open_.any():
        k = int(np.argmax(open_))
        ear = outline[[before[k], k, after[k]]]
        near = blocking & np.all((outline >= ear.min(axis=0)) & (outline <= ear.max(axis=0)), axis=1)
        near[[before[k], after[k]]] = False
        points = outline[near]
        for e in range(3):
            points = points[side(ear[e - 1], ear[e], points) >= 0]
        if not len(points):
            return k
        open_[k] = False
    return -1
