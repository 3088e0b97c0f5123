"""Times that a planner found some positioners to need, whatever the others do."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from fiberplan import certificates
from fiberplan.errors import PlanError

if TYPE_CHECKING:
    from fiberplan.focal_plane import FocalPlane
    from fiberplan.plan.plan import Plan

_KINDS = {"kinematic": "by the speeds of their joints", "obstacle": "past what never moves", "pair": "even alone"}


@dataclass(frozen=True)
class Bound:
    """Why a plan takes longer than the speeds of its joints ask for."""

    kind: Literal["kinematic", "obstacle", "pair"]  #: joints' speeds; obstacles and those that cannot move; each other
    seconds: float  #: how long they need [s]
    positioners: tuple[int, ...]  #: who needs the time
    proven: bool = False  #: False: an estimate

    def __post_init__(self) -> None:
        if self.kind not in _KINDS:
            raise PlanError(f"a bound is of the kind '{self.kind}', which is none of {', '.join(_KINDS)}")
        if not (self.positioners and self.seconds >= 0):
            raise PlanError(f"a bound of {self.seconds} s for {len(self.positioners)} positioners makes no sense")

    def said(self, plane: "FocalPlane") -> str:
        """The bound in words."""
        names = " and ".join(plane.ids[i] for i in self.positioners)
        needs = "needs" if len(self.positioners) == 1 else "need"
        how = "proven" if self.proven else "an estimate on a lattice, no proof"
        return f"{self.kind} bound: {names} {needs} {self.seconds:.1f} s {_KINDS[self.kind]} ({how})"


def proven_bounds(plan: "Plan", turn: float | None = None) -> tuple[Bound, ...]:
    """What is proven of the bounds that a plan states as estimates: a few seconds for each pair.

    Args:
        plan: whose `bounds` are asked about, for the goals at which it ends.
        turn: of the fastest joint in a step of time [rad], as for `proven_least_time`; finer proves more.

    Returns:
        one of each, of the plan's makespan at most: who is proven to need that much cannot be sooner.
    """
    problem, end = plan.problem, plan.trajectory.end
    found = []
    for bound in plan.bounds:
        if not bound.proven:
            who, longest = bound.positioners, plan.makespan
            asked = problem.plane, who, problem.start, end, problem.margin, longest, turn
            seconds = certificates.proven_least_time(*asked)  # whose kernels are loaded only for that
            found.append(Bound(bound.kind, seconds, who, proven=True))
    return tuple(found)
