"""The choice to make, as numbers: options, what excludes what, and what each is worth, level by level.

An option takes two places, its positioner and its target, and each place is taken once. A set of options is allowed if
no two share a place or touch, and no group has more members in it than it needs. Of two allowed sets the better one has
more of the first level at which they differ: required positions, then tier by tier the priorities, then short motion.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from fiberplan.arrays import read_only
from fiberplan.survey.conflicts import ConflictTable


class Choices(NamedTuple):
    """What a solver needs; lists are those of `first[k]` to `first[k + 1]`."""

    place: np.ndarray  #: (m, 2) of each option: its positioner, and n + its target
    place_first: np.ndarray  #: (places + 1,)
    at_place: np.ndarray  #: options at each place
    touch_first: np.ndarray  #: (m + 1,)
    touch: np.ndarray  #: options that an option touches
    group: np.ndarray  #: (m,) of required positions that an option counts for; -1: none
    need: np.ndarray  #: (groups,) how many are required
    weight: np.ndarray  #: (m, levels) whole numbers

    @classmethod
    def of(
        cls, table: ConflictTable, n: int, targets: int, weight: np.ndarray, group: np.ndarray, need: np.ndarray
    ) -> "Choices":
        """The choice among the options of `table`, of `n` positioners and so many `targets`."""
        place = np.stack([table.options.positioner, n + table.options.target], axis=1)
        order = np.argsort(place.ravel(), kind="stable")
        first = np.searchsorted(place.ravel()[order], np.arange(n + targets + 1))
        whole = (place, first, order // 2, table.indptr, table.indices, group, need, weight)
        return cls(*(read_only(each, np.int64) for each in whole))

    @property
    def robot(self) -> np.ndarray:
        """(m,) positioner of each option."""
        return self.place[:, 0]

    def at(self, place: int) -> np.ndarray:
        """Options at a place."""
        return self.at_place[self.place_first[place] : self.place_first[place + 1]]

    def touched(self, v: int) -> np.ndarray:
        """Options that option `v` touches."""
        return self.touch[self.touch_first[v] : self.touch_first[v + 1]]

    @property
    def touching(self) -> csr_array:
        """(m, m) of ones where options touch."""
        m = len(self.place)
        return csr_array((np.ones(len(self.touch)), self.touch, self.touch_first), shape=(m, m))

    def without(self, pairs: np.ndarray) -> "Choices":
        """The same choice, in which the options of each of `pairs` (k, 2) exclude each other as if they touched.

        A pair of an option with itself rules it out: it is worth nothing.
        """
        alone = pairs[pairs[:, 0] == pairs[:, 1], 0]
        weight = np.array(self.weight)
        weight[alone] = 0
        m, (a, b) = len(self.place), pairs[pairs[:, 0] != pairs[:, 1]].T
        more = csr_array((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), shape=(m, m))
        touching = (self.touching + more).tocsr()
        touching.sort_indices()
        return self._replace(
            touch_first=read_only(touching.indptr, np.int64),
            touch=read_only(touching.indices, np.int64),
            weight=read_only(weight, np.int64),
        )
