"""A focal plane as the kernels take it: arrays of arms, of convex pieces and of their vertices."""

from typing import TYPE_CHECKING

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.bodies import LINKS, Body, Obstacle
from fiberplan.errors import InstrumentError
from fiberplan.four_bar import FourBar
from fiberplan.kernels.arms import ARM, BAR, PIECE, Arms

if TYPE_CHECKING:
    from fiberplan.focal_plane import FocalPlane


def compile_arms(plane: "FocalPlane") -> tuple[Arms, np.ndarray]:
    """Bodies and obstacles as the kernels' arrays, and each positioner's whole reach with radii (n,) [mm]."""
    n, count = plane.n, plane.n + len(plane.obstacles)
    bits = {name: 1 << k for k, name in enumerate(_categories(plane))}
    if len(bits) > 62:
        raise InstrumentError(f"{plane.name}: {len(bits)} body categories, at most 62 are possible")
    everything = (1 << 62) - 1
    everyone: list[Body | Obstacle] = [*plane.bodies, *plane.obstacles]
    for thing in everyone:
        unknown = [name for name in thing.meets or () if name not in bits]
        if unknown:  # a misspelt category would switch collisions off
            raise InstrumentError(f"{plane.name}: '{thing.name}' meets '{unknown[0]}', a category that nothing has")

    pieces: list[tuple[float, ...]] = []
    vertices: list[np.ndarray] = []
    used = 0

    def add(shape: list[np.ndarray], link: int, radius: float, body: Body | Obstacle) -> None:
        nonlocal used
        meets = everything if body.meets is None else sum(bits.get(name, 0) for name in set(body.meets))
        for piece in shape:
            center = 0.5 * (piece.min(axis=0) + piece.max(axis=0))
            extent = np.hypot(*(piece - center).T).max()
            pieces.append((link, radius, bits[body.category], meets, used, used + len(piece), *center, extent))
            vertices.append(piece)
            used += len(piece)

    arm = np.zeros(count, ARM)
    arm["x"][:n], arm["y"][:n], arm["length"][:n] = *plane.base.T, plane.length
    arm["alpha_zero"][:n], arm["beta_zero"][:n] = plane.zero.T
    arm["bar"] = -1
    bar = np.zeros(n if plane.four_bar else 0, BAR)
    if plane.four_bar is not None:
        _fill_bars(plane, plane.four_bar, bar)
        arm["bar"][:n] = np.arange(n)
        arm["alpha_zero"][:n] += plane.four_bar.orientation
    shared = [b.pieces(0) if b.points.ndim == 2 else None for b in plane.bodies]
    extents = [np.broadcast_to(np.hypot(b.points[..., 0], b.points[..., 1]).max(axis=-1), (n,)) for b in plane.bodies]
    radii = [np.broadcast_to(b.radius, (n,)) for b in plane.bodies]
    reach = np.zeros(n)
    for body, extent in zip(plane.bodies, extents, strict=True):
        name = {"alpha": "reach_alpha", "beta": "reach_beta"}.get(body.link)
        if name is not None:
            arm[name][:n] = np.maximum(arm[name][:n], extent)
        origin = plane.length if body.link == "beta" else np.zeros(n)
        if body.link == "rocker":
            bar["reach"] = np.maximum(bar["reach"], extent)
            origin = bar["spacing"]
        reach = np.maximum(reach, extent + body.radius + origin)
    for i in range(n):
        arm["first_piece"][i] = len(pieces)
        for body, shape, thickness in zip(plane.bodies, shared, radii, strict=True):
            add(body.pieces(i) if shape is None else shape, LINKS[body.link], float(thickness[i]), body)
        arm["last_piece"][i] = len(pieces)
    for k, obstacle in enumerate(plane.obstacles):
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


def _fill_bars(plane: "FocalPlane", four_bar: FourBar, bar: np.ndarray) -> None:
    """Four-bar constants of every positioner, but for the reach of bodies on the rocker."""
    pivot, turn = four_bar.rockers(plane.base, np.zeros((plane.n, 2)), plane.zero)
    bar["x"], bar["y"] = pivot.T
    bar["spacing"], bar["length"], bar["turn"] = four_bar.spacing, four_bar.rocker, turn
    bar["shortest"], bar["longest"] = four_bar.shortest, four_bar.longest


def _categories(plane: "FocalPlane") -> list[str]:
    """Categories in order of appearance."""
    names = [body.category for body in plane.bodies] + [obstacle.category for obstacle in plane.obstacles]
    return list(dict.fromkeys(names))
