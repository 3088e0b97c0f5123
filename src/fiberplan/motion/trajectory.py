"""Motion in joint space: knots per positioner, linear between them, held before the first and after the last.

Each positioner has its own knots, so one that moves once has two. Stored ragged (CSR): those of positioner i are
``offsets[i]:offsets[i + 1]``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fiberplan.arrays import Frozen, number, plain, read_only, texts
from fiberplan.errors import TrajectoryError

_LATEST = 1e18  # [s]: proofs allow for the rounding of times, which are minutes apart here; products stay finite

if TYPE_CHECKING:
    from astropy.table import QTable


@dataclass(frozen=True, eq=False)
class Trajectory(Frozen):
    """Knots in joint space.

    Raises:
        TrajectoryError: a positioner without knots, times that do not increase, or values that are not finite.
    """

    offsets: np.ndarray  #: (n + 1,) int64
    times: np.ndarray  #: (k,) [s], increasing within a positioner, 0 or later
    angles: np.ndarray  #: (k, 2) commanded alpha, beta [rad]

    def __post_init__(self) -> None:
        for name, dtype, unit in (("offsets", np.int64, ""), ("times", np.float64, "s"), ("angles", np.float64, "rad")):
            array = read_only(getattr(self, name), dtype, unit, name, TrajectoryError)
            object.__setattr__(self, name, array)
        offsets, times, angles = self.offsets, self.times, self.angles
        if offsets.ndim != 1 or len(offsets) < 1 or offsets[0] != 0 or offsets[-1] != len(times):
            raise TrajectoryError(f"offsets must run from 0 to the number of knots, {len(times)}")
        if times.ndim != 1 or angles.shape != (len(times), 2):
            raise TrajectoryError(f"{len(times)} times need angles of shape ({len(times)}, 2), got {angles.shape}")
        if np.any(np.diff(offsets) < 1):
            raise TrajectoryError(f"positioner {np.flatnonzero(np.diff(offsets) < 1)[0]} has no knot")
        bad = np.flatnonzero(~((times >= 0) & (times <= _LATEST)) | ~np.all(np.isfinite(angles), axis=1))
        if len(bad):
            k = bad[0]
            raise TrajectoryError(
                f"positioner {self.owner[k]}: knot at {times[k]} s with angles {angles[k]} rad is not usable"
            )
        steps = np.diff(times)
        steps[offsets[1:-1] - 1] = np.inf  # from one positioner to the next, time starts again
        if np.any(steps <= 0):
            k = np.flatnonzero(steps <= 0)[0]
            raise TrajectoryError(f"positioner {self.owner[k]}: time does not increase after {times[k]} s")

    def __repr__(self) -> str:
        return f"<Trajectory: {len(self.times)} knots of {self.n} positioners, {self.duration:.6g} s>"

    @property
    def n(self) -> int:
        """Number of positioners."""
        return len(self.offsets) - 1

    @cached_property
    def owner(self) -> np.ndarray:
        """(k,) the positioner that each knot belongs to."""
        return read_only(np.repeat(np.arange(self.n), np.diff(self.offsets)), np.int64)

    def knots(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Times (m,) [s] and angles (m, 2) [rad] of positioner `i`."""
        own = slice(int(self.offsets[i]), int(self.offsets[i + 1]))
        return self.times[own], self.angles[own]

    @property
    def duration(self) -> float:
        """Time of the last knot [s]."""
        return float(self.times.max(initial=0.0))

    @property
    def start(self) -> np.ndarray:
        """First angles (n, 2) [rad]."""
        return self.angles[self.offsets[:-1]]

    @property
    def end(self) -> np.ndarray:
        """Last angles (n, 2) [rad]."""
        return self.angles[self.offsets[1:] - 1]

    def at(self, t: float) -> np.ndarray:
        """Angles (n, 2) [rad] at time `t` [s]."""
        t = number(t, "s", "t", TrajectoryError)
        if self.n == 0:
            return np.empty((0, 2))
        # the last knot at or before t, by a count per positioner
        before = np.add.reduceat((self.times <= t).astype(np.int64), self.offsets[:-1])
        left = self.offsets[:-1] + np.maximum(before - 1, 0)
        right = np.minimum(left + 1, self.offsets[1:] - 1)
        span = self.times[right] - self.times[left]
        part = np.divide(t - self.times[left], span, out=np.zeros(self.n), where=span > 0)
        part = np.clip(part, 0.0, 1.0)[:, None]
        return (1.0 - part) * self.angles[left] + part * self.angles[right]

    def reversed(self) -> "Trajectory":
        """The same motion backwards in time, of the same duration."""
        owner, times, angles = self.owner[::-1], self.duration - self.times[::-1], self.angles[::-1]
        if self.n and times.max() < self.duration:  # a knot at the very end, so that the duration is kept
            owner, times = np.append(owner, 0), np.append(times, self.duration)
            angles = np.append(angles, self.start[:1], axis=0)
        return self.from_knots(owner, times, angles, self.n)

    def then(self, other: "Trajectory") -> "Trajectory":
        """This motion, then `other`, which must begin where this one ends.

        Raises:
            TrajectoryError: a positioner is not where `other` begins.
        """
        gap = np.abs(self.end - other.start).max(axis=1, initial=0.0) if other.n == self.n else np.array([np.inf])
        if np.any(gap > 1e-9):
            i = int(np.argmax(gap > 1e-9))
            raise TrajectoryError(f"positioner {i} ends {gap[i]:.6g} rad from where the next motion begins")
        owner = np.concatenate([self.owner, other.owner])
        times = np.concatenate([self.times, self.duration + other.times])
        return self.from_knots(owner, times, np.concatenate([self.angles, other.angles]), self.n)

    def select(self, who: np.ndarray) -> "Trajectory":
        """The motion of the positioners `who` (k,) alone, in this order."""
        counts = np.diff(self.offsets)[who]
        offsets = np.concatenate([[0], np.cumsum(counts)])
        rows = np.arange(offsets[-1]) + np.repeat(self.offsets[who] - offsets[:-1], counts)
        return Trajectory(offsets, self.times[rows], self.angles[rows])

    def sampled(self, times: np.ndarray) -> np.ndarray:
        """Where everybody is (n, len(times), 2) [rad] at `times` [s]."""
        times = np.asarray(plain(times, "s", "times", TrajectoryError), float)
        out = np.empty((self.n, len(times), 2))
        for i in range(self.n):
            own_times, own_angles = self.knots(i)
            for joint in (0, 1):
                out[i, :, joint] = np.interp(times, own_times, own_angles[:, joint])
        return out

    def between(self, begin: float, end: float) -> "Trajectory":
        """The motion from `begin` to `end` [s] alone, which takes the time between them.

        Raises:
            TrajectoryError: times below 0, not finite, or of which the second is not the later.
        """
        begin, end = number(begin, "s", "begin", TrajectoryError), number(end, "s", "end", TrajectoryError)
        if not 0 <= begin < end < np.inf:
            raise TrajectoryError(f"no motion lies between {begin} s and {end} s")
        within, everyone = (self.times > begin) & (self.times < end), np.arange(self.n)
        return self.from_knots(
            np.concatenate([everyone, self.owner[within], everyone]),
            np.concatenate([np.zeros(self.n), self.times[within] - begin, np.full(self.n, end - begin)]),
            np.concatenate([self.at(begin), self.angles[within], self.at(end)]),
            self.n,
        )

    def to_table(self, ids: Sequence[str] | None = None) -> "QTable":
        """A row a knot: positioner, time [s], commanded alpha and beta [deg]; between knots both joints turn evenly.

        Args:
            ids: (n,) names of the positioners; their indices unless given.

        Raises:
            TrajectoryError: another number of ids than positioners.
        """
        from astropy import units
        from astropy.table import QTable

        names = np.arange(self.n) if ids is None else np.array(texts(ids, "ids", TrajectoryError), str)
        if len(names) != self.n:
            raise TrajectoryError(f"{len(names)} ids for {self.n} positioners")
        alpha, beta = np.degrees(self.angles).T
        columns = {"time": self.times * units.s, "alpha": alpha * units.deg, "beta": beta * units.deg}
        return QTable({"positioner": names[self.owner]} | columns)

    @classmethod
    def from_knots(cls, owner: np.ndarray, times: np.ndarray, angles: np.ndarray, n: int) -> "Trajectory":
        """Knots in any order.

        Args:
            owner: (k,) the positioner of each knot.
            times: (k,) [s].
            angles: (k, 2) [rad].
            n: how many positioners there are.

        Of several knots of one positioner at one time the first given is kept.

        Raises:
            TrajectoryError: as for the class.
        """
        times = np.asarray(plain(times, "s", "times", TrajectoryError), float)
        angles = np.asarray(plain(angles, "rad", "angles", TrajectoryError), float)
        order = np.lexsort((times, owner))  # stable: knots at one time stay in the order given
        owner, times, angles = np.asarray(owner)[order], times[order], angles[order]
        keep = np.ones(len(times), bool)
        keep[1:] = (owner[1:] != owner[:-1]) | (times[1:] > times[:-1])
        counts = np.bincount(owner[keep], minlength=n)
        return cls(np.concatenate([[0], np.cumsum(counts)]), times[keep], angles[keep])

    @classmethod
    def from_samples(cls, times: np.ndarray, angles: np.ndarray) -> "Trajectory":
        """Knots for all positioners at the same `times` (k,) [s], `angles` (k, n, 2) [rad].

        Raises:
            TrajectoryError: other shapes, times that do not increase, or values that are not finite.
        """
        times = np.asarray(plain(times, "s", "times", TrajectoryError), float)
        angles = np.asarray(plain(angles, "rad", "angles", TrajectoryError), float)
        if angles.ndim != 3 or angles.shape[::2] != (len(times), 2):
            raise TrajectoryError(f"{len(times)} times need angles of shape ({len(times)}, n, 2), got {angles.shape}")
        n = angles.shape[1]
        offsets = np.arange(n + 1) * len(times)
        return cls(offsets, np.tile(times, n), angles.transpose(1, 0, 2).reshape(-1, 2))

    @classmethod
    def at_rest(cls, angles: np.ndarray) -> "Trajectory":
        """No motion at all, at `angles` (n, 2) [rad]."""
        return cls.from_samples(np.zeros(1), np.asarray(plain(angles, "rad", "angles", TrajectoryError), float)[None])
