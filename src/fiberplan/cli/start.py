"""Options of several commands that say where everyone stands, who cannot move, and how much room to leave."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from fiberplan.errors import FiberplanError, ProblemError

if TYPE_CHECKING:
    import numpy as np

    from fiberplan.focal_plane import FocalPlane
    from fiberplan.problem import Problem, State

StartTime = Annotated[float | None, typer.Option(metavar="S", help="Moment of --start's motion to begin at.", min=0.0)]
Offline = Annotated[
    list[str] | None,
    typer.Option(metavar="ID,ID|FILE", help="Robots that cannot move. Repeatable."),
]
Margin = Annotated[
    float | None,
    typer.Option(metavar="MM", help="Clearance to keep at all times (mm); if not given, as recommended.", min=0.0),
]
Jitter = Annotated[float, typer.Option(metavar="S", help="Each clock may be off by this (s).", min=0.0)]
PositionError = Annotated[float, typer.Option(metavar="MM", help="Each arm may be off by this (mm).", min=0.0)]


_TABLES = (".ecsv", ".fits", ".fit")  # endings of files that are no text of names
_FILES = (*_TABLES, ".csv", ".txt", ".dat")  # endings of what is meant as a file


class Room(NamedTuple):
    """How much room arms leave to each other."""

    margin: float  #: [mm]
    error: "np.ndarray"  #: (n,) position error, what jitter adds to it included [mm]
    notes: tuple[str, ...]


def switched_off(plane: "FocalPlane", given: Sequence[str]) -> tuple["FocalPlane", tuple[str, ...]]:
    """The focal plane in which the robots that `given` names cannot move, and a note that says so.

    Raises:
        FiberplanError: a name that is no positioner's, nor of a file; it is named.
    """
    who = sorted({plane.names[name] for text in given for name in _names(plane, text)})
    if not who:
        return plane, ()
    online = plane.online.copy()
    online[who] = False
    return plane.replace(online=online), ("offline, as --offline says: " + ", ".join(plane.ids[i] for i in who),)


def _names(plane: "FocalPlane", text: str) -> list[str]:
    """What one --offline names: robots, or those that a file lists; of a table that says who is online, the others."""
    import numpy as np

    from fiberplan.tables.table_reader import read_table, read_text
    from fiberplan.tables.wording import nearest

    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise FiberplanError(f"--offline '{text}': it names nobody")
    path = Path(text)
    unknown = [name for name in names if name not in plane.names]
    if unknown and not path.is_file():
        if path.suffix.lower() in _FILES:
            raise FiberplanError(f"--offline {text}: no such file")
        raise FiberplanError(
            f"--offline {text}: {plane.name} has no positioner '{unknown[0]}'{nearest(unknown[0], plane.names)}"
        )
    if not unknown:
        return names
    lines = [] if path.suffix.lower() in _TABLES else read_text(path, FiberplanError)
    heading = lines[0].lower().replace(" ", "").split(",") if lines else []
    if path.suffix.lower() in _TABLES or (len(heading) > 1 and "positioner" in heading):
        table = read_table(path, FiberplanError)
        table.require("positioner")
        able = table.flags("online") if "online" in table else np.zeros(len(table), bool)
        for row, name in enumerate(table.names("positioner")):
            if name not in plane.names:
                raise table.fail(row, f"{plane.name} has no positioner '{name}'{nearest(name, plane.names)}")
        return [name for name, moves in zip(table.names("positioner"), able, strict=True) if not moves]
    found = []
    for number, line in enumerate(lines, 1):
        for name in line.partition("#")[0].replace(",", " ").split():
            if name not in plane.names and not (number == 1 and name.lower() == "positioner"):
                close = nearest(name, plane.names)
                raise FiberplanError(f"{path}: line {number}: {plane.name} has no positioner '{name}'{close}")
            found += [name] if name in plane.names else []
    return found


def begun(plane: "FocalPlane", start: Path | None, at: float | None) -> "State | None":
    """The state that --start and --start-time say; None if there is no --start.

    Raises:
        FiberplanError: a moment of no motion, or what `State.read` refuses.
    """
    from fiberplan.problem import State

    if start is None and at is not None:
        raise FiberplanError(f"--start-time {at:g}: of which motion? --start names its file")
    return None if start is None else State.read(start, plane, at=at)


def room(plane: "FocalPlane", margin: float | None, jitter: float, position_error: float) -> Room:
    """Margin and position errors to plan with: a clock that is off counts as an arm that is."""
    import numpy as np

    from fiberplan.arrays import LARGEST
    from fiberplan.focal_plane.drift import drift

    notes = []
    if margin is None:
        margin = plane.recommended_margin or 0.0
        if plane.recommended_margin is not None:
            notes.append(f"margin {margin:g} mm, as is recommended for {plane.name}; --margin takes another")
    error = np.full(plane.n, position_error)
    if jitter:
        error = error + drift(plane, jitter)
        if not (error <= LARGEST).all():
            raise ProblemError(f"--jitter {jitter:g}: arms could be off by more than {LARGEST:g} mm by then")
        notes.append(
            f"clocks that are off by {jitter:g} s are planned for as arms that are off by up to "
            f"{error.max() - position_error:.3f} mm more"
        )
    return Room(margin, error, tuple(notes))


def refuse_overlaps(problem: "Problem") -> None:
    """Refuse a start in which two overlap, neither of whose places is a guess: that is for someone to decide.

    Raises:
        ProblemError: it names the pairs, and what parts them.
    """
    plane, state, error = problem.plane, problem.state, problem.position_error
    assert error is not None  # set on construction
    found = []
    for a, b, gap in problem.opening:
        guessed = state is not None and any(i >= 0 and state.unknown[i] for i in (a, b))
        true = gap + float(error[a]) + (float(error[b]) if b >= 0 else 0.0)
        if true < 0 and not guessed:
            found.append((f"{plane.label(a)} and {plane.label(b)} overlap (clearance {true:.3f} mm)", a, b))
    if found:
        more = f"; and {len(found) - 4} more" if len(found) > 4 else ""
        text = "; ".join(each[0] for each in found[:4]) + more
        named = tuple(sorted({i for _, a, b in found for i in (a, b) if i >= 0}))
        raise ProblemError(f"start: {text}; `fiberplan separate` parts them, with proof", named)
