"""The choice to make, as numbers: options, what excludes what, and what each is worth, level by level.

A set of options is allowed if no two are of one positioner, of one target or touch, if no group has more members in it
than it needs, and if no combination that was ruled out is in it as a whole. Of two allowed sets the better one has more
of the first level at which they differ: required positions, then tier by tier the priorities, then short motion.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.survey.conflicts import ConflictTable


class Choices(NamedTuple):
    """What a solver needs; lists are those of `first[k]` to `first[k + 1]`."""

    robot: np.ndarray  #: (m,) of each option
    target: np.ndarray  #: (m,)
    of_robot: np.ndarray  #: (n + 1,) options of positioner i are of_robot[i] to of_robot[i + 1]
    target_first: np.ndarray  #: (targets + 1,)
    of_target: np.ndarray  #: (m,) options by target
    touch_first: np.ndarray  #: (m + 1,)
    touch: np.ndarray  #: options that an option touches
    group: np.ndarray  #: (m,) of required positions that an option counts for; -1: none
    need: np.ndarray  #: (groups,) how many are required
    weight: np.ndarray  #: (m, levels) whole numbers
    out_first: np.ndarray  #: (m + 1,)
    out: np.ndarray  #: combinations that an option is in
    ruled_first: np.ndarray  #: (combinations + 1,)
    ruled: np.ndarray  #: options of each combination that was ruled out

    @classmethod
    def of(
        cls, table: ConflictTable, n: int, targets: int, weight: np.ndarray, group: np.ndarray, need: np.ndarray
    ) -> "Choices":
        """The choice among the options of `table`, of `n` positioners and so many `targets`."""
        options, m = table.options, len(table.options)
        by_target = np.argsort(options.target, kind="stable")
        whole = (
            options.positioner,
            options.target,
            np.searchsorted(options.positioner, np.arange(n + 1)),
            np.searchsorted(options.target[by_target], np.arange(targets + 1)),
            by_target,
            table.indptr,
            table.indices,
            group,
            need,
            weight,
            np.zeros(m + 1),
            (),
            (0,),
            (),
        )
        return cls(*(read_only(each, np.int64) for each in whole))

    def without(self, combinations: list[np.ndarray]) -> "Choices":
        """The same choice, in which no set may hold all options of one of these combinations."""
        members = np.concatenate([np.empty(0, np.int64), *combinations])
        sizes = np.array([len(each) for each in combinations], np.int64)
        by_member = np.argsort(members, kind="stable")
        return self._replace(
            out_first=read_only(np.searchsorted(members[by_member], np.arange(len(self.robot) + 1)), np.int64),
            out=read_only(np.repeat(np.arange(len(sizes)), sizes)[by_member], np.int64),
            ruled_first=read_only(np.concatenate([[0], np.cumsum(sizes)]), np.int64),
            ruled=read_only(members, np.int64),
        )
