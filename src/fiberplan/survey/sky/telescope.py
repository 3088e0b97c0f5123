"""A telescope as a radial plate scale: an angle from the field's centre becomes a distance from the plane's middle.

r = s1 theta + s2 theta^2 + ..., and the direction on the sky stays that in the focal plane: at position angle 0, y
points north and x east or west. With a position angle, y points that far east of north. Angles are those of ICRS, so a
place does not depend on the hour angle.

Not modelled: refraction and its change over the field, aberration, precession of the position angle's pole, parallax,
colour, atmospheric dispersion and its corrector, flexure and tilt, and all optics that are not radial.
"""

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.arrays import Frozen, number, read_only
from fiberplan.errors import InstrumentError
from fiberplan.survey.sky.positions import SkyPositions
from fiberplan.tables.contents import read_whole
from fiberplan.tables.wording import nearest, one_line

_BUILTIN = Path(__file__).parent / "telescopes"
_FIELDS = {"format", "name", "title", "instruments", "scale", "radius", "x_east", "sources", "assumptions"}
_STEPS = 1001  # between centre and edge of the field, at which the scale is looked at
NOT_MODELLED = (
    "sky to focal plane by a radial plate scale: no refraction, aberration, parallax, colour, flexure or optics "
    "that are not radial"
)


@dataclass(frozen=True, eq=False)
class Telescope(Frozen):
    """A radial plate scale.

    Raises:
        InstrumentError: a scale that does not grow all the way to the edge, or a radius that is not from 0 to 90 deg.
    """

    name: str
    scale: np.ndarray  #: (k,) of theta, theta^2, ... [mm/rad, mm/rad^2, ...]
    radius: float  #: of the field [rad]
    x_east: bool = True  #: at position angle 0, x grows toward the east; False: toward the west
    instruments: tuple[str, ...] = ()  #: names of focal planes that it feeds
    assumptions: tuple[str, ...] = ()  #: beyond what no radial scale models

    def __post_init__(self) -> None:
        object.__setattr__(self, "scale", read_only(self.scale, float, "", f"{self.name}: scale", InstrumentError))
        radius = number(self.radius, "rad", f"{self.name}: radius", InstrumentError)
        object.__setattr__(self, "radius", radius)
        if not 0 < radius < np.pi / 2:
            raise InstrumentError(f"{self.name}: radius must be more than 0 and less than 90 deg")
        if self.scale.ndim != 1 or not len(self.scale) or not np.isfinite(self.scale).all():
            raise InstrumentError(f"{self.name}: scale must be one or more finite numbers")
        if not (np.diff(self.distance(np.linspace(0.0, radius, _STEPS))) > 0).all():
            raise InstrumentError(f"{self.name}: the distance from the middle must grow up to the edge of the field")

    @classmethod
    def load(cls, name_or_path: str | os.PathLike) -> "Telescope":
        """A telescope that is built in, by its name or that of a focal plane that it feeds; or one from a TOML file.

        Raises:
            InstrumentError: no such name or file, or a field of it that cannot be used.
        """
        known = {path.stem: path for path in sorted(_BUILTIN.glob("*.toml"))}
        path = Path(name_or_path)
        if str(name_or_path) in known:
            return _read(known[str(name_or_path)])
        if path.suffix.lower() == ".toml":
            return _read(path)
        for each in map(_read, known.values()):
            if str(name_or_path) in each.instruments:
                return each
        close = nearest(str(name_or_path), known)
        raise InstrumentError(f"there is no telescope '{name_or_path}'{close}: {', '.join(known)}, or a TOML file")

    def distance(self, theta: np.ndarray) -> np.ndarray:
        """Distance from the middle of the focal plane [mm] at angles from the field's centre [rad]."""
        return np.polynomial.polynomial.polyval(theta, np.concatenate([[0.0], self.scale]))

    def place(self, stars: SkyPositions, ra: float, dec: float, position_angle: float = 0.0) -> np.ndarray:
        """(m, 2) x and y [mm] of `stars` for a field centred there [rad]; NaN beyond the edge of the field.

        Args:
            stars: as they are when the field is observed (`SkyPositions.at`).
            ra: of the centre [rad].
            dec: of the centre [rad].
            position_angle: of y, from north through east [rad].
        """
        from astropy import units as u
        from astropy.coordinates import angular_separation
        from astropy.coordinates import position_angle as direction

        theta = angular_separation(ra, dec, stars.ra, stars.dec)
        towards = direction(ra * u.rad, dec * u.rad, stars.ra * u.rad, stars.dec * u.rad).rad - position_angle
        r = np.where(theta <= self.radius, self.distance(theta), np.nan)
        return np.stack([(r if self.x_east else -r) * np.sin(towards), r * np.cos(towards)], axis=1)

    def sky(self, points: np.ndarray, ra: float, dec: float, position_angle: float = 0.0) -> SkyPositions:
        """Where on the sky (m,) what `place` puts at some points is.

        Args:
            points: (m, 2) in the focal plane [mm].
            ra: of the field's centre [rad].
            dec: likewise [rad].
            position_angle: as in `place` [rad].

        Raises:
            InstrumentError: a point beyond the edge of the field.
        """
        from astropy.coordinates import SkyCoord

        x, y = points[:, 0] if self.x_east else -points[:, 0], points[:, 1]
        r, edge = np.hypot(x, y), float(self.distance(np.array(self.radius)))
        if (r > edge * (1 + 1e-12)).any():
            raise InstrumentError(
                f"{self.name}: a point is {r.max():.3f} mm from the middle, the field ends at {edge:.3f} mm"
            )
        theta = np.interp(r, self.distance(grid := np.linspace(0.0, self.radius, _STEPS)), grid)
        slope = np.polynomial.polynomial.polyder(np.concatenate([[0.0], self.scale]))
        for _ in range(4):  # Newton from a grid this fine doubles its digits each time
            theta = theta - (self.distance(theta) - r) / np.polynomial.polynomial.polyval(theta, slope)
        centre = SkyCoord(ra, dec, unit="rad")
        found = centre.directional_offset_by((np.arctan2(x, y) + position_angle) * _rad(), theta * _rad())
        return SkyPositions(found.ra.rad, found.dec.rad)


def _rad() -> Any:
    from astropy import units as u

    return u.rad


def _read(path: Path) -> Telescope:
    """A telescope from a file: scale in mm/deg, mm/deg^2, ..., radius in deg.

    Raises:
        InstrumentError: no such file, or a field that is missing, unknown or of another kind.
    """
    try:
        said = tomllib.loads(read_whole(path, InstrumentError).decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as problem:
        raise InstrumentError(f"{path}: is not TOML ({one_line(problem)})") from None
    unknown = sorted(set(said) - _FIELDS)
    if unknown:
        raise InstrumentError(f"{path}: unknown field '{unknown[0]}'{nearest(unknown[0], _FIELDS)}")
    if said.get("format") != 1:
        raise InstrumentError(f"{path}: format is {said.get('format')}, expected 1")
    scale = _numbers(path, said, "scale")
    powers = np.arange(1, len(scale) + 1)
    (radius,) = _numbers(path, said | {"radius": [said.get("radius")]}, "radius")
    return Telescope(
        name=str(said.get("name", path.stem)),
        scale=np.array(scale) * np.degrees(1.0) ** powers,
        radius=float(np.radians(radius)),
        x_east=bool(said.get("x_east", True)),
        instruments=tuple(map(str, said.get("instruments", ()))),
        assumptions=tuple(map(str, said.get("assumptions", ()))),
    )


def _numbers(path: Path, said: Mapping[str, Any], field: str) -> list[float]:
    values = said.get(field)
    if not isinstance(values, list) or not all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        raise InstrumentError(f"{path}: {field} is {values}, expected numbers")
    return [float(value) for value in values]
