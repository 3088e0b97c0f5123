"""Proof that pairs keep clear whatever the speeds: each joint may be anywhere within its turn at any time.

Motors whose speeds are not known, as piezo motors, are somewhere between the ends of a turn, each joint for itself. So
for a pair all angles of its four joints are looked at, box by box: a box is clear if the clearance at its middle
exceeds the margin by more than any body point can move within it. Else it is halved across the joint that moves most.
"""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.certificates.safety import Contact
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import motion
from fiberplan.kernels.clearance import clearance
from fiberplan.kernels.compile import kernel
from fiberplan.tolerances import ROUNDING

FLOOR = 0.005  #: a box in which nothing moves farther than this counts as undecided, so as unsafe [mm]
_DEEP = 256  # boxes that wait: halving four joints to a micron needs fewer


@kernel
def _worst(arms, pairs, boxes, error, margin, floor, waiting):
    """(m, 2) of each pair 1.0 if it is clear everywhere, else 0.0; and the clearance at which that was given up [mm].

    Args:
        arms: positioners, then obstacles.
        pairs: (m, 2) arms.
        boxes: (m, 8) low and high of alpha and beta of the first, then of the second [rad].
        error: (arms,) how far each may be off [mm].
        margin: [mm].
        floor: [mm].
        waiting: (_DEEP, 8) work space.
    """
    out = np.empty((len(pairs), 2))
    half = np.empty(4)
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        wanted = margin + error[i] + error[j] + ROUNDING
        waiting[0] = boxes[k]
        count = 1
        out[k, 0], out[k, 1] = 1.0, np.inf
        while count:
            count -= 1
            box = waiting[count]
            for d in range(4):
                half[d] = 0.5 * (box[2 * d + 1] - box[2 * d])
            gap = clearance(arms, i, box[0] + half[0], box[2] + half[1], j, box[4] + half[2], box[6] + half[3])
            within = motion(arms, i, half[0], half[1]) + motion(arms, j, half[2], half[3])
            if gap - within >= wanted:
                continue
            if not (gap >= wanted) or within < floor or count + 2 > len(waiting):
                out[k, 0], out[k, 1] = 0.0, gap - error[i] - error[j]
                break
            most, widest = -1.0, 0
            for d in range(4):
                arm = i if d < 2 else j
                moves = motion(arms, arm, half[d] if d % 2 == 0 else 0.0, half[d] if d % 2 == 1 else 0.0)
                if moves > most:
                    most, widest = moves, d
            middle = box[2 * widest] + half[widest]
            waiting[count + 1] = box
            waiting[count + 1, 2 * widest] = middle
            waiting[count, 2 * widest + 1] = middle
            count += 2
    return out


def clear_at_any_speed(
    plane: FocalPlane, pairs: np.ndarray, low: np.ndarray, high: np.ndarray, margin: float, error: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Which pairs are proven clear while each joint is anywhere within its turn.

    Args:
        plane: an array of arms of two links.
        pairs: (m, 2) arms as the kernels count them: obstacle k is n + k.
        low: (m, 2, 2) least angle of pair, arm and joint [rad]; of an obstacle 0.
        high: (m, 2, 2) largest [rad].
        margin: clearance to keep [mm].
        error: (n,) how far each arm may be off [mm].

    Returns:
        (m,) whether each is; (m,) the clearance at which the others were given up [mm], inf for those that are.
    """
    boxes = np.stack([low, high], axis=-1).reshape(len(pairs), 8)
    errors = np.concatenate([error, np.zeros(len(plane.obstacles))])
    found = _worst(
        plane.arms,
        read_only(pairs, np.int64),
        read_only(boxes),
        read_only(errors),
        margin,
        FLOOR,
        np.zeros((_DEEP, 8)),
    )
    return found[:, 0] == 1.0, found[:, 1]


def contacts_at_any_speed(
    plane: FocalPlane, begin: np.ndarray, end: np.ndarray, margin: float, error: np.ndarray, time: float = 0.0
) -> tuple[Contact, ...]:
    """Pairs, one of which can move, that are not proven clear while everyone turns from `begin` to `end` (n, 2) [rad].

    Args:
        plane: an array of arms of two links.
        begin: angles before.
        end: angles after.
        margin: clearance to keep [mm].
        error: (n,) how far each arm may be off [mm].
        time: to put into the contacts [s].
    """
    pairs = plane.arm_pairs_within(margin + 2.0 * float(error.max(initial=0.0)) + 1e-6)
    online = np.concatenate([plane.online, np.zeros(len(plane.obstacles), bool)])
    pairs = pairs[online[pairs].any(axis=1)]
    low, high = (plane.with_obstacles(edge(begin, end))[pairs] for edge in (np.minimum, np.maximum))
    clear, gap = clear_at_any_speed(plane, pairs, low, high, margin, error)
    return tuple(
        Contact((plane.public(pairs[k, 0]), plane.public(pairs[k, 1])), time, float(gap[k]))
        for k in np.flatnonzero(~clear)
    )
