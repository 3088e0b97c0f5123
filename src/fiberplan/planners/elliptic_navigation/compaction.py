"""Rounds of relief were found one after the other; most have nothing to do with each other and can run at once.

A block is what one group of neighbours did in one round. It only depends on what its members and their neighbours did
before, so it may begin as soon as they have come to rest; then whoever it passes stands where it stood, and moves on
later, as before. Motions keep their order wherever two positioners could touch.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory


class Block(NamedTuple):
    """One group in one round."""

    members: np.ndarray  #: (k,)
    begin: int  #: step at which the round began; all have been at rest for a step
    end: int  #: step of its last motion


def closed_up(motion: Trajectory, dt: float, blocks: Iterable[Block], near: Neighbourhood) -> Trajectory:
    """The same motion with every block as early as it may be.

    Args:
        motion: whose knots are at multiples of `dt`.
        dt: length of a step [s].
        blocks: in the order in which they happened; what is in no block stays when it was.
        near: everyone that could touch.
    """
    n = motion.n
    owner = motion.owner
    old = np.rint(motion.times / dt).astype(np.int64)
    new, in_block = old.copy(), np.zeros(len(old), bool)
    moved = []
    for block in blocks:
        theirs = np.concatenate([np.arange(motion.offsets[i], motion.offsets[i + 1]) for i in block.members])
        knots = theirs[(old[theirs] >= block.begin) & (old[theirs] <= block.end)]
        in_block[knots] = True
        moved.append((block, knots))
    ready = np.zeros(n, np.int64)  # when each came to rest
    np.maximum.at(ready, owner[~in_block], old[~in_block])
    for block, knots in moved:
        around = [near.around(i) for i in block.members]
        who = np.unique(np.concatenate([block.members, *around]))
        new[knots] += ready[who[who < n]].max() - block.begin
        np.maximum.at(ready, owner[knots], new[knots])
    return Trajectory.from_knots(owner, new * dt, motion.angles, n)
