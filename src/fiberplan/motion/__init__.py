"""Motion in joint space: trajectories, and the same as lists of moves."""

from fiberplan.motion.trajectory import Trajectory

__all__ = ["Trajectory"]
