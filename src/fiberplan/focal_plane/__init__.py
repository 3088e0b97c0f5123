"""A focal plane: where positioners stand, how they turn, what can touch, and who is next to whom.

- `focal_plane`: the array, with fibers, clearances and changed copies of itself; `checks`: what its values must be
- `bodies`: bodies that ride on links, and obstacles
- `outlines`: filled outlines cut into convex pieces, by signs that are exact
- `layouts`: where positioners stand in regular arrays
- `kinematics`: what a kind of arm is to everyone else; `two_link` and `four_bar` are kinds, named for files in `kinds`
- `motor_limits`: the least time for a turn, where acceleration is bounded
- `inverse_kinematics`: all joint angles within the ranges that bring a fiber to a point
- `compiled_arms`: the focal plane as arrays for the kernels
- `outliers`: robots whose values are far from the others'
- `geometry`: which geometry a proof is about, as a name and a digest
- `differences`: where two descriptions of an array differ; `drift`: how far arms get in a moment
- `coverage`: how many positioners reach each point
- `joint_space`: which configurations of a positioner its neighbours block as they stand
- `neighbours`: who could touch whom at a given margin; `obstacle_pairs`: which obstacles
- `discs`: in which of some discs a point lies
"""

from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.focal_plane import FocalPlane
from fiberplan.focal_plane.four_bar import FourBar

__all__ = ["Body", "FocalPlane", "FourBar", "Obstacle"]
