"""Greedy reverse path to a common folded state (Sayres2021): from field A to folded to field B.

The way from the start to folded is searched as it is; the way from folded to the goal is searched backwards, from the
goal, and reversed. Folding is easy because all arms turn the same way; the forward search "utterly fails".
"""

from dataclasses import asdict, dataclass
from time import process_time
from typing import Literal

import numpy as np

from fiberplan.arrays import in_units
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.motion import Trajectory
from fiberplan.plan import Plan
from fiberplan.planners.greedy_fold.fold import RELIEFS, Folding
from fiberplan.planners.greedy_fold.losses import Losses
from fiberplan.planners.protocol import PLANNERS, setting
from fiberplan.planners.shared.prepared import prepared
from fiberplan.planners.shared.requirements import refuse_seed, require_two_links
from fiberplan.planners.shared.straighten import straighten
from fiberplan.problem import Problem
from fiberplan.tolerances import SPEED

_MOST_LOOPS = 100_000_000  # of a walk: hours; they are counted in 32 bits


@PLANNERS.register("greedy-fold")
@dataclass(frozen=True)
class GreedyFold:
    """Sayres2021's greedy fold, made safe: moves are tested over the whole step and against simultaneous moves.

    Raises:
        ProblemError: a step or travel that is not a positive angle, or an unknown relief.
    """

    step: float = setting(np.radians(0.1), "turn of the fastest joint per loop", "rad")
    max_travel: float = setting(np.radians(700.0), "turn after which a walk is given up", "rad")
    skip_noops: bool = setting(
        True, "pass over moves that a joint limit turns into nothing; as printed, they are taken"
    )
    relief: Literal["joint", "reverse", "replace", "none"] = setting("joint", "what to do in a deadlock")
    """Fold the few that are stuck once more, past the others, or jointly after them (ours); reverse the ranking of one
    for a while (proposed in the paper); give one another target and begin again (used there); nothing."""
    seed: int = 0  #: of the random choices of relief

    name = "greedy-fold"
    reference = "Sayres2021, section 3"

    def __post_init__(self) -> None:
        in_units(self, {"step": "rad", "max_travel": "rad"}, ProblemError)
        refuse_seed(self.name, self.seed)
        for label in ("step", "max_travel"):
            value = getattr(self, label)
            if not (np.isfinite(value) and value > 0):
                raise ProblemError(f"greedy-fold: {label} must be a positive angle, got {np.degrees(value):g} deg")
        if self.step > np.pi or self.max_travel < self.step:
            raise ProblemError(
                f"greedy-fold: step {np.degrees(self.step):g} deg must be at most 180 deg and at most max_travel "
                f"{np.degrees(self.max_travel):g} deg"
            )
        if not self.max_travel / self.step <= _MOST_LOOPS:
            travel, step = np.degrees([self.max_travel, self.step])
            raise ProblemError(
                f"greedy-fold: max_travel {travel:g} deg in steps of {step:g} deg are {travel / step:.3g} loops, and "
                f"{_MOST_LOOPS:,} are the most"
            )
        if self.relief not in RELIEFS:
            raise ProblemError(f"greedy-fold: relief must be one of {', '.join(RELIEFS)}, got '{self.relief}'")

    @prepared
    def plan(self, problem: Problem) -> Plan:
        """Fold from the start, unfold to the goal; what gets stuck is given up, and the rest is planned around it."""
        require_two_links(self.name, problem.plane)
        begun = process_time()
        rng = np.random.default_rng(self.seed)
        near = Neighbourhood.of(problem.plane, problem.margin)
        losses = Losses(problem, near)
        out, walked_out = None, losses.movable
        while True:
            end = losses.end()
            if out is None or not np.array_equal(
                walked_out, losses.movable
            ):  # the way out changes with who is held only
                walked_out = losses.movable.copy()
                out = self._folding(problem, near, walked_out).fold(problem.start, rng)
            back = self._folding(problem, near, losses.movable, problem.priority).fold(end, rng)
            losses.record(back)
            if not (len(out.stuck) or len(back.stuck)):
                break
            if self.relief == "replace" and len(back.stuck) and not len(out.stuck):
                losses.replace_target(int(rng.choice(back.stuck)), back.blockers, rng)
            else:
                losses.give_up(out, back)
        walked = process_time()
        motion = straighten(problem.plane, out.trajectory.then(back.trajectory.reversed()), problem.margin, near)
        motion = _slower_than_rounding(motion)
        done = process_time()
        return Plan(
            problem=problem,
            trajectory=motion,
            outcomes=losses.outcomes(motion.end),
            planner=self.name,
            parameters=asdict(self),
            seed=self.seed,
            blockers=losses.blockers(motion.end),
            timings={"walk": walked - begun, "straighten": done - walked},
            notes=(*problem.notes, *losses.notes()),
        )

    def _folding(
        self, problem: Problem, near: Neighbourhood, movable: np.ndarray, expendable: np.ndarray | None = None
    ) -> Folding:
        return Folding(
            problem.plane,
            problem.margin,
            movable,
            near,
            self.step,
            self.max_travel,
            self.skip_noops,
            self.relief,
            expendable,
        )


def _slower_than_rounding(motion: Trajectory) -> Trajectory:
    """The same motion, slower where times are so large that rounding them makes a joint faster than it can be."""
    steps = np.diff(motion.times)[np.diff(motion.owner) == 0]
    rounding = np.spacing(motion.duration) / steps.min(initial=np.inf)
    if rounding <= SPEED:
        return motion
    return Trajectory(motion.offsets, motion.times * (1.0 + 4.0 * rounding), motion.angles)
