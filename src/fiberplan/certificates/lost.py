"""Which proofs show that a positioner had to lose its goal: the smallest question that has one is asked first."""

from collections.abc import Mapping, Sequence

import numpy as np

from fiberplan.certificates.unreachable import Barrier, decided
from fiberplan.focal_plane import FocalPlane


def proofs_of_loss(
    plane: FocalPlane,
    i: int,
    ends: Mapping[int, np.ndarray],
    start: np.ndarray,
    margin: float,
    beside: Sequence[int],
) -> tuple[Barrier, ...]:
    """Proofs that positioner `i` can be in none of its goal configurations, or only where another one is not.

    For each configuration: past what never moves; for want of a place where one `beside` it could be; with one beside
    it that has to make way; and at last, with one beside it that has to be at its own goal at the end.

    Args:
        plane: the array.
        i: who is lost.
        ends: (k, 2) configurations that count as the goals of `i`, and of those who arrive [rad].
        start: (n, 2) where everyone stands [rad].
        margin: clearance to keep [mm].
        beside: online positioners that block it.

    Returns:
        The proofs; none if for any configuration there is none.
    """
    found: list[Barrier] = []
    for end in ends[i]:
        proofs = _of_end(plane, i, end, ends, start, margin, beside)
        if not proofs:
            return ()
        found += proofs
    return tuple(found)


def _of_end(
    plane: FocalPlane,
    i: int,
    end: np.ndarray,
    ends: Mapping[int, np.ndarray],
    start: np.ndarray,
    margin: float,
    beside: Sequence[int],
) -> list[Barrier]:
    """Proofs that `i` cannot be at `end` (2,), or not together with one who arrives; empty if there are none."""
    jointly = [[i, j] for j in beside]
    for who in [[i], *([j] for j in beside), *jointly]:
        _, barrier = decided(plane, who, {i: end}, start, margin)
        if barrier is not None:
            return [barrier]
    for who in jointly:
        proofs = []
        for other in ends.get(who[1], ()):
            _, barrier = decided(plane, who, {i: end, who[1]: other}, start, margin)
            if barrier is None:
                break
            proofs.append(barrier)
        else:
            if proofs:
                return proofs
    return []
