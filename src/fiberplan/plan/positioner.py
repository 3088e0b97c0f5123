"""What a plan says of one positioner: where it was asked to go, how it moves, what became of it."""

import operator
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fiberplan.arrays import Frozen, shortened
from fiberplan.errors import UnknownPositionerError
from fiberplan.plan.diagnosis import Loss, losses
from fiberplan.plan.outcomes import Outcome
from fiberplan.tables.wording import nearest

if TYPE_CHECKING:
    from astropy.table import QTable

    from fiberplan.plan.plan import Plan


@dataclass(frozen=True, eq=False)
class PositionerPlan(Frozen):
    """One positioner's part of a plan."""

    id: str
    index: int
    outcome: Outcome
    priority: float
    start: np.ndarray  #: (2,) commanded alpha, beta [rad]
    goal: np.ndarray  #: (2,) the goal that was kept [rad]; NaN: none
    requested: np.ndarray  #: (2,) the goal before any was dropped [rad]; NaN: none
    end: np.ndarray  #: (2,) where it stops [rad]
    times: np.ndarray  #: (m,) knots of its path [s]
    angles: np.ndarray  #: (m, 2) of its path [rad]
    cause: str = ""  #: why it is not at its target; "" if it is, or has none
    blockers: tuple[str, ...] = ()  #: ids of positioners and names of obstacles in its way

    def __repr__(self) -> str:
        knots = f"{len(self.times)} knots, {self.times[-1]:.6g} s"
        return f"<PositionerPlan '{shortened(self.id)}': {self.outcome.name}, {knots}>"


def positioner_plans(plan: "Plan") -> Iterator[PositionerPlan]:
    """Every positioner's part, in the focal plane's order."""
    lost = {loss.positioner: loss for loss in losses(plan)}
    return (_part(plan, i, lost.get(i)) for i in range(plan.problem.n))


def positioner_plan(plan: "Plan", key: str | int) -> PositionerPlan:
    """The part of one positioner, by id or index.

    Raises:
        UnknownPositionerError: there is none of this id or index.
    """
    i = _index(plan, key)
    return _part(plan, i, next((loss for loss in losses(plan) if loss.positioner == i), None))


def _index(plan: "Plan", key: str | int) -> int:
    plane = plan.problem.plane
    if isinstance(key, str):
        if key in plane.index:
            return plane.index[key]
        raise UnknownPositionerError(f"{plane.name} has no positioner '{shortened(key)}'{nearest(key, plane.ids)}")
    try:
        i = operator.index(key)
    except TypeError:
        raise UnknownPositionerError(
            f"a positioner has an id and an index, and is not {shortened(repr(key))}"
        ) from None
    if not 0 <= i < plane.n:
        raise UnknownPositionerError(f"{plane.name} has no positioner {i}: indices run from 0 to {plane.n - 1}")
    return i


def _part(plan: "Plan", i: int, loss: Loss | None) -> PositionerPlan:
    problem = plan.problem
    assert problem.priority is not None  # set on construction
    times, angles = plan.trajectory.knots(i)
    return PositionerPlan(
        id=problem.plane.ids[i],
        index=i,
        outcome=plan.outcomes[i],
        priority=float(problem.priority[i]),
        start=problem.start[i],
        goal=problem.goal[i],
        requested=problem.requested[i],
        end=angles[-1],
        times=times,
        angles=angles,
        cause=loss.cause if loss else "",
        blockers=loss.names if loss else (),
    )


def plan_table(plan: "Plan") -> "QTable":
    """A row a positioner; see `Plan.to_table`."""
    from astropy import units
    from astropy.table import QTable

    parts = list(positioner_plans(plan))
    columns: dict[str, object] = {
        "positioner": np.array([part.id for part in parts]),
        "outcome": np.array([part.outcome.name for part in parts]),
    }
    for name in ("start", "requested", "end"):
        angles = np.degrees(np.array([getattr(part, name) for part in parts]))
        for k, joint in enumerate(("alpha", "beta")):
            columns[f"{'goal' if name == 'requested' else name}_{joint}"] = angles[:, k] * units.deg
    columns |= {
        "priority": np.array([part.priority for part in parts]),
        "cause": np.array([part.cause for part in parts]),
        "blockers": np.array([", ".join(part.blockers) for part in parts]),
    }
    return QTable(columns)
