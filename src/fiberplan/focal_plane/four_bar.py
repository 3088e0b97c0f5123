"""Four-bar arms: a probe that slides through a rocker, driven by two cranks, as in MIRADAS (Sabater2018).

In an arm's own frame, x towards its workspace, J1 is the origin, J2 lies on x at `spacing`, J3 = d13 (cos t1, sin t1)
and J4 = J2 + d24 (-cos t2, sin t2), with t1 = alpha and t2 = beta. The probe lies along the line from J3 to J4 and its
tip at a fixed distance from J3. It slides through J4: the length from J3 to J4 has a range, and configurations outside
it form the zone of avoidance. The first link's length (d13) is `FocalPlane.length`, the tip is the fiber.

A point has up to four configurations. J3 lies where the circle of the first link about J1 meets the circle of the tip's
distance about the point: at most two places. From each the probe's direction is known, and J4 lies where it crosses the
rocker's circle about J2: again at most two places, each with its slider length.
"""

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fiberplan.arrays import Frozen, plain, read_only
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.kinematics import Mounted
from fiberplan.focal_plane.two_link import along, rotated
from fiberplan.kernels.arms import BAR
from fiberplan.kernels.four_bar import SINGULAR
from fiberplan.tolerances import ARRIVAL, ROUNDING, ZONE

TOLERANCE = ARRIVAL  #: a point this far out of reach is taken to its edge: tables have three decimals [mm]
_CIRCLE = 1e-6  # [mm] a rocker that is too short by this just reaches the probe's line
_UNITS = {"spacing": "mm", "rocker": "mm", "shortest": "mm", "longest": "mm", "orientation": "rad"}


@dataclass(frozen=True, eq=False)
class FourBar(Frozen):
    """What an array of four-bar arms has beyond base, first link and fiber.

    Raises:
        InstrumentError: values that are not finite, lengths that are not positive, or a slider range that is reversed
            or begins where the probe's direction is ill-conditioned; the message names the row.
    """

    spacing: np.ndarray  #: (n,) J1 to J2, d12 [mm]
    rocker: np.ndarray  #: (n,) J2 to J4, d24 [mm]
    shortest: np.ndarray  #: (n,) slider, J3 to J4 [mm]
    longest: np.ndarray  #: (n,) [mm]
    orientation: np.ndarray  #: (n,) direction of the arm's x axis in the focal plane [rad]

    name: ClassVar[str] = "four-bar"
    joints: ClassVar[tuple[str, str]] = ("theta1", "theta2")
    link_names: ClassVar[tuple[str, ...]] = ("base", "alpha", "beta", "rocker")
    has_avoidance: ClassVar[bool] = True
    has_parities: ClassVar[bool] = False

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            name = f"four-bar {field.name}"
            given = plain(getattr(self, field.name), _UNITS[field.name], name, InstrumentError)
            values = read_only(np.atleast_1d(given), name=name, error=InstrumentError)
            if values.ndim != 1 or values.shape != np.shape(self.spacing) or not np.isfinite(values).all():
                raise InstrumentError(f"{name} must be one finite number for each arm")
            object.__setattr__(self, field.name, values)
        for name in ("spacing", "rocker"):
            self._refuse(~(getattr(self, name) > 0), name, "is not a positive length")
        self._refuse(~(self.shortest >= SINGULAR), "shortest", f"slider is under {SINGULAR:g} mm, too near singular")
        self._refuse(~(self.longest > self.shortest), "longest", "slider is not above the shortest")

    def _refuse(self, bad: np.ndarray, name: str, complaint: str) -> None:
        if np.any(bad):
            i = int(np.argmax(bad))
            raise InstrumentError(f"four-bar arm {i + 1}: {name} {getattr(self, name)[i]:.6g} mm {complaint}")

    def __repr__(self) -> str:
        return f"<FourBar: {len(self.spacing)} arms>"

    def check(self, n: int) -> None:
        """Refuse constants of another number of arms.

        Raises:
            InstrumentError: they are not of `n` arms.
        """
        if len(self.spacing) != n:
            raise InstrumentError(f"four-bar values of {len(self.spacing)} arms, not {n}")

    def subset(self, who: np.ndarray) -> "FourBar":
        """The same for the arms `who` (k,)."""
        return FourBar(*(getattr(self, field.name)[who] for field in dataclasses.fields(self)))

    @property
    def turned(self) -> np.ndarray:
        """Direction of each arm's own frame (n,) [rad]."""
        return self.orientation

    def rockers(self, base: np.ndarray, angles: np.ndarray, zero: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """J2 (n, 2) [mm] and directions of the rockers (n,) [rad].

        Args:
            base: (n, 2) J1 [mm].
            angles: (n, 2) commanded [rad].
            zero: (n, 2) what geometry adds to them [rad].
        """
        turn = self.orientation + np.pi - zero[:, 1] - angles[:, 1]
        return along(base, self.spacing, self.orientation), turn

    def elbows(self, plane: Mounted, angles: np.ndarray) -> np.ndarray:
        """J3 (n, 2) [mm]."""
        return along(plane.base, plane.length, angles[:, 0] + plane.zero[:, 0] + self.orientation)

    def links(self, plane: Mounted, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions of the first crank and of the probe (n,) [rad]."""
        pivot, turn = self.rockers(plane.base, angles, plane.zero)
        probe = along(pivot, self.rocker, turn) - self.elbows(plane, angles)
        return angles[:, 0] + plane.zero[:, 0] + self.orientation, np.arctan2(probe[:, 1], probe[:, 0])

    def frames(self, plane: Mounted, angles: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Origin (n, 2) [mm] and direction (n,) [rad] of every link that bodies can ride on."""
        first, second = self.links(plane, angles)
        return {
            "base": (plane.base, np.zeros(len(first))),
            "alpha": (plane.base, first),
            "beta": (self.elbows(plane, angles), second),
            "rocker": self.rockers(plane.base, angles, plane.zero),
        }

    def skeleton(self, plane: Mounted, angles: np.ndarray) -> tuple[np.ndarray, ...]:
        """First cranks and rockers, each (n, 2 ends, 2) [mm]."""
        pivot, turn = self.rockers(plane.base, angles, plane.zero)
        rockers = np.stack([pivot, along(pivot, self.rocker, turn)], axis=1)
        return np.stack([plane.base, self.elbows(plane, angles)], axis=1), rockers

    def sliders(self, length: np.ndarray, angles: np.ndarray, zero: np.ndarray) -> np.ndarray:
        """Slider lengths (n,) [mm].

        Args:
            length: (n,) of the first link, d13 [mm].
            angles: (n, 2) commanded [rad].
            zero: (n, 2) what geometry adds to them [rad].
        """
        t1, t2 = (angles + zero).T
        across = self.rocker * np.sin(t2) - length * np.sin(t1)
        return np.hypot(self.spacing - self.rocker * np.cos(t2) - length * np.cos(t1), across)

    def in_avoidance(self, plane: Mounted, angles: np.ndarray) -> np.ndarray:
        """(n,) whether the slider is out of its range; NaN rows are not."""
        slider = self.sliders(plane.length, angles, plane.zero)
        return (slider < self.shortest - ZONE) | (slider > self.longest + ZONE)

    def avoidance(self, plane: Mounted, i: int, angles: np.ndarray) -> str:
        """What is wrong with an arm whose angles lie in its zone of avoidance.

        Args:
            plane: whose arm it is.
            i: which.
            angles: (n, 2) commanded, of all arms [rad].
        """
        theta = ", ".join(f"{np.degrees(t):.6g}" for t in angles[i])
        slider = self.sliders(plane.length, angles, plane.zero)[i]
        return (
            f"{', '.join(self.joints)} {theta} deg are in the zone of avoidance: "
            f"slider {slider:.6g} mm is outside {self.shortest[i]:.6g} to {self.longest[i]:.6g} mm"
        )

    def inverse(
        self, plane: Mounted, who: np.ndarray, points: np.ndarray, offset: np.ndarray, parity: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Up to four solutions outside the zone of avoidance (m, 4, 2) [rad]; see `Kinematics.inverse`.

        Args:
            plane: whose arms these are.
            who: (m,) which of them.
            points: (m, 2) where their tips shall be [mm].
            offset: (m, 2) of the tip in the probe's frame [mm].
            parity: (m,) not used: these arms have no elbow that is right or left.
        """
        length = plane.length[who]
        delta = points - plane.base[who]
        c, s = np.cos(self.orientation[who]), np.sin(self.orientation[who])
        x, y = c * delta[:, 0] + s * delta[:, 1], c * delta[:, 1] - s * delta[:, 0]
        tip, away = np.hypot(offset[:, 0], offset[:, 1]), np.hypot(x, y)
        # the angle at J1 in the triangle J1, J3, tip, by its half: accurate at both ends
        wide = (tip - away + length) * (tip + away - length)
        near = (away + length - tip) * (away + length + tip)
        missed = np.maximum(np.maximum(away - (length + tip), np.abs(length - tip) - away), 0.0)
        with np.errstate(invalid="ignore"):
            gamma = 2.0 * np.arctan2(np.sqrt(np.maximum(wide, 0.0)), np.sqrt(np.maximum(near, 0.0)))
            gamma = np.where((missed <= TOLERANCE) & (away > 0.0), gamma, np.nan)
        first = np.arctan2(y, x)[:, None] + np.stack([gamma, -gamma], axis=1)  # (m, 2)
        j3x, j3y = length[:, None] * np.cos(first), length[:, None] * np.sin(first)
        lean = np.arctan2(y[:, None] - j3y, x[:, None] - j3x) - np.arctan2(offset[:, 1], offset[:, 0])[:, None]
        ux, uy = np.cos(lean), np.sin(lean)
        spacing, rocker = self.spacing[who, None], self.rocker[who, None]
        forward = (spacing - j3x) * ux - j3y * uy  # of J2, from J3
        across = (spacing - j3x) * uy + j3y * ux
        half = np.sqrt(np.where(np.abs(across) <= rocker + _CIRCLE, np.maximum(rocker**2 - across**2, 0.0), np.nan))
        slider = np.stack([forward + half, forward - half], axis=2)  # (m, 2, 2)
        j4x, j4y = j3x[:, :, None] + slider * ux[:, :, None], j3y[:, :, None] + slider * uy[:, :, None]
        second = np.arctan2(j4y, spacing[:, :, None] - j4x)
        same = np.stack([np.zeros_like(half, bool), half == 0.0], axis=2)  # one solution under two names
        same |= ((gamma < 1e-12)[:, None] & np.array([False, True]))[:, :, None]
        low, high = self.shortest[who, None, None] - ZONE, self.longest[who, None, None] + ZONE
        good = (slider >= low) & (slider <= high) & ~same
        angles = np.stack([np.broadcast_to(first[:, :, None], second.shape), second], axis=-1)
        angles = np.where(good[..., None], angles - plane.zero[who, None, None], np.nan)
        left = np.maximum(TOLERANCE - missed, ROUNDING)
        return angles.reshape(len(who), 4, 2), left / self.levers(plane, who, offset).sum(axis=1)

    def levers(self, plane: Mounted, who: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Bounds (m, 2) [mm/rad]: a crank moves its end of the probe, which turns about the other end, J3 or J4.

        The probe turns by what that end moves over the slider's length, which is the shortest at worst.

        Args:
            plane: whose arms these are.
            who: (m,) which of them.
            offset: (m, 2) of the point in the probe's frame [mm].
        """
        tip, length, shortest = np.hypot(offset[:, 0], offset[:, 1]), plane.length[who], self.shortest[who]
        return np.stack([length * (1.0 + tip / shortest), tip * self.rocker[who] / shortest], axis=1)

    def random(self, plane: Mounted, rng: np.random.Generator, who: np.ndarray) -> np.ndarray:
        """Angles (k, 2) [rad] uniform over the joint ranges, outside the zone of avoidance, tip in the field.

        Args:
            plane: whose arms these are.
            rng: draws them, the same for the same seed.
            who: (k,) which of them.
        """
        drawn, missing = np.array(plane.folded), who
        while len(missing):
            low, high = plane.lower[missing], plane.upper[missing]
            drawn[missing] = low + rng.random((len(missing), 2)) * (high - low)
            _, second = self.links(plane, drawn)
            tip = self.elbows(plane, drawn) + rotated(plane.fiber, second)
            bad = np.hypot(*tip.T) > plane.field_radius
            missing = missing[(bad | self.in_avoidance(plane, drawn))[missing]]
        return drawn[who]

    def constants(self, base: np.ndarray, zero: np.ndarray) -> np.ndarray:
        """What the kernels need of every arm (n,), but for the reach of bodies on the rocker.

        Args:
            base: (n, 2) J1 [mm].
            zero: (n, 2) what geometry adds to commanded angles [rad].
        """
        bar = np.zeros(len(self.spacing), BAR)
        pivot, turn = self.rockers(base, np.zeros((len(bar), 2)), zero)
        bar["x"], bar["y"] = pivot.T
        bar["spacing"], bar["length"], bar["turn"] = self.spacing, self.rocker, turn
        bar["shortest"], bar["longest"] = self.shortest, self.longest
        return bar

    def columns(self) -> dict[str, tuple[np.ndarray, str]]:
        """Constants by name with their unit."""
        return {name: (getattr(self, name), unit) for name, unit in _UNITS.items()}

    def describe(self) -> tuple[tuple[str, tuple[np.ndarray, ...], str], ...]:
        """Links and slider."""
        return (
            ("J1 to J2", (self.spacing,), "mm"),
            ("J2 to J4", (self.rocker,), "mm"),
            ("slider", (self.shortest, self.longest), "mm"),
        )
