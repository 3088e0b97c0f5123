"""Goals at which tables can end: the tail goes 3 deg back, and needs room for that in ranges and between neighbours.

Of two whose goals are near each other one ends first, and stands while the tail of the other brings it home; or both
come at the same time. Where arms would touch in all three cases, one of the goals cannot be kept.
"""

import os
from typing import Any

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.drift import motion_bounds
from fiberplan.hardware.certified import ALLOWANCE
from fiberplan.hardware.desi.calibration import motors_of
from fiberplan.hardware.desi.moves import EDGE
from fiberplan.hardware.desi.rows import BACKLASH, FORTH
from fiberplan.hardware.desi.turns import largest_errors
from fiberplan.kernels.arms import ARM, Arms
from fiberplan.kernels.clearance import clearances
from fiberplan.problem import Dropped, Problem
from fiberplan.problem.least_cover import least_loss

_BACK = -np.radians(BACKLASH) * np.array(FORTH)  # where the tail turns, from the goal [rad]
_SHIFTS = (-1.0, 0.0, 1.0)  # by which the first of two tails is earlier than the second, in tails
_LOOKS = 13  # at each of them


def with_goals(
    problem: Problem, *, calibration: str | os.PathLike | None = None, tail: bool = True, **_: Any
) -> Problem:
    """The problem with goals at which tables can end: another configuration where there is one, else it is given up.

    Args:
        problem: any.
        calibration: as of `write`: linear phi motors have no tail.
        tail: as of `write`.
        **_: other options of `write`.

    Raises:
        ProblemError: a goal that cannot be kept, where conflicts are refused.
    """
    if not tail:
        return problem
    plane, goal = problem.plane, problem.goal.copy()
    linear = motors_of(calibration).linear
    tailed = plane.online & problem.has_goal & (goal != problem.start).any(axis=1)
    tailed &= np.array([alias not in linear for alias in plane.aliases or [""] * plane.n])
    room = with_room_for_the_tail(plane)

    dropped: dict[int, Dropped] = {}
    fixed = np.zeros(len(plane.obstacles), bool)
    for i in np.flatnonzero(tailed & ~((room.lower <= goal) & (goal <= room.upper)).all(axis=1)).tolist():
        others = np.empty((0, 2)) if problem.alternatives is None else problem.alternatives[i]
        good = others[((room.lower[i] <= others) & (others <= room.upper[i])).all(axis=1)]
        if len(good):
            goal[i] = good[0]
        else:
            dropped[i] = Dropped("the tail of its move has no room in its ranges")
    while True:  # who is given up rests at its start, where it may be in the way of others
        goal[list(dropped)], tailed[list(dropped)] = np.nan, False
        ends = np.where(np.isnan(goal), problem.start, goal)
        lost = least_loss(_blocked(problem, ends, tailed), np.append(tailed, fixed), problem.weight)
        if not lost:
            break
        dropped |= {i: Dropped.beside(plane, "the tail of its move has no room", arms) for i, arms in lost.items()}
    if dropped and problem.conflicts == "raise":
        i, first = next(iter(dropped.items()))
        raise ProblemError(f"goal: positioner '{plane.ids[i]}': {first.cause}", tuple(sorted(dropped)))
    if not dropped and np.array_equal(goal, problem.goal, equal_nan=True):
        return problem
    return problem.giving_up(dropped, goal)


def _blocked(problem: Problem, ends: np.ndarray, tailed: np.ndarray) -> list[tuple[int, int]]:
    """Pairs of arms that touch whichever of them ends first, where everyone ends at `ends` (n, 2) [rad]."""
    plane, error = problem.plane, problem.position_error
    assert error is not None  # set on construction
    rows = motion_bounds(plane, largest_errors(np.zeros(plane.n, bool)))
    errors = np.concatenate([error + rows, np.zeros(len(plane.obstacles))])
    moving = np.append(tailed, np.zeros(len(plane.obstacles), bool))
    sweep = 2.0 * float(motion_bounds(plane, np.broadcast_to(_BACK, (plane.n, 2))).max(initial=0.0))
    limit = max(0.0, problem.margin - ALLOWANCE)
    pairs = plane.arm_pairs_within(limit + 2.0 * float(errors.max(initial=0.0)))
    pairs = read_only(pairs[moving[pairs].any(axis=1)], np.int64)
    all_ends = plane.with_obstacles(ends)
    pairs = pairs[clearances(plane.arms, all_ends, pairs) < limit + errors[pairs].sum(axis=1) + sweep]
    needed, both = limit + errors[pairs].sum(axis=1), moving[pairs].all(axis=1)
    blocked = np.ones(len(pairs), bool)
    for shift in _SHIFTS:  # nobody waits for one that rests
        blocked &= ~tails_clear(plane.arms, all_ends, moving, pairs, np.where(both, shift, 0.0), needed)
    return [(int(i), int(j)) for i, j in pairs[blocked]]


def tails_clear(
    arms: Arms, ends: np.ndarray, moving: np.ndarray, pairs: np.ndarray, earlier: np.ndarray, needed: np.ndarray
) -> np.ndarray:
    """(m,) whether pairs stay clear while tails bring them home, at so many looks.

    Args:
        arms: positioners, then obstacles.
        ends: (arms, 2) where all end [rad].
        moving: (arms,) whose moves have a tail; the others stand at their ends.
        pairs: (m, 2) of arms.
        earlier: (m,) by how many tails that of the first is before that of the second.
        needed: (m,) clearance to keep [mm].
    """
    first, second = pairs.T
    m = len(pairs)
    each_arms = arms._replace(arm=read_only(arms.arm[np.concatenate([first, second])], ARM))
    each = read_only(np.arange(2 * m).reshape(2, m).T, np.int64)
    clear = np.ones(m, bool)
    for part in np.linspace(0.0, 1.0, _LOOKS):
        done = part + np.maximum(0.0, earlier)
        shares = [np.clip(1.0 - done, 0.0, 1.0), np.clip(1.0 - done + earlier, 0.0, 1.0)]
        angles = np.concatenate(
            [
                ends[who] + _BACK * (moving[who] * share)[:, None]
                for who, share in zip((first, second), shares, strict=True)
            ]
        )
        clear &= clearances(each_arms, read_only(angles), each) >= needed
    return clear


def with_room_for_the_tail(plane: FocalPlane) -> FocalPlane:
    """The same with ranges that end where the tail still has its 3 deg, and whole steps their rounding: for goals."""
    lower, upper = plane.lower + np.radians(EDGE), plane.upper - np.radians(EDGE)
    for axis, forth in enumerate(FORTH):
        edge = upper if forth < 0 else lower
        edge[:, axis] += forth * np.radians(BACKLASH)
    free = plane.online[:, None] & (lower < upper)
    lower, upper = np.where(free, lower, plane.lower), np.where(free, upper, plane.upper)
    return plane.replace(lower=lower, upper=upper, folded=np.clip(plane.folded, lower, upper))
