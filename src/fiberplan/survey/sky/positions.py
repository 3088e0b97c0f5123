"""Where targets are on the sky (ICRS), and where their proper motions take them.

Proper motion in right ascension is that along the circle of declination (mu_alpha cos delta), as Gaia gives it.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import Frozen, read_only
from fiberplan.errors import TargetError

EPOCH = 2016.0  #: [yr] of positions that give none: that of Gaia DR3
_UNITS = {"ra": "rad", "dec": "rad", "pm_ra": "rad/yr", "pm_dec": "rad/yr", "epoch": "yr"}


@dataclass(frozen=True, eq=False)
class SkyPositions(Frozen):
    """Positions on the sky.

    Raises:
        TargetError: a value that is not finite, a declination beyond a pole, or shapes that do not fit.
    """

    ra: np.ndarray  #: (m,) [rad]
    dec: np.ndarray  #: (m,) [rad]
    pm_ra: np.ndarray = None  # type: ignore[assignment]  #: (m,) with cos dec; zeros unless given [rad/yr]
    pm_dec: np.ndarray = None  # type: ignore[assignment]  #: (m,) zeros unless given [rad/yr]
    epoch: np.ndarray = None  # type: ignore[assignment]  #: (m,) Julian years; 2016.0 unless given
    source: str = "positions"  #: for messages
    rows: tuple[str, ...] = ()  #: (m,) where each stands in it

    def __post_init__(self) -> None:
        m = np.size(self.ra)
        blanks = {"pm_ra": 0.0, "pm_dec": 0.0, "epoch": EPOCH}
        object.__setattr__(self, "rows", tuple(self.rows) or tuple(f"row {k + 1}" for k in range(m)))
        for name, unit in _UNITS.items():
            value = getattr(self, name)
            label = f"{self.source}: {name}"
            value = np.full(m, blanks[name]) if value is None else value
            value = read_only(value, float, unit, label, TargetError)
            if value.shape != (m,):
                raise TargetError(f"{label} must have shape ({m},), got {value.shape}")
            if not np.isfinite(value).all():
                row = int(np.argmin(np.isfinite(value)))
                raise TargetError(f"{self.source}: {self.rows[row]}: {name} is {value[row]:g}")
            object.__setattr__(self, name, value)
        beyond = np.abs(self.dec) > np.pi / 2
        if beyond.any():
            row = int(np.argmax(beyond))
            said = f"dec is {np.degrees(self.dec[row]):g} deg, expected -90 to 90"
            raise TargetError(f"{self.source}: {self.rows[row]}: {said}")

    def __len__(self) -> int:
        return len(self.ra)

    def some(self, rows: np.ndarray) -> "SkyPositions":
        """Those in `rows` (k,)."""
        columns = {name: getattr(self, name)[rows] for name in _UNITS}
        return SkyPositions(**columns, source=self.source, rows=tuple(self.rows[row] for row in rows.tolist()))

    def at(self, year: float) -> "SkyPositions":
        """Where they are in a Julian year, along straight lines in space; distances, and so parallax, are not known."""
        moves = (self.pm_ra != 0) | (self.pm_dec != 0)
        if not moves.any() or not np.isfinite(year):
            return self
        east = np.stack([-np.sin(self.ra), np.cos(self.ra), np.zeros(len(self))], axis=1)
        north = np.cross(self.directions, east)
        velocity = self.pm_ra[:, None] * east + self.pm_dec[:, None] * north
        x, y, z = (self.directions + velocity * (year - self.epoch)[:, None]).T
        ra, dec = np.arctan2(y, x) % (2 * np.pi), np.arctan2(z, np.hypot(x, y))
        ra, dec = np.where(moves, ra, self.ra), np.where(moves, dec, self.dec)
        return dataclasses.replace(self, ra=ra, dec=dec, epoch=np.full(len(self), year))

    @property
    def directions(self) -> np.ndarray:
        """(m, 3) unit vectors."""
        flat = np.cos(self.dec)
        return np.stack([flat * np.cos(self.ra), flat * np.sin(self.ra), np.sin(self.dec)], axis=1)
