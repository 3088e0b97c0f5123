"""Private garages: places where an arm can wait out of everybody's way. Sabater2018 names them as future work.

A place is private in a plan if it is clear of every other arm on its straight way from start to goal, wherever that arm
may be at the time.
"""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import kernel
from fiberplan.planners.prioritized_roadmap.roadmap import cells, travel_time

GRID = (24, 18)  #: cells of joint space that are tried
LOOKS = 16  #: along every other arm's way


@kernel
def _private(arms, i, places, ways, others, limit):
    """Whether each of `places` (k, 2) of arm i is clear of the `ways` (arms, looks, 2) of `others`."""
    out = np.ones(len(places), np.bool_)
    for p in range(len(places)):
        frame_i = frame(arms, i, places[p, 0], places[p, 1])
        for o in range(len(others)):
            j = others[o]
            for k in range(ways.shape[1]):
                frame_j = frame(arms, j, ways[j, k, 0], ways[j, k, 1])
                if not (frames_clearance(arms, i, frame_i, j, frame_j) >= limit):
                    out[p] = False
                    break
            if not out[p]:
                break
    return out


def garages(
    plane: FocalPlane, i: int, start: np.ndarray, goal: np.ndarray, others: np.ndarray, limit: float, most: int = 8
) -> np.ndarray:
    """Configurations (k, 2) [rad] in which arm `i` is out of everybody's way, quickest to go over first.

    Args:
        plane: the array.
        i: the arm.
        start: (n, 2) of all arms [rad].
        goal: (n, 2) of all arms [rad].
        others: (m,) arms, obstacles included, that `i` could meet.
        limit: clearance from their ways [mm].
        most: how many are returned.
    """
    part = np.linspace(0.0, 1.0, LOOKS)[None, :, None]
    ways = np.zeros((len(plane.arms.arm), LOOKS, 2))
    ways[: plane.n] = start[:, None] + part * (goal - start)[:, None]
    places = np.concatenate([plane.folded[[i]], cells(plane, i, GRID)])
    times = travel_time(plane, i, start[i], places) + travel_time(plane, i, places, goal[i])
    places = places[np.argsort(times, kind="stable")]
    return places[_private(plane.arms, i, places, ways, others, limit)][:most]
