"""When robots begin, on the paths that they have, so that no supply has more of them moving at once than it may.

Time is cut into cells, and a robot counts in every cell in which it moves at all, so what is counted is never too
little. Beginning with the motion that was given, robots are taken one after the other, the shortest motion first, out
of moments in which too many move, to where that makes least excess: the squares of robots too many, added up over time.
Of delays that are as good the longest is taken: motions that end together leave one gap, not many. Whoever would come
too near to one that begins later begins later, too; so at every step all pairs keep their distance.
"""

import itertools
from collections.abc import Iterator

import numpy as np

from fiberplan.shaping.delayed_pairs import Begin, DelayedPairs
from fiberplan.shaping.supply_load import Stretches

_CELLS = 4096  # of time, about: more are finer and slower
_PASSES = 10  # over all robots, at most ...
_LESS = 0.9  # ... while excess becomes less by such a factor
_LOOKS = 16  # delays of one robot that are tried, each the best of a part of the time
_ALONG = 12  # robots that are delayed together, at most
_FEW = 10  # cells: a window of fewer counts as a moment, which asks for more


class Delays:
    """The search for one motion.

    Args:
        moves: of all robots as given, then of all as they may begin later, if that is another motion.
        supply: (n,) which one each robot has.
        limits: of each supply: robots that may move at once.
        window: on average over so long [s]; 0: at any moment.
        pairs: which delays keep them apart.
        duration: about how long the motion will be [s].
    """

    def __init__(
        self,
        moves: Stretches,
        supply: np.ndarray,
        limits: np.ndarray,
        window: float,
        pairs: DelayedPairs,
        duration: float,
    ):
        self._supply, self._limits, self._pairs = supply, limits, pairs
        self._cell = max(1, int(np.ceil(1000 * duration / _CELLS)))  # [ms]
        self._span = 1000 * window / self._cell  # of a window, in cells
        if self._span < _FEW:
            self._span = 0.0
        self._touched = int(np.ceil(self._span)) + 1 if self._span else 1  # cells by a window
        paths = pairs.paths
        first, begin, end = _in_cells(moves, paths * len(supply), self._cell / 1000)
        self._stretches = [
            list(zip(begin[a:b].tolist(), end[a:b].tolist(), strict=True)) for a, b in itertools.pairwise(first)
        ]
        last = self._last = [own[-1][1] if own else 0 for own in self._stretches]
        self._late = paths - 1  # the path of those that begin later
        self._order = sorted((i for i in range(len(supply)) if last[i]), key=lambda i: last[self._at(i, self._late)])

    def within(self, horizon: float) -> list[Begin]:
        """How each begins so that all is over after so long [s], with as little excess as was found."""
        cells = 1000 * horizon / self._cell
        self._until, self._cells = int(cells + 1e-6), int(np.ceil(cells)) + 1
        self._begins = [Begin(0, 0)] * len(self._supply)
        self._load = np.zeros((len(self._limits), self._cells), np.int64)
        for i in self._order:
            self._count(self._load[self._supply[i]], i, self._begins[i], 1)
        self._excess = [self._excess_of(s, load) for s, load in enumerate(self._load)]
        for _ in range(_PASSES):
            before = sum(self._excess)
            for i in self._order:
                if self._excess[self._supply[i]]:
                    self._better(i)
            if not sum(self._excess) < _LESS * before:
                break
        return self._begins

    def _at(self, i: int, path: int) -> int:
        return i + path * len(self._supply)

    def _better(self, i: int) -> None:
        """Begin the motion of a robot at another time, if there is one with less excess."""
        supply, begin = self._supply[i], self._begins[i]
        others = self._load[supply].copy()
        self._count(others, i, begin, -1)
        price = np.concatenate([[0.0], np.cumsum(self._price(supply, others))])
        now, later = 0.0, begin.later // self._cell
        for a, b in self._stretches[self._at(i, begin.path)]:
            now += price[b + later] - price[a + later]
        if now == 0.0:
            return
        looks = [look for path in {begin.path, self._late} for look in self._looks(i, path, price)]
        for cost, delay, path in sorted(looks, key=lambda look: (look[0], -look[1], -look[2])):
            if not cost < now:
                return
            group = self._group(i, path, delay * self._cell - begin.later)
            if group and self._changed(group):
                return

    def _looks(self, i: int, path: int, price: np.ndarray) -> Iterator[tuple[float, int, int]]:
        """What it costs a robot to begin later, at the best of each part of the time, its delay in cells, and path."""
        own = self._stretches[self._at(i, path)]
        delays = self._until - own[-1][1] + 1
        if delays <= 0:
            return
        costs = np.zeros(delays)
        for a, b in own:
            costs += price[b : b + delays] - price[a : a + delays]
        part = -(-delays // _LOOKS)
        parts = np.full(part * -(-delays // part), np.inf)
        parts[:delays] = costs[::-1]  # the first of those as good is the longest delay
        best = delays - 1 - np.arange(0, len(parts), part) - np.argmin(parts.reshape(-1, part), axis=1)
        yield from zip(costs[best].tolist(), best.tolist(), itertools.repeat(path), strict=False)

    def _group(self, i: int, path: int, later: int) -> dict[int, Begin]:
        """How the robot and those begin that have to be delayed along with it [ms]; nobody if that cannot be.

        If the robot keeps its path they keep theirs, so that they are as they were to each other.
        """
        group, new, changes = dict[int, Begin](), {i}, path != self._begins[i].path
        while new:
            for j in new:
                begin = Begin(path if changes else self._begins[j].path, self._begins[j].later + later)
                if not 0 <= begin.later <= (self._until - self._last[self._at(j, begin.path)]) * self._cell:
                    return {}
                group[j] = begin
            near = self._pairs.too_near(group, self._begins)
            new = near - group.keys()
            if len(group) + len(new) > _ALONG or (near and not new):
                return {}
        return group

    def _changed(self, group: dict[int, Begin]) -> bool:
        """Let a group begin so, if that leaves less excess; whether it did."""
        loads = {int(s): self._load[s].copy() for s in {self._supply[i] for i in group}}
        for i, begin in group.items():
            self._count(loads[self._supply[i]], i, self._begins[i], -1)
            self._count(loads[self._supply[i]], i, begin, 1)
        excess = {s: self._excess_of(s, load) for s, load in loads.items()}
        if not sum(excess.values()) < sum(self._excess[s] for s in excess) * (1.0 - 1e-9):
            return False
        for s, load in loads.items():
            self._load[s], self._excess[s] = load, excess[s]
        for i, begin in group.items():
            self._begins[i] = begin
        return True

    def _count(self, load: np.ndarray, i: int, begin: Begin, by: int) -> None:
        later = begin.later // self._cell
        for a, b in self._stretches[self._at(i, begin.path)]:
            load[a + later : b + later] += by

    def _averages(self, load: np.ndarray) -> np.ndarray:
        """How many move in each window, on average."""
        if not self._span:
            return load.astype(float)
        moved = np.concatenate([[0], np.cumsum(load)])
        return (moved[self._touched :] - moved[: -self._touched]) / self._span

    def _excess_of(self, supply: int, load: np.ndarray) -> float:
        return float(np.sum(np.maximum(0.0, self._averages(load) - self._limits[supply]) ** 2))

    def _price(self, supply: int, load: np.ndarray) -> np.ndarray:
        """(cells,) what a robot that moves in a cell adds to the excess."""
        over = self._averages(load) - self._limits[supply]
        price = np.maximum(0.0, over + 1.0) ** 2 - np.maximum(0.0, over) ** 2
        if not self._span:
            return price
        summed = np.concatenate([[0.0], np.cumsum(price / self._span)])
        cells = np.arange(len(load))
        upto = np.minimum(cells + 1, len(price))
        return summed[upto] - summed[np.maximum(0, cells + 1 - self._touched)]


def _in_cells(moves: Stretches, n: int, cell: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First stretch of each robot (n + 1,), and the first cell of each stretch and the one after its last."""
    begin, end = np.floor(moves.begin / cell).astype(np.int64), np.ceil(moves.end / cell).astype(np.int64)
    apart = np.ones(len(begin) + 1, bool)
    apart[1:-1] = (moves.owner[1:] != moves.owner[:-1]) | (begin[1:] > end[:-1])
    first = np.searchsorted(moves.owner[apart[:-1]], np.arange(n + 1))
    return first, begin[apart[:-1]], end[apart[1:]]
