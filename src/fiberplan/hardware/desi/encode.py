"""From a plan to DESI's move tables: `moves` of each positioner, made into `rows`, and the bytes of all of them."""

import csv
import io
from typing import NamedTuple

import numpy as np

from fiberplan.errors import PlanError
from fiberplan.hardware.desi.moves import planned_moves
from fiberplan.hardware.desi.rows import Row, rows_of
from fiberplan.plan import Plan


class Table(NamedTuple):
    """The move table of one positioner."""

    posid: str
    canid: int
    busid: str
    linear: bool  #: whether phi has a linear motor
    rows: tuple[Row, ...]


def tables(plan: Plan, linear: dict[str, bool], buses: dict[str, tuple[int, str]], tail: bool) -> list[Table]:
    """The move tables of all positioners that turn.

    Raises:
        PlanError: a positioner without a device id, or one that turns nearer to a hard stop than its range by the tail.
    """
    plane, made = plan.problem.plane, []
    for i in np.flatnonzero(plane.online).tolist():
        if not np.ptp(plan.trajectory.knots(i)[1], axis=0).any():
            continue
        posid = plane.aliases[i] if plane.aliases else ""
        if not posid:
            raise PlanError(f"positioner '{plane.ids[i]}' has no device id (M01234), by which controllers know it")
        is_linear = linear.get(posid, False)
        moves, rest = planned_moves(plan, i, is_linear)
        digits = "".join(letter for letter in posid if letter.isdigit())
        canid, busid = buses.get(posid, (int(digits or 0), ""))
        rows = tuple(rows_of(moves, is_linear, tail, rest))
        if rows:  # none where it turns aside by less than a row, and back
            made.append(Table(posid, canid, busid, is_linear, rows))
    return made


def as_csv(made: list[Table]) -> bytes:
    """The tables as the instrument's archive keeps them: a line a positioner, a list in each cell of its rows."""
    text = io.StringIO()
    zeno = any(table.linear for table in made)
    names = ["busid", "canid", "motor_steps_P", "motor_steps_T", "move_time", "nrows", "posid", "postpause", "required"]
    names += ["speed_mode_P", "speed_mode_T", "total_time", "failed_to_send", *(["zeno"] if zeno else [])]
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(names)
    for table in made:
        rows = table.rows
        times, pauses = [row.time for row in rows], [row.pause for row in rows]
        total = sum(times) + sum(pauses) / 1000
        steps, modes = ([[getattr(row, name)[axis] for row in rows] for axis in (1, 0)] for name in ("steps", "mode"))
        cells = [table.busid, table.canid, *steps, times, len(rows), table.posid, pauses, True, *modes, total, False]
        lines.writerow([*cells, *(["P" if table.linear else ""] if zeno else [])])
    return text.getvalue().encode()
