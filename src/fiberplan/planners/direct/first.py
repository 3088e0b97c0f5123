"""A first plan, soon: coarser lattices, and more time than the slowest joint needs.

Of 547 positioners every replan is cheaper by far on lattices of twice the spacing, and where there is a fifth more time
fewer contacts are left that only a pair can solve. What is found so is longer than need be, and kept for whoever cannot
wait.
"""

import numpy as np

from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.direct.search import DirectSearch
from fiberplan.problem import Problem

PART = 0.8  #: of the time that there is, after which a first plan is not waited for any longer
WIDEST = np.pi / 4  #: turn of alpha in one step that a search may have [rad]
_COARSER = 2.0  # than the search that follows
_LONGER = 1.2  # times the steps that are needed
_WORK = 300, 2.5  # replans, and of each positioner: it takes one to two


def most_work(n: int) -> int:
    """Replans of so many positioners, after which a first plan is not waited for either."""
    return int(_WORK[0] + _WORK[1] * n)


def first_search(
    problem: Problem, near: Neighbourhood, goal: np.ndarray, turn: float, max_time: float | None, seed: int
) -> DirectSearch:
    """A search that is soon done, of what a search with alphas that `turn` [rad] so far in a step does better."""
    search = DirectSearch(problem, near, goal, min(_COARSER * turn, WIDEST), max_time, seed)
    search.lengthen(min(int(np.ceil(_LONGER * search.steps)), search.most_steps))
    return search
