"""Everyone turns phi in, some after others, and who could not turns theta first: in which steps, whatever the speeds.

In each step whoever can turns in beside those that rest and those that turn with it. Where nobody can any more, those
that are left look for the theta nearest to theirs to which, and from which in, their neighbours let them; failing that,
neighbours that are in, whose elbows are in the way, look for one at which they are not. Backwards it is the way out.
"""

import numpy as np

from fiberplan.certificates.any_speed import clear_at_any_speed
from fiberplan.errors import PlanError
from fiberplan.focal_plane import FocalPlane
from fiberplan.tolerances import SLACK

_TURNS = np.radians([sign * turn for turn in (10, 20, 30, 45, 60, 90, 120, 180) for sign in (1, -1)])  # of theta
_MOST = 40  # steps
_SHOWN = 4


def withdrawn(
    plane: FocalPlane, at: np.ndarray, phi: np.ndarray, moves: np.ndarray, margin: float, error: np.ndarray
) -> list[np.ndarray]:
    """(n, 2) where everyone is after each step, the last with everyone within `phi` (n,) [rad].

    Args:
        plane: an array of arms of two links.
        at: (n, 2) where everyone stands [rad].
        phi: (n,) to turn in to [rad].
        moves: (n,) who may turn at all; the others stand at `phi`.
        margin: clearance to keep [mm].
        error: (n,) how far each arm may be off [mm].

    Raises:
        PlanError: positioners that neither turn of phi nor one of theta before it frees, which are named; or more steps
            than make sense.
    """
    steps = _Steps(plane, moves, margin, error)
    at, found = at.copy(), list[np.ndarray]()
    while (todo := at[:, 1] != phi).any():
        if len(found) == _MOST:
            raise PlanError(f"{todo.sum()} positioners do not get phi in within {_MOST} steps")
        to = np.stack([at[:, 0], phi], axis=1)
        who = steps.jointly(at, to, todo)
        for way in (steps.aside, steps.out_of_the_way):
            if not who.any():
                to = way(at, phi, todo)
                who = steps.jointly(at, to, to[:, 0] != at[:, 0])
        if not who.any():
            names = [f"'{plane.ids[i]}'" for i in np.flatnonzero(todo)]
            more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
            raise PlanError(f"positioners {', '.join(names[:_SHOWN])}{more} cannot turn phi out past each other")
        at[who] = to[who]
        found.append(at.copy())
    return found


class _Steps:
    """Who may turn, beside whom, of an array."""

    def __init__(self, plane: FocalPlane, moves: np.ndarray, margin: float, error: np.ndarray):
        self._plane, self._moves, self._margin, self._error = plane, moves, margin, error
        self._pairs = plane.arm_pairs_within(margin + 2.0 * float(error.max(initial=0.0)) + SLACK)

    def _clear(self, rest: np.ndarray, begin: np.ndarray, end: np.ndarray, turns: np.ndarray) -> np.ndarray:
        """(pairs,) whether each is clear while its arms that turn (pairs, 2) do, and the other, if any, rests."""
        some = turns.any(axis=1)
        pairs, turns = self._pairs[some], turns[some, :, None]
        rest, begin, end = (self._plane.with_obstacles(angles)[pairs] for angles in (rest, begin, end))
        low, high = (np.where(turns, edge(begin, end), rest) for edge in (np.minimum, np.maximum))
        clear = np.ones(len(self._pairs), bool)
        clear[some] = clear_at_any_speed(self._plane, pairs, low, high, self._margin, self._error)[0]
        return clear

    def _with_fixed(self, who: np.ndarray) -> np.ndarray:
        return np.concatenate([who, np.zeros(len(self._plane.obstacles), bool)])

    def alone(self, rest: np.ndarray, begin: np.ndarray, end: np.ndarray, who: np.ndarray) -> np.ndarray:
        """(n,) which of `who` (n,) may turn from `begin` to `end` while all others rest."""
        able = self._with_fixed(who)
        turns = able[self._pairs]
        for side in (0, 1):
            clear = self._clear(rest, begin, end, turns & (np.arange(2) == side))
            able[self._pairs[~clear, side]] = False
        return able[: self._plane.n]

    def jointly(self, at: np.ndarray, to: np.ndarray, who: np.ndarray) -> np.ndarray:
        """(n,) as many of `who` (n,) as come easily that may turn at the same time."""
        able = self._with_fixed(self.alone(at, at, to, who))
        both = able[self._pairs].all(axis=1)
        for i, j in self._pairs[~self._clear(at, at, to, np.stack([both, both], axis=1))].tolist():
            able[j] &= not able[i]
        return able[: self._plane.n]

    def aside(self, at: np.ndarray, phi: np.ndarray, who: np.ndarray) -> np.ndarray:
        """(n, 2) where those of `who` (n,) are to turn theta that can turn phi in from there; the others rest."""
        to = at.copy()
        for turn in _TURNS:
            there, able = self._turned(at, turn, who & (to[:, 0] == at[:, 0]))
            able = self.alone(at, there, np.stack([there[:, 0], phi], axis=1), able)
            to[able] = there[able]
        return to

    def out_of_the_way(self, at: np.ndarray, phi: np.ndarray, who: np.ndarray) -> np.ndarray:
        """(n, 2) where others are to turn theta that are in the way of phi of `who` (n,)."""
        to, inside = at.copy(), np.stack([at[:, 0], phi], axis=1)
        turns = self._with_fixed(who)[self._pairs]
        turns &= ~turns[:, ::-1]
        met = ~self._clear(at, at, inside, turns)
        in_the_way = self._with_fixed(np.zeros_like(who))
        in_the_way[self._pairs[met][~turns[met]]] = True
        in_the_way = in_the_way[: self._plane.n] & self._moves
        for turn in _TURNS:
            there, able = self._turned(at, turn, in_the_way & (to[:, 0] == at[:, 0]))
            still = met & ~self._clear(np.where(able[:, None], there, at), at, inside, turns)
            stay = self._with_fixed(~able)
            stay[self._pairs[still][~turns[still]]] = True
            able = ~stay[: self._plane.n]
            to[able] = there[able]
        return to

    def _turned(self, at: np.ndarray, turn: float, who: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n, 2) with theta turned, and which of `who` (n,) can turn so while all others rest."""
        there = at + np.array([turn, 0.0])
        in_range = (there[:, 0] >= self._plane.lower[:, 0]) & (there[:, 0] <= self._plane.upper[:, 0])
        return there, self.alone(at, at, there, who & in_range)
