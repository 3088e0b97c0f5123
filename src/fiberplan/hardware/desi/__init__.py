"""DESI: hardware move tables, in which each axis turns by whole steps of its motor, row by row.

A file is a table with a line a positioner, as the instrument archives it. Facts from the public code and tables of the
instrument's team; not verified on hardware.

- `encode`: from a plan to the bytes of its tables; `moves`: what its path wants of each row
- `rows`: cruise and creep in whole steps, jogs of linear phi motors, the tail that takes out backlash
- `scheduling`: other rows for those who would meet, chosen among `ways`; `meetings`: who meets whom
- `power`: waits with which no power supply has too many moving at once
- `endings`: goals at which tables can end
- `decode`: from rows to the motion they cause; `turns`: what a motor makes of its steps, ramps included
- `calibration`: buses, power supplies and linear motors, from a focal-plane file
"""

import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.arrays import not_negative
from fiberplan.certificates import Certificate, verify
from fiberplan.errors import PlanError, TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.hardware.certified import ALLOWANCE, hand_over, refuse_empty
from fiberplan.hardware.controller import CONTROLLERS, HandedOver, known_to
from fiberplan.hardware.desi.calibration import motors_of
from fiberplan.hardware.desi.decode import COLUMNS, decode
from fiberplan.hardware.desi.encode import as_csv, tables
from fiberplan.hardware.desi.endings import with_goals
from fiberplan.hardware.desi.power import powered
from fiberplan.hardware.desi.scheduling import scheduled
from fiberplan.hardware.desi.ways import seconds
from fiberplan.motion import Executed
from fiberplan.plan import Plan
from fiberplan.problem import State
from fiberplan.tables.contents import read_whole

__all__ = ["accepts", "motors_of", "prove", "read", "with_goals", "with_limits", "write"]

CRUISE = 59_400 / (46 / 14 + 1) ** 4  #: of rotary motors [deg/s]
PART = 0.8  #: of cruise speed, at which there is room for most rows

MOST = "of a supply's moving units, at once"  #: fact of tables that wait for power: largest shares
LEAST = "seconds longer for power, at least"  #: likewise: even if nobody were in the way of anybody

FASTEST = 180_000 / (46 / 14 + 1) ** 4  #: of all motors: linear phi, 30,000 rpm over the gear [deg/s]


def write(
    plan: Plan,
    path: str | os.PathLike,
    *,
    calibration: str | os.PathLike | None = None,
    tail: bool = True,
    allowance: float = ALLOWANCE,
    power: float | None = None,
) -> HandedOver:
    """Write a plan's motion as move tables, proven as they are read back.

    Rows follow the plan's path; where that brings a pair too near, one of them gets to its end another way, or later.

    Args:
        plan: to be executed; positioners that do not turn have no table.
        path: of the file.
        calibration: a ``fp-*.ecsv``, or its folder: buses, power supplies, and who has a linear phi motor; unless
            given, no bus is named and nobody has.
        tail: 3 deg back and 3 deg forth in creep at the end of each axis that turns, which takes out backlash.
        allowance: the executed motion may keep this much less than the plan's margin [mm].
        power: share of the units of a power supply, of those that move, that may move at once (the instrument's team
            takes 0.5); some wait for it.

    Returns:
        the proof; tables, rows and the time that the tables take longer than the plan [s] as facts.

    Raises:
        PlanError: a positioner without device id, or of unknown supply where `power` is given, a share that cannot be
            kept, a motion that is not proven, a file that cannot be written.
        InstrumentError: a calibration that cannot be used.
    """
    motors, file = motors_of(calibration), Path(path)
    as_planned = tables(plan, dict.fromkeys(motors.linear, True), motors.buses, tail)
    refuse_empty(as_planned, file, "move tables name a positioner at least")
    margin = max(0.0, plan.problem.margin - not_negative(allowance, "mm", "allowance", PlanError))
    made = scheduled(plan, as_planned, tail, margin)
    plane = plan.problem.plane

    def decoded(written: bytes, state: State) -> Executed:
        return decode(file, written, plane, state, motors.linear)

    others = sum(a.rows != b.rows for a, b in zip(as_planned, made, strict=True))
    shares = {}
    if power is not None:
        does, motors_plane = decoded(as_csv(made), plan.state_at(0.0)), _as_fast_as_motors(plane)
        made, spread = powered(plan, motors_plane, made, does, motors.supplies, power, margin)
        shares = {
            "wait for power": int(np.count_nonzero(spread.delay)),
            "seconds longer for power": round(spread.longer, 3),
            LEAST: round(spread.at_least, 3),
            MOST: {name: round(share, 3) for name, share in spread.after.items()},
            "the same without waiting": {name: round(share, 3) for name, share in spread.before.items()},
        }
    counts = [len(table.rows) for table in made]
    longest = max(seconds(table.rows) for table in made)
    facts = {
        "tables": len(made),
        "rows": sum(counts),
        "rows of one, at most": max(counts),
        "other ways than planned": others,
        "seconds longer than the plan": round(longest - plan.makespan, 3),
        **shares,
    }

    return hand_over(plan, path, as_csv(made), decoded, allowance, facts, prove)


def read(
    path: str | os.PathLike,
    plane: FocalPlane,
    state: State | None = None,
    *,
    linear: Iterable[str] = (),
) -> Executed:
    """The motion that a file of move tables causes.

    Args:
        path: of the file.
        plane: whose positioners it moves, by device id.
        state: where they stand before; folded unless given. Positioners without a table stay there.
        linear: device ids of those whose phi has a linear motor, besides those that the file names (column zeno).

    Raises:
        TrajectoryError: a column, cell or positioner that cannot be used; one line that names it.
    """
    path = Path(path)
    return decode(path, read_whole(path, TrajectoryError), plane, known_to(plane, state), frozenset(linear))


def with_limits(plane: FocalPlane) -> FocalPlane:
    """The same at a part of cruise speed: plan with it."""
    return plane.replace(max_speed=np.minimum(plane.max_speed, PART * np.radians(CRUISE)))


def prove(plane: FocalPlane, executed: Executed, margin: float, **options: Any) -> Certificate:
    """Proof of an executed motion, as `verify`: rows say how far axes turn, not how fast, so no speed is too large."""
    return verify(_as_fast_as_motors(plane), executed, margin, **options)


def _as_fast_as_motors(plane: FocalPlane) -> FocalPlane:
    return plane.replace(max_speed=np.full((plane.n, 2), np.radians(FASTEST)))


def accepts(path: Path, content: bytes) -> bool:
    """Whether a file is a table of moves."""
    heading = content[:4096].split(b"\n", 1)[0].decode("utf-8", "replace")
    return set(COLUMNS) <= {name.strip() for name in heading.split(",")}


CONTROLLERS.register("desi")(sys.modules[__name__])
