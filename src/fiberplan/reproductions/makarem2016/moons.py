"""The cases of the MOONS prototype, beside what was published for them.

They are read where they are, and not shipped: from the folder that the environment variable FIBERPLAN_DATA names, or
else from ``../shared/data``.
"""

import csv
import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from fiberplan.focal_plane import FocalPlane
from fiberplan.problem import Problem, Targets
from fiberplan.reproductions.makarem2016.runs import MODES, Run, planned
from fiberplan.reproductions.rows import Row, value

SIZES = (10, 30, 60, 120, 250, 500, 1006)
FIELDS = (1, 2, 3)
COLUMNS = {"alone": "dnf", "relief": "dnf_fsm"}


class Case(NamedTuple):
    """One field on one array."""

    size: int  #: the class
    field: int
    targets: int
    runs: dict[str, Run]  #: by mode
    published: dict[str, tuple[int, float]]  #: by mode: arrived, time to compute [s]


def folder() -> Path:
    """Where the cases are looked for."""
    return Path(os.environ.get("FIBERPLAN_DATA", "../shared/data")) / "moons"


def cases() -> list[Case]:
    """All cases, planned both ways; none where the data are not at hand."""
    where = folder()
    results = where / "published_results.csv"
    if not results.is_file():
        return []
    with results.open(encoding="utf-8") as file:
        published = {(int(row["config"]), int(row["n_positioners"])): row for row in csv.DictReader(file)}
    found = []
    for size in SIZES:
        plane = FocalPlane.load(where / str(size) / "positioners.cfg")
        for field in FIELDS:
            targets = Targets.read(where / str(size) / f"targets_{field}.txt")
            problem = Problem.from_targets(plane, targets, conflicts="drop")
            row = published[field, len(targets)]
            theirs = {
                mode: (int(row[f"{name}_arrived"]), float(row[f"{name}_seconds"])) for mode, name in COLUMNS.items()
            }
            runs = {mode: planned(problem, mode)[1] for mode in MODES}
            found.append(Case(size, field, len(targets), runs, theirs))
    return found


def rows(found: list[Case]) -> Iterator[Row]:
    """Arrivals of every case; contacts and the longest time to compute by class."""
    if not found:
        yield value(f"MOONS cases: skipped, no data in {folder()} (set FIBERPLAN_DATA)", None, None, 0)
    for mode in MODES:
        for case in found:
            what = f"MOONS {case.size}, targets {case.field}, {mode}"
            yield value(
                f"{what}: arrived", float(case.published[mode][0]), float(case.runs[mode].arrived), case.targets
            )
    for size in sorted({case.size for case in found}):
        some = [case for case in found if case.size == size]
        unsafe = sum(run.contacts for case in some for run in case.runs.values())
        yield value(f"MOONS {size}: contacts in all runs", None, float(unsafe), 2 * len(some))
        for mode in MODES:
            paper = max(case.published[mode][1] for case in some)
            ours = max(case.runs[mode].cpu for case in some)
            yield value(f"MOONS {size}, {mode}: longest time to compute [s]", paper, ours, len(some))
            motion = max(case.runs[mode].motion for case in some)
            yield value(f"MOONS {size}, {mode}: longest motion [s]", None, motion, len(some))
