"""Which goals are kept: one that cannot be is refused, or given up with its cause; least is lost for contacts."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.problem.faults import in_forbidden_place, named, out_of_range, refuse_touching, touch_text, touches
from fiberplan.problem.least_cover import least_loss

if TYPE_CHECKING:
    from fiberplan.problem.problem import Problem


@dataclass(frozen=True)
class Dropped:
    """Why a goal was given up before planning."""

    cause: str
    blockers: tuple[int, ...] = ()  #: positioners it touches; -1 - k is obstacle k

    @classmethod
    def beside(cls, plane: FocalPlane, cause: str, arms: Iterable[int]) -> "Dropped":
        """Given up for others in its way, which the cause names.

        Args:
            plane: the array.
            cause: why, without names.
            arms: positioners, and obstacles after them, in its way.
        """
        touched = tuple(plane.public(arm) for arm in arms)
        return cls(f"{cause}: {' and '.join(map(plane.label, touched))}", touched)


def settled_goals(problem: "Problem") -> tuple[np.ndarray, dict[int, Dropped]]:
    """The goals (n, 2) [rad] that are kept, NaN where no planner has to reach one, and why others were given up.

    Raises:
        ProblemError: a goal that is none, or, unless goals may be dropped, one that cannot be kept.
    """
    plane = problem.plane
    goal, drop = problem.goal.copy(), problem.conflicts == "drop"
    assert problem.wished is not None  # set on construction
    half = np.flatnonzero(np.isnan(goal).any(axis=1) != np.isnan(goal).all(axis=1))
    if len(half):
        raise ProblemError(f"goal: {named(plane, half[0])} has only one of two angles", (int(half[0]),))
    if np.isinf(goal).any():
        i = int(np.argwhere(np.isinf(goal))[0, 0])
        raise ProblemError(f"goal: {named(plane, i)} has an infinite angle", (i,))
    goal[~plane.online] = np.nan
    goal[list(problem.dropped)] = np.nan
    dropped = dict(problem.dropped)
    for what, find in (("out of reach", out_of_range), ("forbidden place", in_forbidden_place)):
        found = find(plane, goal)
        refused = tuple(i for i in found if not problem.wished[i])
        if refused and not drop:
            raise ProblemError(f"goal: {found[refused[0]]}", refused)
        for i, complaint in found.items():
            dropped[i] = Dropped(f"{what}: {complaint}")
            goal[i] = np.nan
    resting = np.where(plane.online[:, None], goal, problem.start)
    near = touches(problem.roomy, resting, problem.margin)
    can_yield = np.concatenate([plane.online, np.zeros(len(plane.obstacles), bool)])
    if not drop:
        can_yield[: plane.n] &= problem.wished
        stuck = [touch for touch in near if not can_yield[list(touch[:2])].any()]
        refuse_touching(plane, problem.margin, "goal", stuck)
    for i, blockers in least_loss([(a, b) for a, b, _ in near], can_yield, problem.weight).items():
        texts = [touch_text(plane, problem.margin, touch) for touch in near if i in touch[:2]]
        touched = tuple(plane.public(b) for b in blockers)
        dropped[i] = Dropped("its goal touches something at rest: " + "; ".join(texts), touched)
        goal[i] = np.nan
    return read_only(goal), dict(sorted(dropped.items()))
