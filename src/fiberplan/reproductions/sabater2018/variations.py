"""The same arms with one link length changed: the lengths are ours, so the conclusions must not hang on them."""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body
from fiberplan.focal_plane.four_bar import FourBar

CHANGES = (-0.1, 0.1)  #: of each length
LENGTHS = {"spacing": "d12", "length": "d13", "rocker": "d24", "tip": "d3tip"}  #: ours -> the paper's name


def varied(plane: FocalPlane, which: str, change: float) -> FocalPlane:
    """`plane` with one length times 1 + `change`; parked tips stay where they are, and the slider keeps its play.

    Args:
        plane: four-bar arms on a ring, all alike.
        which: a key of `LENGTHS`.
        change: as a part of the length.
    """
    bar = plane.kinematics
    assert isinstance(bar, FourBar)
    values = {"spacing": bar.spacing, "length": plane.length, "rocker": bar.rocker, "tip": plane.fiber[:, 0]}
    old = dict(values)
    values[which] = values[which] * (1.0 + change)
    parked = {k: v["spacing"] + v["length"] - v["rocker"] for k, v in (("old", old), ("new", values))}
    shift = parked["new"] - parked["old"]
    outward = (values["tip"] - old["tip"]) - (values["length"] - old["length"])
    away = np.hypot(plane.base[:, 0], plane.base[:, 1])
    ends = {"probe": values["tip"], "carriage": values["rocker"], "first crank": values["length"]}
    ends["rocker"] = values["rocker"]
    return plane.replace(
        base=plane.base * ((away + outward) / away)[:, None],
        length=values["length"],
        fiber_offsets={"tip": np.stack([values["tip"], np.zeros(plane.n)], axis=1)},
        kinematics=FourBar(
            values["spacing"], values["rocker"], bar.shortest + shift, bar.longest + shift, bar.orientation
        ),
        bodies=tuple(_stretched(body, float(ends[body.name][0])) for body in plane.bodies),
        name=f"{plane.name}, {LENGTHS[which]} {change:+.0%}",
    )


def _stretched(body: Body, end: float) -> Body:
    """The body with its far end at `end` [mm]."""
    points = body.points.copy()
    points[-1, 0] = end
    return Body(points, body.radius, body.link, body.closed, body.category, body.meets, body.name)
