"""A plan's motion in the formats of other programs."""

import io
import os
from collections.abc import Callable, Mapping

import numpy as np
from astropy import units
from astropy.table import QTable

from fiberplan import __version__
from fiberplan.files import write_whole
from fiberplan.plan import Plan


def write_ecsv(plan: Plan, path: str | os.PathLike) -> None:
    """Write the motion as one ECSV table, a row a knot; between knots both joints turn evenly.

    Columns: positioner (id), time [s], alpha and beta [deg], commanded. Rows run positioner by positioner in the
    instrument's order, and by time within one. The table's meta data say what was planned, and how.

    Raises:
        PlanError: the file cannot be written; what was there before is kept.
    """
    motion, plane = plan.trajectory, plan.problem.plane
    owner = np.repeat(np.array(plane.ids), np.diff(motion.offsets))
    columns = {
        "positioner": owner,
        "time": motion.times * units.s,
        "alpha": np.degrees(motion.angles[:, 0]) * units.deg,
        "beta": np.degrees(motion.angles[:, 1]) * units.deg,
    }
    meta = {
        "instrument": plane.name,
        "planner": plan.planner,
        "seed": int(plan.seed),
        "margin_mm": float(plan.problem.margin),
        "makespan_s": float(plan.makespan),
        "certified": bool(plan.certificate.ok),
        "lost": [plane.ids[int(i)] for i in plan.lost],
        "fiberplan": __version__,
    }
    text = io.StringIO()
    QTable(columns, meta=meta).write(text, format="ascii.ecsv")
    write_whole(path, text.getvalue().encode())


FORMATS: Mapping[str, Callable[[Plan, str | os.PathLike], None]] = {"ecsv": write_ecsv}
