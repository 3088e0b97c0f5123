"""One field, whoever does it: allocated, planned, certified, as bytes for whoever writes them.

A worker is told once what all fields share, and then field by field where everyone stands and what can be observed. It
writes nothing, so that one that is given up, or is slow to notice that nobody waits for it, does no harm.
"""

import dataclasses
import io
import pickle
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fiberplan.arrays import Frozen, FrozenDict
from fiberplan.errors import FiberplanError
from fiberplan.focal_plane import FocalPlane
from fiberplan.io.plan_file import plan_bytes
from fiberplan.plan import Plan
from fiberplan.plan.closest import closest_pairs
from fiberplan.plan.diagnosis import stop_times
from fiberplan.planners.protocol import Planner
from fiberplan.problem import State
from fiberplan.survey.allocate import allocate
from fiberplan.survey.allocation import Allocation
from fiberplan.survey.batch.record import Record, Slow
from fiberplan.survey.catalogue import Catalogue
from fiberplan.survey.solve import Solver

_SLOWEST = 3  # of a field that are kept


@dataclass(frozen=True, eq=False)
class Setup(Frozen):
    """What all fields of a survey share."""

    plane: FocalPlane
    margin: float  #: [mm]
    required: Mapping[str, int]  #: category -> positions
    regions: int  #: parts of the array over which these are spread
    solver: Solver
    planner: Planner
    seed: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "required", FrozenDict(self.required))


class Packed(NamedTuple):
    """A setup for workers: unpacked once by each, however many fields it does."""

    name: str  #: of its content
    content: bytes  #: pickled; empty where workers have been told at their start

    def unpacked(self) -> Setup:
        """The setup."""
        if self.name not in _unpacked:
            _unpacked.clear()
            _unpacked[self.name] = pickle.loads(self.content)
        return _unpacked[self.name]


_unpacked: dict[str, Setup] = {}  # of this process


class Job(NamedTuple):
    """A field to do."""

    field: int
    id: str
    catalogue: Catalogue  #: what can be observed in it
    numbers: np.ndarray  #: (m,) of these targets in the survey
    start: np.ndarray  #: (n, 2) where everyone stands [rad]
    begins: str  #: that in words


class Done(NamedTuple):
    """A field that was done."""

    record: Record  #: without files
    end: np.ndarray | None  #: (n, 2) where everyone stands in the end [rad]; None: it failed, and nobody moved
    plan: bytes = b""
    targets: bytes = b""


def work(packed: Packed, job: Job) -> Done | None:
    """Do a field; None if an interrupt cut it short, so that another try would give another plan."""
    setup = packed.unpacked()
    cpu, wall = time.process_time(), time.perf_counter()
    state = State(job.start, setup.plane.online, source=job.begins)
    try:
        allocation = allocate(
            setup.plane,
            job.catalogue,
            setup.margin,
            start=state,
            required=setup.required,
            regions=setup.regions,
            solver=setup.solver,
            planner=setup.planner,
            seed=setup.seed,
        )
        if allocation.interrupted:
            return None
        assert allocation.plan is not None  # motion was asked for
        plan = dataclasses.replace(allocation.plan, timings={})  # the same bytes whenever it is planned
        if faults := plan.faults():
            return Done(Record(job.field, job.id, f"not proven: {faults[0]}"), None)
    except FiberplanError as error:
        return Done(Record(job.field, job.id, str(error)), None)
    content = plan_bytes(plan, certificate=True)
    targets = _table(allocation)
    record = _record(job, allocation, plan)
    times = time.process_time() - cpu, time.perf_counter() - wall, 1
    return Done(record._replace(times=times), plan.trajectory.end, content, targets)


def _record(job: Job, allocation: Allocation, plan: Plan) -> Record:
    listed = job.catalogue
    assert listed.category is not None  # set on construction
    classes = sorted(set(listed.category))
    reasons: dict[tuple[str, str], int] = {}
    for row, reason in sorted(allocation.reasons.items()):
        key = listed.category[row], reason.why.name
        reasons[key] = reasons.get(key, 0) + 1
    close = closest_pairs(plan)
    return Record(
        field=job.field,
        id=job.id,
        candidates=tuple((name, listed.category.count(name)) for name in classes),
        taken=tuple(job.numbers[allocation.rows].tolist()),
        positioners=tuple(allocation.positioners.tolist()),
        value=allocation.value,
        bound=allocation.bound,
        price=allocation.price,
        short=sum(quota.required - quota.allocated for quota in allocation.quotas),
        rounds=allocation.rounds,
        makespan=plan.makespan,
        lower_bound=plan.lower_bound,
        clearance=close[0].clearance if close and np.isfinite(close[0].clearance) else None,
        reasons=tuple((*key, count) for key, count in sorted(reasons.items())),
        slowest=_slowest(plan),
    )


def _slowest(plan: Plan) -> tuple[Slow, ...]:
    """Who stops last, and how long each would need alone."""
    stops, motion, plane = stop_times(plan.trajectory), plan.trajectory, plan.problem.plane
    least = plane.least_time(motion.end - motion.start).max(axis=1)
    last = np.argsort(-stops, kind="stable")[:_SLOWEST]
    return tuple(Slow(plane.ids[i], float(stops[i]), float(least[i])) for i in last.tolist() if stops[i] > 0)


def _table(allocation: Allocation) -> bytes:
    """The allocation as ECSV; empty if nothing is allocated."""
    if allocation.targets is None:
        return b""
    written = io.StringIO()
    allocation.to_table().write(written, format="ascii.ecsv")
    return written.getvalue().encode()
