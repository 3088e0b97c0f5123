"""A focal plane and a motion of it as the page wants them: what its drawing needs, whoever made the motion.

Angles and knots are in single precision, plenty for a drawing.
"""

from typing import Any

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import LINKS
from fiberplan.focal_plane.four_bar import FourBar
from fiberplan.motion import Trajectory
from fiberplan.visuals.heights import kinds, passed_over
from fiberplan.visuals.packing import packed


def plane_data(plane: FocalPlane) -> dict[str, Any]:
    """Names, geometry, bodies and obstacles."""
    return {
        "name": plane.name,
        "ids": list(plane.ids),
        **({"aliases": list(plane.aliases)} if plane.aliases else {}),
        "base": packed(plane.base, "<f8"),
        "length": packed(plane.length, "<f4"),
        "zero": packed(plane.zero, "<f4"),
        "lower": packed(plane.lower, "<f4"),
        "upper": packed(plane.upper, "<f4"),
        "fiber": packed(plane.fiber, "<f4"),
        "reach": packed(plane.reach, "<f4"),
        **_bars(plane),
        "bodies": [_shape(body) | {"link": LINKS[body.link]} for body in plane.bodies],
        "obstacles": [_shape(o) | {"over": list(passed_over(plane, o)) or None} for o in plane.obstacles],
        "heights": [
            {"name": kind.name, "count": kind.count, "meets": kind.meets, "over": kind.over} for kind in kinds(plane)
        ],
    }


def motion_data(motion: Trajectory) -> dict[str, Any]:
    """Knots and duration."""
    return {
        "duration": motion.duration,
        "offsets": packed(motion.offsets, "<u4"),
        "times": packed(motion.times, "<f4"),
        "angles": packed(motion.angles, "<f4"),
    }


def _bars(plane: FocalPlane) -> dict[str, str]:
    """What the page needs to draw four-bar arms: J2 x, y, rocker and orientation of each, and its slider's range."""
    bar = plane.kinematics
    if not isinstance(bar, FourBar):
        return {}
    pivot, _ = bar.rockers(plane.base, plane.folded, plane.zero)
    bars = np.column_stack([pivot, bar.rocker, bar.orientation])
    return {"bars": packed(bars, "<f8"), "sliders": packed(np.column_stack([bar.shortest, bar.longest]), "<f8")}


def _shape(shape: Any) -> dict[str, Any]:
    return {
        "name": shape.name,
        "points": packed(shape.points, "<f4"),
        "count": int(shape.points.shape[-2]),
        "shared": shape.points.ndim == 2,
        "radius": packed(np.atleast_1d(shape.radius), "<f4"),
        "closed": bool(shape.closed),
        "category": shape.category,
        "meets": None if shape.meets is None else list(shape.meets),
    }
