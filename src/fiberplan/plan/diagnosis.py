"""Why a plan is as it is: who did not arrive and who was in the way, what set its duration, how often joints turn back.

The command line prints it and the page shows it; neither judges anything of its own.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fiberplan.motion import Trajectory
from fiberplan.plan.bounds import Bound, proven_bounds
from fiberplan.plan.outcomes import Outcome
from fiberplan.tolerances import ARRIVAL

if TYPE_CHECKING:
    from fiberplan.plan.plan import Plan

_STILL = 1e-9  # [rad] a joint that turns less between two knots rests there
_SLOWEST = 3  # how many of the last to stop are listed


@dataclass(frozen=True)
class Loss:
    """A positioner that did not arrive at its target."""

    positioner: int
    id: str
    outcome: Outcome
    cause: str  #: a sentence, without who is in the way
    priority: float
    blockers: tuple[int, ...]  #: positioners in its way; -1 - k is obstacle k
    names: tuple[str, ...]  #: of the blockers
    distance: float  #: left from the fiber to its target [mm]; NaN if no configuration reaches it

    def __str__(self) -> str:
        blockers = f"; in the way: {', '.join(self.names)}" if self.names else ""
        if self.outcome is not Outcome.OFFLINE:
            return f"{self.id}: {self.cause}{blockers}"
        left = "its target is out of reach" if np.isnan(self.distance) else f"{self.distance:.3f} mm from its target"
        return f"{self.id}: offline, {self.cause}; {left}"


@dataclass(frozen=True)
class Slow:
    """A positioner that takes long."""

    positioner: int
    id: str
    stops: float  #: when it stops [s]; NaN: it never moves
    needed: float  #: what its joints alone need to go where it goes [s]


@dataclass(frozen=True)
class Reversals:
    """How often a joint turns back, over the positioners that move."""

    median: float
    most: int
    positioner: int | None  #: who does most; None: nobody turns back


@dataclass(frozen=True)
class Diagnosis:
    """Causes of what a plan loses and of how long it takes."""

    losses: tuple[Loss, ...]
    makespan: float  #: [s]
    lower_bound: float  #: [s]
    bound_by: Slow | None  #: who of those that arrive has joints that need longest; None if nobody has to move
    slowest: tuple[Slow, ...]  #: the last to stop, the very last first
    pair_bounds: tuple[str, ...]  #: of those that need longer (`Plan.bounds`), and what is proven of it, in words
    alpha: Reversals
    beta: Reversals

    def __repr__(self) -> str:
        return f"<Diagnosis: {len(self.losses)} losses, {self.makespan:.6g} s, bound {self.lower_bound:.6g} s>"


def diagnose(plan: "Plan", prove: bool = False) -> Diagnosis:
    """Who did not arrive, why, and what set the makespan.

    Args:
        plan: any.
        prove: what the planner estimated of those that need longer; a few seconds for each pair.
    """
    alpha, beta = reversals(plan.trajectory).T
    stops = stop_times(plan.trajectory)
    bounds = (*plan.bounds, *(proven_bounds(plan) if prove else ()))
    return Diagnosis(
        losses=losses(plan),
        makespan=plan.makespan,
        lower_bound=plan.lower_bound,
        bound_by=_bound_by(plan),
        slowest=_slowest(plan, stops),
        pair_bounds=tuple(bound.said(plan.problem.plane) for bound in bounds),
        alpha=_summary(alpha, stops),
        beta=_summary(beta, stops),
    )


def leading_bounds(plan: "Plan") -> tuple[Bound, ...]:
    """The largest bound of each kind; the kinematic one, which is proven, comes first if anybody has to move."""
    found: dict[str, Bound] = {}
    slowest = _bound_by(plan)
    if slowest is not None:
        found["kinematic"] = Bound("kinematic", plan.lower_bound, (slowest.positioner,), proven=True)
    for bound in plan.bounds:
        if bound.kind not in found or bound.seconds > found[bound.kind].seconds:
            found[bound.kind] = bound
    return tuple(found.values())


def losses(plan: "Plan") -> tuple[Loss, ...]:
    """Everyone with a target who is not at it in the end: `plan.lost`, and those that cannot move and had one."""
    plane, problem = plan.problem.plane, plan.problem
    away = _distances(plan)
    assert problem.wished is not None  # set on construction
    stuck = [int(i) for i in plan.having(Outcome.OFFLINE) if away[i] > ARRIVAL and not problem.wished[i]]

    def loss(i: int) -> Loss:
        dropped = problem.dropped.get(i)
        blockers = tuple(plan.blockers.get(i, ()) or (dropped.blockers if dropped else ()))
        names = tuple(plane.label(b) for b in blockers)
        assert problem.priority is not None  # set on construction
        priority = float(problem.priority[i])
        return Loss(i, plane.ids[i], plan.outcomes[i], cause(plan, i), priority, blockers, names, float(away[i]))

    return tuple(loss(i) for i in sorted({*map(int, plan.lost), *stuck}))


def cause(plan: "Plan", i: int) -> str:
    """Why positioner `i` is not at its target, in a sentence."""
    outcome = plan.outcomes[i]
    if outcome is Outcome.DROPPED:
        dropped = plan.problem.dropped.get(i)
        return dropped.cause if dropped else "its goal touched one that had to stay at its start"
    if outcome is Outcome.DEADLOCKED:
        stays = np.array_equal(plan.trajectory.start[i], plan.trajectory.end[i])
        return f"{outcome.value}; it ends {'where it starts' if stays else 'elsewhere, out of the way'}"
    return outcome.value


def displaced(plan: "Plan") -> tuple[str, ...]:
    """A sentence for each idle positioner that ends elsewhere than it was wished to; no target is lost by it."""
    ids = plan.problem.plane.ids
    return tuple(f"idle positioner '{ids[i]}' ends elsewhere than recorded: {cause(plan, i)}" for i in plan.displaced)


def reversals(trajectory: Trajectory) -> np.ndarray:
    """How often alpha and beta of each positioner change the sign of their speed (n, 2); rests in between do not count.

    A joint that goes on in the direction in which it stopped has not turned back.
    """
    turns = np.diff(trajectory.angles, axis=0)
    owner = trajectory.owner
    within = owner[1:] == owner[:-1]
    out = np.zeros((trajectory.n, 2), np.int64)
    for joint in (0, 1):
        real = within & (np.abs(turns[:, joint]) > _STILL)
        sign, who = np.sign(turns[real, joint]), owner[1:][real]
        back = (who[1:] == who[:-1]) & (sign[1:] != sign[:-1])
        out[:, joint] = np.bincount(who[1:][back], minlength=trajectory.n)
    return out


def _distances(plan: "Plan") -> np.ndarray:
    """(n,) from each fiber in the end to its target [mm]; NaN where none was asked for or nothing reaches it."""
    plane = plan.problem.plane
    return np.linalg.norm(plane.fibers(plan.trajectory.end) - plane.fibers(plan.problem.requested), axis=1)


def stop_times(trajectory: Trajectory) -> np.ndarray:
    """(n,) when each positioner stops for good [s]; NaN: it never moves."""
    turns = np.abs(np.diff(trajectory.angles, axis=0)).max(axis=1) > _STILL
    owner = trajectory.owner
    turns &= owner[1:] == owner[:-1]
    stops = np.full(trajectory.n, np.nan)
    stops[owner[1:][turns]] = trajectory.times[1:][turns]  # the last one written is the latest
    return stops


def _slowest(plan: "Plan", stops: np.ndarray) -> tuple[Slow, ...]:
    plane, motion = plan.problem.plane, plan.trajectory
    needed = plane.least_time(motion.end - motion.start).max(axis=1)
    order = np.lexsort((np.arange(plane.n), -needed, -np.round(stops, 9)))  # NaN comes last
    last = [int(i) for i in order[:_SLOWEST] if np.isfinite(stops[i])]
    return tuple(Slow(i, plane.ids[i], float(stops[i]), float(needed[i])) for i in last)


def _bound_by(plan: "Plan") -> Slow | None:
    """Who of those that arrive needs longest, be it at the quickest of the configurations that reach its target."""
    plane, problem = plan.problem.plane, plan.problem
    ends = problem.goal[:, None]
    if problem.alternatives is not None:
        ends = np.concatenate([ends, problem.alternatives], axis=1)
    travel = plane.least_time(ends - problem.start[:, None]).max(axis=2)
    needed = np.nanmin(travel, axis=1, initial=np.inf)
    arrived = plan.having(Outcome.ARRIVED)
    if not needed[arrived].max(initial=0.0) > 0:
        return None
    i = int(arrived[np.argmax(needed[arrived])])
    return Slow(i, plane.ids[i], float(stop_times(plan.trajectory)[i]), float(needed[i]))


def _summary(counts: np.ndarray, stops: np.ndarray) -> Reversals:
    moving = np.isfinite(stops)
    if not moving.any():
        return Reversals(0.0, 0, None)
    worst = int(np.argmax(counts))
    return Reversals(float(np.median(counts[moving])), int(counts[worst]), worst if counts[worst] else None)
