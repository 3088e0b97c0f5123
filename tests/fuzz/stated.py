"""Arms and their motion as data that other programs can read: a line of JSON, and back.

An arm has its base [mm], length [mm], zeros [rad], bodies (link, points [mm], radius [mm], whether they are closed,
category and what they meet), whether it moves (`online`), and knots (time [s], alpha, beta [rad]). An obstacle is an
arm that has one body on the link "base", and no place or knots. What is not said is as in `references.make_plane`.
"""

import numpy as np

import fiberplan as fp
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.motion import Trajectory
from references import make_plane

SHAPE = ("points", "radius", "closed", "category", "meets")


def stated(plane: fp.FocalPlane, motion: Trajectory, arm: int) -> dict:
    """An arm of two links, or an obstacle (`arm` is n and more), as data."""
    if arm >= plane.n:
        return {"bodies": [{"link": "base"} | _shape(plane.obstacles[arm - plane.n], 0, 1)], "online": False}
    own = slice(*motion.offsets[arm : arm + 2])
    knots = np.column_stack([motion.times[own], motion.angles[own]]).tolist()
    place = {"base": plane.base[arm].tolist(), "length": float(plane.length[arm]), "zero": plane.zero[arm].tolist()}
    bodies = [{"link": body.link} | _shape(body, arm, plane.n) for body in plane.bodies]
    return place | {"bodies": bodies, "knots": knots, "online": bool(plane.online[arm])}


def _shape(body, arm: int, n: int) -> dict:
    return {
        "points": (body.points[arm] if body.points.ndim == 3 else body.points).tolist(),
        "radius": float(np.broadcast_to(body.radius, n)[arm]),
        "closed": body.closed,
        "category": body.category,
        "meets": None if body.meets is None else sorted(body.meets),
    }


def plane_of(arms: list[dict]) -> fp.FocalPlane:
    """The array of these arms, which have bodies of the same kinds, and obstacles last."""
    movers = [arm for arm in arms if "base" in arm]
    kinds = zip(*(arm["bodies"] for arm in movers), strict=True)
    bodies = [
        Body(
            np.array([shape["points"] for shape in of], float),
            np.array([shape["radius"] for shape in of], float),
            of[0].get("link", "beta"),
            **_said(of[0]),
        )
        for of in kinds
    ]
    fixed = [arm["bodies"][0] for arm in arms if "base" not in arm]
    obstacles = [Obstacle(f"obstacle {k}", of["points"], of["radius"], **_said(of)) for k, of in enumerate(fixed)]
    fields = {
        name: np.array([arm[name] for arm in movers], float)
        for name in ("zero", "lower", "upper", "folded", "max_speed")
        if name in movers[0]
    }
    fields = {"max_speed": 1e12} | fields | {"online": np.array([arm.get("online", True) for arm in movers])}
    return make_plane([arm["base"] for arm in movers], bodies, obstacles, [arm["length"] for arm in movers], **fields)


def _said(shape: dict) -> dict:
    """What the shape says that is not its place; what meets nothing else meets everything."""
    said = {name: shape[name] for name in ("closed", "category") if name in shape}
    meets = shape.get("meets")
    return said | {"meets": None if meets is None else tuple(meets)}


def motion_of(arms: list[dict]) -> Trajectory:
    """Their motion."""
    knots = [arm["knots"] for arm in arms if "base" in arm]
    every = np.array([row for own in knots for row in own], float)
    return Trajectory(np.cumsum([0, *map(len, knots)]), every[:, 0], every[:, 1:])
