"""A survey, field after field: what is ready goes to workers, what comes back is written and entered in the ledger.

The ledger is read first, and whatever it has is not done again. All that a field depends on is in it: where the field
before in the chain ended, and what was observed in fields that share targets with it.
"""

import os
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from pathlib import Path
from typing import Any

import numpy as np

from fiberplan import __version__
from fiberplan.arrays import not_negative
from fiberplan.arrays.seeds import seed_complaint
from fiberplan.cores import cores
from fiberplan.errors import FiberplanError, ProblemError, interrupted
from fiberplan.focal_plane import FocalPlane
from fiberplan.io.plan_file import read_plan
from fiberplan.planners import Direct
from fiberplan.planners.protocol import Planner
from fiberplan.problem import State
from fiberplan.survey.batch.fields import Fields
from fiberplan.survey.batch.fingerprint import fingerprint
from fiberplan.survey.batch.ledger import Ledger
from fiberplan.survey.batch.precedence import Precedence
from fiberplan.survey.batch.record import Record
from fiberplan.survey.batch.report import write_report
from fiberplan.survey.batch.summary_tables import write_tables
from fiberplan.survey.batch.survey import Survey
from fiberplan.survey.batch.survey_targets import LyingIn, SurveyTargets
from fiberplan.survey.batch.work import Done, Job, Packed, Setup, work
from fiberplan.survey.batch.workers import Here, LocalProcesses, died, packed
from fiberplan.survey.quotas import Quotas
from fiberplan.survey.sky import Telescope
from fiberplan.survey.sky.telescope import NOT_MODELLED
from fiberplan.survey.solve import Solver
from fiberplan.survey.standing import standing

_TRIES = 3  # of a field whose worker dies


def run(
    plane: FocalPlane,
    catalogue: Any,
    fields: Any,
    folder: str | os.PathLike,
    executor: Executor | None = None,
    *,
    margin: float = 0.0,
    telescope: Telescope | None = None,
    start: State | None = None,
    required: Mapping[str, int] | None = None,
    regions: int = 1,
    solver: Solver = "milp",
    planner: Planner | None = None,
    seed: int = 0,
    at_once: int | None = None,
    report: Callable[[str], None] | None = None,
) -> Survey:
    """Allocate, plan and prove fields in order, each from what is still to be observed; go on where a run was ended.

    For each field a plan and an allocation are written, and a line in ``ledger.jsonl``; in the end tables and a report.
    Killed at any moment and started again with the same inputs, everything comes out as if nothing had happened, but
    for recorded times. A field that fails, since what is asked cannot be or its worker dies three times, is told by
    name, and the next in its chain begins where the one before it ended.

    Args:
        plane: the array.
        catalogue: a `SurveyTargets`, a table of astropy, or the path of a file (columns in docs/survey.md).
        fields: a `Fields`, a table, or the path of a file.
        folder: made if need be. The workers need not see it.
        executor: any of `concurrent.futures`, which is left open; as many processes as there are cores unless given,
            or this process if `at_once` is 1.
        margin: clearance to keep, at rest and in motion [mm].
        telescope: of targets on the sky; that which feeds `plane` unless given.
        start: where everyone stands before each chain; folded unless given.
        required: category -> how many positions each field needs; these are offered again and again.
        regions: over how many parts of the array these are spread.
        solver: as in `allocate`.
        planner: as in `allocate`.
        seed: as in `allocate`, of every field.
        at_once: fields in the hands of workers at the same time; as many as there are cores unless given.
        report: told about progress, in words.

    Raises:
        FiberplanError: inputs that cannot be used; a ledger that is damaged, or of other inputs; a folder that cannot
            be written, or in which another run is at work; an executor that broke.
    """
    if complaint := seed_complaint(seed):
        raise ProblemError(complaint)
    if solver not in ("milp", "heuristic"):
        raise ProblemError(f"solver must be 'milp' or 'heuristic', got '{solver}'")
    if at_once is not None and at_once < 1:
        raise ProblemError(f"at_once must be 1 or more, got {at_once}")
    margin = not_negative(margin, "mm", "margin", ProblemError)
    targets, fields = SurveyTargets.of(catalogue), Fields.of(fields)
    if targets.sky is not None and telescope is None:
        telescope = Telescope.load(plane.name)
    lying = targets.lying_in(fields, telescope)
    Quotas.of(plane, required, regions)  # it complains of what makes no sense
    there = standing(plane, start, None, margin, None)
    plane, begin = there.plane, there.start
    setup = Setup(plane, margin, dict(required or {}), regions, solver, planner or Direct(seed=seed), seed)
    places = {"catalogue": targets, "fields": fields, "telescope": telescope if targets.sky is not None else None}
    settings = {name: getattr(setup, name) for name in ("margin", "required", "regions", "solver", "seed")}
    settings |= {"planner": setup.planner, "start": begin}
    parts = {"focal plane": plane, **places, "choice of settings": settings, "version of fiberplan": __version__}
    Path(folder).mkdir(parents=True, exist_ok=True)
    with Ledger(Path(folder), {name: fingerprint(part) for name, part in parts.items()}) as ledger:
        batch = _Batch(Path(folder), targets, fields, lying, setup, begin, ledger)
        if batch.todo:
            many = at_once or cores()
            mine = executor is None
            name = fingerprint(setup)
            whole = packed(setup, name)
            if executor is None:
                executor = Here() if many == 1 else LocalProcesses(min(many, batch.todo), whole)
                whole = Packed(name, whole.content if many == 1 else b"")
            try:
                batch.go(executor, whole, many, report or (lambda _: None))
            finally:
                if mine:
                    executor.shutdown(wait=False, cancel_futures=True)
        assumed = () if telescope is None or targets.sky is None else (NOT_MODELLED, *telescope.assumptions)
        records = tuple(ledger.records[k] for k in range(len(fields)))
        survey = Survey(plane, targets, fields, records, batch.lying, batch.longest, assumed)
        write_tables(survey.tables(), Path(folder) / "tables")
        write_report(survey, Path(folder) / "report.html")
        return survey


class _Batch:
    """What is done, what is ready, and what targets are still to be observed."""

    def __init__(
        self,
        folder: Path,
        targets: SurveyTargets,
        fields: Fields,
        lying: LyingIn,
        setup: Setup,
        begin: np.ndarray,
        ledger: Ledger,
    ):
        self._folder, self._targets, self._fields, self._in = folder, targets, fields, lying
        self._setup, self._begin, self._ledger = setup, begin, ledger
        self._repeated = targets.repeated(setup.required)
        self._left = targets.visits[targets.first].copy()
        self._ends: dict[int, tuple[np.ndarray, str]] = {}  # field -> where everyone stands after it, in words too
        self.lying = np.zeros(len(targets), np.int64)
        self._order = Precedence(fields.chain, len(targets))
        for k in range(len(fields)):
            there = targets.target[lying.of(k)[0]]
            self.lying[there] += 1
            self._order.add(there[~self._repeated[there]])
        self.longest = self._order.longest
        self.todo = len(fields) - len(ledger.records)

    def go(self, executor: Executor, setup: Packed, many: int, report: Callable[[str], None]) -> None:
        """Do what is to be done."""
        running: dict[Future, tuple[Job, int]] = {}
        again: list[tuple[Job, int]] = []
        while True:
            while len(running) < many and (next_ := again.pop() if again else self._next()):
                job, tries = next_
                try:
                    running[executor.submit(work, setup, job)] = job, tries
                except BrokenExecutor:
                    raise FiberplanError("the executor broke; what is done is kept: start again to go on") from None
            if not running:
                return
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in sorted(finished, key=lambda each: running[each][0].field):
                job, tries = running.pop(future)
                done = self._outcome(future, job, tries, isinstance(executor, Here))
                if done is None:
                    again.append((job, tries + 1))
                    continue
                self._settle(job.field, done)
                report(f"{len(self._ledger.records)} of {len(self._fields)} fields")

    def _next(self) -> tuple[Job, int] | None:
        """The next field to do, at its first try; those in the ledger, and those with nothing in them, are settled."""
        while (k := self._order.next()) is not None:
            if k in self._ledger.records:
                self._pass(k, self._ledger.records[k])
                continue
            rows, places = self._in.of(k)
            numbers = self._targets.target[rows]
            wanted = self._left[numbers] > 0
            rows, places, numbers = rows[wanted], places[wanted], numbers[wanted]
            id_ = self._fields.ids[k]
            if not len(rows):
                self._settle(k, Done(Record(k, id_), None))
                continue
            start, begins = self._stands(k)
            offered = self._targets.listed.some(rows, places, f"field {id_}")
            return Job(k, id_, offered, numbers, start, begins), 1
        return None

    def _stands(self, k: int) -> tuple[np.ndarray, str]:
        """Where everyone stands before field k, and that in words."""
        before = self._order.before[k]
        while before is not None:
            if before in self._ends:
                return self._ends[before]
            record = self._ledger.records[before]
            if record.files:
                end = read_plan(self._folder / record.files[0][0]).trajectory.end
                return end, f"end of field {record.id}"
            before = self._order.before[before]  # nobody moved
        return self._begin, "start of the chain"

    @staticmethod
    def _outcome(future: Future, job: Job, tries: int, here: bool) -> Done | None:
        """What a worker says; None: once more."""
        try:
            done = future.result()
            if done is None and here:
                raise KeyboardInterrupt
            why = "interrupted again and again"
        except Exception as error:
            if here and interrupted(error):
                raise KeyboardInterrupt from None
            if not died(error):
                why = f"{type(error).__name__}: {error}".splitlines()[0]
                return Done(Record(job.field, job.id, why, times=(0.0, 0.0, tries)), None)
            done, why = None, f"its worker died {tries} times ({type(error).__name__})"
        if done is not None:
            record = done.record
            return done._replace(record=record._replace(times=(*record.times[:2], tries)))
        return None if tries < _TRIES else Done(Record(job.field, job.id, why, times=(0.0, 0.0, tries)), None)

    def _settle(self, k: int, done: Done) -> None:
        """Write and enter a field, and let others go on."""
        stem = f"{k:06d}"
        files = {f"plans/{stem}.fits": done.plan, f"targets/{stem}.ecsv": done.targets}
        record = self._ledger.enter(done.record, {name: content for name, content in files.items() if content})
        if done.end is not None and self._order.follows(k):
            self._ends[k] = done.end, f"end of field {record.id}"
        self._pass(k, record)

    def _pass(self, k: int, record: Record) -> None:
        """Field k is behind us."""
        taken = np.array(record.taken, np.int64)
        self._left[taken[~self._repeated[taken]]] -= 1
        before = self._order.before[k]
        if record.files and before is not None:
            self._ends.pop(before, None)
        self._order.done(k)
