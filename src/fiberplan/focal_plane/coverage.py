"""How many positioners can bring their fiber to each point of the focal plane, on a grid."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fiberplan.arrays import number, read_only
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.focal_plane import FocalPlane
from fiberplan.focal_plane.inverse_kinematics import reaches

_BATCH = 200_000  # points that are solved together
_MOST = 5000  # cells along either axis


class Coverage(NamedTuple):
    """Points of a grid, each with how many positioners reach it."""

    x: np.ndarray  #: (c,) [mm]
    y: np.ndarray  #: (r,) [mm]
    reached: np.ndarray  #: (r, c)

    def shares(self) -> np.ndarray:
        """Share of the points that anybody reaches which 1, 2, 3 ... positioners reach, that of 1 first."""
        counts = np.bincount(self.reached.ravel())[1:]
        return counts / counts.sum() if counts.sum() else counts.astype(float)


def coverage(plane: FocalPlane, step: float, fiber: str | None = None) -> Coverage:
    """How many of the positioners that can move bring a fiber to each point of a grid.

    Where no fiber may end, none does: outside `field_radius` and in `forbidden` places. Others in the way are not
    looked at.

    Args:
        plane: the array.
        step: between points [mm].
        fiber: its name; the default fiber unless given.

    Raises:
        InstrumentError: no fiber of that name, or a step that is not positive or leaves too many points.
    """
    step = number(step, "mm", "step", InstrumentError)
    if fiber is not None and fiber not in plane.fiber_offsets:
        raise InstrumentError(f"{plane.name}: no fiber '{fiber}'; it has {', '.join(plane.fiber_offsets)}")
    offset = plane.fiber if fiber is None else plane.fiber_offsets[fiber]
    who = np.flatnonzero(plane.online & np.isfinite(offset).all(axis=1))
    reach = plane.length + np.hypot(*np.nan_to_num(offset).T)
    low, high = (plane.base - reach[:, None]).min(axis=0), (plane.base + reach[:, None]).max(axis=0)
    if not step > 0 or not (high - low).max() / step <= _MOST:
        raise InstrumentError(f"{plane.name}: a step of {step:g} mm is none, or leaves more than {_MOST} points a row")
    x, y = (np.arange(np.floor(low[k] / step), np.ceil(high[k] / step) + 1) * step for k in (0, 1))
    count = np.zeros(len(x) * len(y), np.int64)
    for row, column, whose in _batches(plane.base[who], reach[who], x, y):
        points = np.stack([x[column], y[row]], axis=1)
        i = who[whose]
        good = reaches(plane, i, points, offset[i]) & (np.hypot(*points.T) <= plane.field_radius)
        count += np.bincount((row * len(x) + column)[good], minlength=len(count))
    grid = count.reshape(len(y), len(x))
    if len(plane.forbidden):
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        grid = np.where(plane.forbidden_at(points).reshape(grid.shape) >= 0, 0, grid)
    return Coverage(read_only(x), read_only(y), read_only(grid, np.int64))


def _batches(
    base: np.ndarray, reach: np.ndarray, x: np.ndarray, y: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Rows and columns of the points in each positioner's box, and whose box it is, some positioners at a time."""
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    waiting = 0
    for k, (middle, far) in enumerate(zip(base, reach, strict=True)):
        columns, rows = (
            np.arange(np.searchsorted(grid, at - far), np.searchsorted(grid, at + far, "right"))
            for grid, at in zip((x, y), middle, strict=True)
        )
        row, column = (part.ravel() for part in np.meshgrid(rows, columns, indexing="ij"))
        parts.append((row, column, np.full(len(row), k)))
        waiting += len(row)
        if waiting > _BATCH or k == len(base) - 1:
            row, column, whose = (np.concatenate(some) for some in zip(*parts, strict=True))
            yield row, column, whose
            parts, waiting = [], 0
