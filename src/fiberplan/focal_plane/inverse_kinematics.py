"""Joint angles that bring a fiber to a point: two elbow solutions, each as often as it fits into the joint ranges.

With d the distance from base to point, l the first link and r the fiber's distance from the elbow, the angle between
the two directions is ``gamma = +-2 atan2(sqrt((l + r)^2 - d^2), sqrt(d^2 - (l - r)^2))``: the half-angle form of the
law of cosines, accurate at both edges of the annulus. Positive gamma is the right elbow (beta > 0), negative the
left one. Arms of four bars: `fiberplan.focal_plane.four_bar_inverse`.
"""

import numpy as np

from fiberplan.focal_plane.focal_plane import FocalPlane
from fiberplan.focal_plane.four_bar_inverse import candidates
from fiberplan.tolerances import RANGE

TURN = 2 * np.pi
TOLERANCE = 1e-6  #: a point this far outside the annulus is on its edge [mm]


def reach(plane: FocalPlane, who: np.ndarray, offset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest distance (m,) [mm] of a fiber at `offset` (m, 2) [mm] from the bases of `who` (m,)."""
    length, arm = plane.length[who], np.hypot(offset[:, 0], offset[:, 1])
    return np.abs(length - arm), length + arm


def solutions(
    plane: FocalPlane, who: np.ndarray, points: np.ndarray, offset: np.ndarray, parity: np.ndarray
) -> np.ndarray:
    """All commanded angles (m, k, 2) [rad] that bring fibers to `points`, quickest from folded first, NaN-padded.

    The time is that of the slower joint; equal times (to a nanosecond) go to the right elbow, then to smaller angles.

    Args:
        plane: whose lengths, zeros and ranges to use.
        who: (m,) positioners.
        points: (m, 2) in the focal plane [mm].
        offset: (m, 2) of the fiber in the beta link's frame [mm].
        parity: (m,) +1 right elbow only, -1 left only, 0 either.
    """
    if plane.four_bar is not None:
        return _four_bar_solutions(plane, who, points, offset)
    gamma = _bend(plane, who, points, offset)
    both = np.stack([gamma, -gamma], axis=1)  # (m, 2)
    same = (gamma < 1e-12) | (gamma > np.pi - 1e-12)  # straight or folded back: one solution under two names
    allowed = np.stack([parity >= 0, (parity < 0) | ((parity == 0) & ~same)], axis=1)

    length, arm = plane.length[who, None], np.hypot(offset[:, 0], offset[:, 1])[:, None]
    delta = points - plane.base[who]
    heading = np.arctan2(delta[:, 1], delta[:, 0])[:, None]
    first = heading - np.arctan2(arm * np.sin(both), length + arm * np.cos(both))
    alpha = first - plane.zero[who, 0, None]
    on_axis = np.hypot(delta[:, 0], delta[:, 1]) < 1e-12  # a fiber over its own base: any alpha does, so do not turn
    alpha = np.where(on_axis[:, None], plane.folded[who, 0, None], alpha)
    beta = both - (plane.zero[who, 1] + np.arctan2(offset[:, 1], offset[:, 0]))[:, None]

    slack = TOLERANCE / np.maximum(length[:, 0] + arm[:, 0], TOLERANCE)
    alphas = _turns(alpha, plane.lower[who, 0], plane.upper[who, 0], slack)  # (m, 2, a)
    betas = _turns(beta, plane.lower[who, 1], plane.upper[who, 1], slack)  # (m, 2, b)
    shape = (len(who), 2, alphas.shape[2], betas.shape[2])
    angles = np.stack(
        [np.broadcast_to(alphas[:, :, :, None], shape), np.broadcast_to(betas[:, :, None, :], shape)], axis=-1
    )
    angles = np.where((allowed[:, :, None, None] & np.isfinite(angles).all(axis=-1))[..., None], angles, np.nan)
    left = np.broadcast_to(np.arange(2)[None, :, None, None], shape).reshape(len(who), np.prod(shape[1:]))
    return _quickest_first(plane, who, angles.reshape(*left.shape, 2), left)


def _four_bar_solutions(plane: FocalPlane, who: np.ndarray, points: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """The same for four-bar arms, whose solutions have no parity."""
    found = candidates(plane, who, points, offset)  # (m, 4, 2)
    slack = np.full(len(who), RANGE)
    alphas = _turns(found[..., 0], plane.lower[who, 0], plane.upper[who, 0], slack)
    betas = _turns(found[..., 1], plane.lower[who, 1], plane.upper[who, 1], slack)
    shape = (len(who), 4, alphas.shape[2], betas.shape[2])
    angles = np.stack(
        [np.broadcast_to(alphas[:, :, :, None], shape), np.broadcast_to(betas[:, :, None, :], shape)], axis=-1
    )
    angles = np.where(np.isfinite(angles).all(axis=-1, keepdims=True), angles, np.nan).reshape(len(who), -1, 2)
    return _quickest_first(plane, who, angles, np.broadcast_to(np.arange(angles.shape[1]), angles.shape[:2]))


def _bend(plane: FocalPlane, who: np.ndarray, points: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Bend of the right elbow (m,) in [0, pi]; NaN outside the annulus."""
    inner, outer = reach(plane, who, offset)
    delta = points - plane.base[who]
    d = np.hypot(delta[:, 0], delta[:, 1])
    wide = np.sqrt(np.maximum((outer - d) * (outer + d), 0.0))
    near = np.sqrt(np.maximum((d - inner) * (d + inner), 0.0))
    return np.where((d <= outer + TOLERANCE) & (d >= inner - TOLERANCE), 2.0 * np.arctan2(wide, near), np.nan)


def _turns(angle: np.ndarray, lower: np.ndarray, upper: np.ndarray, slack: np.ndarray) -> np.ndarray:
    """`angle` (m, 2) plus every number of turns that lands in its range: (m, 2, k), NaN-padded."""
    lower, upper, slack = lower[:, None], upper[:, None], slack[:, None]
    start = lower - slack
    lowest = start + np.mod(angle - start, TURN)
    most = int(np.max((upper - lower + 2 * slack) // TURN, initial=0.0))
    found = lowest[:, :, None] + TURN * np.arange(most + 1)
    inside = found <= (upper + slack)[:, :, None]
    return np.where(inside, np.clip(found, lower[:, :, None], upper[:, :, None]), np.nan)


def _quickest_first(plane: FocalPlane, who: np.ndarray, angles: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Sort each row's solutions (m, k, 2) and leave out columns that no row needs."""
    travel = np.abs(angles - plane.folded[who, None]) / plane.max_speed[who, None]
    time = np.round(travel.max(axis=2, initial=0.0), 9)
    keys = (angles[:, :, 1], angles[:, :, 0], left, np.where(np.isnan(time), np.inf, time))
    order = np.stack([np.lexsort([key[i] for key in keys]) for i in range(len(who))]) if len(who) else left[:, :0]
    ordered = np.take_along_axis(angles, order[:, :, None], axis=1)
    needed = int(np.isfinite(ordered[:, :, 0]).sum(axis=1).max(initial=0))
    return ordered[:, : max(needed, 1)]
