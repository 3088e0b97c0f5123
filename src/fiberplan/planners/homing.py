"""Who may look for its joints' stops at the same time.

A robot that homes does not know where it stands, and how fast it gets to its stop is anybody's guess. So it counts as
everywhere that it may sweep. First betas go to their stop while alphas stand; then alphas go through their whole range,
with betas at the stop. A set is proven if nobody's sweep meets another's, nor anybody who stands. Sets follow each
other: robots that have homed stand at their stops, and make way for others that way, or get into it.
"""

from collections.abc import Sequence
from typing import overload

import numpy as np

from fiberplan.arrays import not_negative, read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.two_link import TwoLink
from fiberplan.kernels.boxes import clear_boxes
from fiberplan.problem import State

ALPHA, BETA = 0, 1


class HomingGroups(Sequence[np.ndarray]):
    """Sets of robots (indices) that may home at the same time, one set after the other: betas first, then alphas."""

    def __init__(
        self,
        beta: tuple[np.ndarray, ...],
        alpha: tuple[np.ndarray, ...],
        unable: tuple[np.ndarray, np.ndarray],
        at_least: tuple[int, int],
    ):
        self.beta = beta  #: sets whose betas home
        self.alpha = alpha  #: sets whose alphas home, after all those
        self.unable_beta, self.unable_alpha = unable[BETA], unable[ALPHA]  #: robots that cannot be shown to be safe
        self.at_least = at_least  #: sets that any order needs for alphas and betas: so many meet each other

    @overload
    def __getitem__(self, k: int) -> np.ndarray: ...
    @overload
    def __getitem__(self, k: slice) -> Sequence[np.ndarray]: ...
    def __getitem__(self, k: int | slice) -> np.ndarray | Sequence[np.ndarray]:
        return (*self.beta, *self.alpha)[k]

    def __len__(self) -> int:
        return len(self.beta) + len(self.alpha)

    def __repr__(self) -> str:
        return f"<HomingGroups: {self}>"

    def __str__(self) -> str:
        return (
            f"{len(self.beta)} sets of betas (at least {self.at_least[BETA]}), {len(self.unable_beta)} unable; "
            f"{len(self.alpha)} sets of alphas (at least {self.at_least[ALPHA]}), {len(self.unable_alpha)} unable"
        )


def homing_groups(plane: FocalPlane, state: State | np.ndarray, margin: float = 0.0) -> HomingGroups:
    """Few sets of robots that may home at the same time, with proof; robots that may not are named.

    Args:
        plane: the array, of arms of two links. A joint's stop is the end of its range that is nearer to folded.
        state: where everyone stands, or (n, 2) commanded angles [rad].
        margin: clearance to keep [mm]; position errors of the state are kept besides.

    Raises:
        ProblemError: a state of another array, a margin that is no length, or arms of another kind.
    """
    if not isinstance(plane.kinematics, TwoLink):
        raise ProblemError(
            f"homing_groups knows arms of two links, not the {plane.kinematics.name} arms of {plane.name}"
        )
    margin = not_negative(margin, "mm", "margin", ProblemError)
    state = state if isinstance(state, State) else State(state)
    if len(state.angles) != plane.n:
        raise ProblemError(f"{state.source}: a state of {len(state.angles)} positioners for {plane.n}")
    middle = np.abs(plane.upper - plane.folded) < np.abs(plane.folded - plane.lower)
    stop = np.where(middle, plane.upper, plane.lower)
    sweep = np.stack([state.angles, state.angles], axis=2)
    sweep[:, BETA] = np.sort(np.stack([state.angles[:, BETA], stop[:, BETA]], axis=1), axis=1)
    able = plane.online & state.online
    homing = _Homing(plane, margin, np.concatenate([state.position_error, np.zeros(len(plane.obstacles))]))
    beta = homing.sets(state.angles, sweep, stop, BETA, able)
    stands = state.angles.copy()
    for one in beta:
        stands[one, BETA] = stop[one, BETA]
    homed = np.zeros(plane.n, bool)
    homed[[i for one in beta for i in one]] = True
    sweep = np.stack([stands, stands], axis=2)
    sweep[:, ALPHA] = np.stack([plane.lower[:, ALPHA], plane.upper[:, ALPHA]], axis=1)
    alpha = homing.sets(stands, sweep, stop, ALPHA, homed)
    done = np.zeros(plane.n, bool)
    done[[i for one in alpha for i in one]] = True
    unable = (np.flatnonzero(able & ~done), np.flatnonzero(able & ~homed))
    return HomingGroups(tuple(beta), tuple(alpha), unable, (homing.cliques[ALPHA], homing.cliques[BETA]))


class _Homing:
    """Sets of one joint after the other."""

    def __init__(self, plane: FocalPlane, margin: float, error: np.ndarray):
        self.plane, self.margin = plane, margin + 2.0 * float(error.max(initial=0.0))
        self.pairs = plane.arm_pairs_within(self.margin)
        self.cliques = [0, 0]

    def sets(
        self, stands: np.ndarray, sweep: np.ndarray, stop: np.ndarray, joint: int, able: np.ndarray
    ) -> list[np.ndarray]:
        """Sets of the `able` (n,), from where everyone `stands` (n, 2), by what each would `sweep` (n, 2, 2)."""
        stands, left = stands.copy(), able & np.isfinite(sweep).all(axis=(1, 2))
        meets = self._meets(sweep, sweep, left, left)
        beside: list[set[int]] = [set() for _ in range(self.plane.n)]
        for i, j in self.pairs[meets].tolist():
            beside[i].add(j)
            beside[j].add(i)
        self.cliques[joint] = max((_clique(beside, i) for i in np.flatnonzero(left).tolist()), default=0)
        found = []
        while left.any():
            here = np.stack([stands, stands], axis=2)
            blocked = np.zeros(self.plane.n + len(self.plane.obstacles), bool)
            blocked[self.pairs[self._meets(sweep, here, left, None), 0]] = True
            blocked[self.pairs[self._meets(here, sweep, None, left), 1]] = True
            free = np.flatnonzero(left & ~blocked[: self.plane.n])
            if not len(free):
                break
            chosen: list[int] = []
            for i in sorted(free.tolist(), key=lambda i: (len(beside[i] & set(free.tolist())), i)):
                if not beside[i] & set(chosen):
                    chosen.append(i)
            one = np.sort(np.array(chosen, np.int64))
            stands[one, joint] = stop[one, joint]
            left[one] = False
            found.append(one)
        return found

    def _meets(
        self, first: np.ndarray, second: np.ndarray, who: np.ndarray | None, other: np.ndarray | None
    ) -> np.ndarray:
        """(k,) rows of `pairs` not shown to be clear, the one in its box of `first`, the other in that of `second`."""
        n, fixed = self.plane.n, np.zeros((len(self.plane.obstacles), 2, 2))
        asked = np.ones(len(self.pairs), bool)
        for column, able in ((0, who), (1, other)):
            if able is not None:
                asked &= np.append(able, np.zeros(len(fixed), bool))[self.pairs[:, column]]
        rows = np.flatnonzero(asked)
        boxes = np.concatenate([first, fixed, second, fixed])
        clear = clear_boxes(
            self.plane.arms, read_only(self.pairs[rows], np.int64), read_only(boxes), n + len(fixed), self.margin
        )
        return rows[~clear]


def _clique(beside: list[set[int]], i: int) -> int:
    """Size of a set, found greedily, of robots that all meet each other, `i` among them."""
    size, common = 1, set(beside[i])
    while common:
        best = max(sorted(common), key=lambda j: len(beside[j] & common))
        common &= beside[best]
        size += 1
    return size
