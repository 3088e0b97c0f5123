"""One greedy walk of the whole array towards folded, as Sayres2021 search the reverse path, with its reliefs left open.

`Walker` owns the arrays that the compiled loop works on; it can be run, nudged and run again.
"""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory
from fiberplan.planners.greedy_fold import ranked_moves
from fiberplan.planners.greedy_fold.ranked_moves import FULL
from fiberplan.planners.greedy_fold.walk_state import KNOT, STATE, Rules, Walk
from fiberplan.planners.shared.memory import refuse_large
from fiberplan.tolerances import SLACK, UNDER_LIMIT


class Walker:
    """A walk towards folded that can be continued.

    Args:
        plane: the array.
        angles: (n, 2) where it begins [rad].
        margin: clearance to keep [mm].
        step: largest turn of the fastest joint per loop [rad].
        movable: (n,) who walks; the others stand at `angles`.
        swept: test moves over the whole step (safe) rather than at its end only (as published).
        skip_noops: pass over a clamped move that changes nothing (as the published figures need) rather than take it.
        patience: turn without progress after which `run` gives up [rad]; None never does.
        neighbourhood: of `plane` at `margin`, if at hand.
    """

    def __init__(
        self,
        plane: FocalPlane,
        angles: np.ndarray,
        margin: float,
        step: float,
        movable: np.ndarray,
        swept: bool = True,
        skip_noops: bool = True,
        patience: float | None = None,
        neighbourhood: Neighbourhood | None = None,
    ):
        self.plane, self.step = plane, step
        near = neighbourhood or Neighbourhood.of(plane, margin)
        n, walking = plane.n, np.flatnonzero(movable)
        fastest = float(plane.max_speed[walking].max(initial=plane.max_speed.min()))
        self.loop_time = step / fastest / UNDER_LIMIT
        state = np.zeros(len(plane.arms.arm), STATE)
        state["alpha"][:n], state["beta"][:n] = np.asarray(angles, float).T
        state["turn"] = state["contrary"] = state["blocker"] = -1
        state["wake"], state["refused"] = -np.inf, -1.0
        state["still"] = True
        state["still"][walking] = False
        joints = {"folded": plane.folded, "lower": plane.lower, "upper": plane.upper}
        for name, values in (joints | {"step": plane.max_speed * (step / fastest)}).items():
            state[f"{name}_alpha"][:n], state[f"{name}_beta"][:n] = values.T
        arm, alpha, beta = plane.arms.arm[:n], state["step_alpha"][:n], state["step_beta"][:n]
        first = arm["reach_alpha"] * alpha
        for name, both in (("stride_same", alpha + beta), ("stride_opposite", np.abs(alpha - beta))):
            state[name][:n] = np.maximum(arm["length"] * alpha + arm["reach_beta"] * both, first) * (1 + 1e-12)
        bend = arm["length"] * alpha**2 + arm["reach_beta"] * (alpha + beta) ** 2
        state["bend"][:n] = np.maximum(bend, first * alpha) / 8
        state["first"], state["last"] = near.offsets[:-1], near.offsets[1:]
        self.walk = Walk(
            state=state,
            frames=np.empty((len(state), 8)),
            near=near.near,
            known=np.full(len(near.pairs), -np.inf),
            active=np.concatenate([walking, np.zeros(n - len(walking), np.int64)]),
            knots=np.empty(16 * n + 16, KNOT),
            counters=np.array([0, len(walking), 0, 0]),
            best=np.array([np.inf]),
        )
        self.rules = Rules(
            limit=float(margin) + SLACK,
            swept=swept,
            skip_noops=skip_noops,
            patience=2**62 if patience is None else int(np.ceil(patience / step)),
        )
        self._begin = self.angles

    @property
    def loops(self) -> int:
        """Loops walked so far."""
        return int(self.walk.counters[0])

    @property
    def stuck(self) -> np.ndarray:
        """Positioners not folded yet, in order."""
        return np.array(self.walk.active[: self.walk.counters[1]])

    @property
    def angles(self) -> np.ndarray:
        """(n, 2) where everyone stands now [rad]."""
        state = self.walk.state[: self.plane.n]
        return np.stack([state["alpha"], state["beta"]], axis=1)

    @property
    def blockers(self) -> dict[int, int]:
        """Stuck positioner -> the arm that last refused it its best move."""
        return {int(i): int(self.walk.state["blocker"][i]) for i in self.stuck if self.walk.state["blocker"][i] >= 0}

    def run(self, turn: float) -> int:
        """Walk on until folded, stuck or stalled, or until `turn` [rad] have been walked in all; returns which."""
        while True:
            ended = ranked_moves.run(self.plane.arms, self.walk, self.rules, round(turn / self.step))
            if ended != FULL:
                return int(ended)
            self._make_room()

    def _make_room(self) -> None:
        """Twice the room for knots."""
        knots = self.walk.knots
        refuse_large(2.0 * knots.nbytes, f"greedy-fold: the knots of {self.plane.n} positioners in {self.loops} loops")
        self.walk = self.walk._replace(knots=np.concatenate([knots, np.empty_like(knots)]))

    def reverse_ranking(self, i: int, turn: float) -> None:
        """Let positioner `i` prefer its worst moves for the next `turn` [rad], and forget the stall."""
        self.walk.state["contrary"][i] = self.loops + int(np.ceil(turn / self.step))
        self.walk.best[0], self.walk.counters[3] = np.inf, self.loops

    def trajectory(self) -> Trajectory:
        """The motion so far, a knot wherever a velocity changes; all end at the same time."""
        n, knots = self.plane.n, self.walk.knots[: self.walk.counters[2]]
        owner = np.concatenate([np.arange(n), knots["owner"], np.arange(n)])
        loop = np.concatenate([np.zeros(n, np.int64), knots["loop"], np.full(n, self.loops)])
        angles = np.concatenate([self._begin, np.stack([knots["alpha"], knots["beta"]], axis=1), self.angles])
        return Trajectory.from_knots(owner, loop * self.loop_time, angles, n)
