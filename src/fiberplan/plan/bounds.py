"""Times that a planner found some positioners to need, whatever the others do."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from fiberplan.errors import PlanError

if TYPE_CHECKING:
    from fiberplan.focal_plane import FocalPlane

_CAUSES = {"pair": "even alone", "fixed": "past what never moves"}


@dataclass(frozen=True)
class Bound:
    """Why a plan takes longer than the speeds of its joints ask for."""

    positioners: tuple[int, ...]  #: who needs the time
    seconds: float  #: how long they need [s]
    cause: Literal["pair", "fixed"] = "pair"  #: because of each other; or of obstacles and those that cannot move
    proven: bool = False  #: False: an estimate

    def __post_init__(self) -> None:
        if self.cause not in _CAUSES:
            raise PlanError(f"a bound has the cause '{self.cause}', which is none of {', '.join(_CAUSES)}")
        if not (self.positioners and self.seconds >= 0):
            raise PlanError(f"a bound of {self.seconds} s for {len(self.positioners)} positioners makes no sense")

    def said(self, plane: "FocalPlane") -> str:
        """The bound in words."""
        names = " and ".join(plane.ids[i] for i in self.positioners)
        needs = "needs" if len(self.positioners) == 1 else "need"
        how = "proven" if self.proven else "an estimate on a lattice, no proof"
        return f"{self.cause} bound: {names} {needs} {self.seconds:.1f} s {_CAUSES[self.cause]} ({how})"
