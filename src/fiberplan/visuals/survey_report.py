"""One self-contained HTML page of a survey: maps, what was observed, and why the rest was not."""

import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from fiberplan.visuals import report_page

_DPI = 110
_DOT = 9000.0  # [points^2] shared by the dots of a map
_MOST = 500  # rows of a table on the page; files have all


class Report(NamedTuple):
    """What the page says."""

    title: str
    verdict: str
    good: bool
    centres: np.ndarray | None  #: (k, 2) right ascension and declination of the fields [deg]; None: not on the sky
    share: np.ndarray  #: (k,) part of what was offered that was observed; NaN: nothing was
    base: np.ndarray  #: (n, 2) of the positioners [mm]
    used: np.ndarray  #: (n,) fields in which each had a target
    makespan: np.ndarray  #: (k,) [s]
    lower_bound: np.ndarray  #: (k,) [s]
    tables: Sequence[tuple[str, Sequence[str], Sequence[Sequence[Any]]]]  #: heading, names of columns, rows
    notes: Sequence[str]


def survey_report(report: Report, path: str | os.PathLike) -> None:
    """Write the page.

    Raises:
        FiberplanError: it cannot be written.
    """
    parts = [report_page.picture(_maps(report), "maps of fields and positioners, and the time of each move")]
    for heading, heads, rows in report.tables:
        if rows:
            parts.append(f"<h2>{report_page.text(heading)}</h2>{report_page.table(heads, rows[:_MOST])}")
            if len(rows) > _MOST:
                parts.append(f"<p><small>and {len(rows) - _MOST} more, in the tables beside this page</small></p>")
    if report.notes:
        parts.append("<h2>Assumed</h2><ul>")
        parts += [f"<li>{report_page.text(note)}</li>" for note in report.notes]
        parts.append("</ul>")
    report_page.write_page(report.title, report.verdict, report.good, parts, path)


def _maps(report: Report) -> bytes:
    """Where fields are and what was observed of them; who had how many targets; how long moves took."""
    from matplotlib.colors import LinearSegmentedColormap

    from fiberplan.visuals import style
    from fiberplan.visuals.canvas import blank, keyed, rendered, titled

    ramp = LinearSegmentedColormap.from_list("ramp", [colour.light for colour in style.RAMP])
    figure, axes = blank((11.0, 3.6), columns=2 + (report.centres is not None))

    def dots(ax: Any, points: np.ndarray, values: np.ndarray, words: str) -> None:
        drawn = ax.scatter(*points.T, c=values, cmap=ramp, s=min(40.0, _DOT / len(points)), linewidths=0)
        figure.colorbar(drawn, ax=ax, label=words)

    *sky, plane, times = axes
    if report.centres is not None:
        dots(sky[0], report.centres, report.share, "observed of what was offered")
        titled(sky[0], "Fields", "right ascension [deg]", "declination [deg]")
        sky[0].invert_xaxis()
    dots(plane, report.base, report.used, "fields with a target")
    titled(plane, "Positioners", "x [mm]", "y [mm]")
    plane.set_aspect("equal")
    times.plot(report.makespan, label="makespan")
    times.plot(report.lower_bound, label="kinematic bound", linewidth=0.8)
    titled(times, "Moves", "field", "time [s]")
    keyed(times, loc="upper right", bbox_to_anchor=None)
    return rendered(figure, "png", _DPI)
