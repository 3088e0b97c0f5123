"""Arms of two links: alpha turns the first about the base, beta the second about the elbow.

Beta is measured from the first link, so pi is folded. A point within reach has two solutions. With d its distance from
the base, l the first link and r the fiber's distance from the elbow, the angle between the two directions is
``gamma = +-2 atan2(sqrt((l + r)^2 - d^2), sqrt(d^2 - (l - r)^2))``: the half-angle form of the law of cosines, accurate
at both edges of the annulus. Positive gamma is the right elbow (beta > 0), negative the left one.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fiberplan.focal_plane.kinematics import Mounted
from fiberplan.kernels.arms import BAR
from fiberplan.tolerances import ARRIVAL, ROUNDING

TOLERANCE = ARRIVAL  #: a point this far out of reach is taken to its edge: tables have three decimals [mm]
_TURN = 2 * np.pi


def reach(plane: Mounted, who: np.ndarray, offset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest distance (m,) [mm] of a fiber at `offset` (m, 2) [mm] from the bases of `who` (m,)."""
    length, arm = plane.length[who], np.hypot(offset[:, 0], offset[:, 1])
    return np.abs(length - arm), length + arm


def along(origin: np.ndarray, length: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Points (n, 2) at `length` (n,) [mm] from `origin` (n, 2) [mm] in the direction `turn` (n,) [rad]."""
    return origin + length[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def rotated(offset: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Vectors `offset` (n, 2) turned by `turn` (n,) [rad]."""
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([c * offset[:, 0] - s * offset[:, 1], s * offset[:, 0] + c * offset[:, 1]], axis=1)


@dataclass(frozen=True)
class TwoLink:
    """The alpha-beta (theta-phi) positioner; there is nothing to set."""

    name: ClassVar[str] = "two-link"
    joints: ClassVar[tuple[str, str]] = ("alpha", "beta")
    link_names: ClassVar[tuple[str, ...]] = ("base", "alpha", "beta")
    has_avoidance: ClassVar[bool] = False
    has_parities: ClassVar[bool] = True

    @property
    def turned(self) -> float:
        """Arms have no frame of their own."""
        return 0.0

    def check(self, n: int) -> None:
        """Nothing can be wrong."""

    def subset(self, who: np.ndarray) -> "TwoLink":
        """The same."""
        return self

    def elbows(self, plane: Mounted, angles: np.ndarray) -> np.ndarray:
        """Elbows (n, 2) [mm]."""
        return along(plane.base, plane.length, angles[:, 0] + plane.zero[:, 0])

    def links(self, plane: Mounted, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions of both links (n,) [rad]."""
        first = angles[:, 0] + plane.zero[:, 0]
        return first, first + angles[:, 1] + plane.zero[:, 1]

    def frames(self, plane: Mounted, angles: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Origin (n, 2) [mm] and direction (n,) [rad] of every link that bodies can ride on."""
        first, second = self.links(plane, angles)
        still = np.zeros(len(first))
        return {
            "base": (plane.base, still),
            "alpha": (plane.base, first),
            "beta": (self.elbows(plane, angles), second),
        }

    def skeleton(self, plane: Mounted, angles: np.ndarray) -> tuple[np.ndarray, ...]:
        """The first links, (n, 2 ends, 2) [mm]."""
        return (np.stack([plane.base, self.elbows(plane, angles)], axis=1),)

    def in_avoidance(self, plane: Mounted, angles: np.ndarray) -> np.ndarray:
        """(n,) False: everything within the joint ranges is allowed."""
        return np.zeros(len(angles), bool)

    def avoidance(self, plane: Mounted, i: int, angles: np.ndarray) -> str:
        """Nothing is forbidden."""
        return ""

    def inverse(
        self, plane: Mounted, who: np.ndarray, points: np.ndarray, offset: np.ndarray, parity: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Right and left elbow solution (m, 2, 2) [rad]; see `Kinematics.inverse`."""
        gamma = _bend(plane, who, points, offset)
        both = np.stack([gamma, -gamma], axis=1)  # (m, 2)
        same = (gamma < 1e-12) | (gamma > np.pi - 1e-12)  # straight or folded back: one solution under two names
        allowed = np.stack([parity >= 0, (parity < 0) | ((parity == 0) & ~same)], axis=1)
        length, arm = plane.length[who, None], np.hypot(offset[:, 0], offset[:, 1])[:, None]
        delta = points - plane.base[who]
        away = np.hypot(delta[:, 0], delta[:, 1])
        heading = np.arctan2(delta[:, 1], delta[:, 0])[:, None]
        straight = (plane.zero[who, 1] + np.arctan2(offset[:, 1], offset[:, 0]))[:, None]  # a straight arm has beta
        beta = _to_end_of_range(both - straight, plane.lower[who, 1, None], plane.upper[who, 1, None])
        reached = np.hypot(length + arm * np.cos(beta + straight), arm * np.sin(beta + straight))
        missed = np.abs(reached - away[:, None])  # by the end of the joint's range
        beta = np.where(missed <= TOLERANCE, beta, both - straight)
        missed = np.where(missed <= TOLERANCE, missed, 0.0)
        bend = beta + straight
        alpha = heading - np.arctan2(arm * np.sin(bend), length + arm * np.cos(bend)) - plane.zero[who, 0, None]
        on_axis = away < 1e-12  # a fiber over its own base: any alpha does, so do not turn
        alpha = np.where(on_axis[:, None], plane.folded[who, 0, None], alpha)
        angles = np.where(allowed[..., None], np.stack([alpha, beta], axis=-1), np.nan)
        angles, missed = _with_alpha_in_range(plane, who, points, straight, arm, angles, missed)
        left = np.maximum(TOLERANCE - np.max(missed, axis=1, initial=0.0, where=~np.isnan(missed)), ROUNDING)
        return angles, left / np.fmax(self.levers(plane, who, offset).sum(axis=1), TOLERANCE)

    def levers(self, plane: Mounted, who: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """How far fibers are from either axis at most (m, 2) [mm/rad]."""
        arm = np.hypot(offset[:, 0], offset[:, 1])
        return np.stack([plane.length[who] + arm, arm], axis=1)

    def random(self, plane: Mounted, rng: np.random.Generator, who: np.ndarray) -> np.ndarray:
        """Configurations (len(who), 2) [rad] whose fibers are uniform over each patrol annulus.

        Alpha is uniform over its range (at most one turn), and beta such that equal areas are equally likely, as far as
        the joint range allows: the squared distance of the fiber from the base is uniform in cos(beta).
        """
        turn = 2 * np.pi  # of a range without ends, one turn each way from folded
        low = np.maximum(plane.lower[who], plane.folded[who] - turn)
        high = np.minimum(plane.upper[who], plane.folded[who] + turn)
        alpha = low[:, 0] + rng.random(len(who)) * np.minimum(high[:, 0] - low[:, 0], 2 * np.pi)
        bend = plane.zero[who, 1] + np.arctan2(
            plane.fiber[who, 1], plane.fiber[who, 0]
        )  # a straight arm has beta -bend
        first, last = low[:, 1] + bend, np.minimum(high[:, 1] + bend, low[:, 1] + bend + 2 * np.pi)
        # cos(beta) is monotonic on half turns only: draw by weight |sin(beta)| through the integral of |sin|
        draw = _abs_sin_integral(first) + rng.random(len(who)) * (_abs_sin_integral(last) - _abs_sin_integral(first))
        turns = np.floor(draw / 2.0)
        beta = turns * np.pi + np.arccos(np.clip(1.0 - (draw - 2.0 * turns), -1.0, 1.0)) - bend
        return np.stack([alpha, np.clip(beta, low[:, 1], high[:, 1])], axis=1)

    def constants(self, base: np.ndarray, zero: np.ndarray) -> np.ndarray:
        """None."""
        return np.zeros(0, BAR)

    def columns(self) -> dict[str, tuple[np.ndarray, str]]:
        """None."""
        return {}

    def describe(self) -> tuple[tuple[str, tuple[np.ndarray, ...], str], ...]:
        """Nothing beyond the lengths that every arm has."""
        return ()


TWO_LINK = TwoLink()


def _to_end_of_range(angle: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Angles as they are where some number of turns brings them into the range, else the nearer end of it."""
    above = np.mod(angle - lower, _TURN)
    out = above > upper - lower
    to_upper = above - (upper - lower)
    return np.where(out, np.where(to_upper < _TURN - above, upper, lower), angle)


def _with_alpha_in_range(
    plane: Mounted,
    who: np.ndarray,
    points: np.ndarray,
    straight: np.ndarray,
    arm: np.ndarray,
    angles: np.ndarray,
    missed: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Alpha that is out of its range at the end of it, and beta aimed anew, where the fiber misses by little enough.

    Args:
        plane: the array.
        who: (m,) arms.
        points: (m, 2) [mm].
        straight: (m, 1) minus the beta of the straight arm [rad].
        arm: (m, 1) from the elbow to the fiber [mm].
        angles: (m, 2, 2) both solutions [rad].
        missed: (m, 2) by how much they miss their points [mm].

    Returns:
        `angles` and `missed` as they are then; the elbow stays on its side.
    """
    low, high = plane.lower[who, None], plane.upper[who, None]
    alpha = _to_end_of_range(angles[..., 0], low[..., 0], high[..., 0])
    turn = alpha + plane.zero[who, 0, None]
    elbow = plane.base[who, None] + plane.length[who, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    ahead = points[:, None] - elbow
    misses = np.abs(np.hypot(ahead[..., 0], ahead[..., 1]) - arm)
    beta = np.arctan2(ahead[..., 1], ahead[..., 0]) - turn - straight
    ends = (alpha != angles[..., 0]) & (misses <= TOLERANCE)
    ends &= _to_end_of_range(beta, low[..., 1], high[..., 1]) == beta
    ends &= np.sin(beta + straight) * np.sin(angles[..., 1] + straight) >= 0.0
    angles = np.where(ends[..., None], np.stack([alpha, beta], axis=-1), angles)
    return angles, np.where(ends, misses, missed)


def _bend(plane: Mounted, who: np.ndarray, points: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Bend of the right elbow (m,) in [0, pi]; NaN outside the annulus."""
    inner, outer = reach(plane, who, offset)
    delta = points - plane.base[who]
    d = np.hypot(delta[:, 0], delta[:, 1])
    with np.errstate(over="ignore"):  # of a target at 1e300 mm
        wide = np.sqrt(np.maximum((outer - d) * (outer + d), 0.0))
        near = np.sqrt(np.maximum((d - inner) * (d + inner), 0.0))
    return np.where((d <= outer + TOLERANCE) & (d >= inner - TOLERANCE), 2.0 * np.arctan2(wide, near), np.nan)


def _abs_sin_integral(x: np.ndarray) -> np.ndarray:
    """Integral of |sin| from 0 to x: 2 per half turn."""
    turns = np.floor(x / np.pi)
    return 2.0 * turns + 1.0 - np.cos(x - turns * np.pi)
