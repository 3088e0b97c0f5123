"""A focal plane: where positioners stand, how they turn, what can touch, and who is next to whom."""

from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.focal_plane import FocalPlane

__all__ = ["Body", "FocalPlane", "Obstacle"]
