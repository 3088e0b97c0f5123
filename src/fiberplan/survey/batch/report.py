"""A survey as one HTML page, from its tables."""

import os
from collections.abc import Iterable

import numpy as np
from astropy.table import Table

from fiberplan.survey.batch.survey import Survey
from fiberplan.survey.reasons import Why
from fiberplan.visuals.survey_report import Report, survey_report

_SHOWN = 20  # rows of a long table


def write_report(survey: Survey, path: str | os.PathLike) -> None:
    """Write the page.

    Raises:
        FiberplanError: it cannot be written.
    """
    tables, fields = survey.tables(), survey.fields
    share = [_share(record.taken, record.candidates) for record in survey.records]
    centres = np.degrees(np.stack([fields.ra, fields.dec], axis=1)) if fields.on_sky else None
    moves = tables["moves"][:_SHOWN]
    sums: dict[str, int] = {}
    for row in tables["reasons"]:
        sums[str(row["reason"])] = sums.get(str(row["reason"]), 0) + int(row["targets"])
    why = [(Why[name].value, count) for name, count in sorted(sums.items(), key=lambda item: -item[1])]
    failed = [(record.id, record.why) for record in survey.failed]
    page = Report(
        title=f"Survey of {len(fields)} fields with {survey.plane.name}",
        verdict=str(survey),
        good=not failed,
        centres=centres,
        share=np.array(share),
        base=survey.plane.base,
        used=np.array(tables["positioners"]["fields"]),
        makespan=np.array(tables["fields"]["makespan"]),
        lower_bound=np.array(tables["fields"]["lower_bound"]),
        tables=(
            ("Fields that failed", ("field", "why"), failed),
            ("Completeness by class and tier", *_rows(tables["completeness"])),
            ("Why offered targets were not allocated, all fields together", ("reason", "targets"), why),
            ("Slowest moves", *_rows(moves)),
            ("Fields", *_rows(tables["fields"])),
        ),
        notes=survey.assumptions,
    )
    survey_report(page, path)


def _share(taken: tuple[int, ...], candidates: Iterable[tuple[str, int]]) -> float:
    offered = sum(count for _, count in candidates)
    return len(taken) / offered if offered else np.nan


def _rows(table: Table) -> tuple[tuple[str, ...], list[tuple]]:
    heads = tuple(f"{name} [{table[name].unit}]" if table[name].unit else name for name in table.colnames)
    return heads, [tuple(value.item() for value in row) for row in table.iterrows()]
