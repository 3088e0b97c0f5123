"""Collision zones as ellipses, for a field to push apart (Makarem2016).

Every body becomes one ellipse about its own centre, with its axes along the link: half as long and half as wide as the
body with its rounding. Two ellipses A and B, as matrices of squared semi-axes, lie within the ellipse 2 A + 2 B of each
other only if they are near: the weighted distance ``d sqrt(s' (2 A + 2 B)^-1 s)`` of centres s apart is about d where
they touch. The field only steers: what moves is decided by the bodies themselves.
"""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import LINKS
from fiberplan.kernels.compile import record

ZONE = record(
    [
        ("link", "i8"),  # 0 fixed, 1 alpha, 2 beta
        ("u", "f8"),  # centre in the link's frame [mm]
        ("v", "f8"),
        ("along", "f8"),  # squared semi-axes [mm^2]
        ("across", "f8"),
        ("category", "i8"),  # one bit
        ("meets", "i8"),
        ("tip", "?"),  # in the outer half of the arm: weighed by lambda2, else by lambda3
    ]
)


def elliptic_zones(plane: FocalPlane) -> np.ndarray:
    """(n, bodies) ZONE, one ellipse for each body of each positioner."""
    zones = np.zeros((plane.n, len(plane.bodies)), ZONE)
    bits = {name: 1 << k for k, name in enumerate(dict.fromkeys(body.category for body in plane.bodies))}
    for body, zone in zip(plane.bodies, zones.T, strict=True):
        points = np.broadcast_to(body.points, (plane.n, *body.points.shape[-2:]))
        low, high = points.min(axis=1), points.max(axis=1)
        radius = np.broadcast_to(body.radius, plane.n)
        zone["link"] = LINKS[body.link]
        zone["u"], zone["v"] = (low + high).T / 2
        half = (high - low) / 2 + radius[:, None]
        zone["along"], zone["across"] = np.square(half.T)
        zone["category"] = bits[body.category]
        zone["meets"] = -1 if body.meets is None else sum(bits.get(name, 0) for name in set(body.meets))
        zone["tip"] = zone["u"] > plane.fiber[:, 0] / 2 if body.link == "beta" else False
    return read_only(zones, ZONE)


def circles(zones: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Circles about all zones of each positioner: centre along the beta link from the elbow, and radius (n,) [mm].

    `length` (n,) are the first links, on which zones may ride too [mm].
    """
    extent = np.sqrt(np.maximum(zones["along"], zones["across"]))
    on_beta = zones["link"] == 2
    low = np.where(on_beta, zones["u"] - extent, np.inf).min(axis=1, initial=np.inf)
    high = np.where(on_beta, zones["u"] + extent, -np.inf).max(axis=1, initial=-np.inf)
    middle = np.where(low <= high, (low + high) / 2, 0.0)
    off = np.hypot(zones["u"] - middle[:, None], zones["v"]) + extent
    elsewhere = middle[:, None] + length[:, None] + np.hypot(zones["u"], zones["v"]) + extent
    return middle, np.where(on_beta, off, elsewhere).max(axis=1, initial=0.0)
