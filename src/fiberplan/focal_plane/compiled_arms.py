"""A focal plane as the kernels take it: arrays of arms, of convex pieces and of their vertices."""

from collections.abc import Sequence

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.bodies import LINKS, Body, Obstacle
from fiberplan.focal_plane.kinematics import Kinematics
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

    pieces: list[tuple[float, ...]] = []
    vertices: list[np.ndarray] = []
    used = 0

    def add(shape: list[np.ndarray], link: int, radius: float, body: Body | Obstacle) -> None:
        nonlocal used
        meets = _EVERY_CATEGORY if body.meets is None else sum(bits.get(name, 0) for name in set(body.meets))
        for piece in shape:
            center = 0.5 * (piece.min(axis=0) + piece.max(axis=0))
            extent = np.hypot(*(piece - center).T).max()
            pieces.append((link, radius, bits[body.category], meets, used, used + len(piece), *center, extent))
            vertices.append(piece)
            used += len(piece)

    arm = np.zeros(count, ARM)
    arm["x"][:n], arm["y"][:n], arm["length"][:n] = *base.T, length
    arm["alpha_zero"][:n], arm["beta_zero"][:n] = zero.T
    arm["bar"] = -1
    bar = kinematics.constants(base, zero)
    arm["bar"][: len(bar)] = np.arange(len(bar))
    arm["alpha_zero"][:n] += kinematics.turned
    shared = [b.pieces(0) if b.points.ndim == 2 else None for b in bodies]
    extents = [np.broadcast_to(np.hypot(b.points[..., 0], b.points[..., 1]).max(axis=-1), (n,)) for b in bodies]
    radii = [np.broadcast_to(b.radius, (n,)) for b in bodies]
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
    for i in range(n):
        arm["first_piece"][i] = len(pieces)
        for body, shape, thickness in zip(bodies, shared, radii, strict=True):
            add(body.pieces(i) if shape is None else shape, LINKS[body.link], float(thickness[i]), body)
        arm["last_piece"][i] = len(pieces)
    for k, obstacle in enumerate(obstacles):
        arm["first_piece"][n + k] = len(pieces)
        add(obstacle.pieces(), 0, obstacle.radius, obstacle)
        arm["last_piece"][n + k] = len(pieces)
    arms = Arms(
        arm=read_only(arm, ARM),
        piece=read_only(np.array(pieces, PIECE), PIECE),
        vertices=read_only(np.concatenate(vertices) if vertices else np.empty((0, 2))),
        bar=read_only(bar, BAR),
    )
    return arms, read_only(reach)
