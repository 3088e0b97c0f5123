"""From targets of PFS' cobras to the motion they cause, as far as it is known: where everyone is between iterations.

Within an iteration each joint turns from where it was to where it is wanted, at a speed of its own. The trajectory has
the nominal speeds; `prove` leaves all speeds open.
"""

import dataclasses
import itertools
from pathlib import Path

import numpy as np

from fiberplan.certificates import Certificate, verify
from fiberplan.certificates.any_speed import contacts_at_any_speed
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Executed, Trajectory
from fiberplan.problem import State
from fiberplan.tables.table_reader import read_table
from fiberplan.tables.wording import nearest

COLUMNS = ("iteration", "cobra_id", "theta", "phi")
_ANY = ("each iteration begins when all have come to rest; in it every joint may be anywhere within its turn",)
_SHOWN = 12


def decode(path: Path, content: bytes, plane: FocalPlane, state: State) -> Executed:
    """The motion that a table of targets causes, from the state before.

    Raises:
        TrajectoryError: no such table, or a cobra, iteration or angle that cannot be used; row and value are named.
    """
    table = read_table(path, TrajectoryError, content, form=".csv")
    table.require(*COLUMNS)
    names, numbers = table.texts("cobra_id"), table.numbers("iteration")
    angles = np.stack([table.numbers(name, "rad", "deg") for name in ("theta", "phi")], axis=1)
    wanted: dict[tuple[int, int], np.ndarray] = {}
    for row, (name, number) in enumerate(zip(names, numbers.tolist(), strict=True)):
        if name not in plane.names:
            raise table.fail(row, f"{plane.name} has no positioner '{name}'{nearest(name, plane.names)}")
        if number != int(number) or number < 0:
            raise table.fail(row, f"iteration is {number:g}, expected a whole number")
        key = int(number), plane.names[name]
        if key in wanted:
            raise table.fail(row, f"cobra '{name}' is given twice in iteration {number:g}")
        wanted[key] = angles[row]
    at, moved = np.array(state.angles), np.zeros(plane.n, bool)
    places, times = [at.copy()], [0.0]
    for number in sorted({number for number, _ in wanted}):
        for (when, i), angle in wanted.items():
            if when == number:
                at[i], moved[i] = angle, True
        longest = float((np.abs(at - places[-1]) / plane.max_speed).max())
        if longest > 0:
            places.append(at.copy())
            times.append(times[-1] + longest * (1 + 1e-9))
    guessed = [plane.ids[i] for i in np.flatnonzero(state.unknown)]
    more = f" and {len(guessed) - _SHOWN} more" if len(guessed) > _SHOWN else ""
    assumed = [f"{', '.join(guessed[:_SHOWN])}{more} are taken to stand folded at first"] if guessed else []
    return Executed(
        Trajectory.from_samples(np.array(times), np.array(places)),
        joint_error=np.zeros((plane.n, 2)),
        clock_error=0.0,
        assumptions=(*_ANY, *assumed),
        online=moved & plane.online & state.online,
    )


def prove(
    plane: FocalPlane,
    executed: Executed,
    margin: float,
    position_error: float | np.ndarray = 0.0,
    opening: bool = False,
) -> Certificate:
    """Proof of what `decode` returns, whatever the speeds: as `verify`, and each iteration for any speeds besides."""
    proof = verify(plane, executed, margin, position_error=position_error, opening=opening)
    error = np.broadcast_to(np.asarray(position_error, float), (plane.n,))
    times, _ = executed.trajectory.knots(0)
    assert executed.online is not None  # set on construction
    judged = plane.replace(online=plane.online & executed.online)
    opened = {pair.pair for pair in proof.opening}
    found = {contact.pair: contact for contact in proof.contacts}
    for begin, end in itertools.pairwise(times):
        ends = executed.trajectory.at(begin), executed.trajectory.at(end)
        for contact in contacts_at_any_speed(judged, *ends, margin, error, float(begin)):
            if contact.pair not in opened:
                found.setdefault(contact.pair, contact)
    return dataclasses.replace(proof, contacts=tuple(sorted(found.values(), key=lambda c: (c.time, c.pair))))
