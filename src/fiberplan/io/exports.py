"""A plan's motion in the formats of other programs."""

import io
import os
from collections.abc import Callable

import numpy as np

from fiberplan.motion.moves import moves, start_stops
from fiberplan.plan import Plan
from fiberplan.plan.summary import about
from fiberplan.registry import Registry
from fiberplan.tables.atomic import write_whole

EXPORTS: Registry[Callable[[Plan, str | os.PathLike], None]] = Registry("export", "fiberplan.exports")


@EXPORTS.register("ecsv")
def write_ecsv(plan: Plan, path: str | os.PathLike) -> None:
    """Write the motion as one ECSV table, a row a knot; between knots both joints turn evenly.

    Columns: positioner (id), time [s], alpha and beta [deg], commanded. Rows run positioner by positioner in the
    instrument's order, and by time within one. The table's meta data say what was planned, and how.

    Raises:
        PlanError: the file cannot be written; what was there before is kept.
    """
    table = plan.trajectory.to_table(plan.problem.plane.ids)
    table.meta.update(about(plan))
    text = io.StringIO()
    table.write(text, format="ascii.ecsv")
    write_whole(path, text.getvalue().encode())


@EXPORTS.register("motions")
def write_motions(plan: Plan, path: str | os.PathLike) -> None:
    """Write the motion as a list of moves, hardware-neutral, in ECSV: a row a move, none for rests.

    Columns: positioner (id), segment (counted from 1), start and duration [s], alpha_speed and beta_speed [deg/s],
    stops (start-stops of that positioner in all, by the rule of Sabater2018).

    Raises:
        PlanError: the file cannot be written; what was there before is kept.
    """
    from astropy import units
    from astropy.table import QTable

    plane, listed = plan.problem.plane, moves(plan.trajectory)
    stops, speeds = start_stops(plan.trajectory), np.array([move.speed for move in listed]).reshape(-1, 2)
    columns = {
        "positioner": np.array([plane.ids[move.positioner] for move in listed], str),
        "segment": np.array([move.segment for move in listed], np.int64),
        "start": np.array([move.start for move in listed], float) * units.s,
        "duration": np.array([move.duration for move in listed], float) * units.s,
        "alpha_speed": np.degrees(speeds[:, 0]) * units.deg / units.s,
        "beta_speed": np.degrees(speeds[:, 1]) * units.deg / units.s,
        "stops": np.array([stops[move.positioner] for move in listed], np.int64),
    }
    text = io.StringIO()
    QTable(columns, meta=about(plan)).write(text, format="ascii.ecsv")
    write_whole(path, text.getvalue().encode())
