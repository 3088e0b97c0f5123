"""Where positioners stand in regular arrays, and what equal ones have."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fiberplan.arrays import number, read_only
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.bodies import Body
from fiberplan.focal_plane.checks import UNITS


def hexagonal_grid(rings: int, pitch: float) -> tuple[tuple[str, ...], np.ndarray]:
    """Ids (R+1C3: row, column) and positions (n, 2) [mm] of a filled hexagon, row by row from the lowest y."""
    ids, base = [], []
    for row in range(-rings, rings + 1):
        count = 2 * rings + 1 - abs(row)
        for column in range(count):
            ids.append(f"R{row:+d}C{column + 1}" if row else f"R0C{column + 1}")
            base.append(((column - (count - 1) / 2) * pitch, row * pitch * np.sqrt(3) / 2))
    return tuple(ids), np.array(base)


def hexagonal_array(
    rings: int,
    pitch: float,
    lengths: Sequence[float],
    radius: float,
    joints: Mapping[str, Any],
    bodies: Sequence[Body] | None,
) -> dict[str, Any]:
    """Fields of a focal plane that is a filled hexagon of equal positioners; see `FocalPlane.hexagonal`.

    Args:
        rings: around the middle positioner.
        pitch: distance of neighbours in a row [mm].
        lengths: of both links [mm].
        radius: of the capsule that an arm is without `bodies` [mm].
        joints: fields that have a value for each joint, or one for both.
        bodies: what can touch.

    Raises:
        InstrumentError: values of which there is no hexagon.
    """
    pitch = number(pitch, "mm", "pitch", InstrumentError)
    links = read_only(lengths, unit="mm", name="lengths", error=InstrumentError)
    if links.shape != (2,):
        raise InstrumentError(f"lengths must be those of both links, got shape {links.shape}")
    if rings < 0 or not pitch > 0:
        raise InstrumentError(f"a hexagon needs rings >= 0 and pitch > 0, got {rings} and {pitch}")
    ids, base = hexagonal_grid(rings, pitch)
    if bodies is None:
        bodies = (Body(np.array([[0.0, 0.0], [links[1], 0.0]]), radius),)
    return {
        "ids": ids,
        "base": base,
        "length": np.full(len(ids), links[0]),
        "fiber_offsets": {"fiber": np.array([links[1], 0.0])},
        "bodies": tuple(bodies),
        **{name: _joint_values(values, len(ids), name) for name, values in joints.items()},
    }


def _joint_values(values: Any, n: int, name: str) -> np.ndarray:
    """(n, 2) the same for every positioner, and one for both joints if there is only one."""
    given = read_only(values, unit=UNITS.get(name, "rad"), name=name, error=InstrumentError)
    if given.shape not in ((), (1,), (2,)):
        raise InstrumentError(f"{name} must be of one or both joints, got shape {given.shape}")
    return np.tile(np.broadcast_to(given, 2), (n, 1))
