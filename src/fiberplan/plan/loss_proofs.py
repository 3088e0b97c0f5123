"""Proofs that a positioner of a problem had to lose its goal, given who arrives and who blocks it."""

from collections.abc import Iterable

import numpy as np

from fiberplan.certificates.lost import proofs_of_loss
from fiberplan.certificates.unreachable import Barrier
from fiberplan.problem import Problem

_MOST_RANGE = 20 * np.pi**2  # [rad^2] of both joints, up to which a proof takes seconds
_BESIDE = 3  # blockers of which proofs are tried: each takes up to a second


def loss_proofs(problem: Problem, i: int, arrived: Iterable[int], blockers: Iterable[int]) -> tuple[Barrier, ...]:
    """Proofs that positioner `i` can be in no configuration that counts as its goal; none where none is found.

    Args:
        problem: what was asked.
        i: who is lost.
        arrived: who arrives: of these a proof may ask that they do.
        blockers: arms that block `i`; of obstacles and of those that cannot move every proof knows.
    """
    if not problem.has_goal[i] or not _is_narrow(problem, i):
        return ()
    online = [j for j in blockers if 0 <= j < problem.n and problem.plane.online[j]]
    beside = [j for j in online if _is_narrow(problem, j)][:_BESIDE]
    there = set(arrived)
    ends = {j: _ends(problem, j) for j in (i, *(j for j in beside if j in there and problem.has_goal[j]))}
    return proofs_of_loss(problem.plane, i, ends, problem.start, problem.margin, beside)


def _ends(problem: Problem, i: int) -> np.ndarray:
    """(k, 2) configurations that count as the goal of `i` [rad]."""
    others = np.empty((0, 2)) if problem.alternatives is None else problem.alternatives[i]
    return np.concatenate([problem.goal[i, None], others[~np.isnan(others).any(axis=1)]])


def _is_narrow(problem: Problem, i: int) -> bool:
    """Whether proofs over the joint ranges of positioner `i` take no longer than seconds."""
    return bool(np.prod(problem.plane.upper[i] - problem.plane.lower[i]) <= _MOST_RANGE)
