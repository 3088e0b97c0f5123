"""Fiber ends as the field of Makarem2014 sees them: where each is, where it goes, and what its joints do to it."""

from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import frame
from fiberplan.kernels.compile import inlined, kernel, record
from fiberplan.kernels.neighbours import NEAR, neighbour_lists, neighbour_pairs
from fiberplan.tolerances import UNDER_LIMIT

END = record(
    [
        ("x", "f8"),  # the fiber at the beginning of the step [mm]
        ("y", "f8"),
        ("alpha_x", "f8"),  # what a radian of alpha does to it [mm]: the Jacobian's first column
        ("alpha_y", "f8"),
        ("beta_x", "f8"),  # and of beta
        ("beta_y", "f8"),
        ("target_x", "f8"),  # where the fiber should be [mm]; NaN: anywhere
        ("target_y", "f8"),
        ("goal_alpha", "f8"),  # the configuration that it should end in [rad]; NaN: any
        ("goal_beta", "f8"),
        ("bend", "f8"),  # angle from the first link to the fiber, as seen from the elbow, where beta is 0 [rad]
        ("offset_u", "f8"),  # the fiber in the beta link's frame [mm]
        ("offset_v", "f8"),
        ("most_alpha", "f8"),  # turn of each joint in one step [rad]
        ("most_beta", "f8"),
        ("lower_alpha", "f8"),
        ("lower_beta", "f8"),
        ("upper_alpha", "f8"),
        ("upper_beta", "f8"),
    ]
)


class Ends(NamedTuple):
    """All fiber ends, and which of them can come so near each other that they repel."""

    end: np.ndarray  # (n,) END
    offsets: np.ndarray  # (n + 1,) those of i are near[offsets[i]:offsets[i + 1]]
    near: np.ndarray  # (m,) NEAR


def fiber_ends(plane: FocalPlane, angles: np.ndarray, goals: np.ndarray, D: float, dt: float, most: int | None) -> Ends:
    """Fiber ends at `angles` that head for `goals`, both (n, 2) [rad].

    Args:
        plane: whose fibers.
        angles: where they are [rad].
        goals: where they should be, NaN where that does not matter [rad].
        D: distance within which two repel each other [mm].
        dt: a step [s].
        most: how many neighbours one has, the nearest bases; None: all that can come within `D`.
    """
    end = np.zeros(plane.n, END)
    end["offset_u"], end["offset_v"] = plane.fiber.T
    end["bend"] = plane.zero[:, 1] + np.arctan2(plane.fiber[:, 1], plane.fiber[:, 0])
    end["target_x"], end["target_y"] = plane.fibers(goals).T
    end["goal_alpha"], end["goal_beta"] = goals.T
    for k, joint in enumerate(("alpha", "beta")):
        end[f"most_{joint}"] = plane.max_speed[:, k] * dt * UNDER_LIMIT
        end[f"lower_{joint}"], end[f"upper_{joint}"] = plane.lower[:, k], plane.upper[:, k]
    reach = plane.length + np.hypot(*plane.fiber.T)
    offsets, near = neighbour_lists(plane.n, neighbour_pairs(plane.base, reach, float(D)))
    if most is not None:
        offsets, near = _nearest(plane.base, offsets, near, most)
    ends = Ends(end, offsets, near)
    place_ends(plane.arms, ends, np.ascontiguousarray(angles, float))
    return ends


def _nearest(base: np.ndarray, offsets: np.ndarray, near: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Neighbour lists cut to the `most` nearest bases; those as near as the last of them are kept too."""
    owner = np.repeat(np.arange(len(base)), np.diff(offsets))
    far = np.round(np.hypot(*(base[near["arm"]] - base[owner]).T), 6)
    order = np.lexsort((near["arm"], far, owner))
    rank = np.arange(len(near)) - offsets[owner]
    last = np.full(len(base), np.inf)
    at = order[rank == most - 1]
    last[owner[at]] = far[at]
    kept = far <= last[owner]
    return np.concatenate([[0], np.cumsum(np.bincount(owner[kept], minlength=len(base)))]), near[kept].astype(NEAR)


@inlined
def place_end(arms, ends, i, alpha, beta):
    """Put the fiber end of arm i where (alpha, beta) [rad] puts it, with its Jacobian."""
    end = ends.end[i]
    links = frame(arms, i, alpha, beta)
    ux = links[6] * end.offset_u - links[7] * end.offset_v
    uy = links[7] * end.offset_u + links[6] * end.offset_v
    end.x, end.y = links[2] + ux, links[3] + uy
    end.alpha_x, end.alpha_y = -(end.y - links[1]), end.x - links[0]
    end.beta_x, end.beta_y = -uy, ux


@kernel
def place_ends(arms, ends, angles):
    """Put all fiber ends where `angles` (n, 2) [rad] put them."""
    for i in range(len(angles)):
        place_end(arms, ends, i, angles[i, 0], angles[i, 1])


@inlined
def away(end):
    """Distance of a fiber end from its target [mm]; NaN if it has none."""
    return np.hypot(end.x - end.target_x, end.y - end.target_y)


@inlined
def through_joints(end, fx, fy):
    """A push on the fiber, as its joints feel it (the transposed Jacobian, Eq. 4)."""
    return end.alpha_x * fx + end.alpha_y * fy, end.beta_x * fx + end.beta_y * fy
