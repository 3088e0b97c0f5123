"""A focal plane: where positioners stand, how they turn, what can touch, and who is next to whom.

- `focal_plane`: the array, with fibers, clearances and changed copies of itself
- `bodies`: bodies that ride on links, and obstacles
- `layouts`: where positioners stand in regular arrays
- `inverse_kinematics`: joint angles that bring a fiber to a point, for arms of two links
- `four_bar`, `four_bar_inverse`: four-bar arms, and their joint angles for a point
- `compiled_arms`: the focal plane as arrays for the kernels
- `neighbours`: who could touch whom at a given margin
"""

from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.focal_plane import FocalPlane

__all__ = ["Body", "FocalPlane", "Obstacle"]
