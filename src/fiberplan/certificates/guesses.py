"""Whether a proof of safety needs the place that somebody, of whom it is unknown, is taken to stand at.

It does not if the motion would keep its margin wherever that arm stood: nobody who moves comes near the disc about its
base that its whole arm sweeps.
"""

import numpy as np

from fiberplan.certificates.safety import verify
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.motion import Trajectory


def needed_guesses(
    plane: FocalPlane,
    trajectory: Trajectory,
    margin: float,
    who: np.ndarray,
    position_error: float | np.ndarray = 0.0,
) -> np.ndarray:
    """(k,) whether the proof needs to know where `who` stand, who cannot move; False is proven, True may be cautious.

    Args:
        plane: the array.
        trajectory: that is proven.
        margin: clearance to keep [mm].
        who: (k,) positioners whose place is a guess.
        position_error: as for `verify`.
    """
    discs = [Obstacle(f"anywhere of {plane.ids[i]}", plane.base[[i]], float(plane.reach[i])) for i in who]
    first = len(plane.obstacles)
    crowded = plane.replace(obstacles=(*plane.obstacles, *discs))
    proof = verify(crowded, trajectory, margin, position_error=position_error, opening=True)
    met = {other for found in (*proof.contacts, *proof.undecided) for other in found.pair if other < 0}
    met |= {other for found in proof.opening for other in found.pair if other < 0}
    return np.array([-1 - (first + k) in met for k in range(len(who))], bool)
