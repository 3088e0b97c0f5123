"""A layer above the field: once it stands still, those it left stalled are led past whoever is in their way.

The idea is Tao2018's (detect a deadlock, give way by priority, resume); states and rules are ours. It works in rounds,
in which most positioners stand where they are (RESTING) and feel nothing. Some of the stalled lead, no two of them
neighbours: first those that have led least often, then by priority, then those with smaller zones. A leader is

- RETREATING: pulled back to its folded state, its first joint turned to where its goal wants it, or to one of a few
  angles beside that, another one each time it leads (the second time it does not retreat); then
- GOING: pulled to its goal. Neighbours that are not where they belong either join the round from its beginning, and
  whoever refuses the leader joins when it does, up to five; they are
- AWAY: pulled back itself, and may ask others away too, until the leader is there or stuck for good; then it is GOING
  as well, back to where it belongs.

A round ends when nobody in it comes any nearer. Those in it fall into groups of neighbours, which cannot have felt one
another. A group that has not gained (in priorities of those at their goals) is put back where it was, and its part of
the motion is struck out. So nobody loses its place for nothing, and what is left is the motion of the groups that did
gain. Every step is granted as it is without relief: safety is never at stake.
"""

import numpy as np

from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.elliptic_navigation.descent import Scene
from fiberplan.planners.shared.safe_steps import Stepping

RESTING, RETREATING, GOING, AWAY = range(4)

MOST_LED = 8  #: how often a positioner may lead
_JOINING = 5  # who may be away for one leader
_ASIDE = (0.0, None, 0.7, -0.7, 1.5, -1.5, 2.5, -2.5)  # [rad] first joint of a retreat, from its goal; None: no retreat
_LAST_WAIT = 3.0  # how many times the patience a leader is waited for; one that nobody waits for gets one more
_FOREVER = 2**40


class Relief:
    """Who leads, who makes way, and in which state everyone is.

    Args:
        goal: (n, 2) where everyone belongs [rad].
        folded: (n, 2) [rad].
        rank: (n,) the lower leads first.
        free: (n,) who can move at all.
        near: neighbour lists.
        patience: time without coming nearer that counts as stuck [s].
    """

    def __init__(
        self,
        goal: np.ndarray,
        folded: np.ndarray,
        rank: np.ndarray,
        free: np.ndarray,
        near: Neighbourhood,
        patience: float,
    ):
        n = len(goal)
        self._goal, self._free, self._near, self._patience = goal, free, near, patience
        self._rank = rank
        self._back = np.stack([goal[:, 0], folded[:, 1]], axis=1)
        self._leader = np.full(n, -1)  # for whom each is away
        self._asked = np.zeros(n, np.int64)  # how many are away for each
        self.led = np.zeros(n, np.int64)  #: how often each has led
        self.state = np.full(n, RESTING)

    def _neighbours(self, i: int) -> np.ndarray:
        """Positioners that arm `i` could touch."""
        who = self._near.around(i)
        return who[who < len(self._goal)]

    def begin(self, scene: Scene, stalled: np.ndarray, there: np.ndarray) -> bool:
        """Let everyone rest but the leaders of a new round and neighbours that are not `there` (n,) either.

        Returns:
            False if none of `stalled` may lead any more.
        """
        self.state[:], self._leader[:], self._asked[:] = RESTING, -1, 0
        scene.aim["moves"], scene.aim["quiet"] = False, _FOREVER
        stalled = stalled[self.led[stalled] < MOST_LED]
        taken = np.zeros(len(self._goal), bool)
        for i in stalled[np.lexsort([self._rank[stalled], self.led[stalled]])]:
            if taken[i]:
                continue
            taken[self._neighbours(i)] = True
            aside = _ASIDE[self.led[i] % len(_ASIDE)]
            self.led[i] += 1
            if aside is None:
                self._send(scene.aim, int(i), GOING)
            else:
                alpha = np.clip(self._goal[i, 0] + aside, scene.aim["lower_alpha"][i], scene.aim["upper_alpha"][i])
                self._back[i, 0] = alpha
                self._send(scene.aim, int(i), RETREATING)
            for j in self._neighbours(i):
                if self._free[j] and not there[j] and self.state[j] == RESTING:
                    self._join(scene.aim, int(j), int(i))
        return bool(len(stalled))

    def look(self, scene: Scene, now: Stepping, dt: float) -> bool:
        """Change states where it is time to; False when the round is over."""
        aim = scene.aim
        waited = aim["quiet"] * dt
        stuck = ~aim["there"] & (waited >= self._patience)
        for i in np.flatnonzero((self.state == RETREATING) & (aim["there"] | stuck)):
            self._send(aim, int(i), GOING)
        asks = ((self.state == GOING) & (self._leader < 0)) | (self.state == AWAY)
        for i in np.flatnonzero(asks & stuck):
            self._ask_away(aim, int(i), int(now.pose["blocker"][i]))
        for j in np.flatnonzero(self.state == AWAY):
            leader = self._leader[j]
            if aim["there"][leader] or aim["quiet"][leader] * dt >= _LAST_WAIT * self._patience:
                self._send(aim, int(j), GOING)
        over = aim["there"] | (aim["quiet"] * dt >= (_LAST_WAIT + 1.0) * self._patience)
        return bool(np.any((self.state != RESTING) & ~((self.state == GOING) & over)))

    def _ask_away(self, aim: np.ndarray, i: int, blocker: int) -> None:
        """Let whoever refuses stuck positioner `i` join the round, if it rests, can move and is not one too many."""
        leader = i if self._leader[i] < 0 else self._leader[i]
        if not 0 <= blocker < len(self._goal) or not self._free[blocker] or self.state[blocker] != RESTING:
            return
        if self._asked[leader] < _JOINING:
            self._join(aim, blocker, int(leader))
            aim["quiet"][[i, leader]] = 0

    def _join(self, aim: np.ndarray, i: int, leader: int) -> None:
        self._leader[i] = leader
        self._asked[leader] += 1
        self._back[i, 0] = self._goal[i, 0]
        self._send(aim, i, AWAY)

    def _send(self, aim: np.ndarray, i: int, state: int) -> None:
        self.state[i] = state
        aim["alpha"][i], aim["beta"][i] = self._goal[i] if state == GOING else self._back[i]
        aim["best"][i], aim["quiet"][i], aim["refused"][i] = np.inf, 0, -1.0
        aim["moves"][i], aim["there"][i] = True, False

    def groups(self) -> list[np.ndarray]:
        """Those in the round, as groups of neighbours."""
        left = set(np.flatnonzero(self.state != RESTING).tolist())
        found = []
        while left:
            group = [left.pop()]
            for i in group:  # grows meanwhile
                more = left.intersection(self._neighbours(i).tolist())
                left -= more
                group += sorted(more)
            found.append(np.array(sorted(group)))
        return found
