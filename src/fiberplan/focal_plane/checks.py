"""What the values of a focal plane must be, in which units."""

from typing import TYPE_CHECKING

import numpy as np

from fiberplan.arrays import LARGEST
from fiberplan.errors import InstrumentError

if TYPE_CHECKING:
    from fiberplan.focal_plane.focal_plane import FocalPlane

NO_LIMIT = {"max_acceleration": np.inf, "min_speed": 0.0}  #: of joints that have none
UNITS = {"base": "mm", "length": "mm", "max_speed": "rad/s", "online": ""}  # of the others rad
UNITS |= {"max_acceleration": "rad/s2", "min_speed": "rad/s"}


def check(plane: "FocalPlane") -> None:
    """Refuse values of which no focal plane can be made.

    Raises:
        InstrumentError: naming the positioner and the value.
    """
    if not plane.n:
        raise InstrumentError(f"{plane.name}: no positioners")
    if len(plane.index) < plane.n:
        twice = next(id_ for i, id_ in enumerate(plane.ids) if plane.index[id_] != i)
        rows = [i for i, id_ in enumerate(plane.ids) if id_ == twice]
        raise InstrumentError(f"{plane.name}: positioner id '{twice}' appears twice (rows {rows[0]} and {rows[1]})")
    blank = next((name for name in (*plane.ids, *plane.aliases) if name != name.strip()), None)
    if blank is not None:  # no table keeps them
        raise InstrumentError(f"{plane.name}: positioner id '{blank}' begins or ends with a blank")
    if not plane.fiber_offsets:
        raise InstrumentError(f"{plane.name}: no fiber is given")
    for name in ("base", "length", "zero", "folded"):
        _refuse(plane, ~np.isfinite(getattr(plane, name)), name, "is not a finite number")
    for k, (name, value) in enumerate(plane.fiber_offsets.items()):
        lacking = np.isnan(value).all(axis=1, keepdims=True) & (k > 0)  # all carry the default fiber
        _refuse(plane, ~np.isfinite(value) & ~lacking, f"fiber '{name}'", "is not a finite number", value)
        _refuse(plane, np.abs(value) > LARGEST, f"fiber '{name}'", f"is more than {LARGEST:g} mm", value)
    for name in ("base", "length"):
        _refuse(plane, np.abs(getattr(plane, name)) > LARGEST, name, f"is more than {LARGEST:g} mm")
    if len(plane.aliases) not in (0, plane.n):
        raise InstrumentError(f"{plane.name}: {len(plane.aliases)} second names for {plane.n} positioners")
    if plane.recommended_margin is not None and not 0 <= plane.recommended_margin < np.inf:
        raise InstrumentError(f"{plane.name}: recommended margin {plane.recommended_margin:g} mm is not a length")
    if plane.forbidden.ndim != 2 or plane.forbidden.shape[1] != 3 or not np.isfinite(plane.forbidden).all():
        raise InstrumentError(f"{plane.name}: forbidden must be finite and of shape (m, 3): x, y and radius")
    for body in plane.bodies:
        for what, count in (("points", body.points.ndim == 3), ("radii", np.ndim(body.radius) == 1)):
            given = len(body.points if what == "points" else np.atleast_1d(body.radius))
            if count and given != plane.n:
                raise InstrumentError(f"{plane.name}: body '{body.name}': {what} of {given} positioners, not {plane.n}")
    _refuse(plane, ~(plane.length >= 0), "length", "is negative")
    _refuse(plane, ~(plane.lower <= plane.upper), "lower", "is above the upper end of the joint's range")
    _refuse(plane, ~(np.isfinite(plane.max_speed) & (plane.max_speed > 0)), "max_speed", "is not a positive speed")
    if plane.max_acceleration is not None:
        _refuse(plane, ~(plane.max_acceleration > 0), "max_acceleration", "is not a positive acceleration")
    if plane.min_speed is not None:
        _refuse(plane, ~(plane.min_speed >= 0), "min_speed", "is not a speed")
        _refuse(plane, plane.min_speed > plane.max_speed, "min_speed", "is above the joint's largest speed")
    outside = ~((plane.folded >= plane.lower) & (plane.folded <= plane.upper))
    _refuse(plane, outside, "folded", "lies outside the joint's range")
    if not plane.field_radius > 0:
        raise InstrumentError(f"{plane.name}: field_radius {plane.field_radius:g} mm is not a positive length")
    rides = [body for body in plane.bodies if body.link not in plane.kinematics.link_names]
    if rides:
        raise InstrumentError(
            f"{plane.name}: a body rides on the {rides[0].link}, but {plane.kinematics.name} arms have the links "
            f"{', '.join(plane.kinematics.link_names)}"
        )
    try:
        plane.kinematics.check(plane.n)
    except InstrumentError as error:
        raise InstrumentError(f"{plane.name}: {error}") from None
    inside = plane.in_avoidance(plane.folded)
    if inside.any():
        i = int(np.argmax(inside))
        raise InstrumentError(f"{plane.name}: positioner '{plane.ids[i]}': folded: {plane.avoidance(i, plane.folded)}")


def _refuse(plane: "FocalPlane", bad: np.ndarray, name: str, complaint: str, values: np.ndarray | None = None) -> None:
    """Raise for the first True of `bad`, naming its positioner and value."""
    if not np.any(bad):
        return
    i, *column = np.argwhere(bad)[0]
    value = (getattr(plane, name) if values is None else values)[(i, *column)]
    shown = f"{value:.6g} mm"
    axis = ("x ", "y ")[column[0]] if column else ""
    unit = UNITS.get(name, "rad" if name in ("zero", "folded", "lower") else "mm")
    if unit.startswith("rad"):
        shown = f"{np.degrees(value):.6g} {unit.replace('rad', 'deg').replace('s2', 's^2')}"
        axis = ("alpha ", "beta ")[column[0]]
    raise InstrumentError(f"{plane.name}: positioner '{plane.ids[i]}': {axis}{name} {shown} {complaint}")
