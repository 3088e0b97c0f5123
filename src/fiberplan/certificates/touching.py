"""Who touches whom in many motions of one focal plane, and nothing else: what a simulation asks thousands of times.

It is the search of `verify` without what only a certificate needs: lower bounds are not made sharp, speeds and ranges
are not looked at, and neighbours are found once.
"""

import numpy as np

from fiberplan.arrays import not_negative, read_only
from fiberplan.certificates.bisection import judge
from fiberplan.certificates.path import as_motion, rounding
from fiberplan.certificates.safety import TOLERANCE, Contact
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory


class Touching:
    """Finds the contacts of motions of one focal plane.

    Args:
        plane: whose arms move.
        margin: nearer than this is a contact [mm].

    Raises:
        TrajectoryError: a margin that is negative or not finite.
    """

    def __init__(self, plane: FocalPlane, margin: float = 0.0):
        self.plane, self.margin = plane, not_negative(margin, "mm", "margin", TrajectoryError)
        self._pairs = plane.arm_pairs_within(self.margin + 1e-6)

    def contacts(self, trajectory: Trajectory) -> tuple[Contact, ...]:
        """Pairs that come nearer than the margin, or cannot be shown not to, by time; not those of which neither moves.

        Raises:
            TrajectoryError: another number of positioners than the focal plane has.
        """
        plane = self.plane
        if trajectory.n != plane.n:
            raise TrajectoryError(f"the motion has {trajectory.n} positioners, the focal plane {plane.n}")
        turns = np.zeros(plane.n + len(plane.obstacles), bool)
        turns[trajectory.owner[(trajectory.angles != trajectory.start[trajectory.owner]).any(axis=1)]] = True
        pairs = read_only(self._pairs[turns[self._pairs].any(axis=1)], np.int64)
        path = as_motion(plane.arms, trajectory)
        errors = read_only(rounding(plane.arms, path.offsets, path.knots))
        low, seen, when = judge(plane.arms, path, pairs, errors, self.margin, 0.0, TOLERANCE, self.margin).T
        found = [
            Contact((plane.public(pairs[k, 0]), plane.public(pairs[k, 1])), float(when[k]), float(seen[k]))
            for k in np.flatnonzero(~(low >= self.margin))
        ]
        return tuple(sorted(found, key=lambda contact: (contact.time, contact.pair)))
