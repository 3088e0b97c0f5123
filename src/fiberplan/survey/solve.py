"""The best set of options, level by level: local search, a bound, and where these differ the integer program.

The relaxation over maximal cliques bounds each level from above. An option whose reduced cost takes the bound below
what is found already is in no better set; the integer program (HiGHS) chooses among the others. Levels that are
settled are kept as constraints, and motion, the last level, is left to local search.
"""

from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, OptimizeResult, linprog, milp
from scipy.sparse import csr_array, vstack

from fiberplan.arrays import read_only
from fiberplan.survey.choices import Choices
from fiberplan.survey.cliques import cliques
from fiberplan.survey.local_search import local_search

Solver = Literal["milp", "heuristic"]

STEPS = {"milp": 1, "heuristic": 3}  #: steps of local search for each option, at least ...
LEAST_STEPS = 20_000  #: ... so many, but ...
MOST_STEPS = 40  #: ... no more than that for each option of a small field, where nothing is found any more
NODES = 200  #: of the integer program's search tree, on each level
GAP = 1e-5  #: part of a level's worth that the integer program may leave open
_EPSILON = 1e-6  #: of the linear program


class Solved(NamedTuple):
    """A set of options and how much better another could be."""

    chosen: np.ndarray  #: options, in rising order
    totals: np.ndarray  #: (levels,) of the weights
    bounds: np.ndarray  #: (levels,) no set that is as good on all levels before has more; motion has no bound
    interrupted: bool  #: a deadline came first


def solve(choices: Choices, solver: Solver, seed: int, deadline: float | None) -> Solved:
    """The best set that the solver finds.

    Args:
        choices: what there is to choose from.
        solver: "milp" proves most sets best; "heuristic" leaves the integer program out, and bounds what is lost.
        seed: of the local search.
        deadline: wall-clock seconds for each integer program; the outcome then depends on the machine.
    """
    levels = choices.weight.shape[1]
    worth = choices._replace(weight=read_only(choices.weight[:, : levels - 1], np.int64))  # all but motion
    least = min(LEAST_STEPS, MOST_STEPS * len(choices.place))
    steps = max(least, STEPS[solver] * len(choices.place))
    chosen = local_search(worth, steps, seed)
    if not len(chosen):
        nothing = np.zeros(levels, np.int64)
        return Solved(chosen, nothing, nothing, False)
    bounds, interrupted = np.zeros(levels, np.int64), False
    rows, usable = _rows(choices), np.arange(len(choices.place))
    for level in range(levels - 1):
        weight = choices.weight[:, level]
        relaxed = _relaxed(weight[usable], rows)
        bounds[level] = max(weight[chosen].sum(), _floor(-relaxed.fun))
        if bounds[level] > weight[chosen].sum() and solver == "milp":
            better, bound, late = _integer(weight[usable], rows, relaxed, int(weight[chosen].sum()), deadline)
            interrupted |= late
            if better is not None and weight[usable[better]].sum() > weight[chosen].sum():
                chosen = local_search(worth, least, seed, begin=usable[better])
            bounds[level] = max(weight[chosen].sum(), min(bounds[level], bound))
        total = int(weight[chosen].sum())
        near = _within(relaxed, total)
        rows = rows.with_level(weight[usable], total).columns(near)
        usable = usable[near]
    chosen = local_search(choices, steps, seed, begin=chosen)
    totals = choices.weight[chosen].sum(axis=0)
    bounds[-1] = totals[-1]
    return Solved(chosen, totals, bounds, interrupted)


class _Rows(NamedTuple):
    """What every allowed set keeps: matrix @ x <= most."""

    matrix: csr_array
    most: np.ndarray

    def with_level(self, weight: np.ndarray, total: int) -> "_Rows":
        """One more: a level is worth at least `total`."""
        if total <= 0:
            return self
        row = csr_array(-weight[None] / total)
        return _Rows(vstack([self.matrix, row], format="csr"), np.append(self.most, -(total - 0.5) / total))

    def columns(self, which: np.ndarray) -> "_Rows":
        """Of some options only."""
        matrix = self.matrix[:, which]
        needed = (np.diff(matrix.indptr) > 1) | (self.most != 1)
        return _Rows(matrix[needed], self.most[needed])


def _rows(choices: Choices) -> _Rows:
    """At most one of each clique, and no more of a group than are needed."""
    m, parts, most = len(choices.place), [cliques(choices)], []
    most.append(np.ones(parts[0].shape[0]))
    grouped = np.flatnonzero(choices.group >= 0)
    if len(grouped):
        shape = (len(choices.need), m)
        parts.append(csr_array((np.ones(len(grouped)), (choices.group[grouped], grouped)), shape=shape))
        most.append(choices.need.astype(float))
    return _Rows(vstack(parts, format="csr"), np.concatenate(most))


def _relaxed(weight: np.ndarray, rows: _Rows) -> OptimizeResult:
    """The linear relaxation of one level, least of the negative weight."""
    return linprog(-weight.astype(float), A_ub=rows.matrix, b_ub=rows.most, bounds=(0.0, 1.0), method="highs")


def _floor(value: float) -> int:
    return int(np.floor(value * (1.0 + _EPSILON / 1e3) + _EPSILON))


def _within(relaxed: OptimizeResult, total: int) -> np.ndarray:
    """Columns that may be in a set worth `total` or more on this level, by their reduced costs."""
    return np.flatnonzero(relaxed.lower.marginals <= -relaxed.fun - total + _EPSILON * max(1.0, total))


def _integer(
    weight: np.ndarray, rows: _Rows, relaxed: OptimizeResult, found: int, deadline: float | None
) -> tuple[np.ndarray | None, int, bool]:
    """Columns worth more than `found`, if there are such; what none exceeds; whether a deadline came first."""
    usable = _within(relaxed, found)
    part = rows.columns(usable)
    limit = {} if deadline is None else {"time_limit": deadline}
    done = milp(
        -weight[usable].astype(float),
        constraints=LinearConstraint(part.matrix, ub=part.most),
        integrality=np.ones(len(usable)),
        bounds=Bounds(0, 1),
        options={"mip_rel_gap": GAP, "node_limit": NODES, **limit},
    )
    late = done.status == 1 and deadline is not None and (done.mip_node_count or 0) < NODES
    if done.x is None:  # nothing better, or nothing found in time
        return None, found if done.status == 2 else _floor(-relaxed.fun), late
    return usable[done.x > 0.5], max(found, _floor(-done.mip_dual_bound)), late
