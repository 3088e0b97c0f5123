"""Boxes that tile the joint ranges of one positioner, of several widths: which lie side by side, and what they join."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

_AROUND = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 2)
_EDGE = 1e-9  # of a box: what is as near to an edge as this is on both sides of it


@dataclass(frozen=True, eq=False)
class Layer:
    """Some boxes of one level, whose `grid` (2,) boxes would tile everything."""

    level: int  #: how often the boxes of level 0 were halved
    grid: np.ndarray  #: (2,) boxes along each joint
    cells: np.ndarray  #: (m, 2) which of them
    goal: np.ndarray  #: (m,) whether a goal may lie in them; in boxes that are clear, whether one does

    def __len__(self) -> int:
        return len(self.cells)

    def __getitem__(self, which: np.ndarray) -> "Layer":
        """Those that a mask names."""
        return replace(self, cells=self.cells[which], goal=self.goal[which])

    def halved(self) -> "Layer":
        """Their quarters, on the next level."""
        quarters = 2 * self.cells[:, None] + [[0, 0], [0, 1], [1, 0], [1, 1]]
        return Layer(self.level + 1, 2 * self.grid, quarters.reshape(-1, 2), np.repeat(self.goal, 4))

    @cached_property
    def _in_order(self) -> tuple[np.ndarray, np.ndarray]:
        """(m,) codes of the boxes, ascending, and which box each is of."""
        codes = self._codes(self.cells)
        order = np.argsort(codes, kind="stable")
        return codes[order], order

    def _codes(self, cells: np.ndarray) -> np.ndarray:
        inside = ((cells >= 0) & (cells < self.grid)).all(axis=1)
        return np.where(inside, cells[:, 0] * self.grid[1] + cells[:, 1], -1)

    def holding(self, cells: np.ndarray, level: int) -> np.ndarray:
        """(k,) which box holds each of some cells (k, 2) of this level or a later one; -1: none."""
        if not len(self):
            return np.full(len(cells), -1)
        codes, order = self._in_order
        wanted = self._codes(cells >> (level - self.level))  # a shift keeps what is outside outside
        at = np.minimum(np.searchsorted(codes, wanted), len(codes) - 1)
        return np.where(codes[at] == wanted, order[at], -1)


@dataclass
class Tiling:
    """What is known of a joint space: its boxes that are clear everywhere, those of wider levels first."""

    low: np.ndarray  #: (2,) lower ends of the joint ranges [rad]
    high: np.ndarray  #: (2,) upper ends [rad]
    count: np.ndarray  #: (2,) boxes of level 0 along each joint
    clear: list[Layer] = field(default_factory=list)
    _beside: list[np.ndarray] = field(default_factory=list)  # (2, e) numbers of clear boxes that touch, of each layer
    _beyond: tuple[Layer, np.ndarray] | None = None  # the undecided boxes of the last question, and what they touch

    def whole(self) -> Layer:
        """Every box of level 0."""
        cells = np.argwhere(np.ones(self.count, bool))
        return Layer(0, self.count, cells, np.ones(len(cells), bool))

    def width(self, level: int) -> np.ndarray:
        """(2,) of the boxes of a level [rad]."""
        return (self.high - self.low) / (self.count * 2**level)

    def middles(self, layer: Layer) -> np.ndarray:
        """(m, 2) of its boxes [rad]."""
        return self.low + (layer.cells + 0.5) * self.width(layer.level)

    def add_clear(self, layer: Layer) -> None:
        """Boxes that are clear everywhere, of a level not below those before."""
        self._beside.append(self._touching(layer, [*self.clear, layer]))
        self.clear.append(layer)
        self._beyond = None

    def region(self, start: np.ndarray) -> np.ndarray:
        """(m, 2, 2) the clear boxes that `start` (2,) is joined to: low and high of each joint [rad].

        Boxes that share an edge have the same number there, to the last bit.
        """
        region, boxes, begin = self._regions(), [], []
        for layer in self.clear:
            width = self.width(layer.level)
            boxes.append(np.stack([self.low + layer.cells * width, self.low + (layer.cells + 1) * width], axis=-1))
            begin.append(self.holds(layer, start))
        return np.concatenate(boxes)[np.isin(region, region[np.concatenate(begin)])]

    def joined(self, start: np.ndarray, undecided: Layer | None = None) -> bool:
        """Whether boxes, each next to the one before, lead from `start` (2,) to a goal: clear, or undecided."""
        layers = self.clear if undecided is None else [*self.clear, undecided]
        region, goal = self._regions(undecided), np.concatenate([layer.goal for layer in layers])
        first, begin = 0, []
        for layer in layers:
            begin.append(first + np.flatnonzero(self.holds(layer, start)))
            first += len(layer)
        return bool(np.isin(region[goal], region[np.concatenate(begin)]).any())

    def joins(self, undecided: Layer, start: np.ndarray) -> np.ndarray:
        """(m,) whether each of the undecided may join what clear boxes do not: whole clusters of them."""
        links = self._links_of(undecided)
        first = sum(map(len, self.clear))
        own = links[:, (links >= first).all(axis=0)] - first
        cluster = _labels(own, len(undecided))
        to_clear = links[:, (links < first).any(axis=0)]
        met = np.stack([cluster[to_clear[0] - first], self._regions()[to_clear[1]]], axis=1)
        regions = np.bincount(np.unique(met, axis=0)[:, 0], minlength=len(undecided))
        regions[cluster[undecided.goal | self.holds(undecided, start)]] += 2
        return regions[cluster] > 1

    def holds(self, layer: Layer, q: np.ndarray) -> np.ndarray:
        """(m,) whether boxes hold `q` (2,), their neighbours where it lies within rounding of an edge."""
        with np.errstate(invalid="ignore"):
            at = np.nan_to_num((q - self.low) / self.width(layer.level))
        near = np.floor(at + _EDGE * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])).astype(np.int64)
        held = layer.holding(np.clip(near, 0, layer.grid - 1), layer.level)
        mask = np.zeros(len(layer), bool)
        mask[held[held >= 0]] = True
        return mask

    def _regions(self, undecided: Layer | None = None) -> np.ndarray:
        """(k,) which region each clear box is of, and each undecided one if those are boxes to go through, too."""
        links, count = list(self._beside), sum(map(len, self.clear))
        if undecided is not None:
            links.append(self._links_of(undecided))
            count += len(undecided)
        return _labels(np.concatenate(links, axis=1), count)

    def _links_of(self, undecided: Layer) -> np.ndarray:
        """(2, e) which boxes the undecided touch, found once for all that is asked of them."""
        if self._beyond is None or self._beyond[0] is not undecided:
            self._beyond = undecided, self._touching(undecided, [*self.clear, undecided])
        return self._beyond[1]

    @staticmethod
    def _touching(layer: Layer, others: list[Layer]) -> np.ndarray:
        """(2, e) pairs of a box of `layer`, the last of `others`, and one of `others` that touches it, by number."""
        first = np.cumsum([0, *map(len, others)])
        own, pairs = first[-2] + np.arange(len(layer)), []
        for step in _AROUND:
            for other, number in zip(others, first[:-1], strict=True):
                found = other.holding(layer.cells + step, layer.level)
                pairs.append(np.stack([own[found >= 0], number + found[found >= 0]]))
        return np.concatenate(pairs, axis=1)


def _labels(links: np.ndarray, count: int) -> np.ndarray:
    """(count,) which component of a graph each node is of; `links` (2, e)."""
    graph = coo_array((np.ones(links.shape[1], bool), (links[0], links[1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]
