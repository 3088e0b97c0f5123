"""A focal plane as the kernels take it: arrays of arms, of convex pieces and of their vertices."""

from collections.abc import Sequence

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.bodies import LINKS, Body, Obstacle
from fiberplan.focal_plane.kinematics import Kinematics
from fiberplan.focal_plane.outlines import convex_pieces, strictly_convex
from fiberplan.kernels.arms import ARM, BAR, PIECE, Arms

_EVERY_CATEGORY = (1 << 62) - 1


def compile_arms(
    base: np.ndarray,
    length: np.ndarray,
    zero: np.ndarray,
    bodies: Sequence[Body],
    obstacles: Sequence[Obstacle],
    kinematics: Kinematics,
) -> tuple[Arms, np.ndarray]:
    """Bodies and obstacles as the kernels' arrays, and each positioner's whole reach with radii (n,) [mm].

    Args:
        base: (n, 2) alpha axes [mm].
        length: (n,) base to elbow [mm].
        zero: (n, 2) added to commanded angles [rad].
        bodies: on the links of every positioner.
        obstacles: fixed.
        kinematics: the kind of arm.

    Raises:
        InstrumentError: too many categories, or one that nothing has.
    """
    n, count = len(base), len(base) + len(obstacles)
    everything: list[Body | Obstacle] = [*bodies, *obstacles]
    bits = {name: 1 << k for k, name in enumerate(dict.fromkeys(thing.category for thing in everything))}
    if len(bits) > 62:
        raise InstrumentError(f"{len(bits)} body categories, at most 62 are possible")
    for thing in everything:
        unknown = [name for name in thing.meets or () if name not in bits]
        if unknown:  # a misspelt category would switch collisions off
            raise InstrumentError(f"'{thing.name}' meets '{unknown[0]}', a category that nothing has")

    cut = _Cut()
    meeting = [_EVERY_CATEGORY if t.meets is None else sum(bits[name] for name in set(t.meets)) for t in everything]
    bit = [bits[thing.category] for thing in everything]

    arm = np.zeros(count, ARM)
    arm["x"][:n], arm["y"][:n], arm["length"][:n] = *base.T, length
    arm["alpha_zero"][:n], arm["beta_zero"][:n] = zero.T
    arm["bar"] = -1
    bar = kinematics.constants(base, zero)
    arm["bar"][: len(bar)] = np.arange(len(bar))
    arm["alpha_zero"][:n] += kinematics.turned
    extents = [np.broadcast_to(np.hypot(b.points[..., 0], b.points[..., 1]).max(axis=-1), (n,)) for b in bodies]
    reach = np.zeros(n)
    for body, extent in zip(bodies, extents, strict=True):
        name = {"alpha": "reach_alpha", "beta": "reach_beta"}.get(body.link)
        if name is not None:
            arm[name][:n] = np.maximum(arm[name][:n], extent)
        origin = length if body.link == "beta" else np.zeros(n)
        if body.link == "rocker":
            bar["reach"] = np.maximum(bar["reach"], extent)
            origin = bar["spacing"]
        reach = np.maximum(reach, extent + body.radius + origin)
    of_body = []  # for each body, pieces by shape, the shape of each positioner, and where its pieces begin
    placed = np.zeros(n, np.int64)
    for k, body in enumerate(bodies):
        outlines, shape = _distinct(body.points, n)
        whole = strictly_convex(outlines) if body.closed and body.points.ndim == 3 else np.zeros(len(outlines), bool)
        templates = [
            cut.pieces(
                [outline] if convex else convex_pieces(outline, body.closed), LINKS[body.link], bit[k], meeting[k]
            )
            for outline, convex in zip(outlines, whole.tolist(), strict=True)
        ]
        of_body.append((templates, shape, placed.copy()))
        placed += np.array([len(template) for template in templates])[shape]
    arm["last_piece"][:n] = np.cumsum(placed)
    arm["first_piece"][:n] = arm["last_piece"][:n] - placed
    piece = np.empty(int(placed.sum()), PIECE)
    for body, (templates, shape, begin) in zip(bodies, of_body, strict=True):
        radius = np.broadcast_to(body.radius, (n,))
        for number, template in enumerate(templates):
            mine = np.flatnonzero(shape == number) if len(templates) > 1 else np.arange(n)
            rows = (arm["first_piece"][mine] + begin[mine])[:, None] + np.arange(len(template))
            piece[rows] = template
            piece["radius"][rows] = radius[mine, None]
    fixed = [
        cut.pieces(obstacle.pieces(), 0, bit[k], meeting[k]) for k, obstacle in enumerate(obstacles, start=len(bodies))
    ]
    for template, obstacle in zip(fixed, obstacles, strict=True):
        template["radius"] = obstacle.radius
    arm["last_piece"][n:] = len(piece) + np.cumsum([len(template) for template in fixed], dtype=np.int64)
    arm["first_piece"][n:] = arm["last_piece"][n:] - [len(template) for template in fixed]
    arms = Arms(
        arm=read_only(arm, ARM),
        piece=read_only(np.concatenate([piece, *fixed]), PIECE),
        vertices=read_only(np.concatenate(cut.vertices) if cut.vertices else np.empty((0, 2))),
        bar=read_only(bar, BAR),
    )
    return arms, read_only(reach)


class _Cut:
    """Convex pieces that are cut so far, and their vertices; positioners of one outline share its vertices."""

    def __init__(self) -> None:
        self.vertices: list[np.ndarray] = []
        self._used = 0

    def pieces(self, shape: list[np.ndarray], link: int, category: int, meets: int) -> np.ndarray:
        """Convex pieces (k, 2) [mm] as (m,) PIECE, without their radius."""
        rows = []
        for piece in shape:
            center = 0.5 * (piece.min(axis=0) + piece.max(axis=0))
            extent = np.hypot(*(piece - center).T).max()
            rows.append((link, 0.0, category, meets, self._used, self._used + len(piece), *center, extent))
            self.vertices.append(piece)
            self._used += len(piece)
        return np.array(rows, PIECE)


def _distinct(points: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Outlines (m, k, 2) that differ, and which of them each of n positioners has (n,): each is cut once only."""
    if points.ndim == 2:
        return points[None], np.zeros(n, np.int64)
    outlines, shape = np.unique(points.reshape(n, -1), axis=0, return_inverse=True)
    return outlines.reshape(len(outlines), *points.shape[1:]), shape.reshape(n)
