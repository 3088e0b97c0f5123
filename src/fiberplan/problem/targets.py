"""Targets: where fibers are wanted; `solution` has the joint angles that put them there.

A target belongs to one positioner (assignment is not done here) and is a point [mm], or commanded angles where the file
gives them. Parity names the elbow solution: +1 is right (beta > 0), -1 left.
"""

import dataclasses
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from fiberplan.arrays import Frozen, read_only, shortened, texts
from fiberplan.errors import TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.problem.solution import Solution, refuse_unreachable, solved
from fiberplan.registry import io_function
from fiberplan.tables.wording import nearest

if TYPE_CHECKING:
    from astropy.table import QTable, Table

MOST_PRIORITY = 1e12  #: so that whole numbers of them can be added up exactly
_UNITS = {"x": "mm", "y": "mm", "angles": "rad"}
_PLACE = 0.05  # [mm] a positioner named by its place stands no farther from there (files have six digits)


@dataclass(frozen=True, eq=False)
class Targets(Frozen):
    """A field of targets.

    Raises:
        TargetError: no targets, a value that is not finite, a negative priority, a parity other than +1, 0 or -1, or
            two targets for one positioner; the message names the row.
    """

    x: np.ndarray  #: (m,) [mm]; NaN where only angles are given
    y: np.ndarray  #: (m,) [mm]
    positioner: tuple[str, ...] | None = None  #: (m,) ids; None: not assigned
    priority: np.ndarray = None  # type: ignore[assignment]  #: (m,) larger matters more; 1 unless given
    fiber: tuple[str, ...] | None = None  #: (m,) names; "" is the default fiber
    parity: np.ndarray = None  # type: ignore[assignment]  #: (m,) +1 right, -1 left, 0 (unless given) either
    angles: np.ndarray = None  # type: ignore[assignment]  #: (m, 2) commanded; NaN where absent [rad]
    base: np.ndarray | None = None  #: (m, 2) instead of ids: where the positioners stand [mm]
    idle: np.ndarray | None = None  #: (k, 2) with `base`: where those without a target stand [mm]
    offline: tuple[str, ...] = ()  #: ids whose position the source says is unknown
    source: str = "targets"  #: a file, for messages
    rows: tuple[str, ...] = ()  #: (m,) where each target stands in it
    notes: tuple[str, ...] = ()
    prefer: Literal["angles", "xy"] | None = None
    """Which to take of rows that give angles and x, y: the angles unless given, and only if the two agree."""
    assigned: np.ndarray = None  # type: ignore[assignment]
    """(m,) False: an idle positioner was only put there, and gives way to targets; True unless given."""
    disabled: np.ndarray = None  # type: ignore[assignment]
    """(m,) True: the positioner cannot move from the angles of its row; False unless given."""
    left_out: tuple[str, ...] = ()  #: targets that were wanted and are in no row, a sentence each: they are lost
    site: str = ""  #: the observatory whose positioners these are, if the source says it
    second_names: tuple[str, ...] | None = None  #: (m,) what else the source calls the positioners; "": nothing

    def __post_init__(self) -> None:
        m = np.size(self.x)
        defaults = {"priority": np.ones(m), "parity": np.zeros(m), "angles": np.full((m, 2), np.nan)}
        for name in ("x", "y", "priority", "parity", "angles"):
            value = getattr(self, name)
            label, unit = f"{self.source}: {name}", _UNITS.get(name, "")
            value = read_only(defaults[name] if value is None else value, float, unit, label, TargetError)
            shape = (m, 2) if name == "angles" else (m,)
            if value.shape != shape:
                raise TargetError(f"{self.source}: {name} must have shape {shape}, got {value.shape}")
            object.__setattr__(self, name, value)
        for name, usual in (("assigned", True), ("disabled", False)):
            value = np.full(m, usual) if (value := getattr(self, name)) is None else value
            value = read_only(value, bool, name=f"{self.source}: {name}", error=TargetError)
            if value.shape != (m,):
                raise TargetError(f"{self.source}: {name} must have shape {(m,)}, got {value.shape}")
            object.__setattr__(self, name, value)
        object.__setattr__(self, "left_out", tuple(self.left_out))
        for name in ("base", "idle"):
            if (value := getattr(self, name)) is not None:
                places = read_only(value, unit="mm", name=f"{self.source}: {name}", error=TargetError)
                if places.size and (places.ndim != 2 or places.shape[1] != 2):
                    raise TargetError(f"{self.source}: {name} must have shape (k, 2), got {places.shape}")
                object.__setattr__(self, name, read_only(places.reshape(-1, 2)))
        if self.base is not None and len(self.base) != m:
            raise TargetError(f"{self.source}: base has {len(self.base)} entries for {m} targets")
        object.__setattr__(self, "rows", self.rows or tuple(f"row {k + 1}" for k in range(m)))
        for name in ("positioner", "fiber", "rows", "offline", "second_names"):
            if (value := getattr(self, name)) is not None:
                value = texts(value, f"{self.source}: {name}", TargetError)
                if name != "offline" and len(value) != m:
                    raise TargetError(f"{self.source}: {name} has {len(value)} entries for {m} targets")
                object.__setattr__(self, name, value)
        self._validate()

    def __len__(self) -> int:
        return len(self.x)

    def __repr__(self) -> str:
        return f"<Targets: {len(self)} from '{shortened(self.source)}'>"

    @property
    def commanded(self) -> np.ndarray:
        """(m,) whether a target is taken as angles."""
        given = ~np.isnan(self.angles[:, 0])
        return given & np.isnan(self.x + self.y) if self.prefer == "xy" else given

    def fail(self, row: int | np.integer, complaint: str) -> TargetError:
        """The error to raise about a row."""
        return TargetError(f"{self.source}: {self.rows[row]}: {complaint}")

    def _validate(self) -> None:
        if not len(self) and not self.offline:
            raise TargetError(f"{self.source}: there are no targets")
        if self.prefer not in (None, "angles", "xy"):
            raise TargetError(f"{self.source}: prefer must be 'angles' or 'xy', got '{self.prefer}'")
        angles = self.angles
        for row in np.flatnonzero(np.isinf(angles).any(axis=1) | (np.isnan(angles[:, 0]) != np.isnan(angles[:, 1]))):
            shown = ", ".join(f"{np.degrees(a):.6g}" for a in angles[row])
            raise self.fail(row, f"alpha, beta are {shown} deg: both must be finite, or both be left out")
        for name in ("x", "y"):
            value = getattr(self, name)
            for row in np.flatnonzero(np.isinf(value) | (np.isnan(value) & ~self.commanded)):
                raise self.fail(row, f"{name} is {value[row]}")
        for row in np.flatnonzero(~(np.isfinite(self.priority) & (self.priority >= 0))):
            raise self.fail(row, f"priority is {self.priority[row]:g}, expected a finite number of 0 or more")
        for row in np.flatnonzero(~np.isin(self.parity, (-1, 0, 1))):
            raise self.fail(row, f"parity is {self.parity[row]:g}, expected +1 (right), -1 (left) or 0 (either)")
        seen: dict[str, int] = {}
        for k, id_ in enumerate(self.positioner or ()):
            if (first := seen.setdefault(id_, k)) != k:
                raise self.fail(k, f"positioner '{id_}' already has a target in {self.rows[first]}")
        for id_ in self.offline:
            if id_ in seen:
                raise self.fail(seen[id_], f"positioner '{id_}' has a target but its position is unknown")

    @classmethod
    def read(
        cls,
        path: str | os.PathLike,
        priority_order: Literal["larger", "smaller"] = "larger",
        prefer: Literal["angles", "xy"] | None = None,
        conflicts: Literal["raise", "drop"] = "raise",
    ) -> "Targets":
        """Read targets from any table that astropy reads, a SDSS ``confSummary*.par``, or a MOONS ``targets_K.txt``.

        Columns: ``x``, ``y`` [mm], or commanded ``alpha``, ``beta`` [deg]; optionally ``positioner``, ``priority``,
        ``fiber`` and ``parity`` (+1 or right, -1 or left, 0 or any). Units in brackets are assumed where none
        are given.

        Args:
            path: of the file.
            priority_order: which priorities matter more in the file. With "smaller" they are turned round, largest for
                smallest, since inside larger always matters more; a note says so.
            prefer: which to take of rows that give angles and x, y, however much they disagree.
            conflicts: "drop" leaves out rows that cannot be used, each with a note that names it; a place in such a row
                is a target that is lost (`left_out`).

        Raises:
            TargetError: a file, column, unit or value that cannot be used; one line naming it.
        """
        if conflicts not in ("raise", "drop"):
            raise TargetError(f"conflicts must be 'raise' or 'drop', got '{conflicts}'")
        if priority_order not in ("larger", "smaller"):
            raise TargetError(f"priority_order must be 'larger' or 'smaller', got '{priority_order}'")
        fields = io_function("read_columns")(path, drop=conflicts == "drop")
        targets = cls(**fields | ({"prefer": prefer} if prefer else {}))
        if priority_order == "larger" or not len(targets):
            return targets
        lowest, highest = targets.priority.min(), targets.priority.max()
        note = f"in {targets.source} smaller priorities matter more: {lowest:g} counts as {highest:g}, and so on"
        return dataclasses.replace(targets, priority=lowest + highest - targets.priority, notes=(*targets.notes, note))

    @classmethod
    def from_table(cls, table: "Table", masked: Literal["raise", "drop"] = "raise") -> "Targets":
        """Targets from a table of astropy, with the columns that `read` knows.

        Args:
            table: a Table or QTable.
            masked: what to do about rows in which a cell that is needed is masked: refuse them, or leave them out, each
                with a note that names it. An optional cell that is masked is as one that is empty in a file.

        Raises:
            TargetError: a column, unit or value that cannot be used; one line naming it.
        """
        return cls(**io_function("columns_of")(table, masked))

    def to_table(self) -> "QTable":
        """The targets as `from_table` takes them, to the last bit: x and y [mm], alpha and beta [rad] where given."""
        return io_function("table_of")(self)

    def write(self, path: str | os.PathLike) -> None:
        """Write the targets as a table in the format that the file's name says, such as ECSV, CSV or FITS.

        `read` reads the same targets back. Which positioners are offline or idle only ECSV can say.

        Raises:
            TargetError: no such format, or a file that cannot be written; what was there before is kept.
        """
        io_function("write_targets")(self, path)

    def indices(self, plane: FocalPlane) -> np.ndarray:
        """(m,) the positioner each target belongs to.

        Raises:
            TargetError: targets without positioners, or a positioner that `plane` does not have.
        """
        if self.positioner is None and self.base is not None:
            return self._standing_at(plane)
        if self.positioner is None:
            raise TargetError(
                f"{self.source}: no column 'positioner': say which positioner is assigned which target, or let "
                "`fiberplan allocate` say it"
            )
        for row, id_ in enumerate(self.positioner):
            if id_ not in plane.names:
                raise self.fail(row, f"{plane.name} has no positioner '{id_}'{nearest(id_, plane.names)}")
        for id_ in self.offline:
            if id_ not in plane.names:
                raise TargetError(f"{self.source}: {plane.name} has no positioner '{id_}'{nearest(id_, plane.names)}")
        who = np.array([plane.names[id_] for id_ in self.positioner], np.int64)
        first: dict[int, int] = {}
        for row, i in enumerate(who.tolist()):
            if (before := first.setdefault(i, row)) != row:  # under its id and its second name
                raise self.fail(row, f"positioner '{plane.ids[i]}' already has a target in {self.rows[before]}")
        return who

    def disabled_at(self, plane: FocalPlane) -> dict[int, tuple[np.ndarray, str]]:
        """Positioners that cannot move -> the angles [rad] of their row (NaN: not given), and which row that is."""
        if not self.disabled.any():
            return {}
        who = self.indices(plane)
        return {int(who[r]): (self.angles[r], self.rows[r]) for r in np.flatnonzero(self.disabled)}

    def _standing_at(self, plane: FocalPlane) -> np.ndarray:
        """(m,) the positioners that stand at `base`; with `idle`, every positioner must be named."""
        assert self.base is not None
        listed = self.base if self.idle is None else np.concatenate([self.base, self.idle])
        from scipy.spatial import cKDTree  # slow to import, and a plan that is read needs none

        away, who = cKDTree(plane.base).query(listed)
        m, rows = len(self), np.arange(len(listed))
        for row in np.flatnonzero(~(away <= _PLACE)):
            x, y = listed[row]
            what = self.rows[row] if row < m else "a row without a target"
            raise TargetError(
                f"{self.source}: {what}: {plane.name} has no positioner at x {x:.3f}, y {y:.3f} mm "
                f"(the nearest is {away[row]:.3f} mm away)"
            )
        if len(np.unique(who)) < len(listed):
            again = int(rows[~np.isin(rows, np.unique(who, return_index=True)[1])][0])
            what = self.rows[again] if again < m else "a row without a target"
            raise TargetError(f"{self.source}: {what}: positioner '{plane.ids[who[again]]}' already has a row")
        missing = np.setdiff1d(np.arange(plane.n), who)
        if self.idle is not None and len(missing):
            raise TargetError(
                f"{self.source}: {len(listed)} rows for the {plane.n} positioners of {plane.name}: "
                f"none for positioner '{plane.ids[missing[0]]}'; is the file truncated?"
            )
        return np.asarray(who[:m], np.int64)

    def solve(self, plane: FocalPlane) -> Solution:
        """Joint angles for every target: of several, those reached soonest from folded (ties: right elbow).

        Targets given as angles are taken as they are, and have no alternatives. Where a row gives a position beside
        them, the two are compared.

        Raises:
            TargetError: targets without positioners, a positioner or fiber that `plane` does not have, targets of
                another observatory, or a field of which most rows disagree by more than 0.2 mm and `prefer` is not set.
        """
        return solved(self, plane)

    def configuration(self, plane: FocalPlane) -> np.ndarray:
        """Goal angles (n, 2) [rad]; NaN rows for positioners without a target.

        Raises:
            TargetError: as `solve`, and targets that are out of reach, with distance and reach.
        """
        solution = self.solve(plane)
        refuse_unreachable(plane, self.source, solution)
        return solution.goal
