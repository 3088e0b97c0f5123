"""The joint space of one positioner at one moment: which of its configurations its neighbours block as they stand."""

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from fiberplan.arrays import number, read_only
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood, clearances_around

FREE = np.iinfo(np.int64).min  #: nothing blocks
AVOIDED = FREE + 1  #: the arm's own zone of avoidance


class JointSpace(NamedTuple):
    """A grid over both joints, each cell with whoever comes nearest there, if nearer than the margin."""

    alpha: np.ndarray  #: (a,) commanded [rad]
    beta: np.ndarray  #: (b,) [rad]
    blocker: np.ndarray  #: (a, b) a positioner, or obstacle -1 - k; `FREE`, or `AVOIDED`
    clearance: np.ndarray  #: (a, b) from the nearest [mm]; inf where nobody can come within the margin


def joint_space(plane: FocalPlane, i: int, angles: np.ndarray, margin: float = 0.0, cells: int = 180) -> JointSpace:
    """What blocks positioner `i` in each of its configurations while all others stand at `angles`.

    Args:
        plane: the array.
        i: the positioner.
        angles: (n, 2) where everyone stands [rad]; its own row does not matter.
        margin: clearance to keep [mm].
        cells: along either joint; joints without end are shown for one turn from where it stands.

    Raises:
        InstrumentError: fewer than two cells.
    """
    margin = number(margin, "mm", "margin", InstrumentError)
    if cells < 2:
        raise InstrumentError(f"a grid of {cells} cells shows nothing")
    low, high = plane.lower[i], plane.upper[i]
    endless = ~np.isfinite(low) | ~np.isfinite(high)
    low, high = np.where(endless, angles[i] - np.pi, low), np.where(endless, angles[i] + np.pi, high)
    alpha, beta = (np.linspace(low[k], high[k], cells) for k in (0, 1))
    poses = read_only(np.stack(np.meshgrid(alpha, beta, indexing="ij"), axis=-1).reshape(-1, 2))
    near = Neighbourhood.of(plane, margin)
    everyone = plane.with_obstacles(angles)
    blocker, least = np.full(len(poses), FREE), np.full(len(poses), np.inf)
    for arm in near.around(i):
        alone = np.full_like(everyone, np.nan)
        alone[arm] = everyone[arm]
        gap = clearances_around(plane.arms, near, read_only(alone), i, poses)
        nearer = gap < least
        least[nearer] = gap[nearer]
        blocker[nearer & ~(gap >= margin)] = plane.public(arm)
    blocker[_avoided(plane, i, poses)] = AVOIDED
    shape = (cells, cells)
    return JointSpace(alpha, beta, read_only(blocker.reshape(shape), np.int64), read_only(least.reshape(shape)))


def _avoided(plane: FocalPlane, i: int, poses: np.ndarray) -> np.ndarray:
    """(m,) which of `poses` (m, 2) [rad] are in the zone of avoidance of positioner `i`."""
    if not plane.kinematics.has_avoidance:
        return np.zeros(len(poses), bool)
    again = np.full(len(poses), i)
    alike: Any = SimpleNamespace(base=plane.base[again], length=plane.length[again], zero=plane.zero[again])
    return plane.kinematics.subset(again).in_avoidance(alike, poses)
