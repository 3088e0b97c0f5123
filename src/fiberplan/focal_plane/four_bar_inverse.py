"""Joint angles that bring the tip of a four-bar arm to a point: up to four, each as often as it fits into the ranges.

J3 lies where the circle of the first link about J1 meets the circle of the tip's distance about the point: at most two
places. From each the probe's direction is known, and J4 lies where it crosses the rocker's circle about J2: again at
most two places, each with its slider length. Those outside the slider's range are in the zone of avoidance.
"""

import numpy as np

from fiberplan.focal_plane.focal_plane import FocalPlane
from fiberplan.tolerances import ZONE

TOLERANCE = 1e-6  #: a point this far out of the reach of a circle is on its edge [mm]


def candidates(plane: FocalPlane, who: np.ndarray, points: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Angles (m, 4, 2) [rad], in (-pi, pi] and whatever the joint ranges, that bring fibers to `points`; else NaN.

    Args:
        plane: of four-bar arms.
        who: (m,) positioners.
        points: (m, 2) in the focal plane [mm].
        offset: (m, 2) of the fiber in the probe's frame [mm].
    """
    assert plane.four_bar is not None
    bar, length = plane.four_bar, plane.length[who]
    delta = points - plane.base[who]
    c, s = np.cos(bar.orientation[who]), np.sin(bar.orientation[who])
    x, y = c * delta[:, 0] + s * delta[:, 1], c * delta[:, 1] - s * delta[:, 0]
    tip, away = np.hypot(offset[:, 0], offset[:, 1]), np.hypot(x, y)
    # the angle at J1 in the triangle J1, J3, tip, by its half: accurate at both ends
    wide = (tip - away + length) * (tip + away - length)
    near = (away + length - tip) * (away + length + tip)
    edge = TOLERANCE * (away + length + tip)
    with np.errstate(invalid="ignore"):
        gamma = 2.0 * np.arctan2(np.sqrt(np.maximum(wide, 0.0)), np.sqrt(np.maximum(near, 0.0)))
        gamma = np.where((wide >= -edge) & (near >= -edge) & (away > 0.0), gamma, np.nan)
    first = np.arctan2(y, x)[:, None] + np.stack([gamma, -gamma], axis=1)  # (m, 2)
    j3x, j3y = length[:, None] * np.cos(first), length[:, None] * np.sin(first)
    lean = np.arctan2(y[:, None] - j3y, x[:, None] - j3x) - np.arctan2(offset[:, 1], offset[:, 0])[:, None]
    ux, uy = np.cos(lean), np.sin(lean)
    spacing, rocker = bar.spacing[who, None], bar.rocker[who, None]
    along = (spacing - j3x) * ux - j3y * uy  # of J2, from J3
    across = (spacing - j3x) * uy + j3y * ux
    half = np.sqrt(np.where(np.abs(across) <= rocker + TOLERANCE, np.maximum(rocker**2 - across**2, 0.0), np.nan))
    slider = np.stack([along + half, along - half], axis=2)  # (m, 2, 2)
    j4x, j4y = j3x[:, :, None] + slider * ux[:, :, None], j3y[:, :, None] + slider * uy[:, :, None]
    second = np.arctan2(j4y, spacing[:, :, None] - j4x)
    same = np.stack([np.zeros_like(half, bool), half == 0.0], axis=2)  # one solution under two names
    same |= ((gamma < 1e-12)[:, None] & np.array([False, True]))[:, :, None]
    low, high = bar.shortest[who, None, None] - ZONE, bar.longest[who, None, None] + ZONE
    good = (slider >= low) & (slider <= high) & ~same
    angles = np.stack([np.broadcast_to(first[:, :, None], second.shape), second], axis=-1) - plane.zero[who, None, None]
    return np.where(good[..., None], angles, np.nan).reshape(len(who), 4, 2)
