"""What a kind of arm is to everyone else: one object that knows how two commanded angles place its links.

`FocalPlane.kinematics` is one of these: `fiberplan.focal_plane.two_link` or `fiberplan.focal_plane.four_bar`. A new
kind of arm is a class like them, an entry in `fiberplan.focal_plane.kinds`, and its frames and motion bounds in
`fiberplan.kernels`.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Protocol

import numpy as np


class Mounted(Protocol):
    """Where arms of any kind stand and what their joints may do; a `FocalPlane` is one."""

    @property
    def base(self) -> np.ndarray:
        """(n, 2) alpha axes [mm]."""
        ...

    @property
    def length(self) -> np.ndarray:
        """(n,) first links [mm]."""
        ...

    @property
    def zero(self) -> np.ndarray:
        """(n, 2) added to commanded angles [rad]."""
        ...

    @property
    def fiber(self) -> np.ndarray:
        """(n, 2) default fiber in the second link's frame [mm]."""
        ...

    @property
    def folded(self) -> np.ndarray:
        """(n, 2) park state [rad]."""
        ...

    @property
    def lower(self) -> np.ndarray:
        """(n, 2) least angles [rad]."""
        ...

    @property
    def upper(self) -> np.ndarray:
        """(n, 2) greatest angles [rad]."""
        ...

    @property
    def field_radius(self) -> float:
        """Targets lie this close to the origin [mm]."""
        ...


class Kinematics(Protocol):
    """One kind of arm. Angles are commanded ones, (n, 2) [rad]; points (n, 2) [mm]."""

    name: ClassVar[str]  #: of the kind
    joints: ClassVar[tuple[str, str]]  #: what its papers call the two angles
    link_names: ClassVar[tuple[str, ...]]  #: what bodies can ride on
    has_avoidance: ClassVar[bool]  #: some configurations in range may be forbidden; motion bounds hold outside those
    has_parities: ClassVar[bool]  #: a point has a right and a left elbow solution

    def check(self, n: int) -> None:
        """Refuse constants of another number of arms.

        Raises:
            InstrumentError: they are not of `n` arms.
        """
        ...

    def subset(self, who: np.ndarray) -> "Kinematics":
        """The same for the arms `who` (k,)."""
        ...

    def elbows(self, plane: Mounted, angles: np.ndarray) -> np.ndarray:
        """Origins of the second link (n, 2) [mm]."""
        ...

    def links(self, plane: Mounted, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions of the first and the second link (n,) [rad]."""
        ...

    def frames(self, plane: Mounted, angles: np.ndarray) -> Mapping[str, tuple[np.ndarray, np.ndarray]]:
        """Origin (n, 2) [mm] and direction (n,) [rad] of every link that bodies can ride on."""
        ...

    def skeleton(self, plane: Mounted, angles: np.ndarray) -> Sequence[np.ndarray]:
        """Lines that stand for links without bodies, each (n, 2 ends, 2) [mm]."""
        ...

    def in_avoidance(self, plane: Mounted, angles: np.ndarray) -> np.ndarray:
        """(n,) whether `angles` are forbidden; NaN rows are not."""
        ...

    def avoidance(self, plane: Mounted, i: int, angles: np.ndarray) -> str:
        """What is wrong with arm `i`, whose `angles` are forbidden."""
        ...

    def inverse(
        self, plane: Mounted, who: np.ndarray, points: np.ndarray, offset: np.ndarray, parity: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Angles that bring fibers to points, up to whole turns and whatever the joint ranges.

        Args:
            plane: the array.
            who: (m,) arms.
            points: (m, 2) [mm].
            offset: (m, 2) of the fiber in the second link's frame [mm].
            parity: (m,) +1 right elbow only, -1 left only, 0 either.

        Returns:
            (m, c, 2) [rad], NaN where there are fewer, and (m,) how far out of its range an angle still counts as at
            its end [rad].
        """
        ...

    def levers(self, plane: Mounted, who: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Bounds (m, 2) on how far fibers at `offset` (m, 2) [mm] move for each radian of each joint [mm/rad]."""
        ...

    def random(self, plane: Mounted, rng: np.random.Generator, who: np.ndarray) -> np.ndarray:
        """Random configurations (len(who), 2) [rad] that are allowed."""
        ...

    def constants(self, base: np.ndarray, zero: np.ndarray) -> np.ndarray:
        """What the kernels need beyond base, first link and zero: (n,) of `fiberplan.kernels.arms.BAR`, or none."""
        ...

    @property
    def turned(self) -> np.ndarray | float:
        """Added to the zero of alpha: the direction of the arm's own frame (n,) [rad]."""
        ...

    def columns(self) -> Mapping[str, tuple[np.ndarray, str]]:
        """Constants by name, (n,) each with its unit, as files store them."""
        ...

    def describe(self) -> Sequence[tuple[str, tuple[np.ndarray, ...], str]]:
        """What people want to know of the constants: what it is, the values, their unit."""
        ...
