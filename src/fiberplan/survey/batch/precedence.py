"""Which fields a field has to wait for.

For the one before in its chain, where it begins; and for the last one before that shares a target with it, since what
is observed there is not offered again. Whatever is planned at the same time then has nothing to do with each other, and
any number of workers give the same plans as one.
"""

import heapq
from collections.abc import Sequence

import numpy as np


class Precedence:
    """Fields that are ready, smallest number first, as others get done."""

    def __init__(self, chain: Sequence[str], targets: int):
        self.before: list[int | None] = []  #: the field before in the chain
        self._last_in_chain: dict[str, int] = {}
        self._last_with = np.full(targets, -1, np.int64)
        self._turn: list[int] = []  # of each field: how many have to be done one after the other until it is
        self._unmet: list[int] = []
        self._followers: list[list[int]] = []
        self._ready: list[int] = []
        self._chain = chain

    def add(self, shared: np.ndarray) -> None:
        """The next field, and the targets in it that another field would not be offered again."""
        k = len(self._unmet)
        before = self._last_in_chain.get(self._chain[k])
        self._last_in_chain[self._chain[k]] = k
        needs = set(np.unique(self._last_with[shared]).tolist()) - {-1}
        self._last_with[shared] = k
        needs |= set() if before is None else {before}
        self._turn.append(1 + max((self._turn[other] for other in needs), default=0))
        self.before.append(before)
        self._unmet.append(len(needs))
        self._followers.append([])
        for other in needs:
            self._followers[other].append(k)
        if not needs:
            heapq.heappush(self._ready, k)

    @property
    def longest(self) -> int:
        """How many fields have to be done one after the other, however many workers there are."""
        return max(self._turn, default=0)

    def done(self, k: int) -> None:
        """Field k is done; whoever waited for it alone is ready."""
        for other in self._followers[k]:
            self._unmet[other] -= 1
            if not self._unmet[other]:
                heapq.heappush(self._ready, other)

    def next(self) -> int | None:
        """A field that is ready, which is then no longer offered; None if there is none."""
        return heapq.heappop(self._ready) if self._ready else None

    def follows(self, k: int) -> bool:
        """Whether another field of its chain comes after field k."""
        return self._last_in_chain[self._chain[k]] != k
