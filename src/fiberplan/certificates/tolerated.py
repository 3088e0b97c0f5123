"""How much more a proven motion tolerates before anything touches: it keeps a margin, and margins are there to be used.

Nothing of this is sampled: clearances are the certificate's proven lower bounds, and how far clocks may be off is half
the reaction time (`fiberplan.certificates.reactions`).
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import Frozen, read_only
from fiberplan.certificates.reactions import Stall, reaction
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory


@dataclass(frozen=True, eq=False)
class Subject(Frozen):
    """What a certificate is about."""

    plane: FocalPlane
    trajectory: Trajectory
    errors: np.ndarray  #: (n,) position errors allowed for [mm]


@dataclass(frozen=True, eq=False)
class Tolerated(Frozen):
    """What a motion tolerates at margin 0, beyond the jitter and position errors that its certificate allows for."""

    jitter: float  #: each clock may be off by less than this more [s], if arms are exact otherwise
    position_error: float  #: each arm may be off by less than this more [mm], if clocks are exact otherwise
    reaction: Stall  #: who may stop dead for how long
    room: np.ndarray  #: (n,) by how much an arm and its critical neighbour may both be off [mm], as far as was looked
    critical: np.ndarray  #: (n,) that neighbour; -1 - k: obstacle k, which is not off; beyond them: nobody that near


def tolerated(subject: Subject, jitter: float, pairs: np.ndarray, clearance: np.ndarray, looked: float) -> Tolerated:
    """How much more a motion tolerates.

    Args:
        subject: the motion.
        jitter: that was allowed for [s].
        pairs: (m, 2) a positioner, and another or obstacle -1 - k: all that could come within what was `looked` at.
        clearance: (m,) proven lower bounds, less what jitter and position errors can take [mm].
        looked: at clearances up to this [mm].
    """
    plane = subject.plane
    moves = np.append(plane.online, np.zeros(len(plane.obstacles), bool))
    free = moves[pairs].any(axis=1) if len(pairs) else np.zeros(0, bool)
    pairs, share = pairs[free], np.maximum(clearance[free], 0.0)
    share = np.where(pairs[:, 1] >= 0, 0.5 * share, share)
    two = pairs[:, 1] >= 0
    first, second = np.append(pairs[:, 0], pairs[two, 1]), np.append(pairs[:, 1], pairs[two, 0])
    share = np.append(share, share[two])
    near = share < 0.5 * looked
    first, second, share = first[near], second[near], share[near]
    order = np.lexsort((second, share, first))
    rows = order[np.unique(first[order], return_index=True)[1]]
    room, critical = np.full(plane.n, 0.5 * looked), np.full(plane.n, -1 - len(plane.obstacles))
    room[first[rows]], critical[first[rows]] = share[rows], second[rows]
    found = reaction(plane, subject.trajectory, subject.errors)
    left = max(0.0, found.seconds - 2.0 * jitter)
    stall = Stall(left, found.moment, found.positioner, found.other)
    least = float(room.min(initial=0.5 * looked))
    return Tolerated(0.5 * left, least, stall, read_only(room), read_only(critical, np.int64))
