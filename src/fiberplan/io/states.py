"""Readers of configurations: the joint angles of all positioners, from a table or from the end of a plan.

A table has columns ``positioner``, ``alpha`` and ``beta`` (degrees unless the columns say otherwise), one row per
positioner. Angles are commanded ones.
"""

import os
from pathlib import Path

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.io.plan_file import is_plan, plan_from_bytes
from fiberplan.tables.contents import read_whole
from fiberplan.tables.table_reader import nearest, read_table

_SHOWN = 4  # how many missing positioners an error message lists


def read_configuration(path: str | os.PathLike, plane: FocalPlane) -> np.ndarray:
    """Commanded angles (n, 2) [rad] of every positioner of `plane`; of a plan file, those at its end.

    Raises:
        ProblemError: a file, column, unit or value that cannot be used, a positioner that `plane` does not have, one
            given twice, or one that is missing; one line that names it.
        PlanError: a plan file that is damaged or of a newer format.
    """
    path = Path(path)
    content = read_whole(path, ProblemError)
    if is_plan(content):
        plan = plan_from_bytes(content, path)
        known = plan.problem.plane.ids
        where, angles = tuple(f"row {k + 1}" for k in range(len(known))), plan.trajectory.end
    else:
        table = read_table(path, ProblemError, content)
        table.require("positioner", "alpha", "beta")
        known, where = table.texts("positioner"), table.rows
        angles = np.stack([table.numbers(name, "rad", "deg") for name in ("alpha", "beta")], axis=1)
    return _arrange(plane, str(path), known, where, angles)


def _arrange(
    plane: FocalPlane, source: str, known: tuple[str, ...], where: tuple[str, ...], angles: np.ndarray
) -> np.ndarray:
    """Rows of a file in the focal plane's order."""
    out = np.full((plane.n, 2), np.nan)
    rows: dict[str, str] = {}
    for id_, row, pose in zip(known, where, angles, strict=True):
        if id_ not in plane.names:
            raise ProblemError(f"{source}: {row}: {plane.name} has no positioner '{id_}'{nearest(id_, plane.names)}")
        if (first := rows.setdefault(id_, row)) != row:
            raise ProblemError(f"{source}: {row}: positioner '{id_}' was already given in {first}")
        out[plane.names[id_]] = pose
    missing = [i for i in range(plane.n) if np.isnan(out[i, 0])]
    if missing:
        listed = ", ".join(f"'{plane.ids[i]}'" for i in missing[:_SHOWN])
        more = f" and {len(missing) - _SHOWN} more" if len(missing) > _SHOWN else ""
        raise ProblemError(f"{source}: no angles for positioner {listed}{more}", tuple(missing))
    return read_only(out)
