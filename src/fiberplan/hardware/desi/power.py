"""Tables of which no power supply has too many moving at once: those that have time wait before their first row.

The instrument's own scheduler fills a stage so that half of the units of a supply that move do so at once, on average;
here it is at any moment, of what the rows make the motors do, tails included.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from fiberplan.arrays import number
from fiberplan.errors import PlanError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.drift import motion_bounds
from fiberplan.hardware.desi.encode import Table
from fiberplan.hardware.desi.rows import Move, rows_of
from fiberplan.motion import Executed
from fiberplan.plan import Plan
from fiberplan.shaping import Staggered, staggered


class Powered(NamedTuple):
    """Tables, and what waiting does to the supplies."""

    tables: list[Table]
    spread: Staggered


def powered(
    plan: Plan,
    plane: FocalPlane,
    made: list[Table],
    executed: Executed,
    supplies: Mapping[str, str],
    share: float,
    margin: float,
) -> Powered:
    """The tables with pauses before their first rows, so that at most a share of each supply's moving units moves.

    Args:
        plan: that they were made of.
        plane: with the speeds that motors have.
        made: the tables.
        executed: what they make the motors do.
        supplies: by device id.
        share: that may move at once.
        margin: clearance to keep [mm].

    Raises:
        PlanError: a positioner that moves and whose supply is not known, a share that makes no sense, or one that
            cannot be kept.
    """
    share = number(share, "", "power", PlanError)
    if not 0.0 < share <= 1.0:
        raise PlanError(f"power must be a share above 0 and at most 1, got {share:g}")
    for table in made:
        if table.posid not in supplies:
            raise PlanError(f"{table.posid} moves, and no calibration names its bus: its power supply is not known")
    assert plan.problem.position_error is not None  # set on construction
    spread = staggered(
        executed.trajectory,
        plane,
        _labels(plane, made, supplies),
        share,
        margin=margin,
        position_error=plan.problem.position_error + motion_bounds(plane, executed.joint_error),
        opening=plan.problem.near_start == "open" or plan.problem.needs_opening,
        hurry=False,  # rows have the speeds that motors have
    )
    if spread.over:
        name = max(spread.over, key=lambda name: spread.after[name])
        raise PlanError(
            f"power: of the units of {name} that move {spread.after[name]:.3f} would move at once, "
            f"{spread.allowed[name]:.3f} is asked for; {spread.before[name]:.3f} without waiting"
        )
    waits = dict(zip(plane.aliases, np.round(1000 * spread.delay).astype(int).tolist(), strict=True))
    return Powered([_waiting(table, waits[table.posid]) for table in made], spread)


def _labels(plane: FocalPlane, made: list[Table], supplies: Mapping[str, str]) -> list[str]:
    """(n,) supplies; that of one without a table does not matter."""
    moving = {table.posid for table in made}
    first = supplies[made[0].posid]
    return [supplies[alias] if alias in moving else first for alias in plane.aliases or ("",) * plane.n]


def _waiting(table: Table, wait: int) -> Table:
    """The table that begins so much later [ms]; a table that begins with a pause has a row for it."""
    if not wait:
        return table
    rows = table.rows
    if any(rows[0].steps):
        rows = (*rows_of([Move((0.0, 0.0))], table.linear, tail=False), *rows)
    return table._replace(rows=(rows[0]._replace(pause=rows[0].pause + wait), *rows[1:]))
