"""Who does not arrive, why, and what of that is proven."""

from dataclasses import dataclass

import numpy as np

from fiberplan.plan import Outcome
from fiberplan.plan.loss_proofs import loss_proofs
from fiberplan.plan.outcomes import all_blockers, settled_outcome
from fiberplan.planners.direct.goals import Goals
from fiberplan.planners.direct.search import DirectSearch
from fiberplan.problem import Problem


@dataclass(frozen=True, eq=False)
class Losses:
    """What became of those that had a goal."""

    late: tuple[int, ...]  #: proven: every configuration is too far for the time there is
    shut_off: dict[int, frozenset[int]]  #: proven to be unable to reach its goal if all of these reach theirs
    given_up: dict[int, tuple[int, ...]]  #: positioner that does not arrive -> arms that block it, proven or not
    held: tuple[int, ...]  #: never leave their start
    max_time: float | None  #: [s]

    @classmethod
    def none(cls, problem: Problem) -> "Losses":
        """Nothing is known to be lost."""
        return cls((), {}, {}, (), None)

    @classmethod
    def of(
        cls, problem: Problem, search: DirectSearch, goals: Goals, max_time: float | None, ends: np.ndarray
    ) -> "Losses":
        """What a search gave up, if it does not end at its goal all the same; `ends` (n, 2) is where all end [rad]."""
        given_up = dict.fromkeys(map(int, np.flatnonzero(goals.given_up)), ()) | search.given_up
        there = _at_goal(problem, ends)
        given_up = {i: arms for i, arms in given_up.items() if not there[i]}
        late = tuple(map(int, np.flatnonzero(goals.infeasible)))
        arrived = set(np.flatnonzero(problem.has_goal & problem.plane.online).tolist()) - {*given_up, *late}
        shut_off = {}
        for i, arms in given_up.items():
            proofs = () if i in search.out_of_time else loss_proofs(problem, i, arrived, arms)
            if proofs:
                shut_off[i] = frozenset(j for proof in proofs for j in proof.goals if j != i)
        return cls(late, shut_off, given_up, tuple(sorted(search.held)), max_time)

    @property
    def unproven(self) -> bool:
        """Whether anything was given up without proof that it had to be."""
        return any(i not in self.late and i not in self.shut_off for i in self.given_up)

    def outcomes(self, problem: Problem) -> tuple[Outcome, ...]:
        """An outcome for every positioner, the first that fits."""

        def outcome(i: int) -> Outcome:
            return settled_outcome(problem, i) or (Outcome.DEADLOCKED if i in self.given_up else Outcome.ARRIVED)

        lost = tuple(outcome(i) for i in range(problem.n))
        return tuple(
            Outcome.INFEASIBLE if i in self.late and o is Outcome.ARRIVED else o
            for i, o in enumerate(self.proven_in(lost))
        )

    def proven_in(self, outcomes: tuple[Outcome, ...]) -> tuple[Outcome, ...]:
        """The same outcomes, with those lost without proof named as proven where that is known."""
        arrived = {i for i, outcome in enumerate(outcomes) if outcome is Outcome.ARRIVED}
        proven = {*self.late, *(i for i, others in self.shut_off.items() if others <= arrived)}
        return tuple(
            Outcome.INFEASIBLE if i in proven and o is Outcome.DEADLOCKED else o for i, o in enumerate(outcomes)
        )

    def blockers(self, problem: Problem) -> dict[int, tuple[int, ...]]:
        """Positioner that does not arrive -> arms that block it; -1 - k is obstacle k."""
        n = problem.n
        given_up = {i: tuple(j if j < n else n - 1 - j for j in arms) for i, arms in self.given_up.items()}
        return all_blockers(problem, given_up)

    def notes(self, problem: Problem) -> list[str]:
        """What the outcomes do not say."""

        def listed(who: tuple[int, ...]) -> str:
            return ", ".join(problem.plane.ids[i] for i in who)

        notes = []
        if self.late:
            notes.append(f"proven out of reach within {self.max_time:g} s by joint speeds: {listed(self.late)}")
        alone = tuple(i for i, others in self.shut_off.items() if not others)
        if alone:
            notes.append(f"proven unreachable, whatever all others do: {listed(alone)}")
        for i, others in self.shut_off.items():
            if others:
                notes.append(f"proven: not both reach their goals, {listed((i,))} and {listed(tuple(sorted(others)))}")
        if self.held:
            notes.append(f"held at the start: {listed(self.held)}")
        return notes


def _at_goal(problem: Problem, ends: np.ndarray) -> np.ndarray:
    """(n,) whether positioners end exactly in a configuration that counts as their goal."""
    goal, others = problem.goal[:, None], problem.alternatives
    choices = goal if others is None else np.concatenate([goal, others], axis=1)
    return np.asarray((choices == ends[:, None]).all(axis=2).any(axis=1) & problem.has_goal)
