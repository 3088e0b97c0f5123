"""Where everyone stands, who can move, and how well that is known."""

import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import Frozen, read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.registry import io_function


@dataclass(frozen=True, eq=False)
class State(Frozen):
    """The state of all positioners of a focal plane.

    Raises:
        ProblemError: shapes that do not fit, angles that are not finite, or a position error that is negative.
    """

    angles: np.ndarray  #: (n, 2) commanded alpha, beta [rad]; of who is unknown, where they are taken to stand
    online: np.ndarray = None  # type: ignore[assignment]  #: (n,) False: cannot move; all True unless given
    position_error: np.ndarray = None  # type: ignore[assignment]
    """(n,) how far each arm may be from where it is said to be [mm]; zeros unless given."""
    unknown: np.ndarray = None  # type: ignore[assignment]
    """(n,) True: nobody knows where it stands, `angles` is a guess; all False unless given."""
    source: str = "state"  #: a file, for messages
    notes: tuple[str, ...] = ()  #: one sentence each
    assumptions: tuple[str, ...] = ()  #: of them, what a proof rests on that begins here

    def __post_init__(self) -> None:
        angles = read_only(self.angles, unit="rad", name="state angles", error=ProblemError)
        n = len(angles)
        if angles.shape != (n, 2) or not np.isfinite(angles).all():
            raise ProblemError(f"{self.source}: angles must be finite and of shape (n, 2), got shape {angles.shape}")
        object.__setattr__(self, "angles", angles)
        defaults = {"online": np.ones(n, bool), "unknown": np.zeros(n, bool), "position_error": np.zeros(n)}
        for name, default in defaults.items():
            value = getattr(self, name)
            unit = "mm" if name == "position_error" else ""
            value = read_only(default if value is None else value, default.dtype, unit, name, ProblemError)
            if value.shape != (n,):
                raise ProblemError(f"{self.source}: {name} must have shape ({n},), got {value.shape}")
            object.__setattr__(self, name, value)
        bad = ~(np.isfinite(self.position_error) & (self.position_error >= 0))
        if bad.any():
            raise ProblemError(f"{self.source}: a position error is {self.position_error[bad][0]:g} mm, not 0 or more")
        object.__setattr__(self, "notes", tuple(self.notes))
        object.__setattr__(self, "assumptions", tuple(self.assumptions))

    @classmethod
    def folded(cls, plane: FocalPlane) -> "State":
        """Everyone folded."""
        return cls(plane.folded, plane.online, source="folded")

    @classmethod
    def read(cls, source: object, plane: FocalPlane, *, at: float | None = None) -> "State":
        """The state that a file, or an object, tells.

        Args:
            source: a table (columns positioner, alpha, beta), a plan (its end), a SDSS ``confSummary``, a MOONS field,
                a DESI focal-plane file, a controller's file of a motion, or the path of one; or a `Plan`, or a motion
                (`Trajectory`, or `Executed`, whose joint and clock errors become position errors).
            plane: whose positioners they are.
            at: moment of a motion [s]; its end unless given.

        Raises:
            ProblemError: a file, column, unit or value that cannot be used; one line that names it.
        """
        return io_function("read_state")(source, plane, at=at)

    def write(self, path: str | os.PathLike, plane: FocalPlane) -> None:
        """Write an ECSV table that `read` reads: positioner, alpha, beta [deg], online, position_error [mm].

        Who is unknown has no angles there; notes and source are meta data.

        Raises:
            ProblemError: another number of positioners than the focal plane has, or a file that cannot be written.
        """
        io_function("write_state")(self, path, plane)

    def without(self, plane: FocalPlane, who: Sequence[int], why: str) -> "State":
        """The same with some more that cannot move.

        Args:
            plane: whose positioners they are.
            who: their indices.
            why: a few words for the note that names them.
        """
        online = self.online.copy()
        online[list(who)] = False
        names = ", ".join(plane.ids[i] for i in who)
        note = f"offline, {why}: {names}"
        return dataclasses.replace(self, online=online, notes=(*self.notes, note))

    def __repr__(self) -> str:
        n = len(self.angles)
        return f"<State of {n} positioners, {int(self.online.sum())} online, {int(self.unknown.sum())} unknown>"
