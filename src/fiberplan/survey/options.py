"""Every way to put a fiber on a target: a positioner, a target within its reach, and the angles that bring it there."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from fiberplan.arrays import Frozen, read_only
from fiberplan.errors import TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.inverse_kinematics import solutions
from fiberplan.focal_plane.two_link import reach
from fiberplan.survey.catalogue import Catalogue

_BEYOND = 0.01  #: targets this far out of reach are handed to the inverse kinematics, which decides [mm]


@dataclass(frozen=True, eq=False)
class Options(Frozen):
    """Options in the order of their positioners, then targets, then quickest from folded first."""

    positioner: np.ndarray  #: (m,)
    target: np.ndarray  #: (m,) row in the catalogue
    alpha: np.ndarray  #: (m,) commanded [rad]
    beta: np.ndarray  #: (m,) commanded [rad]

    def __len__(self) -> int:
        return len(self.positioner)

    def __repr__(self) -> str:
        robots, targets = (len(np.unique(part)) for part in (self.positioner, self.target))
        return f"<Options: {len(self)} of {robots} positioners and {targets} targets>"

    @property
    def angles(self) -> np.ndarray:
        """(m, 2) commanded alpha and beta [rad]."""
        return np.stack([self.alpha, self.beta], axis=1)

    def kept(self, which: np.ndarray) -> "Options":
        """Those of `which`: indices in rising order, or flags (m,)."""
        return _options(self.positioner[which], self.target[which], self.angles[which])


def options_of(plane: FocalPlane, catalogue: Catalogue, movable: np.ndarray) -> Options:
    """All options of the positioners `movable` (n,), in ranges, within the field and off forbidden places.

    Raises:
        TargetError: a fiber that `plane` has not, or a parity where arms have none; the row is named.
    """
    names = _fibers(plane, catalogue)
    if not plane.kinematics.has_parities and catalogue.parity.any():
        row = int(np.argmax(catalogue.parity != 0))
        said = f"parity is given, but {plane.kinematics.name} arms have none"
        raise TargetError(f"{catalogue.source}: {catalogue.rows[row]}: {said}")
    points = np.stack([catalogue.x, catalogue.y], axis=1)
    usable = (np.hypot(*points.T) <= plane.field_radius) & (plane.forbidden_at(points) < 0)
    found = []
    for name in dict.fromkeys(names):
        rows = np.flatnonzero(usable & np.array([other == name for other in names], bool))
        if len(rows):
            found.append(_of_fiber(plane, catalogue, points, rows, name, movable))
    if not found:
        return _options(*(np.empty(0, np.int64),) * 2, np.empty((0, 2)))
    who, target, angles = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((target, who))  # stable: the quickest of a pair's stays the first
    return _options(who[order], target[order], angles[order])


def _options(who: np.ndarray, target: np.ndarray, angles: np.ndarray) -> Options:
    return Options(
        read_only(who, np.int64), read_only(target, np.int64), read_only(angles[:, 0]), read_only(angles[:, 1])
    )


def _fibers(plane: FocalPlane, catalogue: Catalogue) -> list[str]:
    """(m,) the fiber that each target needs, as `plane` calls it."""
    known = {name.lower(): name for name in plane.fiber_offsets}
    known[""] = next(iter(plane.fiber_offsets))
    assert catalogue.fiber is not None  # set on construction
    for row, name in enumerate(catalogue.fiber):
        if name.lower() not in known:
            had = ", ".join(plane.fiber_offsets)
            said = f"{plane.name} has no fiber '{name}'; it has {had}"
            raise TargetError(f"{catalogue.source}: {catalogue.rows[row]}: {said}")
    return [known[name.lower()] for name in catalogue.fiber]


def _of_fiber(
    plane: FocalPlane, catalogue: Catalogue, points: np.ndarray, rows: np.ndarray, fiber: str, movable: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positioner (k,), target (k,) and angles (k, 2) of all options of the targets `rows`, which need `fiber`."""
    offset = plane.fiber_offsets[fiber]
    able = np.flatnonzero(movable & plane.carries(fiber))
    far = reach(plane, able, offset[able])[1] + _BEYOND
    near = cKDTree(points[rows]).query_ball_point(plane.base[able], far, return_sorted=True)
    who = np.repeat(able, [len(each) for each in near])
    target = rows[np.concatenate([np.array(each, np.int64) for each in near])] if len(who) else who
    if not len(who):
        return who, target, np.empty((0, 2))
    angles = solutions(plane, who, points[target], offset[who], catalogue.parity[target])
    pair, which = np.nonzero(np.isfinite(angles[:, :, 0]))
    return who[pair], target[pair], angles[pair, which]
