"""Where someone might stand whose place nobody knows: folded, or else the nearest place that the others leave free."""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.kernels.clearance import clearances
from fiberplan.problem.resting import place_the_rest
from fiberplan.problem.state import State


def fitted(plane: FocalPlane, state: State, limit: float) -> tuple[np.ndarray, tuple[str, ...]]:
    """A start in which guesses touch nobody whose place is known, as far as that can be, and what was guessed.

    A guess never refuses a start: one that would touch is wrong, and another is taken.

    Args:
        plane: the array.
        state: with guesses, or without.
        limit: clearance to keep [mm].

    Returns:
        (n, 2) [rad], and a sentence for every guess.
    """
    who = np.flatnonzero(state.unknown)
    if not len(who):
        return state.angles, ()
    known = np.where(state.unknown[:, None], np.nan, state.angles)
    start, nowhere = place_the_rest(plane, known, state.angles, Neighbourhood.of(plane, limit), limit)
    said = []
    for i in who.tolist():
        alpha, beta = np.degrees(start[i])
        text = f"positioner '{plane.ids[i]}' stands at alpha {alpha:.6g}, beta {beta:.6g} deg (its position is unknown"
        if i in nowhere:
            touched = ", ".join(_touched(plane, start, i, limit))
            text += f"; wherever it stood it would touch another, here {touched}"
        elif not np.array_equal(start[i], state.angles[i]):
            text += "; where it was first taken to be it would touch another"
        said.append(text + ")")
    return read_only(start), tuple(said)


def _touched(plane: FocalPlane, start: np.ndarray, i: int, limit: float) -> list[str]:
    """Names of those who are nearer than `limit` [mm] to positioner `i`."""
    pairs = plane.arm_pairs_within(limit)
    pairs = read_only(pairs[(pairs == i).any(axis=1)], np.int64)
    gaps = clearances(plane.arms, plane.with_obstacles(start), pairs)
    near = pairs[~(gaps >= limit)]
    return [plane.label(plane.public(int(a if b == i else b))) for a, b in near]
