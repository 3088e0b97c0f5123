"""Arms of four bars: a probe that slides through a rocker, driven by two cranks, as in MIRADAS (Sabater2018).

In an arm's own frame, x towards its workspace, J1 is the origin, J2 lies on x at `spacing`, J3 = d13 (cos t1, sin t1)
and J4 = J2 + d24 (-cos t2, sin t2), with t1 = alpha and t2 = beta. The probe lies along the line from J3 to J4 and its
tip at a fixed distance from J3. It slides through J4: the length from J3 to J4 has a range, and configurations outside
it form the zone of avoidance. The first link's length (d13) is `FocalPlane.length`, the tip is the fiber.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import InstrumentError
from fiberplan.kernels.four_bar import SINGULAR


@dataclass(frozen=True, eq=False)
class FourBar:
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

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            values = read_only(np.atleast_1d(getattr(self, field.name)))
            if values.ndim != 1 or values.shape != np.shape(self.spacing) or not np.isfinite(values).all():
                raise InstrumentError(f"four-bar {field.name} must be one finite number for each arm")
            object.__setattr__(self, field.name, values)
        for name in ("spacing", "rocker"):
            self._refuse(~(getattr(self, name) > 0), name, "is not a positive length")
        self._refuse(~(self.shortest >= SINGULAR), "shortest", f"slider is under {SINGULAR:g} mm, too near singular")
        self._refuse(~(self.longest > self.shortest), "longest", "slider is not above the shortest")

    def _refuse(self, bad: np.ndarray, name: str, complaint: str) -> None:
        if np.any(bad):
            i = int(np.argmax(bad))
            raise InstrumentError(f"four-bar arm {i + 1}: {name} {getattr(self, name)[i]:.6g} mm {complaint}")

    def rockers(self, base: np.ndarray, angles: np.ndarray, zero: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """J2 (n, 2) [mm] and directions of the rockers (n,) [rad] at commanded `angles` (n, 2) [rad]."""
        along = np.stack([np.cos(self.orientation), np.sin(self.orientation)], axis=1)
        turn = self.orientation + np.pi - zero[:, 1] - angles[:, 1]
        return base + self.spacing[:, None] * along, turn

    def sliders(self, length: np.ndarray, angles: np.ndarray, zero: np.ndarray) -> np.ndarray:
        """Slider lengths (n,) [mm] at commanded `angles` (n, 2) [rad]; `length` (n,) is the first link's [mm]."""
        t1, t2 = (angles + zero).T
        across = self.rocker * np.sin(t2) - length * np.sin(t1)
        return np.hypot(self.spacing - self.rocker * np.cos(t2) - length * np.cos(t1), across)
