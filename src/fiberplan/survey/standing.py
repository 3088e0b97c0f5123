"""Where everyone stands before anything is allocated, who can move, and how much room each arm needs."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from fiberplan.errors import InstrumentError, ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.problem import Problem, State


def standing(plane: FocalPlane, start: Any, stay: Any, margin: Any, position_error: Any) -> Problem:
    """The problem in which nobody has a goal yet: its plane, start, margin and room are those of the one to come.

    Args:
        plane: the array.
        start: a state, (n, 2) commanded angles [rad], or None for folded.
        stay: ids or indices of positioners that keep their place, (n,) flags, or None: these are offline in its plane.
        margin: [mm].
        position_error: (n,) or shared [mm], or None.

    Raises:
        ProblemError: what `Problem` refuses, or a positioner that does not exist.
    """
    if start is None:
        state = State.folded(plane)
    else:
        state = start if isinstance(start, State) else State(start, source="start")
    who = positioners(plane, stay)
    if len(who):
        state = state.without(plane, who, "to stay where they stand")
    nowhere = np.full((plane.n, 2), np.nan)
    return Problem(plane, state, nowhere, margin, position_error=position_error, near_start="open")  # type: ignore[arg-type]


def positioners(plane: FocalPlane, named: Any) -> list[int]:
    """Indices, in rising order, from ids or indices, or from (n,) flags; none from None.

    Raises:
        ProblemError: one that does not exist.
    """
    if named is None:
        return []
    if isinstance(named, np.ndarray) and named.dtype == bool:
        if named.shape != (plane.n,):
            raise ProblemError(f"stay: flags must have shape ({plane.n},), got {named.shape}")
        return np.flatnonzero(named).tolist()
    if isinstance(named, str) or not isinstance(named, Iterable):
        raise ProblemError(f"stay: expected ids or indices of positioners, got {named!r}")
    found = set()
    for each in named:
        try:
            found.add(int(each) if isinstance(each, int | np.integer) else plane.index_of(str(each)))
        except InstrumentError as error:
            raise ProblemError(f"stay: {error}") from None
    beyond = [i for i in found if not 0 <= i < plane.n]
    if beyond:
        raise ProblemError(f"stay: {plane.name} has no positioner {beyond[0]}: indices run from 0 to {plane.n - 1}")
    return sorted(found)
