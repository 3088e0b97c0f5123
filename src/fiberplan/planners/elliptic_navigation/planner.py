"""Decentralized navigation functions for unequal arms with zones at several heights (Makarem2016), with relief.

Every positioner descends its own potential: a pull to its goal and pushes between elongated zones at equal heights.
Which of two goes first is settled beforehand by the sizes each takes zones for. Steps are granted only as far as they
are proven safe, so whoever does not arrive simply stays where it stands.
"""

from dataclasses import asdict, dataclass
from time import process_time
from typing import Literal

import numpy as np

from fiberplan.arrays import in_units
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.plan import Outcome, Plan
from fiberplan.plan.outcomes import all_blockers, settled_outcome
from fiberplan.planners.elliptic_navigation.field import Field
from fiberplan.planners.elliptic_navigation.run import Drive, assigned_sizes, weighted_width
from fiberplan.planners.protocol import PLANNERS, setting
from fiberplan.planners.shared.goal_configurations import faster_goals
from fiberplan.planners.shared.prepared import prepared
from fiberplan.planners.shared.requirements import refuse_seed, require_exact_steps, require_two_links
from fiberplan.problem import Problem
from fiberplan.problem.resting import place_the_rest
from fiberplan.tolerances import EQUALITY

RELIEFS = ("layers", "none")


@PLANNERS.register("elliptic-navigation-function")
@dataclass(frozen=True)
class EllipticNavigationFunction:
    """Makarem2016's field, made safe between steps, and Tao2018's idea of relief.

    Raises:
        ProblemError: a weight, distance or time that is not positive, a negative spread, or an unknown relief.
    """

    lambda1: float = setting(1.0, "pull to the goal, as part of the full speed")
    lambda2: float = setting(0.1, "push on zones in the outer half of an arm", "rad/s mm^2")
    lambda3: float = setting(0.1, "push on all other zones", "rad/s mm^2")
    influence: float = setting(2.0, "zones push from this far apart: the papers' D - d, in weighted distance", "mm")
    spread: float = setting(0.1, "the largest zones are taken for larger than the smallest by this part")
    near: float = setting(3.0, "two that are both this near to their goals push each other less and less", "s")
    stall_time: float = setting(1.0, "a positioner that has come no nearer for this long stops pushing the others", "s")
    dt: float = setting(0.1, "a step of the descent", "s")
    relief: Literal["layers", "none"] = setting("layers", "what to do about deadlocks")
    """Lead the stalled past those in their path, round by round; or nothing."""
    patience: float = setting(1.0, "time without coming nearer that relief takes for stuck", "s")
    max_time: float = setting(600.0, "the motion takes no longer", "s")
    """Rounds of relief are counted one after the other, and put side by side later."""
    seed: int = 0  #: of the order of sizes among equal priorities

    name = "elliptic-navigation-function"
    reference = "Makarem2016; relief after Tao2018"

    def __post_init__(self) -> None:
        refuse_seed(self.name, self.seed)
        units = {"influence": "mm", "near": "s", "stall_time": "s", "dt": "s", "patience": "s", "max_time": "s"}
        push = "rad / (s mm2)"
        in_units(self, units | {"lambda1": "", "lambda2": push, "lambda3": push, "spread": ""}, ProblemError)
        for label in ("lambda1", "lambda2", "lambda3", *units):
            value = getattr(self, label)
            if not (np.isfinite(value) and value > 0):
                unit = f" {units[label]}" if label in units else ""
                raise ProblemError(f"{self.name}: {label} must be positive, got {value:g}{unit}")
        if not (np.isfinite(self.spread) and self.spread >= 0):
            raise ProblemError(f"{self.name}: spread must be 0 or more, got {self.spread:g}")
        if self.relief not in RELIEFS:
            raise ProblemError(f"{self.name}: relief must be one of {', '.join(RELIEFS)}, got '{self.relief}'")

    @prepared
    def plan(self, problem: Problem) -> Plan:
        """Follow the field, then relieve whom it left stalled; those who do not arrive stay where they stopped.

        Raises:
            ProblemError: arms of four bars, which have other zones; or `dt` is so large that a positioner could cross
                its whole patrol zone in one step.
        """
        begun = process_time()
        plane = problem.plane
        self._check_step(problem)
        near = Neighbourhood.of(plane, problem.margin)
        goal, nowhere = self._goals(problem, near)
        priority = np.asarray(problem.priority)
        sizes, rank = assigned_sizes(priority, self.spread, self.seed)
        drive = Drive(plane, problem.start, goal, problem.margin, near, self._field(problem), sizes)
        drive.by_the_field(self.max_time)
        descended = process_time()
        alone = int(np.sum(drive.there & problem.has_goal))
        if self.relief == "layers":
            drive.with_relief(problem.has_goal * (priority + 1e-6), rank, self.patience, self.max_time)
        arrived = drive.there & problem.has_goal
        outcomes = tuple(self._outcome(problem, i, bool(arrived[i])) for i in range(problem.n))
        done = process_time()
        return Plan(
            problem=problem,
            trajectory=drive.trajectory(),
            outcomes=outcomes,
            planner=self.name,
            parameters=asdict(self),
            seed=self.seed,
            blockers=self._blockers(problem, drive, outcomes),
            timings={"field": descended - begun, "relief": done - descended},
            notes=(*problem.notes, *self._notes(problem, alone, int(arrived.sum()), nowhere)),
        )

    def _field(self, problem: Problem) -> Field:
        touch = weighted_width(problem.plane) + problem.margin
        weights = (self.lambda1, self.lambda2, self.lambda3)
        return Field(*weights, touch + self.influence, touch, self.near, self.stall_time, self.dt)

    def _check_step(self, problem: Problem) -> None:
        plane = problem.plane
        require_two_links(self.name, plane)
        require_exact_steps(self.name, problem, self.dt)
        arm = np.hypot(*plane.fiber.T)
        turn = plane.max_speed * self.dt
        step = plane.length * turn[:, 0] + arm * turn.sum(axis=1)
        across = 2.0 * (plane.length + arm)
        if np.any(step > across):
            i = int(np.argmax(step - across))
            raise ProblemError(
                f"{self.name}: dt {self.dt:g} s: positioner '{plane.ids[i]}' could move {step[i]:.3f} mm in one step, "
                f"farther than across its patrol zone ({across[i]:.3f} mm)",
                (i,),
            )

    @staticmethod
    def _goals(problem: Problem, near: Neighbourhood) -> tuple[np.ndarray, np.ndarray]:
        """(n, 2) where everyone belongs: the quicker elbow solution; without a goal, somewhere safe, best folded."""
        plane = problem.plane
        known = np.where(plane.online[:, None], faster_goals(problem, near), problem.start)
        return place_the_rest(plane, known, problem.start, near, problem.margin + EQUALITY)

    @staticmethod
    def _outcome(problem: Problem, i: int, arrived: bool) -> Outcome:
        return settled_outcome(problem, i) or (Outcome.ARRIVED if arrived else Outcome.DEADLOCKED)

    @staticmethod
    def _blockers(problem: Problem, drive: Drive, outcomes: tuple[Outcome, ...]) -> dict[int, tuple[int, ...]]:
        """Positioner that did not arrive -> who is in its way; -1 - k is obstacle k."""
        blockers: dict[int, tuple[int, ...]] = {}
        lost = np.array([i for i, outcome in enumerate(outcomes) if outcome is Outcome.DEADLOCKED], np.int64)
        for i, arm in zip(lost.tolist(), drive.in_the_way(lost).tolist(), strict=True):
            if arm >= 0:
                blockers[i] = (problem.plane.public(arm),)
        return all_blockers(problem, blockers)

    def _notes(self, problem: Problem, alone: int, arrived: int, nowhere: np.ndarray) -> list[str]:
        notes = []
        if self.relief == "layers":
            notes.append(f"the field alone brings {alone} of {int(problem.has_goal.sum())} to their goals")
        ids = [problem.plane.ids[i] for i in nowhere if problem.plane.online[i]]
        if ids:
            notes.append("no safe place to rest was found for: " + ", ".join(ids))
        return notes
