"""Decentralized navigation function (Makarem2014): every fiber end descends a potential of its own, all at once.

The potential attracts each to its target and, within D, repels it from its neighbours. *literal* follows the paper
with the sign of its repulsion mended; what it leaves open is chosen as the package's page says. *repaired*
keeps the model (fiber ends, D, d, simultaneous steps) and changes what keeps the printed one from arriving. In both,
every step is granted only as far as the true bodies stay proven clear, and whoever arrives ends exactly at its goal.
"""

from dataclasses import asdict, dataclass
from time import process_time
from typing import Literal

import numpy as np

from fiberplan.errors import ProblemError
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.plan import Outcome, Plan
from fiberplan.plan.outcomes import all_blockers, settled_outcome
from fiberplan.planners.navigation_function.run import Descent, Settings
from fiberplan.planners.protocol import PLANNERS, setting
from fiberplan.planners.shared.repulsion import theorem1_bound
from fiberplan.planners.shared.requirements import refuse_seed, require_two_links
from fiberplan.problem import Problem
from fiberplan.tolerances import ARRIVAL

MODES = ("repaired", "literal")


@PLANNERS.register("navigation-function")
@dataclass(frozen=True)
class NavigationFunction:
    """Makarem2014's navigation function, made safe between steps.

    Raises:
        ProblemError: weights that are not positive, d that is not below D, lengths or times that are not positive, a
            number of neighbours below 0, or an unknown mode; when planning, a step in which a fiber could leave its
            patrol zone.
    """

    lambda1: float = setting(1.0, "weight of attraction; the repaired mode does not weigh", "1/mm^2")
    lambda2: float = setting(0.05, "weight of repulsion; the repaired mode does not weigh")
    D: float = setting(4.0, "fiber ends nearer than this repel each other", "mm")
    d: float = setting(2.0, "safety distance of fiber ends, where repulsion is without bound; below D", "mm")
    dt: float = setting(0.01, "a step of the descent", "s")
    convergence: float = setting(0.1, "a fiber this near its target has converged; it then goes there exactly", "mm")
    mode: Literal["repaired", "literal"] = setting("repaired", "what arrives, or what is printed")
    neighbours: int = setting(0, "how many repel a fiber, the nearest; 0: all that can come within D")
    ease: float = setting(1.25, "repaired: time that all take together, in times of the slowest joint")
    give_up: float = setting(
        6.0, "a positioner that has not arrived after so many times of the slowest joint is given up"
    )
    seed: int = 0  #: of nudges at singular poses, and of who ranks above whom

    name = "navigation-function"
    reference = "Makarem2014, section 3"

    def __post_init__(self) -> None:
        refuse_seed(self.name, self.seed)
        positive = {
            "lambda1": "weight", "lambda2": "weight", "D": "distance", "d": "distance", "dt": "time",
            "convergence": "distance", "give_up": "number",
        }  # fmt: skip
        for label, what in positive.items():
            value = getattr(self, label)
            if not (np.isfinite(value) and value > 0):
                raise ProblemError(f"{self.name}: {label} must be a positive {what}, got {value:g}")
        if self.d >= self.D:
            raise ProblemError(f"{self.name}: d must be below D, got d {self.d:g} mm and D {self.D:g} mm")
        if not (np.isfinite(self.ease) and self.ease >= 1):
            raise ProblemError(f"{self.name}: ease must be a number of 1 or more, got {self.ease:g}")
        if self.neighbours < 0:
            raise ProblemError(f"{self.name}: neighbours must be a number of 0 or more, got {self.neighbours}")
        if self.mode not in MODES:
            raise ProblemError(f"{self.name}: mode must be one of {', '.join(MODES)}, got '{self.mode}'")

    def plan(self, problem: Problem) -> Plan:
        """Descend until all have arrived, or as long as `give_up` says; who has not arrived waits where it got to."""
        self._refuse(problem)
        begun = process_time()
        near = Neighbourhood.of(problem.plane, problem.margin)
        descent = Descent(problem, near, Settings(**asdict(self)))
        made_ready = process_time()
        if self.mode == "literal":
            descent.run_literally()
        else:
            descent.run_repaired()
        trajectory = descent.trajectory() if self.mode == "literal" else descent.finished()
        outcomes = _outcomes(problem, trajectory.end)
        return Plan(
            problem=problem,
            trajectory=trajectory,
            outcomes=outcomes,
            planner=self.name,
            parameters=asdict(self),
            seed=self.seed,
            blockers=_blockers(problem, descent, outcomes),
            timings={"neighbours": made_ready - begun, **descent.timings, "all": process_time() - begun},
            notes=(*problem.notes, *self._warnings(problem)),
        )

    def _refuse(self, problem: Problem) -> None:
        """Raise for arms that are not of two links, or that could cross their whole patrol zone in one step."""
        plane = problem.plane
        require_two_links(self.name, plane)
        arm = np.hypot(*plane.fiber.T)
        most = plane.length * plane.max_speed[:, 0] + arm * plane.max_speed.sum(axis=1)
        excess = most * self.dt - (plane.length + arm)
        if np.any(excess > 0):
            i = int(np.argmax(excess))
            raise ProblemError(
                f"{self.name}: dt {self.dt:g} s is so large that positioner '{plane.ids[i]}' could move "
                f"{most[i] * self.dt:.3g} mm in a step, beyond its patrol zone of {plane.length[i] + arm[i]:.3g} mm",
                (i,),
            )

    def _warnings(self, problem: Problem) -> list[str]:
        """What these weights and this step cannot promise."""
        notes, literal = [], self.mode == "literal"
        ratio, bound = self.lambda1 / self.lambda2, theorem1_bound(self.D, self.d)
        if ratio >= bound:
            notes.append(
                f"lambda1 / lambda2 = {ratio:.4g} is not below {bound:.4g}, so Theorem 1 of Makarem2014 does not "
                f"exclude spurious minima{'' if literal else '; the repaired mode does not weigh'}"
            )
        arm = np.hypot(*problem.plane.fiber.T)
        gain = 2.0 * self.lambda1 * self.dt * float(np.max((problem.plane.length + arm) ** 2 + arm**2))
        if literal and gain >= 2.0:  # the largest squared singular value of the Jacobian is at most that sum
            notes.append(
                f"2 lambda1 dt J^2 is {gain:.3g} with arms of this length: from 2 on a step overshoots the target by "
                "more than it was away, and fibers may circle it instead of converging"
            )
        return notes


def _blockers(problem: Problem, descent: Descent, outcomes: tuple[Outcome, ...]) -> dict[int, tuple[int, ...]]:
    """Positioner that does not arrive -> who stands in its way."""
    stuck = descent.blockers([i for i, outcome in enumerate(outcomes) if outcome is Outcome.DEADLOCKED])
    return all_blockers(problem, stuck)


def _outcomes(problem: Problem, end: np.ndarray) -> tuple[Outcome, ...]:
    """An outcome for every positioner, the first that fits; `end` (n, 2) is where they stop [rad]."""
    plane = problem.plane
    away = np.hypot(*(plane.fibers(end) - plane.fibers(problem.goal)).T)

    def outcome(i: int) -> Outcome:
        here = Outcome.ARRIVED if away[i] <= 0.5 * ARRIVAL else Outcome.DEADLOCKED
        return settled_outcome(problem, i) or here

    return tuple(outcome(i) for i in range(problem.n))
