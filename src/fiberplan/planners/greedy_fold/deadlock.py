"""What a fold has come to, and who is stuck with whom."""

from dataclasses import dataclass

import numpy as np

from fiberplan.motion import Trajectory


@dataclass(frozen=True, eq=False)
class Fold:
    """A motion towards folded, and who did not get there."""

    trajectory: Trajectory
    stuck: np.ndarray  #: positioners that are not folded at its end
    blockers: dict[int, int]  #: stuck or given up positioner -> arm in its way
    given_up: tuple[int, ...] = ()  #: folded from the beginning, so that the others get there


def stuck_groups(fold: Fold, movable: np.ndarray) -> list[list[int]]:
    """Stuck positioners, each with whoever refused it its best move, linked through them; in order.

    Who refused is mostly folded already, but it has to make room. `movable` (n,) says who can.
    """
    group_of = {int(i): {int(i)} for i in fold.stuck}
    for i, j in fold.blockers.items():
        if i in group_of and j < len(movable) and movable[j]:
            merged = group_of[i] | group_of.get(j, {j})
            for k in merged:
                group_of[k] = merged
    return [list(group) for group in sorted({tuple(sorted(group)) for group in group_of.values()})]
